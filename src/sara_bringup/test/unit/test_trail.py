"""Trails: what is kept of a drive, and where the wheels alone would have it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_bringup.missions.trail import Trail, WheelsAlone
from sara_common.planar import compose

POSES = st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(-math.pi, math.pi))


def test_a_trail_keeps_what_is_far_enough_apart_and_no_more_than_it_may():
    trail = Trail(step=0.1, turn=0.3, longest=5)
    for k in range(1000):
        trail.add((0.01 * k, 0.0, 0.0))
    assert len(trail.poses) == 5 and trail.changed
    gaps = [b[0] - a[0] for a, b in zip(trail.poses, list(trail.poses)[1:])]
    assert all(0.1 - 1e-9 <= gap <= 0.12 for gap in gaps)
    trail.changed = False
    trail.add(trail.poses[-1])
    assert not trail.changed
    x, y, yaw = trail.poses[-1]
    trail.add((x, y, yaw + 0.4))  # turned in place
    assert trail.changed
    trail.clear()
    assert not trail.poses and trail.changed


def test_what_is_no_number_is_not_kept():
    trail = Trail()
    for bad in ((math.nan, 0.0, 0.0), (0.0, math.inf, 0.0), (0.0, 0.0, math.nan)):
        trail.add(bad)
    assert not trail.poses and not trail.changed


@given(start=POSES, first=POSES, moved=POSES)
def test_the_wheels_alone_begin_at_the_start_and_move_as_odometry_does(start, first, moved):
    wheels = WheelsAlone(start)
    assert wheels.pose(first) == pytest.approx(start, abs=1e-9) or abs(abs(start[2]) - math.pi) < 1e-6
    there, wanted = wheels.pose(compose(first, moved)), compose(start, moved)
    assert there[:2] == pytest.approx(wanted[:2], abs=1e-9)
    assert math.remainder(there[2] - wanted[2], 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_a_pose_that_is_set_begins_the_drive_anew():
    wheels = WheelsAlone((0.0, 0.0, 0.0))
    wheels.pose((5.0, 5.0, 1.0))
    wheels.restart((1.0, 2.0, 0.0))
    assert wheels.pose((7.0, 7.0, 0.5)) == pytest.approx((1.0, 2.0, 0.0), abs=1e-12)
