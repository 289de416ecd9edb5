"""Backing out: along the way it came, within its limits, never into anything, and that it ends."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.costmaps.costmap_pair import CostmapPair
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.base import Layer
from sara_nav.goals.driven_path import Track
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.recovery.back_out import BackOutConfig, BackOutRecovery
from sara_nav.recovery.behaviours import RECOVERIES, Situation

FOOTPRINT = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
DT = 0.05


def world(*boxes):
    """Return the LocalWorld of 12 x 12 m about the origin with boxes (x0, y0, xn, yn), m, in it."""
    costs = np.zeros((240, 240), np.uint8)
    for x0, y0, xn, yn in boxes:
        costs[int((y0 + 6) * 20) : int((yn + 6) * 20), int((x0 + 6) * 20) : int((xn + 6) * 20)] = 254
    return LocalWorld(Costmap(costs, GridGeometry(240, 240, 0.05, -6.0, -6.0)), FOOTPRINT)


class Robot:
    """Obeys with a lag, once it has driven in by commands (v, w, s)."""

    def __init__(self, place, commands=(), pose=Pose2D(0.0, 0.0, 0.0), held=False, waits=()):
        self.world, self.pose, self.t, self.held, self.waits = place, pose, 0.0, held, waits
        self.velocity, self.track, self.poses, self.commands = (0.0, 0.0), Track(), [], []
        self.came = [pose]
        for v, w, seconds in commands:
            for _ in range(round(seconds / DT)):
                self.pose = self.pose.advance(v, w, DT)
                self.track.keep(self.pose)
                self.came.append(self.pose)

    def back_out(self, config=BackOutConfig(), cycles=1200, costmaps=None):
        behaviour = BackOutRecovery('back_out', config)
        for number in range(cycles):
            situation = Situation(self.t, DT, self.pose, self.pose, self.velocity, self.world, costmaps, self.track)
            if number == 0:
                behaviour.start(situation)
            if self.waits and self.waits[0] <= self.t < self.waits[1]:  # move_base waits for a sensor
                behaviour.excuse_standing()
                self.t += DT
                continue
            step = behaviour.update(situation)
            if step.done:
                return step
            self.commands.append(step.command)
            self.velocity = tuple(
                0.6 * old + 0.4 * new for old, new in zip(self.velocity, (0.0, 0.0) if self.held else step.command)
            )
            self.pose = self.pose.advance(*self.velocity, DT)
            self.poses.append(self.pose)
            self.t += DT
        raise AssertionError(f'it goes on for ever: {step.text}')


def corridor(width=1.0):
    """Return the walls of a dead end along x, closed at x = 3."""
    return (-5.0, width / 2, 3.0, width / 2 + 0.2), (-5.0, -width / 2 - 0.2, 3.0, -width / 2), (3.0, -1.0, 3.2, 1.0)


def off(pose, came):
    """Return how far (m) a pose is off the nearest of others."""
    return min(pose.distance(other) for other in came)


def test_it_is_registered():
    assert RECOVERIES.find('BackOutRecovery') is BackOutRecovery and 'sara_nav/BackOutRecovery' in RECOVERIES.names()


def test_it_goes_back_its_distance_and_stands_where_it_can_turn():
    robot = Robot(world(), [(0.4, 0.0, 5.0)])
    step = robot.back_out()
    assert 0.6 <= 2.0 - robot.pose.x <= 0.66 and abs(robot.pose.y) < 1e-6
    assert 'room to turn' in step.text and step.command == (0.0, 0.0) and abs(robot.velocity[0]) < 0.03


def test_out_of_a_dead_end_it_goes_on_until_it_is_as_far_as_it_may():
    robot = Robot(world(*corridor()), [(0.4, 0.0, 5.0)])
    step = robot.back_out()
    assert 1.48 <= 2.0 - robot.pose.x <= 1.56 and 'no room to turn' in step.text


def test_out_of_a_dead_end_it_stops_where_it_can_turn():
    robot = Robot(world((1.4, 0.5, 3.0, 0.7), (1.4, -0.7, 3.0, -0.5), (3.0, -1.0, 3.2, 1.0)), [(0.4, 0.0, 5.0)])
    robot.back_out(BackOutConfig(farthest=3.0))
    assert 0.7 < robot.pose.x < 0.85, (
        'the circle of its corners and 0.15 m, 0.76 m, is clear of the walls that begin at x = 1.4'
    )


@settings(max_examples=40)
@given(st.lists(st.tuples(st.floats(0.2, 0.4), st.floats(-0.3, 0.3), st.just(1.5)), min_size=3, max_size=5))
def test_it_keeps_to_the_way_it_came(commands):
    robot = Robot(world(), commands)
    robot.back_out(BackOutConfig(distance=0.5, farthest=0.6))
    assert max(off(pose, robot.came) for pose in robot.poses) < 0.08
    assert all(v <= 0.0 for v, _ in robot.commands)


@settings(max_examples=40)
@given(st.floats(0.05, 0.2), st.floats(0.1, 0.5), st.floats(0.3, 1.0), st.floats(-0.3, 0.3))
def test_no_command_exceeds_speed_acceleration_and_jerk(speed, acc, jerk, w):
    robot = Robot(world(), [(0.3, w, 6.0)])
    robot.back_out(BackOutConfig(speed=speed, acc_lim=acc, jerk_lim=jerk))
    v = np.array([0.0] + [c[0] for c in robot.commands])
    assert np.abs(v).max() <= speed + 1e-9 and max(abs(c[1]) for c in robot.commands) <= 0.3 + 1e-9
    a = np.diff(v) / DT
    moving = slice(2, -4)  # the first and the last centimetre a second are steps
    assert np.abs(a[moving]).max(initial=0.0) <= acc + 1e-6
    assert np.abs(np.diff(a[moving])).max(initial=0.0) / DT <= jerk + 1e-6


@settings(max_examples=60)
@given(st.floats(0.0, 1.2), st.floats(-0.5, 0.5), st.floats(-0.3, 0.3))
def test_it_touches_nothing_that_came_to_stand_behind_it(gap, aside, w):
    driven_in = Robot(world(), [(0.3, w, 5.0)])
    rear = driven_in.pose.advance(-1.0, 0.0, 0.54 + gap + 0.1)
    x, y = rear.x - aside * math.sin(rear.yaw), rear.y + aside * math.cos(rear.yaw)
    place = world((x - 0.1, y - 0.1, x + 0.1, y + 0.1))
    robot = Robot(place, [(0.3, w, 5.0)])
    before = place.touched([[robot.pose.x, robot.pose.y, robot.pose.yaw]])[0]
    robot.back_out()
    touched = place.touched(np.array([[p.x, p.y, p.yaw] for p in robot.poses])) if robot.poses else np.zeros(1)
    assert touched.max() <= before


def test_something_right_behind_keeps_it_where_it_is_and_is_said():
    robot = Robot(world((1.0, -0.3, 1.42, 0.3)), [(0.4, 0.0, 5.0)])
    step = robot.back_out(BackOutConfig(ahead=0.0))
    assert robot.pose.distance(Pose2D(2.0, 0.0, 0.0)) < 0.02 and 'something stands behind' in step.text


class Marks(Layer):
    """What sensors saw; counts how often that is forgotten."""

    class config_class:
        enabled = True

        def faults(self):
            return []

    cleared = 0

    def clear(self, *_):
        self.cleared += 1
        return True


@pytest.mark.parametrize(
    'boxes, forget, cleared',
    [
        ([], True, True),
        ([], False, False),
        ([(1.0, -0.3, 1.42, 0.3)], True, False),  # right behind it: what is before it is heard no better from ahead
    ],
)
def test_what_sensors_saw_is_forgotten_only_where_it_is_asked_for_and_after_going_back(boxes, forget, cleared):
    robot, marks = Robot(world(*boxes), [(0.4, 0.0, 5.0)]), Marks('sonars')
    costmap = LayeredCostmap(CostmapConfig(), [marks], FOOTPRINT)
    step = robot.back_out(BackOutConfig(forget=forget), costmaps=CostmapPair(costmap, costmap))
    assert bool(marks.cleared) == cleared == ('forgotten' in step.text)


def test_without_a_track_it_goes_straight_back_if_that_is_free():
    robot = Robot(world(), pose=Pose2D(1.0, 1.0, 1.0))
    robot.back_out()
    assert abs(robot.pose.distance(Pose2D(1.0, 1.0, 1.0)) - 0.63) < 0.04 and abs(robot.pose.yaw - 1.0) < 1e-6
    assert robot.pose.x < 1.0 and robot.pose.y < 1.0


def test_one_that_had_come_backwards_goes_forwards_again():
    robot = Robot(world(), [(-0.3, 0.1, 5.0)])
    robot.back_out()
    assert all(v >= 0.0 for v, _ in robot.commands) and off(robot.pose, robot.came) < 0.05


@pytest.mark.parametrize('walls', [(), corridor()])
def test_where_it_had_changed_between_ahead_and_astern_it_does_so_again(walls):
    robot = Robot(world(*walls), [(0.4, 0.0, 5.0), (-0.4, 0.0, 1.0)])
    robot.back_out(BackOutConfig(distance=1.2))
    assert all(w == 0.0 for _, w in robot.commands) and robot.commands[0][0] >= 0.0
    assert max(pose.x for pose in robot.poses) < 2.0 and robot.pose.x < 1.2


def test_where_its_track_has_a_corner_it_turns_back_in_place():
    robot = Robot(world(), [(0.4, 0.0, 5.0), (0.0, 0.5, 3.0), (0.4, 0.0, 0.5)])
    robot.back_out(BackOutConfig(distance=1.0))
    assert off(robot.pose, robot.came) < 0.15 and abs(robot.pose.yaw) < 0.3


def test_held_by_something_it_does_not_know_it_gives_up():
    robot = Robot(world(), [(0.4, 0.0, 5.0)], held=True)
    step = robot.back_out()
    assert 'something holds it' in step.text and 9.0 <= robot.t < 11.0
    assert {math.copysign(1.0, v) for v, _ in robot.commands if v} == {1.0, -1.0}, 'it has tried both ways'


def test_time_that_the_robot_waited_in_is_not_taken_for_standing_in_vain():
    robot = Robot(world(), [(0.4, 0.0, 5.0)], waits=(0.1, 20.0))
    step = robot.back_out()
    assert 'something holds it' not in step.text and robot.t > 20.0
    assert {math.copysign(1.0, v) for v, _ in robot.commands if v} == {-1.0}


def test_with_something_right_behind_it_draws_away_from_it():
    robot = Robot(world((1.0, -0.3, 1.42, 0.3)), [(0.4, 0.0, 5.0)])
    step = robot.back_out()
    assert 2.25 < robot.pose.x < 2.35 and step.text.startswith('back_out: went back 0.')


def test_where_it_cannot_turn_back_in_place_it_goes_straight_back_until_it_can():
    came = [(0.4, 0.0, 5.0), (0.0, 0.5, 3.0)]
    robot = Robot(world((2.35, 0.3, 2.45, 0.4)), came)
    robot.back_out()
    assert all(w == 0.0 and v < 0.0 for v, w in robot.commands[:20])
    assert not robot.world.touched(np.array([[p.x, p.y, p.yaw] for p in robot.poses])).any()


def test_one_that_still_drives_comes_to_rest_first():
    robot = Robot(world(), [(0.4, 0.0, 5.0)])
    robot.velocity = 0.4, 0.0
    robot.back_out()
    assert robot.commands[0] == (0.0, 0.0)


@pytest.mark.parametrize(
    'values, fault',
    [
        (dict(distance=0.0), 'distance'),
        (dict(speed=math.nan), 'speed'),
        (dict(distance=1.0, farthest=0.5), 'farthest is 0.5, allowed is at least distance (1)'),
    ],
)
def test_parameters_are_checked(values, fault):
    assert fault in BackOutConfig(**values).faults()[0]
