"""TrajectoryPlannerROS cycle by cycle: what is sampled, which sample is taken, and what its parameters do."""

import dataclasses
import math

import numpy as np
import pytest

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import GridGeometry
from sara_nav.move_base import local_planners as lp
from sara_nav.planners.planning import dense_plan
from sara_nav.sampled.scene import Choice
from sara_nav.sampled.trajectory_planner import TrajectoryPlanner, TrajectoryPlannerConfig

SARA = np.array([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
STILL = (0.0, 0.0)


def world(*boxes, unknown=()):
    """Return a LocalWorld of 10 m x 10 m, a cell centred on the origin, with boxes (x0, y0, x1, y1) of obstacles."""
    costs = np.zeros((201, 201), np.uint8)
    for value, group in ((254, boxes), (255, unknown)):
        for x0, y0, x1, y1 in group:
            c0, r0, c1, r1 = (math.floor((v + 5.025) / 0.05 + 1e-9) for v in (x0, y0, x1, y1))
            costs[r0:r1, c0:c1] = value
    return LocalWorld(Costmap(costs, GridGeometry(201, 201, 0.05, -5.025, -5.025)), SARA)


def first(planner, plan, where=None, pose=Pose2D(0.0, 0.0, 0.0), velocity=STILL, dt=0.05):
    planner.start(plan)
    planner._last = velocity  # what it does is what it was told
    return planner.update(0.0, dt, pose, velocity, 0.0, where or world())


def planner_with(**config):
    return TrajectoryPlanner(TrajectoryPlannerConfig(**config))


AHEAD = dense_plan([(0.0, 0.0), (4.0, 0.0)], 0.0)
BEHIND = dense_plan([(0.0, 0.0), (-4.0, 0.0)], 0.0)
LEFT = dense_plan([(0.0, 0.0), (0.0, 4.0)], 0.0)


def test_the_plan_ahead_is_driven_at_once_and_fast():
    command = first(planner_with(), AHEAD, dt=1.0)
    assert command.state == lp.DRIVING and command.v == pytest.approx(0.55) and abs(command.w) < 0.06


def test_commands_keep_the_accelerations_but_for_the_least_turn_in_place():
    """The peer commands the sample's speed at once."""
    command = first(planner_with(acc_lim_x=0.4), AHEAD, velocity=(0.2, 0.0))
    assert command.v == pytest.approx(0.22)
    assert first(planner_with(acc_lim_theta=1.0), LEFT).w == pytest.approx(0.4)
    assert first(planner_with(acc_lim_theta=1.0), LEFT, velocity=(0.0, 0.6)).w == pytest.approx(0.65)


@pytest.mark.parametrize('plan, senses', [(LEFT, (1,)), (LEFT * (1, -1, 1), (-1,)), (BEHIND, (-1, 1))])
def test_a_plan_to_the_side_or_behind_is_turned_to(plan, senses):
    command = first(planner_with(), plan)
    assert command.w * senses[0] > 0.0 or command.w * senses[-1] > 0.0
    assert command.v == 0.0 and abs(command.w) >= 0.4


def test_a_mirrored_world_is_driven_mirrored():
    """The peer leaves out the fastest turn to the left."""
    where, mirrored = world((0.9, 0.1, 1.4, 0.6)), world((0.9, -0.6, 1.4, -0.1))
    plan = dense_plan([(0.0, 0.0), (1.2, -0.7), (4.0, -0.7)], 0.0)
    a, b = first(planner_with(), plan, where), first(planner_with(), plan * (1, -1, 1), mirrored)
    assert a.v > 0.0 and a.w < 0.0 and (b.v, b.w) == pytest.approx((a.v, -a.w), abs=0.06)


def test_turning_back_is_barred_until_the_robot_has_moved():
    planner = planner_with(vx_samples=1)  # fast or not at all: then it turns in place
    planner.start(LEFT)
    for i in range(2):
        assert planner.update(0.05 * i, 0.05, Pose2D(0.0, 0.0, 0.0), STILL, 0.0, world()).w > 0.0
    planner.replan(LEFT * (1, -1, 1))
    planner.goal = Pose2D(*LEFT[-1])  # as if it were the same goal
    assert planner.update(0.1, 0.05, Pose2D(0.0, 0.0, 0.0), STILL, 0.0, world()).w >= 0.0, 'barred'
    sideways = Pose2D(0.06, 0.0, 0.0)
    planner._remember_turn((0.3, 0.0), sideways)
    planner.stop()
    assert planner.update(0.2, 0.05, sideways, STILL, 0.0, world()).w < 0.0, 'has moved 6 cm'


def test_speed_near_the_goal_is_such_that_it_is_not_overshot():
    command = first(planner_with(), dense_plan([(0.0, 0.0), (0.5, 0.0)], 0.0), dt=1.0)
    assert 0.25 < command.v <= 0.5 / 1.7


def test_dwa_samples_only_what_one_period_reaches():
    command = first(planner_with(dwa=True, acc_lim_x=1.0, controller_frequency=10.0), AHEAD, velocity=(0.2, 0.0))
    assert command.v <= 0.2 + 0.1 + 1e-9
    assert first(planner_with(), AHEAD, velocity=(0.2, 0.0), dt=1.0).v == pytest.approx(0.55)


def test_the_robot_backs_out_when_all_else_is_blocked_and_only_where_it_is_free():
    beside = (-0.56, 0.35, 0.6, 0.4), (-0.56, -0.40, 0.6, -0.35)
    box = (0.6, -1.0, 0.75, 1.0), *beside
    planner = planner_with(min_vel_x=0.1)
    command = first(planner, AHEAD, world(*box))
    assert (command.v, command.w) == (-0.1, 0.0) and 'escape_vel' in command.text
    command = planner.update(0.05, 0.05, Pose2D(0.0, 0.0, 0.0), STILL, 0.0, world())
    assert command.v <= 0.0, 'while escaping, nothing forward'
    command = planner.update(0.1, 0.05, Pose2D(-0.11, 0.0, 0.0), STILL, 0.0, world())
    planner.update(0.15, 0.05, Pose2D(-0.11, 0.0, 0.0), STILL, 0.0, world())
    assert planner.update(0.2, 0.05, Pose2D(-0.11, 0.0, 0.0), STILL, 0.0, world()).v > 0.0, 'escape_reset_dist'
    command = first(planner, AHEAD, world(*box, (-0.7, -1.0, -0.6, 1.0)))
    assert command.state == lp.BLOCKED and (command.v, command.w) == STILL and 'footprint' in command.text


def test_in_a_tight_place_it_looks_less_far_ahead_and_moves_by_inches():
    """Turned by 0.15 rad between two walls: no turn of sim_time is free, the short one that straightens it is."""
    where = world((-2.0, 0.45, 2.0, 0.5), (-2.0, -0.5, 2.0, -0.45))
    pose = Pose2D(0.0, 0.0, 0.15)
    planner = planner_with(min_vel_x=0.3)
    command = first(planner, AHEAD, where, pose)
    assert command.state == lp.DRIVING and command.w < 0.0
    assert not where.worsens(planner.local_plan)


def test_no_way_to_the_goal_is_said():
    wall = (1.5, -5.0, 1.6, 5.0), (-5.0, 3.0, 1.6, 3.1), (-5.0, -3.1, 1.6, -3.0), (-3.0, -3.0, -2.9, 3.0)
    command = first(planner_with(), AHEAD, world(*wall))
    assert command.state == lp.BLOCKED and 'no way' in command.text and (command.v, command.w) == STILL


def test_unknown_cells_of_the_local_costmap_end_the_plan_and_block_the_outline():
    command = first(planner_with(), AHEAD, world(unknown=[(0.56, -5.0, 5.0, 5.0)]))
    assert command.v <= 0.0
    assert first(planner_with(), AHEAD, world(unknown=[(-5.0, -5.0, 5.0, 5.0)])).state == lp.OFF_PATH


def test_weights_decide_between_the_path_and_the_short_way():
    """With no weight on the path the corner is cut; with much, it is not."""
    corner = dense_plan([(0.0, 0.0), (1.5, 0.0), (1.5, 2.0)], 1.57)
    cut = first(planner_with(path_distance_bias=0.0), corner, velocity=(0.5, 0.0))
    keep = first(planner_with(path_distance_bias=5.0), corner, velocity=(0.5, 0.0))
    assert cut.w > keep.w + 0.05


def test_occdist_scale_keeps_away_from_what_costs():
    where = world()
    where.costmap.costs[98:130, 115:140] = 120
    near = first(planner_with(occdist_scale=0.0, path_distance_bias=0.0), AHEAD, where, dt=1.0)
    away = first(planner_with(occdist_scale=1.0, path_distance_bias=0.0), AHEAD, where, dt=1.0)
    assert near.v == pytest.approx(0.55) and (away.v < 0.3 or away.w < -0.2)


def test_meter_scoring_weighs_metres_instead_of_cells():
    planner = planner_with(meter_scoring=True)
    first(planner, AHEAD)
    scaled = planner.cost_cloud
    other = planner_with(path_distance_bias=0.6 * 0.05, goal_distance_bias=0.8 * 0.05)
    first(other, AHEAD)
    assert np.allclose(scaled, other.cost_cloud)


def test_the_simple_attractor_drives_at_the_end_of_the_plan():
    detour = dense_plan([(0.0, 0.0), (0.0, 2.0), (3.0, 2.0), (3.0, 0.0)], 0.0)
    wall = world((1.7, -5.0, 1.8, 1.3))
    assert first(planner_with(simple_attractor=True), detour, wall, dt=1.0).v > 0.4
    assert first(planner_with(), detour, wall, dt=1.0).w > 0.3


def test_heading_scoring_turns_towards_the_plan():
    plan = dense_plan([(0.0, 0.0), (2.5, 2.5)], 0.0)
    command = first(planner_with(heading_scoring=True, heading_scoring_timestep=0.8), plan, dt=1.0)
    assert command.state == lp.DRIVING and command.w > 0.2


def test_the_cost_cloud_holds_what_can_be_driven_to():
    planner = planner_with()
    assert planner.cost_cloud is None
    first(planner, AHEAD, world((1.0, 1.0, 2.0, 2.0)))
    cloud = planner.cost_cloud
    assert cloud.shape[1] == 7 and np.isfinite(cloud).all()
    inside = (cloud[:, 0] > 1.0) & (cloud[:, 0] < 2.0) & (cloud[:, 1] > 1.0) & (cloud[:, 1] < 2.0)
    assert not inside.any(), 'obstacles'
    assert not ((np.abs(cloud[:, 0]) < 0.45) & (np.abs(cloud[:, 1]) < 0.2)).any(), 'under the robot'
    assert np.allclose(cloud[:, 6], 0.6 * cloud[:, 3] + 0.8 * cloud[:, 4] + 0.01 * cloud[:, 5])


def test_a_better_plan_to_the_same_goal_keeps_what_is_reached():
    planner = planner_with(latch_xy_goal_tolerance=True)
    planner.start(AHEAD)
    for i in range(10):
        planner.update(0.05 * i, 0.05, Pose2D(4.0, 0.0, 1.0), STILL, 0.0, world())
    assert planner.phase == 'turn to goal'
    planner.replan(AHEAD)
    assert planner.phase == 'turn to goal'
    planner.replan(BEHIND)
    assert planner.phase == 'follow path'


# -- configuration -----------------------------------------------------------------------------------------------


def test_defaults_are_the_peers_values_in_force():
    config = TrajectoryPlannerConfig()
    assert config.faults() == []
    assert (
        config.sim_time,
        config.vx_samples,
        config.goal_distance_bias,
        config.dwa,
        config.max_vel_x,
        config.min_vel_x,
        config.heading_scoring_timestep,
    ) == (1.7, 20, 0.8, False, 0.55, 0.0, 0.1)
    assert config.escape_reset_theta == pytest.approx(0.5 * math.pi)


@pytest.mark.parametrize(
    'config, text',
    [
        ({'holonomic_robot': True}, 'holonomic_robot is true, allowed is false'),
        ({'escape_vel': 0.1}, 'escape_vel is 0.1, allowed are numbers from -2 to below 0'),
        ({'escape_vel': math.nan}, 'escape_vel is nan'),
        ({'sim_time': 0.0}, 'sim_time is 0.0, allowed are numbers above 0'),
        ({'acc_lim_x': 1e-9}, 'acc_lim_x is 1e-09, allowed are numbers from 0.01'),
        ({'acc_lim_theta': 1e-7}, 'acc_lim_theta is 1e-07, allowed are numbers from 0.01'),
        ({'vx_samples': 0}, 'vx_samples is 0'),
        ({'max_vel_x': math.inf}, 'max_vel_x is inf'),
        ({'min_vel_theta': 0.5}, 'min_vel_theta is 0.5'),
        ({'world_model': 'freespace'}, "world_model is 'freespace', allowed is costmap"),
        ({'y_vels': 'fast'}, "y_vels is 'fast', allowed are numbers"),
        ({'min_vel_x': 0.9}, 'min_vel_x is 0.9'),
        ({'heading_scoring': True, 'sim_time': 0.05}, 'heading_scoring_timestep is 0.1'),
    ],
)
def test_bad_values_are_named_and_refused(config, text):
    bad = TrajectoryPlannerConfig(**config)
    assert len(bad.faults()) == 1 and bad.faults()[0].startswith(text)
    with pytest.raises(ValueError):
        TrajectoryPlanner(bad)
    planner = TrajectoryPlanner()
    with pytest.raises(ValueError):
        planner.reconfigure(bad)
    assert planner.config == TrajectoryPlannerConfig()


def test_every_number_has_limits():
    numbers = {f.name for f in dataclasses.fields(TrajectoryPlannerConfig) if f.type in (float, int)}
    assert numbers - {'escape_vel'} == set(TrajectoryPlannerConfig.LIMITS)
    names = {f.name for f in dataclasses.fields(TrajectoryPlannerConfig)}
    assert set(TrajectoryPlannerConfig.FIXED) < names and 'stop_time_buffer' in TrajectoryPlannerConfig.WITHOUT_EFFECT


def test_beside_a_wall_it_turns_to_a_plan_behind_instead_of_creeping_on():
    """There a turn in place costs more than standing, and forward costs no less: the peer stands for ever."""
    where = world()
    where.costmap.costs[84:88] = 254  # 0.65 m to the right, with costs about it
    where.costmap.costs[88:95] = 253
    command = first(planner_with(occdist_scale=0.05), BEHIND, where)
    assert command.state == lp.DRIVING and command.v == 0.0 and command.w != 0.0


@pytest.mark.parametrize('name', ['base_local_planner/TrajectoryPlannerROS', 'dwa_local_planner/DWAPlannerROS'])
@pytest.mark.parametrize('prune', [True, False])
def test_a_way_that_comes_near_to_where_it_began_is_not_taken_back(name, prune):
    """The way goes out of the local costmap and back in beside the robot; without prune_plan the peer turns round."""
    cls = lp.LOCAL_PLANNERS.find(name)
    planner = cls(cls.config_class(prune_plan=prune))
    planner.start(dense_plan([(0.0, -2.0), (-7.0, -2.0), (-7.0, 0.0), (4.0, 0.0)], 0.0))
    where = world()
    for i in range(60):  # a robot that was carried along the way; the costmap goes with it
        x = -7.0 + 0.12 * i
        rolled = LocalWorld(Costmap(where.costmap.costs, GridGeometry(201, 201, 0.05, x - 5.025, -5.025)), SARA)
        command = planner.update(0.05 * i, 0.05, Pose2D(x, 0.0, 0.0), (0.3, 0.0), 0.0, rolled)
        if x > -2.0:
            assert command.state == lp.DRIVING and command.v > 0.1 and abs(command.w) < 0.3


@pytest.mark.parametrize('name', ['base_local_planner/TrajectoryPlannerROS', 'dwa_local_planner/DWAPlannerROS'])
def test_a_robot_that_does_not_get_on_turns_to_its_plan(name):
    """Whatever samples say: after four seconds in one place with the plan behind it turns there, one way, till it faces
    it.
    """
    cls = lp.LOCAL_PLANNERS.find(name)
    planner = cls()
    planner.start(BEHIND)
    pose, rates, last = Pose2D(0.0, 0.0, 0.0), [], (0.0, 0.0)
    for i in range(300):
        if i < 82:
            swing = Choice((0.0, 0.1 * (-1) ** (i // 10)), np.zeros((1, 3)))
            planner._choose = lambda _, swing=swing: swing
        elif i == 82:
            del planner._choose
        command = planner.update(0.05 * i, 0.05, pose, last, 0.0, world())
        last = (command.v, command.w)
        pose = pose.advance(0.0, command.w, 0.05)
        if i > 82 and abs(pose.yaw) < 2.7:
            rates.append(command.w)
        if command.v > 0.1:
            break
    assert abs(pose.yaw) > 2.5 and command.v > 0.1
    assert len(rates) > 10 and (min(rates) > 0.0 or max(rates) < 0.0)
