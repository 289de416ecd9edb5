"""The planners that sample velocities drive a robot that answers late, to the goal, without contact or hunting."""

import functools
import math

import numpy as np
import pytest

from sara_common.planar import Pose2D, wrap
from sara_nav.costmaps import costmap as cm
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import pad_footprint, parse_footprint, radii
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap
from sara_nav.move_base import local_planners as lp
from sara_nav.planners.grid_planner import GridPlanner
from sara_nav.planners.planning import dense_plan

FOOTPRINT = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
CELLS = 160
PERIOD = 0.05


class LateUnicycle:
    """A unicycle whose speeds follow the command with a first-order lag; it is seen ``delay`` s late.

    slip: how many times less it turns than it is told to.
    """

    def __init__(self, pose, lag=0.12, delay=0.1, slip=1.0):
        self.pose, self.lag, self.slip = pose, lag, slip
        self.v = self.w = 0.0
        self.seen = [(pose, (0.0, 0.0))] * (1 + round(delay / 0.01))

    def drive(self, v, w, seconds):
        for _ in range(round(seconds / 0.01)):
            share = 1.0 - math.exp(-0.01 / self.lag)
            self.v += share * (v - self.v)
            self.w += share * (w / self.slip - self.w)
            self.pose = self.pose.advance(self.v, self.w, 0.01)
            self.seen = self.seen[1:] + [(self.pose, (self.v, self.w))]


