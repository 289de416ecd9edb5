"""move_base with its planners drives a chair with SARA's faults: slip in turns, lag, coarse commands, a late pose."""

import math
import random

import numpy as np
import pytest

from sara_common.planar import Pose2D, wrap
from sara_nav.costmaps.costmap import InflationConfig
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.goals.move_base_config import MoveBaseConfig
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap
from sara_nav.move_base.local_planners import RotateThenPursue, RotateThenPursueConfig
from sara_nav.move_base.state_machine import MoveBase
from sara_nav.planners.grid_planner import GridPlanner

FOOTPRINT = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
SQUARE = [(5.0, 1.0, 90.0), (5.0, 5.0, 180.0), (1.0, 5.0, 270.0), (1.0, 1.0, 0.0)]


class SimChair:
    """A chair that advances in 10 ms; ``pose`` is the truth, ``seen()`` what a planner is given.

    Wheel radius 0.155 m, track 0.525 m; commands are taken at 50 Hz in steps of 1/9.5 rad/s with the rest carried
    over, below 0.02 rad/s nothing moves; a first-order lag; true turn rate = that of the wheels / slip.
    """

    RADIUS, TRACK, STEP = 0.155, 0.525, 1.0 / 9.5

    def __init__(self, pose, delay=0.12, pose_period=0.1, slip=1.27, lag=0.1, noise=0.0):
        self.pose, self.delay, self.slip, self.lag, self.noise = pose, delay, slip, lag, noise
        self.pose_ticks = round(100 * pose_period)
        self.tick = 0
        self.asked, self.rest, self.sent, self.wheels = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.history = [(0.0, pose, (0.0, 0.0))]
        self.turned = 0.0
        self.random = random.Random(1)

    @property
    def t(self):
        return self.tick / 100.0

    def command(self, v, w):
        self.asked = [(v + 0.5 * w * self.TRACK) / self.RADIUS, (v - 0.5 * w * self.TRACK) / self.RADIUS]

    def advance(self):
        for i in (0, 1):
            if self.tick % 2 == 0:
                wanted = self.asked[i] + self.rest[i] if any(self.asked) else 0.0
                self.sent[i] = round(wanted / self.STEP) * self.STEP
                self.rest[i] = wanted - self.sent[i]
            target = self.sent[i] if abs(self.sent[i]) >= 0.02 else 0.0
            self.wheels[i] += (target - self.wheels[i]) * (1.0 - math.exp(-0.01 / self.lag))
        v = 0.5 * self.RADIUS * (self.wheels[0] + self.wheels[1])
        w = self.RADIUS * (self.wheels[0] - self.wheels[1]) / self.TRACK / self.slip
        self.pose = self.pose.advance(v, w, 0.01)
        self.turned += w * 0.01
        self.tick += 1
        if self.tick % self.pose_ticks == 0:
            gauss = self.random.gauss
            seen = Pose2D(
                self.pose.x + gauss(0.0, self.noise),
                self.pose.y + gauss(0.0, self.noise),
                wrap(self.pose.yaw + gauss(0.0, self.noise)),
            )
            self.history.append((self.t, seen, (v, w)))

    def seen(self):
        """Return (pose, velocity, stamp) of the newest measurement that has had time to arrive."""
        stamp, pose, velocity = next(
            (e for e in reversed(self.history) if e[0] <= self.t - self.delay + 1e-9), self.history[0]
        )
        return pose, velocity, stamp


