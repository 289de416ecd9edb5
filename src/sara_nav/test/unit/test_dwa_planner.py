"""DWAPlannerROS cycle by cycle: its samples, its critics in their order, and what its parameters do."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import Grid, GridGeometry
from sara_nav.move_base import local_planners as lp
from sara_nav.planners.planning import dense_plan
from sara_nav.sampled import critics, speed_samples, trajectory
from sara_nav.sampled.critics import OscillationFlags
from sara_nav.sampled.dwa_planner import DWAPlanner, DWAPlannerConfig
from sara_nav.sampled.map_grid import plan_cells
from sara_nav.sampled.scene import Scene

SARA = np.array([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
STILL = (0.0, 0.0)
AHEAD = dense_plan([(0.0, 0.0), (4.0, 0.0)], 0.0)
DIAGONAL = dense_plan([(0.0, 0.0), (2.0, 2.0)], 0.0)


def world(*boxes):
    """Return a LocalWorld of 10 m x 10 m, a cell centred on the origin, with boxes (x0, y0, x1, y1, cost)."""
    costs = np.zeros((201, 201), np.uint8)
    for *box, cost in boxes:
        c0, r0, c1, r1 = (math.floor((v + 5.025) / 0.05 + 1e-9) for v in box)
        costs[r0:r1, c0:c1] = cost
    return LocalWorld(Costmap(costs, GridGeometry(201, 201, 0.05, -5.025, -5.025)), SARA)


def planner_with(**config):
    return DWAPlanner(DWAPlannerConfig(**config))


def first(planner, plan, where=None, pose=Pose2D(0.0, 0.0, 0.0), velocity=STILL):
    planner.start(plan)
    planner._last = velocity  # what it does is what it was told
    return planner.update(0.0, 0.05, pose, velocity, 0.0, where or world())


# -- samples -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    'low, high, count, expected',
    [
        (0.0, 0.0, 1, [0.0]),
        (2.2, 2.2, 1, [2.2]),
        (-3.3, -3.3, 1, [-3.3]),
        (-30, 30, 1, [-30, 0, 30]),
        (10, 30, 1, [10, 30]),
        (-30, -10, 1, [-30, -10]),
        (-30, 30, 3, [-30, 0, 30]),
        (-30, 30, 4, [-30, -10, 0, 10, 30]),
        (-10, 50, 4, [-10, 0, 10, 30, 50]),
        (-10.00001, 10, 3, [-10.00001, -0.000005, 0.0, 10]),
    ],
)
def test_velocities_of_the_peers_tests(low, high, count, expected):
    found = speed_samples.velocities(float(low), float(high), count)
    assert found == pytest.approx(expected, abs=1e-6)
    assert 0.0 in found or low > 0 or high < 0


@given(st.floats(-2.0, 2.0), st.just(0.0) | st.floats(1e-9, 2.0), st.integers(1, 30))
def test_velocities_rise_from_low_to_high_and_hold_zero(low, width, count):
    v = speed_samples.velocities(low, low + width, count)
    assert v[0] == low and v[-1] == low + width and (np.diff(v) > 0.0).all()
    assert 0.0 in v or not low < 0.0 < low + width


def test_the_window_is_what_one_period_reaches():
    c = DWAPlannerConfig(acc_lim_x=1.0, acc_lim_theta=2.0)
    samples = DWAPlanner(c)._speeds((0.3, 0.1), 3.0)
    assert samples[:, 0].min() == pytest.approx(0.25) and samples[:, 0].max() == pytest.approx(0.35)
    assert samples[:, 1].min() == pytest.approx(0.0) and samples[:, 1].max() == pytest.approx(0.2)
    assert len(samples) == 3 * 20
    wide = DWAPlanner(dataclasses.replace(c, use_dwa=False))._speeds((0.3, 0.1), 0.5)
    assert wide[:, 0].max() == pytest.approx(0.5 / 1.7), 'no faster than to the goal in sim_time'
    assert wide[:, 1].max() == 1.0 and wide[:, 1].min() == -1.0


def test_slower_than_both_minimums_is_not_sampled_but_the_minimums_are():
    """From rest, with accelerations too low to reach a minimum in one period, the peer has no sample and stands."""
    samples = planner_with(acc_lim_x=0.4, acc_lim_theta=0.4)._speeds(STILL, 3.0)
    assert {tuple(s) for s in samples} == {(0.1, 0.0), (0.0, 0.4), (0.0, -0.4)}
    fast = planner_with()._speeds((0.3, 0.0), 3.0)
    assert (fast[:, 0] >= 0.1).all() and fast.max() < 0.55


def test_limits_on_the_magnitude_hold():
    assert first(planner_with(max_vel_trans=0.3), AHEAD, velocity=(0.3, 0.0)).v <= 0.3 + 1e-9
    assert first(planner_with(max_vel_trans=-1.0), AHEAD, velocity=(0.5, 0.0)).v > 0.5, 'negative: no limit'


# -- critics -----------------------------------------------------------------------------------------------------


def test_the_critics_are_in_the_peers_order():
    assert critics.NAMES == ('oscillation', 'obstacle', 'goal_front', 'alignment', 'path', 'goal', 'twirling')
    assert (critics.OSCILLATION, critics.TWIRLING) == (0, 6)


def test_the_first_critic_that_refuses_says_why_and_weight_zero_is_silent():
    raw = np.array(
        [
            [0.0, 5.0, 1.0, 1.0, 1.0, 1.0, 1.0],
            [0.0, -6.0, -4.0, 0.0, -3.0, 0.0, 0.0],
            [-5.0, -6.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, -3.0, 0.0, 0.0],
        ]
    )
    assert critics.total(raw, [1, 2, 3, 4, 5, 6, 7]).tolist() == [35.0, -6.0, -5.0, -3.0]
    assert critics.total(raw, [1, 0, 0, 0, 0, 0, 0]).tolist() == [0.0, -6.0, -5.0, 0.0], 'but obstacle always refuses'


def judge(
    costs,
    samples,
    path=None,
    goal=None,
    front=None,
    state=(2.0, 2.0, 0.0, 0.3, 0.0),
    shift=0.3,
    growth=(0.25, 0.55, 0.2),
    accelerating=False,
    sum_scores=False,
    grace=0.0,
):
    zero = np.zeros(costs.shape, np.int32)
    return critics.judge(
        trajectory.Terrain(costs, Grid(0.0, 0.0, 0.05), SARA, np.full_like(costs, 255), grace),
        critics.Distances(*(zero if grid is None else grid for grid in (path, goal, front))),
        trajectory.State(*state),
        np.array(samples, float),
        trajectory.Simulation(1.0, 0.025, 0.1, 2.5, 3.2),
        critics.Rules(*growth, shift, accelerating, sum_scores),
    )


def test_what_each_critic_sees():
    costs = np.zeros((80, 80), np.uint8)
    columns = np.tile(np.arange(80, dtype=np.int32), (80, 1))
    raw, driven = judge(costs, [(0.4, 0.0), (0.0, 0.5)], path=columns, goal=columns * 2, front=columns * 3)
    end = int((2.0 + 0.4 * (1.0 - 1.0 / 16)) / 0.05)
    ahead = int((2.0 + 0.4 * (1.0 - 1.0 / 16) + 0.3) / 0.05)
    assert raw[0].tolist() == [0.0, 0.0, 3 * ahead, ahead, end, 2 * end, 0.0]
    assert (
        raw[1, critics.TWIRLING] == 0.5 and raw[1, critics.PATH] == 40 and driven.tolist() == [[0.4, 0.0], [0.0, 0.5]]
    )


def test_the_obstacle_critic():
    costs = np.zeros((80, 80), np.uint8)
    costs[:, 60:62] = 90  # x 3.0 .. 3.1: the front comes to it
    fast, slow = judge(costs, [(0.5, 0.0), (0.1, 0.0)])[0][:, critics.OBSTACLE]
    assert (fast, slow) == (90.0, 0.0)
    steps = sum(2.0 + 0.54 * 1.2 * 0.9722 + 0.5 * i / 20 >= 3.0 for i in range(20))
    assert judge(costs, [(0.5, 0.0)], sum_scores=True)[0][0, critics.OBSTACLE] == pytest.approx(90.0 * steps, abs=90.0)
    costs[:, 60:62] = 254
    assert judge(costs, [(0.5, 0.0), (0.1, 0.0)])[0][:, critics.OBSTACLE].tolist() == [critics.TOUCHES, 0.0]
    assert judge(costs, [(0.5, 0.0)], state=(-1.0, 2.0, 0.0, 0.0, 0.0))[0][0, critics.OBSTACLE] == critics.LEAVES_MAP


def test_the_footprint_grows_with_the_speed():
    costs = np.zeros((80, 80), np.uint8)
    costs[int((2.0 + 0.32) / 0.05), :] = 254  # 3 cm beside it
    assert judge(costs, [(0.2, 0.0), (0.55, 0.0)])[0][:, critics.OBSTACLE].tolist() == [0.0, critics.TOUCHES]
    assert judge(costs, [(0.55, 0.0)], growth=(0.25, 0.55, 0.0))[0][0, critics.OBSTACLE] == 0.0


def test_grids_refuse_at_the_centre_but_only_cost_at_the_point_ahead():
    costs = np.zeros((80, 80), np.uint8)
    grid = np.zeros((80, 80), np.int32)
    grid[:, 45:47], grid[:, 47:] = costs.size, costs.size + 1
    raw = judge(costs, [(0.4, 0.0), (0.1, 0.0)], path=grid, goal=grid, front=grid)[0]
    assert raw[0, critics.PATH] == critics.IN_OBSTACLE and raw[0, critics.GOAL] == critics.IN_OBSTACLE
    assert raw[1, critics.PATH] == 0.0 and raw[1, critics.GOAL_FRONT] >= costs.size
    near_edge = judge(costs, [(0.1, 0.0)], state=(3.3, 2.0, 0.0, 0.0, 0.0), shift=0.8)[0]
    assert near_edge[0, critics.ALIGNMENT] == critics.LOOKS_OFF_MAP == near_edge[0, critics.GOAL_FRONT]


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_judging_all_at_once_is_judging_one_by_one(seed, accelerating):
    random = np.random.default_rng(seed)
    costs = np.zeros((80, 80), np.uint8)
    for x, y in random.integers(0, 80, (6, 2)):
        costs[max(y - 3, 0) : y + 4, max(x - 3, 0) : x + 4] = random.integers(1, 254)
    samples = random.uniform((0.0, -1.0), (0.55, 1.0), (20, 2))
    together, driven = judge(costs, samples, accelerating=accelerating)
    for i, sample in enumerate(samples):
        alone, one = judge(costs, [sample], accelerating=accelerating)
        assert np.array_equal(alone[0], together[i]) and np.array_equal(one[0], driven[i])
    if not accelerating:
        assert np.array_equal(driven, samples)


# -- oscillation -------------------------------------------------------------------------------------------------


def test_turning_back_in_place_is_barred_until_moved_or_turned():
    flags, here = OscillationFlags(), Pose2D(0.0, 0.0, 0.0)
    both = np.array([[0.0, 0.5], [0.0, -0.5]])
    flags.update(here, 0.0, 0.5, 0.1, 0.05, 0.2)
    assert not flags.barred(both).any()
    flags.update(here, 0.0, -0.5, 0.1, 0.05, 0.2)
    assert flags.barred(both).tolist() == [True, False]
    flags.update(Pose2D(0.0, 0.0, -0.1), 0.0, -0.5, 0.1, 0.05, 0.2)
    assert flags.barred(both).tolist() == [True, False]
    flags.update(Pose2D(0.0, 0.0, -0.25), 0.0, -0.5, 0.1, 0.05, 0.2)
    assert not flags.barred(both).any()


def test_turns_while_driving_are_no_oscillation_but_reversing_is():
    flags, here = OscillationFlags(), Pose2D(0.0, 0.0, 0.0)
    for w in (0.5, -0.5, 0.5):
        flags.update(here, 0.4, w, 0.1, 0.05, 0.2)
    assert not flags.barred(np.array([[0.4, 0.5], [0.4, -0.5]])).any()
    flags.update(here, -0.2, 0.0, 0.1, 0.05, 0.2)
    assert flags.barred(np.array([[0.2, 0.0], [-0.2, 0.0]])).tolist() == [True, False]
    flags.update(Pose2D(-0.06, 0.0, 0.0), -0.2, 0.0, 0.1, 0.05, 0.2)
    assert not flags.barred(np.array([[0.2, 0.0]])).any()


def test_flags_discard_samples():
    planner = planner_with(acc_lim_theta=10.0)
    planner.start(dense_plan([(0.0, 0.0), (0.0, 3.0)], 0.0))
    here = Pose2D(0.0, 0.0, 0.0)
    assert planner.update(0.0, 0.05, here, STILL, 0.0, world()).w > 0.0
    planner._flags.update(here, 0.0, -0.5, 0.1, 0.05, 0.2)
    assert planner.update(0.05, 0.05, here, STILL, 0.0, world()).w <= 0.0


# -- weights -----------------------------------------------------------------------------------------------------


def test_biases_are_per_metre_and_alignment_ends_near_the_goal():
    planner = planner_with(path_distance_bias=32.0, goal_distance_bias=24.0, twirling_scale=0.5)
    assert planner._weights(0.05, 3.0).tolist() == pytest.approx([1.0, 0.01, 1.2, 1.6, 1.6, 1.2, 0.5])
    assert planner._weights(0.05, 0.3)[critics.ALIGNMENT] == 0.0
    assert planner_with(cheat_factor=0.5)._weights(0.05, 0.3)[critics.ALIGNMENT] > 0.0


def test_twirling_keeps_the_robot_from_turning():
    assert abs(first(planner_with(), DIAGONAL, velocity=(0.3, 0.3)).w) > 0.2
    assert abs(first(planner_with(twirling_scale=1000.0), DIAGONAL, velocity=(0.3, 0.3)).w) < 0.2


def test_occdist_scale_zero_does_not_make_the_robot_blind():
    where = world((0.7, -2.0, 0.8, 2.0, 254))
    command = first(planner_with(occdist_scale=0.0), AHEAD, where, velocity=(0.5, 0.0))
    assert command.state == lp.BLOCKED and 'touch' in command.text and (command.v, command.w) == STILL


def test_the_speeds_beyond_one_period_are_accelerated_to_without_dwa():
    command = first(planner_with(use_dwa=False), AHEAD)
    assert 0.0 < command.v <= 2.5 * 1.7 / 38 + 1e-9, 'one simulation step of acceleration from rest'


def test_clouds():
    planner = planner_with()
    assert planner.cost_cloud is None and planner.trajectory_cloud is None
    first(planner, AHEAD, velocity=(0.3, 0.0))
    cloud = planner.trajectory_cloud
    assert cloud.shape[1] == 5 and len(np.unique(cloud[:, 4])) > 3 and (cloud[:, 4] >= 0.0).all()
    assert planner.local_plan.shape[1] == 3 and planner.cost_cloud.shape[1] == 7
    best = cloud[cloud[:, 4] == cloud[:, 4].min()]
    assert np.allclose(best[: len(planner.local_plan), :2], planner.local_plan[:, :2])


# -- configuration -----------------------------------------------------------------------------------------------


def test_defaults_are_the_peers():
    c = DWAPlannerConfig()
    assert c.faults() == []
    assert (
        c.max_vel_trans,
        c.min_vel_trans,
        c.min_vel_theta,
        c.angular_sim_granularity,
        c.vx_samples,
        c.vy_samples,
        c.vth_samples,
        c.use_dwa,
        c.prune_plan,
    ) == (0.55, 0.1, 0.4, 0.1, 3, 10, 20, True, False)


def test_no_sample_sideways_is_no_fault():
    """TurtleBot3's file says so; the C++ planner takes 1 for it."""
    assert DWAPlannerConfig(vy_samples=0).faults() == []
    assert DWAPlannerConfig(vx_samples=0).faults() != []


