"""Outlines, lines and rollouts: the peer's reference costs, its unit tests, and laws of the kernels."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.grids import outline
from sara_nav.grids.grid import Grid, GridGeometry
from sara_nav.grids.polygon import footprint_cells
from sara_nav.sampled import map_grid, rollout, trajectory

REFERENCE = Path(__file__).parents[5] / 'shared' / 'data' / 'reference' / 'costmap.npz'
SQUARE = np.array([[2.0, 2.0], [2.0, -2.0], [-2.0, -2.0], [-2.0, 2.0]])
GRID = Grid(0.0, 0.0, 0.05)
TEN = GridGeometry(10, 10, 1.0, 0.0, 0.0)
SARA = np.array([[0.54, 0.29], [-0.54, 0.29], [-0.54, -0.29], [0.54, -0.29]])
cell = st.integers(-40, 40)


# -- lines and footprints ----------------------------------------------------------------------------------------


def test_line_cells_of_the_peers_tests():
    assert outline.line_cells(0, 0, 10, 10).tolist() == [[i, i] for i in range(11)]
    assert outline.line_cells(1, 2, 1, 4).tolist() == [[1, 2], [1, 3], [1, 4]]
    assert outline.line_cells(0, 0, -2, -4).tolist() == [[0, 0], [-1, -1], [-1, -2], [-2, -3], [-2, -4]]


@given(cell, cell, cell, cell)
def test_a_line_joins_its_ends_without_gaps_and_stays_by_the_straight_one(x0, y0, x1, y1):
    cells = outline.line_cells(x0, y0, x1, y1)
    assert cells[0].tolist() == [x0, y0] and cells[-1].tolist() == [x1, y1]
    assert len(cells) == max(abs(x1 - x0), abs(y1 - y0)) + 1
    assert np.abs(np.diff(cells, axis=0)).max(initial=0) <= 1
    length = math.hypot(x1 - x0, y1 - y0)
    if length > 0.0:
        off = ((cells[:, 0] - x0) * (y1 - y0) - (cells[:, 1] - y0) * (x1 - x0)) / length
        assert np.abs(off).max() <= 1.0


@given(st.integers(0, 9), st.integers(0, 9), st.integers(0, 9), st.integers(0, 9), st.integers(0, 2**32 - 1))
def test_a_lines_cost_is_the_highest_of_its_cells(x0, y0, x1, y1, seed):
    costs = np.random.default_rng(seed).integers(0, 254, (10, 10)).astype(np.uint8)
    cells = outline.line_cells(x0, y0, x1, y1)
    assert outline.line_cost(costs, x0, y0, x1, y1) == costs[cells[:, 1], cells[:, 0]].max()
    costs[cells[-1, 1], cells[-1, 0]] = 254 + seed % 2
    assert outline.line_cost(costs, x0, y0, x1, y1) == (-1, -2)[seed % 2]


def test_footprint_cells_of_the_peers_test():
    """Front, right, back and left edge of a square, at yaw 0; a quarter turn begins with what was the left edge."""
    cells = footprint_cells(Pose2D(4.5, 4.5, 0.0), SQUARE, TEN).tolist()
    assert cells == (
        [[6, y] for y in (6, 5, 4, 3, 2)]
        + [[x, 2] for x in (6, 5, 4, 3, 2)]
        + [[2, y] for y in (2, 3, 4, 5, 6)]
        + [[x, 6] for x in (2, 3, 4, 5, 6)]
    )
    turned = footprint_cells(Pose2D(4.5, 4.5, 0.5 * math.pi), SQUARE, TEN).tolist()
    assert turned == (
        [[x, 6] for x in (2, 3, 4, 5, 6)]
        + [[6, y] for y in (6, 5, 4, 3, 2)]
        + [[x, 2] for x in (6, 5, 4, 3, 2)]
        + [[2, y] for y in (2, 3, 4, 5, 6)]
    )


def test_a_filled_footprint_is_all_cells_inside():
    cells = footprint_cells(Pose2D(4.5, 4.5, 0.0), SQUARE, TEN, True)
    assert {tuple(c) for c in cells} == {(x, y) for x in range(2, 7) for y in range(2, 7)}
    assert len(footprint_cells(Pose2D(1.0, 4.5, 0.0), SQUARE, TEN)) == 0, 'a corner is off the map'


@pytest.mark.skipif(not REFERENCE.exists(), reason='shared/data/reference/costmap.npz is not beside the project')
def test_outline_costs_are_the_peers():
    data = np.load(REFERENCE)
    grid = np.ascontiguousarray(data['fpcost_grid'], dtype=np.uint8)
    costs = [
        outline.outline_cost(grid, GRID, data['poly_0'], outline.Placed(1.0, x, y, math.cos(yaw), math.sin(yaw)))
        for x, y, yaw in data['fpcost_poses']
    ]
    assert np.array_equal(costs, data['fpcost'])


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 6.3))
def test_no_outline_costs_more_than_the_ceiling_of_its_centre(seed, yaw):
    random = np.random.default_rng(seed)
    costs = random.integers(0, 254, (60, 60)).astype(np.uint8) * (random.random((60, 60)) < 0.05)
    ceiling = outline.cost_ceiling(costs, 30, 30, 6, 14)
    for x, y in random.uniform(1.2, 1.8, (20, 2)):
        cost = outline.outline_cost(costs, GRID, SARA, outline.Placed(1.0, x, y, math.cos(yaw), math.sin(yaw)))
        assert 0 <= cost <= ceiling[int(y / 0.05), int(x / 0.05)]
    assert ceiling[30, 30] == costs[16:45, 16:45].max() and ceiling[0, 0] == 255


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(0, 8), st.integers(0, 253))
def test_an_outline_drawn_only_where_it_may_cost_more_costs_the_same(seed, reach, floor):
    random = np.random.default_rng(seed)
    costs = random.integers(0, 254, (70, 60)).astype(np.uint8) * (random.random((70, 60)) < 0.04)
    costs[tuple(random.integers(0, 60, (2, 3)))] = random.choice([254, 255], 3)
    around = outline.Around(outline.highest_around(costs, reach), reach)
    points = outline.points_along(SARA, 2.0 * 0.05 * max(reach - outline.SLACK, 0.1) / 1.2)
    for row, column in random.integers(0, 60, (20, 2)):
        near = costs[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
        assert around.costs[row, column] >= near.max()
    for x, y, yaw in random.uniform((0.0, 0.0, -3.2), (3.0, 3.5, 3.2), (20, 3)):
        placed = outline.Placed(float(random.uniform(0.5, 1.2)), x, y, math.cos(yaw), math.sin(yaw))
        cost = outline.outline_cost(costs, GRID, SARA, placed)
        expected = max(cost, floor) if cost >= 0 else cost
        assert outline.outline_above(costs, around, floor, GRID, SARA, placed) == expected
        if reach > outline.SLACK and cost != outline.OFF_MAP:
            assert (0 <= cost <= floor) or not outline.is_below(around, floor, GRID, points, placed)


# -- rollouts ----------------------------------------------------------------------------------------------------


def score(
    costs,
    samples,
    state,
    path=None,
    goal=None,
    corners=SQUARE,
    resolution=1.0,
    acceleration=(4.0, 4.0),
    simulation=(1.0, 1.0, 1.0),
    weights=(1.0, 1.0, 1.0),
    ceiling=None,
    attractor=(False, 0.0, 0.0),
    heading=(False, 0.1),
    cells=((0, 0),),
    grace=0.0,
):
    zero = np.zeros(costs.shape, np.int32)
    ceiling = np.full_like(costs, 255) if ceiling is None else ceiling
    terrain = trajectory.Terrain(costs, Grid(0.0, 0.0, resolution), corners, ceiling, grace)
    distances = [zero if grid is None else grid for grid in (path, goal)]
    return rollout.score(
        terrain,
        rollout.Distances(*distances, np.array(cells, np.int64)),
        trajectory.State(*state),
        np.array(samples, float),
        trajectory.Simulation(*simulation, *acceleration),
        rollout.Scoring(*weights, attractor[0], attractor[1:], *heading),
    )


def test_footprint_obstacles_of_the_peers_test():
    """Driving and turning with an obstacle under the outline is impossible; without, possible."""
    costs, state = np.zeros((10, 10), np.uint8), (4.5, 4.5, 0.5 * math.pi, 0.0, 0.0)
    samples = [(4.0, 0.0), (0.0, 0.5 * math.pi)]
    assert (score(costs, samples, state, simulation=(1.0, 4.0, 1.0))[0] >= 0.0).all()
    costs[6, 4] = 254
    assert score(costs, samples, state)[0].tolist() == [rollout.COLLIDES] * 2
    costs[6, 4], costs[1:8, 7] = 0, 254  # a wall beside it: an eighth of a turn reaches it
    assert score(costs, [(0.0, 0.5 * math.pi)], state, simulation=(1.0, 1.0, 0.1))[0][0] == rollout.COLLIDES


def test_a_rollout_reaches_the_speed_asked_for_within_the_acceleration():
    poses = rollout.roll(
        trajectory.State(*[0.0] * 5), (1.0, 0.0), trajectory.Simulation(4.0, 0.01, 0.01, 0.5, 1.0), False
    )
    dt = 4.0 / 400
    speed = np.diff(poses[:, 0]) / dt
    assert np.diff(speed).max() <= 0.5 * dt + 1e-9 and speed.max() == pytest.approx(1.0)
    assert poses[-1, 0] == pytest.approx(4.0 - 1.0, abs=0.02), 'two seconds at half the speed are lost'


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_scoring_all_at_once_is_scoring_one_by_one_with_or_without_the_ceiling(seed):
    random = np.random.default_rng(seed)
    costs = np.zeros((80, 80), np.uint8)
    for x, y in random.integers(0, 80, (8, 2)):
        costs[max(y - 3, 0) : y + 4, max(x - 3, 0) : x + 4] = random.integers(1, 254)
        costs[y, x] = 254
    seeds = random.integers(0, 80, (1, 2))
    grid = map_grid.spread(costs, seeds, np.empty((0, 2), np.int64))
    state = (2.0, 2.0, random.uniform(-3, 3), random.uniform(0, 0.5), random.uniform(-1, 1))
    samples = random.uniform((0.0, -1.0), (0.55, 1.0), (30, 2))
    kwargs = dict(corners=SARA, resolution=0.05, path=grid, goal=grid, simulation=(1.7, 0.025, 0.05))
    together, ends = score(costs, samples, state, ceiling=outline.cost_ceiling(costs, 40, 40, 22, 14), **kwargs)
    alone = [score(costs, [s], state, **kwargs)[0][0] for s in samples]
    assert np.array_equal(together, alone)
    simulation = trajectory.Simulation(1.7, 0.025, 0.05, 4.0, 4.0)
    for sample, end, cost in zip(samples, ends, together):
        if cost >= 0.0:
            poses = rollout.roll(trajectory.State(*state), tuple(sample), simulation, False)
            assert poses[-1] == pytest.approx(end)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 4.0), st.floats(-0.5, 0.5))
def test_every_trajectory_and_the_point_ahead_of_it_stays_in_its_room(seed, sim_time, ahead):
    random = np.random.default_rng(seed)
    state = trajectory.State(*random.uniform((-5.0, -5.0, -9.0, -0.6, -1.5), (5.0, 5.0, 9.0, 0.6, 1.5)))
    samples = random.uniform((-0.5, -1.0), (0.6, 1.0), (6, 2)) * (random.random((6, 2)) < 0.8)
    low_x, low_y, high_x, high_y = trajectory.room_of(state, samples, sim_time, ahead)
    assert low_x <= state[0] <= high_x and low_y <= state[1] <= high_y
    for sample in samples:
        poses = rollout.roll(state, tuple(sample), trajectory.Simulation(sim_time, 0.05, 0.05, 2.5, 3.2), False)
        for off in (0.0, ahead):
            x, y = poses[:, 0] + off * np.cos(poses[:, 2]), poses[:, 1] + off * np.sin(poses[:, 2])
            assert (
                low_x <= x.min() + 1e-9
                and x.max() <= high_x + 1e-9
                and low_y <= y.min() + 1e-9
                and y.max() <= high_y + 1e-9
            )


def test_costs_add_up_as_weighted():
    costs = np.full((40, 40), 7, np.uint8)
    goal = np.tile(np.arange(40, dtype=np.int32), (40, 1))
    cost, ends = score(
        costs,
        [(0.4, 0.0)],
        (0.8, 1.0, 0.0, 0.4, 0.0),
        path=goal * 2,
        goal=goal,
        corners=SARA / 4,
        resolution=0.05,
        simulation=(1.0, 0.05, 0.1),
        weights=(0.6, 0.8, 0.01),
    )
    column = int(ends[0, 0] / 0.05)
    assert column == 23 and cost[0] == pytest.approx(0.6 * 2 * column + 0.8 * column + 0.07)


def test_where_no_way_leads_to_the_goal_is_no_way():
    costs, far = np.zeros((40, 40), np.uint8), np.full((40, 40), 1601, np.int32)
    assert (
        score(costs, [(0.1, 0.0)], (1.0, 1.0, 0.0, 0.0, 0.0), goal=far, corners=SARA / 4, resolution=0.05)[0][0]
        == rollout.NO_WAY
    )


def test_the_simple_attractor_counts_the_squared_distance_alone():
    costs, far = np.zeros((40, 40), np.uint8), np.full((40, 40), 1601, np.int32)
    cost, ends = score(
        costs,
        [(0.4, 0.3)],
        (1.0, 1.0, 0.0, 0.4, 0.0),
        path=far,
        goal=far,
        corners=SARA / 4,
        resolution=0.05,
        simulation=(1.0, 0.05, 0.1),
        attractor=(True, 1.9, 1.2),
    )
    assert cost[0] == pytest.approx((ends[0, 0] - 1.9) ** 2 + (ends[0, 1] - 1.2) ** 2)


def test_heading_scoring_adds_the_angle_to_the_furthest_plan_point_in_sight():
    costs = np.zeros((40, 40), np.uint8)
    cells = [(20, 20), (20, 30), (20, 38)]

    def turned():
        return score(
            costs,
            [(0.0, 0.5)],
            (1.025, 1.025, 0.2, 0.5, 0.5),
            corners=SARA / 8,
            resolution=0.05,
            cells=cells,
            simulation=(1.0, 0.1, 0.1),
            heading=(True, 0.4),
            weights=(0.0, 0.0, 0.0),
        )[0][0]

    assert turned() == pytest.approx(0.3 * (0.5 * math.pi - 0.2 - 0.2), abs=0.02)
    cells[-1] = (38, 20)  # now to the right of it
    assert turned() == pytest.approx(0.3 * 0.4, abs=0.02)
    costs[18:23, 30] = 253  # out of sight: the one before counts
    assert turned() == pytest.approx(0.3 * (0.5 * math.pi - 0.4), abs=0.02)


def test_off_the_map_nothing_is_possible():
    costs = np.zeros((40, 40), np.uint8)
    for state in ((-1.0, 1.0, 0.0, 0.0, 0.0), (math.nan, 1.0, 0.0, 0.0, 0.0), (0.1, 1.0, 0.0, 0.0, 0.0)):
        assert score(costs, [(0.1, 0.0)], state, corners=SARA / 2, resolution=0.05)[0][0] == rollout.COLLIDES


def test_a_robot_that_touches_something_may_come_off_it_within_its_grace():
    costs, state = np.zeros((60, 60), np.uint8), (1.5, 1.5, 0.0, 0.0, 0.0)
    costs[30, 19] = 254  # under its tail
    samples = [(0.5, 0.0), (0.0, 0.0)]

    def scored(grace):
        return score(costs, samples, state, corners=SARA, resolution=0.05, simulation=(1.0, 0.025, 0.1), grace=grace)[0]

    assert scored(0.0).tolist() == [rollout.COLLIDES] * 2
    assert scored(0.4).tolist() == [0.0, 0.0], 'standing has one step, which is within the grace'
    costs[30, 46] = 254  # and one ahead of it
    assert scored(0.4).tolist() == [rollout.COLLIDES, 0.0]