def room(cells=160):
    data = np.zeros((cells, cells), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    return data


def costmap(data):
    result = LayeredCostmap(
        CostmapConfig(), [StaticLayer('static'), InflationLayer('inflation', InflationConfig(0.75, 4.0))], FOOTPRINT
    )
    result.layers['static'].set_map(GridMap(data, GridGeometry(160, 160, 0.05, -1.0, -1.0)))
    result.update(0.0, None)
    return result


def make(data=None, frequency=20.0, **config):
    data = room() if data is None else data
    return MoveBase(
        MoveBaseConfig(controller_frequency=frequency, **config),
        costmap(data),
        costmap(data),
        GridPlanner(),
        RotateThenPursue(),
    )


def world(move_base):
    return LocalWorld(move_base.local_costmap.costmap, FOOTPRINT)


def drive(move_base, chair, goal, limit=60.0):
    """Drive to a goal and half a second on; return (StepResult of the end, seconds, [(true pose, command), ...])."""
    move_base.set_goal(goal, chair.t)
    begin, trail = chair.t, []
    while chair.t - begin < limit:
        pose, velocity, stamp = chair.seen()
        result = move_base.step(chair.t, pose, velocity, stamp)
        chair.command(*result.command)
        trail.append((chair.pose, result.command))
        if result.status != 'active':
            break
        for _ in range(round(100.0 / move_base.config.controller_frequency)):
            chair.advance()
    taken = chair.t - begin
    for _ in range(50):
        chair.advance()
    return result, taken, trail


def degrees_between(a, b):
    return abs(math.degrees(wrap(a - b)))


def reversals(trail):
    """How often the sense of a real turn changed."""
    senses = [math.copysign(1.0, w) for _, (_, w) in trail if abs(w) > 0.06]
    return sum(a != b for a, b in zip(senses, senses[1:]))


@pytest.mark.parametrize(
    'delay, period, slip, frequency',
    [
        (0.12, 0.1, 1.27, 20.0),
        (0.15, 0.1, 1.30, 20.0),
        (0.10, 0.02, 1.25, 20.0),
        (0.15, 0.1, 1.27, 10.0),
        (0.05, 0.02, 1.00, 20.0),
        (0.12, 0.02, 1.27, 50.0),
    ],
)
def test_square(delay, period, slip, frequency):
    move_base, chair = make(frequency=frequency), SimChair(Pose2D(1.0, 1.0, 0.0), delay, period, slip)
    for x, y, yaw in SQUARE:
        goal, before = Pose2D(x, y, math.radians(yaw)), chair.pose
        chair.turned = 0.0
        result, taken, trail = drive(move_base, chair, goal)
        assert (result.status, result.text) == ('succeeded', 'Goal reached.')
        assert taken < 30.0
        assert chair.pose.distance(goal) < 0.06
        assert degrees_between(chair.pose.yaw, goal.yaw) < 2.5
        assert abs(math.degrees(chair.turned) - 90.0) < 5.0, 'the long way round'
        assert reversals(trail) == 0, 'hunting'
        leg = math.atan2(goal.y - before.y, goal.x - before.x)
        sideways = [abs(-(p.x - before.x) * math.sin(leg) + (p.y - before.y) * math.cos(leg)) for p, _ in trail]
        assert max(sideways) < 0.03, 'the leg is not straight'


def test_square_with_a_shaking_pose():
    move_base, chair = make(), SimChair(Pose2D(1.0, 1.0, 0.0), noise=0.004)
    for x, y, yaw in SQUARE:
        goal = Pose2D(x, y, math.radians(yaw))
        result, taken, _ = drive(move_base, chair, goal)
        assert result.status == 'succeeded' and taken < 30.0
        assert chair.pose.distance(goal) < 0.06 and degrees_between(chair.pose.yaw, goal.yaw) < 2.5


@pytest.mark.parametrize('turn', [-179.0, -135.0, -60.0, -4.0, 4.0, 30.0, 100.0, 179.0])
def test_turns_in_place_go_the_short_way_and_stay_in_place(turn):
    move_base, chair = make(), SimChair(Pose2D(3.0, 3.0, 0.5))
    result, taken, trail = drive(move_base, chair, Pose2D(3.0, 3.0, 0.5 + math.radians(turn)))
    assert result.status == 'succeeded' and taken < 20.0
    assert math.degrees(chair.turned) == pytest.approx(turn, abs=2.5)
    assert all(v == 0.0 for _, (v, _) in trail) and reversals(trail) == 0


class SlowImuChair(SimChair):
    """A SimChair whose heading comes from an IMU that speaks five times a second and is heard ``late`` s after;
    between, the last rate is believed to go on.
    """

    def __init__(self, pose, late, phase):
        super().__init__(pose, delay=0.0, pose_period=0.01)
        self.late, self.phase = late, phase

    def seen(self):
        pose, velocity, stamp = super().seen()
        at = next(
            (
                entry
                for entry in reversed(self.history)
                if entry[0] <= self.t - self.late + 1e-9 and round(100.0 * entry[0]) % 20 == self.phase
            ),
            self.history[0],
        )
        return Pose2D(pose.x, pose.y, wrap(at[1].yaw + at[2][1] * (self.t - at[0]))), velocity, stamp


@pytest.mark.parametrize('late, phase', [(late, phase) for late in (0.1, 0.18) for phase in (1, 6, 11, 16)])
def test_a_turn_that_ends_does_not_follow_a_heading_that_swings(late, phase):
    move_base, chair = make(), SlowImuChair(Pose2D(3.0, 3.0, 0.0), late, phase)
    for yaw in (90.0, 180.0, 270.0, 0.0):
        result, taken, trail = drive(move_base, chair, Pose2D(3.0, 3.0, math.radians(yaw)))
        assert result.status == 'succeeded' and taken < 8.0
        assert all(w >= 0.0 for _, (_, w) in trail), 'to and fro'
        assert degrees_between(chair.pose.yaw, math.radians(yaw)) < 1.5


def test_commands_keep_the_limits():
    move_base, chair = make(), SimChair(Pose2D(1.0, 1.0, 2.0))
    c = move_base.local_planner.config
    _, _, trail = drive(move_base, chair, Pose2D(5.0, 4.0, -2.0))
    commands = np.array([command for _, command in trail])
    assert np.abs(commands[:, 0]).max() <= c.max_vel_x + 1e-9 and np.abs(commands[:, 1]).max() <= c.max_vel_theta + 1e-9
    speeding = np.diff(np.abs(commands[:-1]), axis=0) / 0.05
    assert speeding[:, 0].max() <= c.acc_lim_x + 1e-6 and speeding[:, 0].min() >= -c.dec_lim_x - 1e-6
    assert speeding[:, 1].max() <= c.acc_lim_theta + 1e-6


def test_the_stop_at_the_goal_is_gentle():
    move_base, chair = make(), SimChair(Pose2D(1.0, 1.0, 0.0), pose_period=0.02)
    _, _, trail = drive(move_base, chair, Pose2D(5.0, 1.0, 0.0))
    v = np.array([command[0] for _, command in trail])
    braking = -(v[10:] - v[:-10]) / 0.5  # over half a second
    assert braking.max() < 1.3 * move_base.local_planner.config.comfort_dec_x


@pytest.mark.parametrize('length', [0.3, 0.6, 4.0])
def test_a_leg_is_driven_within_acceleration_and_jerk_and_not_overrun(length):
    move_base, chair = make(), SimChair(Pose2D(1.0, 1.0, 0.0), pose_period=0.02)
    result, _, trail = drive(move_base, chair, Pose2D(1.0 + length, 1.0, 0.0))
    assert result.status == 'succeeded' and chair.pose.distance(Pose2D(1.0 + length, 1.0, 0.0)) < 0.05
    c = move_base.local_planner.config
    v = np.array([command[0] for _, command in trail])
    assert v.min() >= 0.0, 'it came back'
    acceleration = np.diff(v) / 0.05
    assert -c.dec_lim_x - 1e-6 <= acceleration.min() and acceleration.max() <= c.acc_lim_x + 1e-6
    under_way = acceleration[: np.flatnonzero(v > 0.05)[-1]]  # at the very end it creeps
    assert np.abs(np.diff(under_way)).max() <= c.jerk_lim_x * 0.05 + 1e-6


def test_round_a_pillar_without_touching_it():
    data = room()
    data[55:65, 75:85] = 100  # x 2.75..3.25, y 1.75..2.25
    move_base, chair = make(data), SimChair(Pose2D(1.0, 2.0, 0.0))
    result, _, trail = drive(move_base, chair, Pose2D(5.0, 2.0, 0.0))
    assert result.status == 'succeeded'
    assert chair.pose.distance(Pose2D(5.0, 2.0, 0.0)) < 0.06
    poses = [(p.x, p.y, p.yaw) for p, _ in trail]
    assert world(move_base).touched(poses).max() == 0


def test_an_obstacle_on_the_way_stops_the_chair_and_then_the_goal():
    move_base, chair = make(controller_patience=3.0), SimChair(Pose2D(1.0, 1.0, 0.0))
    goal = Pose2D(5.0, 1.0, 0.0)
    planner = move_base.local_planner
    move_base.set_goal(goal, 0.0)
    move_base.step(0.0, *chair.seen())
    data = room()
    data[20:60, 80:82] = 100  # a wall at x = 3 that the plan does not know of
    move_base.local_costmap.layers['static'].set_map(GridMap(data, GridGeometry(160, 160, 0.05, -1.0, -1.0)))
    move_base.global_planner.plan = lambda *_: np.array([[1.0, 1.0, 0.0], [5.0, 1.0, 0.0]])
    while chair.t < 40.0:
        pose, velocity, stamp = chair.seen()
        result = move_base.step(chair.t, pose, velocity, stamp)
        chair.command(*result.command)
        if result.status != 'active':
            break
        for _ in range(5):
            chair.advance()
    assert result.status == 'aborted' and 'controller_patience' in result.text and result.command == (0.0, 0.0)
    assert 3.0 - 0.54 - 0.3 < chair.pose.x < 3.0 - 0.54
    assert not world(move_base).collides(chair.pose)
    assert planner is move_base.local_planner


def test_bad_settings_are_named():
    faults = RotateThenPursueConfig(max_vel_x=-1.0, acc_lim_x=math.nan, corner_angle=4.0, min_vel_x=0.1).faults()
    assert sorted(f.split()[0] for f in faults) == ['acc_lim_x', 'corner_angle', 'max_vel_x', 'min_vel_x']
    assert 'narrow_vel is 2.0' in RotateThenPursueConfig(narrow_vel=2.0).faults()[0]
    assert 'comfort_dec_x is 0.5' in RotateThenPursueConfig(comfort_dec_x=0.5, dec_lim_x=0.3).faults()[0]
    assert RotateThenPursueConfig().faults() == []


def test_a_better_plan_does_not_start_over():
    planner = RotateThenPursue()
    plan = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]])
    planner.start(plan)
    move_base = make()
    for i in range(5):
        before = planner.update(0.05 * i, 0.05, Pose2D(0.0, 0.0, 0.0), (0.0, 0.0), 0.0, world(move_base))
    assert planner.phase == 'follow path'
    planner.replan(plan)
    after = planner.update(0.25, 0.05, Pose2D(0.0, 0.0, 0.0), (0.0, 0.0), 0.0, world(move_base))
    assert planner.phase == 'follow path' and after.v > before.v > 0.0
