"""The way a robot came by: remembered so far, followed back once, forgotten when the robot was put elsewhere."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D, wrap
from sara_nav.goals.driven_path import JUMP, STEP, Track

speeds = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))


def driven(track, commands, pose=Pose2D(0.0, 0.0, 0.0)):
    """Drive each command for a second, twenty cycles; return all poses."""
    poses = []
    for v, w in commands:
        for _ in range(20):
            pose = pose.advance(v, w, 0.05)
            track.keep(pose)
            poses.append(pose)
    return poses


@settings(max_examples=60)
@given(st.lists(speeds, min_size=1, max_size=8))
def test_what_it_leads_back_by_are_poses_the_robot_had_in_their_reverse_order(commands):
    track = Track(100.0)
    poses = driven(track, commands)
    here, at = poses[-1], len(poses)
    while track.back(here, 0.2) is not None:
        there = track.back(here, 0.2)
        index = max(i for i, pose in enumerate(poses) if pose is there)
        assert index < at and there.distance(here) >= 0.2
        here, at = there, index


@settings(max_examples=60)
@given(st.floats(0.05, 3.0), st.floats(0.1, 0.5))
def test_no_more_than_its_length_is_remembered(length, v):
    track = Track(length)
    driven(track, [(v, 0.0)] * 20)
    assert len(track) * STEP <= max(length, 2 * STEP) + 1e-9


def test_what_has_been_gone_back_is_forgotten():
    track = Track()
    end = driven(track, [(0.4, 0.0)] * 4)[-1]
    assert abs(wrap(track.bearing(end, 0.3) - math.pi)) < 1e-9
    here = Pose2D(end.x - 0.6, 0.0, 0.0)
    assert track.back(here, 0.3).x <= here.x - 0.3
    assert track.back(end, 0.0).x <= here.x - 0.3, 'it never leads forward again'


def test_a_robot_that_stands_adds_nothing_and_one_that_turns_does():
    track = Track()
    driven(track, [(0.0, 0.0)] * 5)
    assert len(track) == 1
    driven(track, [(0.0, 0.5)] * 2)
    assert len(track) >= 8


def test_a_robot_that_was_put_elsewhere_knows_no_way_back():
    track = Track()
    end = driven(track, [(0.4, 0.0)] * 4)[-1]
    track.keep(Pose2D(end.x + JUMP + 0.1, 0.0, 0.0))
    assert len(track) == 1 and track.back(Pose2D(end.x + JUMP + 0.1, 0.0, 0.0), 0.3) is None