@functools.lru_cache(None)
def room(*boxes):
    """Return the Costmap of a walled room of 8 m x 8 m, lower left (-1, -1), with boxes (x0, y0, x1, y1) in it."""
    data = np.zeros((CELLS, CELLS), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    for x0, y0, x1, y1 in boxes:
        c0, r0, c1, r1 = (round((v + 1.0) / 0.05) for v in (x0, y0, x1, y1))
        data[r0:r1, c0:c1] = 100
    grid_map = GridMap(data, GridGeometry(CELLS, CELLS, 0.05, -1.0, -1.0))
    return cm.build(grid_map, radii(FOOTPRINT)[0], inflation=cm.InflationConfig(0.75, 4.0))


def make(name, **config):
    cls = lp.LOCAL_PLANNERS.find(name)
    return cls(cls.config_class(**config))


class Trail:
    """What a drive came to: the last LocalCommand, the true poses and the commands of every cycle, the seconds."""

    def __init__(self):
        self.end, self.poses, self.commands, self.phases, self.seconds = None, [], [], [], 0.0


def drive(planner, robot, costmap, goal, plan=None, limit=90.0, offset=Pose2D(0.0, 0.0, 0.0), delay=0.1):
    world = LocalWorld(costmap, pad_footprint(FOOTPRINT, 0.01), offset=offset)  # footprint_padding
    if plan is None:
        plan = GridPlanner().plan(costmap, robot.pose, goal)
    planner.start(plan)
    trail = Trail()
    while trail.seconds < limit:
        pose, velocity = robot.seen[0]
        trail.end = planner.update(trail.seconds, PERIOD, pose, velocity, delay, world)
        trail.poses.append((robot.pose.x, robot.pose.y, robot.pose.yaw))
        trail.commands.append((trail.end.v, trail.end.w))
        trail.phases.append(planner.phase)
        if trail.end.state in (lp.REACHED, lp.FAILED):
            break
        if trail.end.state == lp.OFF_PATH:
            planner.replan(GridPlanner().plan(costmap, robot.pose, goal))
        robot.drive(trail.end.v, trail.end.w, PERIOD)
        trail.seconds += PERIOD
    robot.drive(0.0, 0.0, 1.0)
    return trail


def hits(costmap, poses):
    """How many poses touch an obstacle: the outline in the costmap, at true poses."""
    return sum(LocalWorld(costmap, FOOTPRINT).footprint_cost(*pose) < 0 for pose in poses)


PLANNERS = ['base_local_planner/TrajectoryPlannerROS', 'dwa_local_planner/DWAPlannerROS']
DOORS = {'path_distance_bias': 32.0, 'goal_distance_bias': 24.0, 'occdist_scale': 0.02}
"""Weights with which DWA dares go through doors: with its defaults, the way it wins there counts less than the
walls.
"""
BOX = (2.6, 1.4, 3.4, 2.6)
GAP = (2.9, -1.0, 3.1, 1.55), (2.9, 2.45, 3.1, 7.0)  # 0.90 m wide
DRIVES = {
    'ahead': ((), Pose2D(1.0, 2.0, 0.0), Pose2D(5.0, 2.0, 0.0)),
    'behind': ((), Pose2D(4.0, 2.0, 0.0), Pose2D(1.0, 2.0, 0.0)),
    'behind, turned': ((), Pose2D(4.0, 2.0, 0.0), Pose2D(1.0, 2.0, math.pi)),
    'to the left': ((), Pose2D(1.0, 2.0, 0.0), Pose2D(1.0, 5.0, 1.57)),
    'to the right': ((), Pose2D(1.0, 5.0, 0.0), Pose2D(1.0, 1.0, 2.5)),
    'around a box': ((BOX,), Pose2D(1.0, 2.0, 0.0), Pose2D(5.0, 2.0, 0.0)),
    'across, around a box': ((BOX,), Pose2D(0.0, 0.0, 1.0), Pose2D(5.5, 4.5, -2.0)),
    'through a gap': (GAP, Pose2D(1.0, 2.0, 0.0), Pose2D(5.0, 2.0, 0.0)),
    'a step to the side': ((), Pose2D(3.0, 3.0, 0.0), Pose2D(3.0, 3.3, 0.0)),
    'a step back': ((), Pose2D(3.0, 3.0, 0.0), Pose2D(2.7, 3.05, 0.3)),
    'a turn': ((), Pose2D(3.0, 3.0, 0.0), Pose2D(3.0, 3.0, 3.1)),
}


def turns_back(trail):
    """How often a turn in place changed its sense from one cycle to the next that turns."""
    rates = [w for v, w in trail.commands if v == 0.0 and w != 0.0]
    return sum(a * b < 0.0 for a, b in zip(rates, rates[1:]))


@pytest.mark.parametrize('name', PLANNERS)
@pytest.mark.parametrize('slip', [1.0, 1.27])
@pytest.mark.parametrize('where', DRIVES)
def test_drives_to_the_goal_within_its_tolerances_and_without_contact(name, slip, where):
    boxes, start, goal = DRIVES[where]
    costmap = room(*boxes)
    planner = make(name, **(DOORS if where == 'through a gap' and 'DWA' in name else {}))
    robot = LateUnicycle(start, 0.12 if slip == 1.0 else 0.2, slip=slip)
    trail = drive(planner, robot, costmap, goal)
    c = planner.config
    assert (trail.end.state, trail.end.text) == (lp.REACHED, '') and trail.seconds < 40.0
    assert robot.pose.distance(goal) <= c.xy_goal_tolerance
    assert abs(wrap(robot.pose.yaw - goal.yaw)) <= c.yaw_goal_tolerance
    assert hits(costmap, trail.poses) == 0
    assert turns_back(trail) <= 2, 'hunting'
    commands = np.array(trail.commands)
    assert np.abs(commands[:, 1]).max() <= c.max_vel_theta + 1e-9
    assert commands[:, 0].max() <= c.max_vel_x + 1e-9 and commands[:, 0].min() >= 0.0


@pytest.mark.parametrize('name', PLANNERS)
def test_the_local_costmap_may_be_in_another_frame(name):
    """The same drive with the costmap moved and turned by a quarter: the same commands but for rounding in the grid."""
    costmap, goal = room(BOX), Pose2D(5.0, 2.0, 0.0)
    offset = Pose2D(10.0, -3.0, 0.5 * math.pi)  # global x is up in the turned costmap
    g = costmap.geometry
    turned = cm.Costmap(
        np.ascontiguousarray(np.rot90(costmap.costs, -1)),
        GridGeometry(CELLS, CELLS, 0.05, offset.x - (g.origin_y + CELLS * 0.05), offset.y + g.origin_x),
    )
    plan = GridPlanner().plan(costmap, Pose2D(1.0, 2.0, 0.0), goal)
    robot = LateUnicycle(Pose2D(1.0, 2.0, 0.0))
    planner = make(name)
    trail = drive(planner, robot, turned, goal, plan, offset=offset)
    assert trail.end.state == lp.REACHED and robot.pose.distance(goal) <= planner.config.xy_goal_tolerance
    assert hits(costmap, trail.poses) == 0


@pytest.mark.parametrize('name', PLANNERS)
def test_the_local_plan_begins_at_the_robot_in_the_global_frame(name):
    offset, planner = Pose2D(3.0, 1.0, 0.7), make(name)
    pose, plan = Pose2D(1.0, 2.0, 0.0), dense_plan([(1.0, 2.0), (2.5, 2.0)], 0.0)
    costs = np.zeros((200, 200), np.uint8)
    world = LocalWorld(cm.Costmap(costs, GridGeometry(200, 200, 0.05, -2.0, -2.0)), FOOTPRINT, offset=offset)
    planner.start(plan)
    assert planner.update(0.0, PERIOD, pose, (0.0, 0.0), 0.0, world).state == lp.DRIVING
    assert planner.local_plan[0] == pytest.approx([pose.x, pose.y, pose.yaw], abs=1e-9)
    assert planner.local_plan[-1, 0] > 1.1 and abs(planner.local_plan[-1, 1] - 2.0) < 0.2


@pytest.mark.parametrize('name', PLANNERS)
def test_a_wall_ahead_that_the_plan_ignores_is_not_touched_and_said(name):
    """The robot may look for ways round it, but never touches it and never says it is there."""
    costmap = room((3.0, -1.0, 3.1, 7.0))
    robot = LateUnicycle(Pose2D(1.0, 2.0, 0.0))
    plan = dense_plan([(1.0, 2.0), (5.0, 2.0)], 0.0)
    trail = drive(make(name), robot, costmap, Pose2D(5.0, 2.0, 0.0), plan, limit=15.0)
    assert trail.end.state == lp.BLOCKED and trail.end.text
    assert (trail.end.v, trail.end.w) == (0.0, 0.0)
    assert hits(costmap, trail.poses) == 0


@pytest.mark.parametrize('name', PLANNERS)
def test_tight_tolerances_and_a_latch_are_kept_to(name):
    for latch in (False, True):
        planner = make(name, xy_goal_tolerance=0.03, yaw_goal_tolerance=0.03, latch_xy_goal_tolerance=latch)
        robot, goal = LateUnicycle(Pose2D(1.0, 2.0, 0.0)), Pose2D(4.0, 2.5, -1.0)
        trail = drive(planner, robot, room(), goal)
        assert trail.end.state == lp.REACHED and trail.seconds < 40.0
        assert robot.pose.distance(goal) < (0.06 if latch else 0.03)
        assert abs(wrap(robot.pose.yaw - goal.yaw)) < 0.03 and turns_back(trail) <= 3


@pytest.mark.parametrize('name', PLANNERS)
def test_a_latched_goal_stays_reached_when_the_robot_is_pushed(name):
    for latch, phase in ((True, 'turn to goal'), (False, 'stop')):
        planner = make(name, latch_xy_goal_tolerance=latch)
        world = LocalWorld(room(), FOOTPRINT)
        planner.start(dense_plan([(3.0, 3.0), (3.5, 3.0)], 2.0))
        t = 0.0
        while planner.phase != 'turn to goal':
            planner.update(t, PERIOD, Pose2D(3.5, 3.0, 0.0), (0.0, 0.0), 0.0, world)
            t += PERIOD
            assert t < 5.0
        planner.update(t, PERIOD, Pose2D(3.5, 3.2, 0.0), (0.0, 0.0), 0.0, world)
        assert planner.phase == phase


@pytest.mark.parametrize('name', PLANNERS)
def test_far_from_its_plan_the_robot_asks_for_a_new_one(name):
    planner = make(name, prune_plan=True)
    planner.start(dense_plan([(0.0, 0.0), (5.0, 0.0)], 0.0))
    command = planner.update(0.0, PERIOD, Pose2D(2.0, 4.0, 0.0), (0.0, 0.0), 0.0, LocalWorld(room(), FOOTPRINT))
    assert command.state == lp.OFF_PATH and 'prune_plan' in command.text and (command.v, command.w) == (0.0, 0.0)


@pytest.mark.parametrize('name', PLANNERS)
def test_the_same_drive_twice_is_the_same(name):
    trails = [
        drive(make(name), LateUnicycle(Pose2D(1.0, 2.0, 0.5)), room(BOX), Pose2D(5.0, 2.0, 0.0)).commands
        for _ in range(2)
    ]
    assert trails[0] == trails[1]


SLOW = {
    PLANNERS[0]: dict(
        acc_lim_x=0.4,
        acc_lim_theta=0.8,
        max_vel_x=0.5,
        max_vel_theta=0.4,
        min_vel_theta=-0.4,
        min_in_place_vel_theta=0.1,
    ),
    PLANNERS[1]: dict(
        DOORS,
        acc_lim_x=0.4,
        acc_lim_theta=0.8,
        max_vel_x=0.5,
        max_vel_trans=0.5,
        max_vel_theta=0.4,
        min_vel_theta=0.1,
        trans_stopped_vel=0.02,
        theta_stopped_vel=0.03,
        yaw_goal_tolerance=0.05,
        use_dwa=False,
    ),
}


@pytest.mark.parametrize('name', PLANNERS)
@pytest.mark.parametrize('where', ['around a box', 'through a gap', 'behind', 'across, around a box'])
def test_a_slow_base_that_slips_touches_nothing_either(name, where):
    """A chair's accelerations; it turns 1.27 times less than it is told to, with 0.2 s of lag and 0.15 s of delay."""
    boxes, start, goal = DRIVES[where]
    costmap, planner = room(*boxes), make(name, **SLOW[name])
    robot = LateUnicycle(start, 0.2, 0.15, 1.27)
    trail = drive(planner, robot, costmap, goal, delay=0.15, limit=120.0)
    assert trail.end.state == lp.REACHED and hits(costmap, trail.poses) == 0
    assert robot.pose.distance(goal) <= 0.1 and abs(wrap(robot.pose.yaw - goal.yaw)) <= 0.05
    assert LocalWorld(costmap, FOOTPRINT).touched(trail.poses).max() == 0
    commands = np.array(trail.commands)
    assert np.diff(commands[:, 0]).max() <= 0.4 * PERIOD + 1e-9


@pytest.mark.parametrize('name', PLANNERS)
def test_turned_beside_a_corner_it_does_not_creep_into_it(name):
    """Lines of cells may miss a corner that the true outline reaches; what is driven is checked with the whole
    footprint.
    """
    costmap, planner = room((2.75, 1.75, 3.25, 2.25)), make(name, **SLOW[name])
    robot = LateUnicycle(Pose2D(2.164, 2.0, 0.0), 0.2, 0.15, 1.27)
    goal = Pose2D(2.0, 5.0, 1.57)
    trail = drive(planner, robot, costmap, goal, dense_plan([(2.164, 2.0), (2.0, 5.0)], 1.57), limit=20.0, delay=0.15)
    assert LocalWorld(costmap, FOOTPRINT).touched(trail.poses).max() == 0
