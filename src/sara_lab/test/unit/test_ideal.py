"""The ideal time against closed forms: a straight, a turn in place, a bend, astern; never through a wall."""

import math

import numpy as np
import pytest

from sara_common.platforms import chosen
from sara_control.gate.comfort import Profile
from sara_lab.ideal.ideal import ideal, limits_of, space_of
from sara_lab.ideal.joins import JOINS, RADII
from sara_lab.ideal.moves import after
from sara_lab.journeys import ideal_times, travel_cases
from sara_lab.judge import gaps
from sara_lab.judge.judge import judge
from sara_lab.judge.judgement import Goal, Track
from sara_nav.lattice.dubins import dubins_join
from sara_sim.world.world import World

BODY = chosen().size
HALF_WIDTH = 0.5 * BODY[1]
LIMITS = limits_of(Profile())
STOPS = (
    0.5 * LIMITS.ahead / LIMITS.acceleration + 0.5 * LIMITS.ahead / LIMITS.braking
)  # s that speeding up and braking take
RADIUS = LIMITS.ahead**2 / LIMITS.lateral  # m, of the sharpest bend at full speed


@pytest.fixture(scope='module')
def plain():
    return space_of(np.zeros((160, 160), bool), 0.05, (0.0, 0.0), BODY)


@pytest.mark.parametrize(
    'start, goal, seconds',
    (
        ((2.0, 3.0, 0.0), (6.0, 3.0, 0.0), 4.0 / LIMITS.ahead + STOPS),
        ((5.0, 2.0, math.pi / 2), (5.0, 6.0, math.pi / 2), 4.0 / LIMITS.ahead + STOPS),
        ((4.0, 4.0, 0.0), (4.0, 4.0, math.pi), math.pi / LIMITS.turn + LIMITS.turn / LIMITS.turn_acceleration),
        ((4.0, 4.0, 0.3), (4.0, 4.0, 0.7), 2.0 * math.sqrt(0.4 / LIMITS.turn_acceleration)),
        ((5.0, 4.0, 0.0), (4.0, 4.0, 0.0), 1.0 / LIMITS.astern + 0.5 * STOPS),
        (
            (2.0, 2.0, 0.0),
            (5.0, 5.0, math.pi / 2),
            (0.5 * math.pi * RADIUS + math.sqrt(2.0) * (3.0 - RADIUS)) / LIMITS.ahead + STOPS,
        ),
    ),
)
def test_the_ideal_time_is_that_of_the_closed_form(plain, start, goal, seconds):
    found = ideal(plain, LIMITS, start, goal, HALF_WIDTH)
    assert found.seconds == pytest.approx(seconds, rel=0.02)
    end = found.poses(start)[-1]
    assert math.dist(end[:2], goal[:2]) < 1e-6 and abs(math.remainder(end[2] - goal[2], 2.0 * math.pi)) < 1e-6


def test_every_join_ends_at_its_pose():
    random, moves, joined = np.random.default_rng(1), np.empty((3, 2)), 0
    for _ in range(100):
        start, end = random.uniform((-3.0, -3.0, -3.2), (3.0, 3.0, 3.2), (2, 3))
        for number in range(JOINS):
            if dubins_join(number, start, end, RADII, moves):
                pose, joined = tuple(start), joined + 1
                for length, turn in moves:
                    pose = after(*pose, length, turn)
                assert math.dist(pose[:2], end[:2]) < 1e-6
                assert abs(math.remainder(pose[2] - end[2], 2.0 * math.pi)) < 1e-6
    assert joined > 100 * JOINS // 2


def test_the_ideal_path_goes_round_a_wall_through_the_door_and_touches_nothing():
    occupied = np.ones((62, 124), bool)
    occupied[1:61, 1:61] = occupied[1:61, 63:123] = False
    closed = space_of(occupied, 0.05, (0.0, 0.0), BODY)
    start, goal = (1.5, 1.0, math.pi / 2), (4.6, 2.0, -math.pi / 2)
    assert math.isnan(ideal(closed, LIMITS, start, goal, HALF_WIDTH).seconds)
    occupied[23:39, 61:63] = False  # a door of 0.80 m
    found, world = ideal(space_of(occupied, 0.05, (0.0, 0.0), BODY), LIMITS, start, goal, HALF_WIDTH), World(occupied)
    assert min(gaps.at(world, tuple(pose), BODY) for pose in found.poses(start)) > 0.0
    assert 3.5 / LIMITS.ahead + STOPS < found.seconds < 20.0


def test_poses_off_the_map_and_poses_in_a_wall_have_no_ideal_time(plain):
    here, walled = (4.0, 4.0, 0.0), np.ones((160, 160), bool)
    for there in ((-1.0, 4.0, 0.0), (4.0, 9.0, 0.0), (math.nan, 4.0, 0.0), (4.0, math.inf, 0.0)):
        assert math.isnan(ideal(plain, LIMITS, here, there, HALF_WIDTH).seconds)
        assert math.isnan(ideal(plain, LIMITS, there, here, HALF_WIDTH).seconds)
    walled[20:140, 20:100] = False
    space = space_of(walled, 0.05, (0.0, 0.0), BODY)
    assert math.isnan(ideal(space, LIMITS, (3.0, 4.0, 0.0), (7.0, 4.0, 0.0), HALF_WIDTH).seconds)


def test_lower_limits_take_longer(plain):
    start, goal = (2.0, 2.0, 0.0), (5.0, 5.0, math.pi / 2)
    fastest = ideal(plain, LIMITS, start, goal, HALF_WIDTH).seconds
    for name in ('ahead', 'lateral', 'acceleration', 'braking'):
        slower = LIMITS._replace(**{name: 0.5 * getattr(LIMITS, name)})
        assert ideal(plain, slower, start, goal, HALF_WIDTH).seconds > fastest + 0.1


def test_ideal_times_of_journeys_are_kept_and_those_of_recorded_drives_are_the_same(tmp_path):
    pair, known = travel_cases.pairs('flat')[32], ideal_times.ideal_time('flat', 32, tmp_path)
    kept = tmp_path / 'ideal_flat_32.json'
    kept.write_text(kept.read_text().replace(f'{known}', '7.5'))
    assert ideal_times.ideal_time('flat', 32, tmp_path) == 7.5
    track = Track(np.array([0.0, 9.0]), np.array([pair.start, pair.goal]), goals=(Goal(pair.goal, 0.0, 9.0, True),))
    found = ideal_times.with_ideal(track, travel_cases.map_file('flat'))
    assert found.goals[0].ideal == pytest.approx(known, abs=1e-5)
    judged = judge(found)
    assert judged.time_ratio == pytest.approx(9.0 / known, abs=1e-3) and 'time / ideal time' in judged.table()
    assert 'ideal' not in judge(track).table()