@pytest.mark.parametrize(
    'config, text',
    [
        ({'acc_lim_x': 1e-9}, 'acc_lim_x is 1e-09, allowed are numbers from 0.01'),
        ({'acc_lim_theta': 1e-7}, 'acc_lim_theta is 1e-07, allowed are numbers from 0.01'),
        ({'max_vel_y': 0.1}, 'max_vel_y is 0.1, allowed is 0'),
        ({'min_vel_y': -0.1}, 'min_vel_y is -0.1, allowed is 0'),
        ({'sim_time': -1.0}, 'sim_time is -1.0'),
        ({'vth_samples': 0}, 'vth_samples is 0'),
        ({'max_vel_trans': 0.05}, 'max_vel_trans is 0.05, allowed is at least min_vel_trans'),
        ({'min_vel_theta': 1.5}, 'min_vel_theta is 1.5, allowed is no more than max_vel_theta'),
        ({'path_distance_bias': math.nan}, 'path_distance_bias is nan'),
    ],
)
def test_bad_values_are_named_and_refused(config, text):
    bad = DWAPlannerConfig(**config)
    assert len(bad.faults()) == 1 and bad.faults()[0].startswith(text)
    with pytest.raises(ValueError):
        DWAPlanner(bad)


def test_every_number_has_limits():
    numbers = {f.name for f in dataclasses.fields(DWAPlannerConfig) if f.type in (float, int)}
    assert numbers - {'max_vel_y', 'min_vel_y'} == set(DWAPlannerConfig.LIMITS)
    names = {f.name for f in dataclasses.fields(DWAPlannerConfig)}
    assert set(DWAPlannerConfig.FIXED) < names and set(DWAPlannerConfig.WITHOUT_EFFECT) < names


