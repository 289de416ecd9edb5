"""Journeys by the touch screen: the rider who drives by hand, and what is kept of a journey."""

import math
from pathlib import Path

import numpy as np
import pytest

from sara_common.planar import advanced
from sara_common.platforms import chosen
from sara_lab.journeys.by_arrows import ArrowRider
from sara_lab.journeys.by_hand import TOUR, Rider, legs, stop
from sara_lab.journeys.touch_journey import TouchJourney, journeys_of, missing
from sara_lab.judge import gaps
from sara_nav.maps import places
from sara_sim.world.world import World

BODY = chosen().size
FLAT = Path(__file__).resolve().parents[3] / 'sara_bringup' / 'maps' / 'flat.yaml'
STEP_S, LATE = 0.05, 4  # of the model; poses are seen so many steps late
LIMITS, ACCELERATIONS = np.array([0.5, 0.5]), np.array([0.25, 0.5])  # m/s, rad/s; m/s2, rad/s2: the gentle profile
ARROWS = {'up': (0.7, 0.0), 'down': (-0.7, 0.0), 'left': (0.0, 0.7), 'right': (0.0, -0.7), None: (0.0, 0.0)}


def flat_places():
    return {name: (one.x, one.y, one.yaw) for name, one in places.load(places.beside(FLAT)).items()}


def driven(rider, pose, command):
    """Poses of a chair that accelerates, until the rider is there and it stands. command(t, pose, rests): in shares."""
    poses, speed = [pose] * (LATE + 1), np.zeros(2)
    for k in range(round(300 / STEP_S)):
        seen = poses[-1 - LATE]
        there = rider.is_there(seen)
        wanted = (0.0, 0.0) if there else command(k * STEP_S, seen, seen == poses[-1])
        most = ACCELERATIONS * STEP_S
        speed = speed + np.clip(wanted * LIMITS - speed, -most, most)
        if there and not speed.any():
            return np.array(poses)
        poses.append(advanced(*poses[-1], *speed, STEP_S))
    raise AssertionError('not there within 300 s')


def by_stick(rider):
    return lambda t, pose, rests: rider.stick(t, pose)


def by_arrows(rider):
    held = None

    def command(t, pose, rests):
        nonlocal held
        if held or rests:
            held = rider.arrow(t, pose, held)
        return ARROWS[held]

    return command


def sees(world):
    return lambda pose: gaps.at(world, pose, BODY)


@pytest.mark.parametrize('by', [by_stick, by_arrows])
def test_a_rider_drives_round_the_flat_by_hand_and_touches_nothing(by):
    world, where = World.from_yaml(FLAT), flat_places()
    pose = where[stop(0)]
    for number in range(1, len(TOUR) + 1):
        way = legs(stop(number - 1), stop(number), where)
        rider = Rider(way) if by is by_stick else ArrowRider(way, sees(world))
        poses = driven(rider, pose, by(rider))
        gap = gaps.along(world, np.arange(len(poses)) * STEP_S, poses, BODY, STEP_S).min()
        assert gap > 0.02
        assert math.dist(poses[-1][:2], where[stop(number)][:2]) < 0.5
        pose = tuple(poses[-1])


def test_a_rider_who_is_stuck_backs_up_for_a_moment():
    rider = Rider([(0.0, 0.0), (3.0, 0.0)])
    pushed = [rider.stick(0.1 * k, (1.0, 0.0, 0.0))[0] for k in range(60)]
    assert pushed[0] > 0.0 > pushed[45]
    assert rider.stick(6.0, (0.8, 0.0, 0.0))[0] > 0.0


def test_a_rider_who_is_stuck_at_the_same_place_again_backs_up_farther():
    rider = Rider([(0.0, 0.0), (3.0, 0.0)])

    def backs_up(t, x):
        for k in range(60):
            rider.stick(t + 0.1 * k, (x, 0.0, 0.0))
        moved = [rider.stick(t + 6.0 + 0.1 * k, (x - 0.1, 0.0, 0.0))[0] for k in range(40)]
        return sum(forward < 0.0 for forward in moved)

    at_first, again, elsewhere = backs_up(0.0, 1.0), backs_up(10.0, 1.05), backs_up(20.0, 2.0)
    assert at_first == elsewhere < again


def test_a_rider_who_cannot_back_up_drives_on_for_a_moment_and_then_tries_again():
    rider = Rider([(0.0, 0.0), (3.0, 0.0)])
    pushed = [rider.stick(0.1 * k, (1.0, 0.0, 1.0)) for k in range(150)]
    assert [pushed[k][0] for k in (0, 45, 60, 90, 110, 130)] == pytest.approx([0.0, -0.6, 0.0, 0.6, 0.0, -0.6])


class Alley:
    """Walls 0.1 m beside a body that stands straight in it, along x; and one across, its distance ahead `end`."""

    def __init__(self, end=math.inf):
        self.end = end

    def __call__(self, pose):
        long, wide = abs(math.cos(pose[2])), abs(math.sin(pose[2]))
        aside = 0.5 * (BODY[0] * wide + BODY[1] * long) + abs(pose[1])
        ahead = self.end - pose[0] - 0.5 * (BODY[0] * long + BODY[1] * wide)
        return max(min(0.5 * BODY[1] + 0.1 - aside, ahead), 0.0)


def test_who_drives_by_arrows_does_not_turn_where_a_corner_of_the_chair_would_come_too_near():
    way = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0)]
    assert ArrowRider(way, Alley()).arrow(0.0, (3.0, 0.0, 0.0), None) == 'up'
    assert ArrowRider(way, lambda pose: 1.0).arrow(0.0, (3.0, 0.0, 0.0), None) == 'left'


def test_who_drives_by_arrows_backs_out_where_there_is_room_neither_to_turn_nor_to_go_on():
    way, at_the_end = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0)], (3.0, 0.0, 0.0)
    assert ArrowRider(way, Alley(3.0 + 0.5 * BODY[0] + 0.15)).arrow(0.0, at_the_end, None) == 'down'


@pytest.mark.parametrize('pose, first, then', [((3.0, 0.0, 0.0), 'left', 'up'), ((1.0, 0.0, 0.0), 'up', 'down')])
def test_who_drives_by_arrows_tries_something_else_where_the_chair_does_not_obey(pose, first, then):
    rider, held, pressed = ArrowRider([(0.0, 0.0), (3.0, 0.0), (3.0, 3.0)], lambda pose: 1.0), None, []
    for k in range(60):
        wanted = rider.arrow(0.1 * k, pose, held)
        held = None if held and wanted != held else wanted
        pressed.append(held)
    assert [button for button, before in zip(pressed, [None, *pressed]) if button and button != before][:2] == [
        first,
        then,
    ]


def test_a_journey_is_read_as_it_was_written_and_a_broken_line_is_told():
    one = TouchJourney('stick', 2, 'kitchen', 'bathroom', 0.2, 0, 0.1, 7.0, 30.0)
    late = TouchJourney('stick', 3, 'bathroom', 'kitchen', 0.9, 1, 0.0, 7.0, 30.0)
    assert journeys_of(f'{one.line()}\n{late.line()}\n{one.line()[:20]}') == [one, late]
    assert (one.arrived, late.arrived) == (True, False)
    assert missing([one, late], ['stick', 'map'], 3) == [('stick', 1), ('map', 1), ('map', 2), ('map', 3)]
    with pytest.raises(ValueError, match='line 1 is no journey'):
        journeys_of('{"by": 1}\n')