@pytest.mark.parametrize('name', ['base_local_planner/TrajectoryPlannerROS', 'dwa_local_planner/DWAPlannerROS'])
def test_a_robot_that_touches_something_drives_off_it_but_not_further_into_it(name):
    """The peers are stuck until something clears the costmap."""
    cls = lp.LOCAL_PLANNERS.find(name)
    behind, ahead = world((-0.56, 0.0, -0.5, 0.05, 254)), world((0.5, 0.0, 1.2, 0.05, 254))
    assert first(cls(), AHEAD, behind).v > 0.05
    command = first(cls(), AHEAD, ahead)
    assert command.v <= 0.0 and (command.state == lp.BLOCKED or command.v < 0.0 or command.w != 0.0)


def test_the_point_ahead_of_the_goal_lies_beyond_it_seen_from_the_robot():
    planner, where = planner_with(forward_point_distance=0.5), world()

    def front(plan, pose):
        cells = plan_cells(plan, where.costmap)
        return planner._front_cell(Scene(0.05, pose, STILL, plan, cells, where, None))[0].tolist(), cells[-1].tolist()

    ahead, end = front(AHEAD, Pose2D(1.0, 0.0, 0.0))
    assert ahead == [end[0] + 10, end[1]]
    ahead, end = front(dense_plan([(0.0, 0.0), (0.0, 2.0)], 0.0), Pose2D(0.0, -1.0, 0.0))
    assert ahead == [end[0], end[1] + 10]
    ahead, end = front(dense_plan([(0.0, 0.0), (9.0, 0.0)], 0.0), Pose2D(0.0, 0.0, 0.0))
    assert ahead == end, 'the plan leaves the map'
