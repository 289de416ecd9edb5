"""Distance grids: the peer's tests of its MapGrid, and that the wave is the shortest way by steps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import GridGeometry
from sara_nav.sampled import map_grid

NONE = np.empty((0, 2), np.int64)


def cells(*pairs):
    return np.array(pairs, np.int64).reshape(-1, 2)


def test_construction_and_reset_of_the_peers_test():
    """A new wave knows nothing of the last: without a seed all cells are unreachable."""
    costs = np.zeros((10, 10), np.uint8)
    map_grid.spread(costs, cells((3, 5)), NONE)
    assert (map_grid.spread(costs, NONE, NONE) == map_grid.unreachable_distance(costs)).all()
    wide = np.zeros((25, 20), np.uint8)
    assert map_grid.spread(wide, cells((19, 24)), NONE).shape == (25, 20)


def test_distance_propagation_of_the_peers_test():
    d = map_grid.spread(np.zeros((10, 10), np.uint8), cells((0, 0)), NONE)
    assert [d[y, x] for x, y in ((0, 0), (1, 1), (0, 4), (4, 0), (9, 9))] == [0, 2, 4, 4, 18]


def test_goal_and_path_distance_of_the_peers_tests():
    costs = np.zeros((10, 10), np.uint8)
    costs[6, 4] = 254
    for x, y in ((1, 2), (1, 1), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (2, 2)):
        costs[y, x] = 254
    d = map_grid.spread(costs, cells((4, 9)), NONE)
    assert [d[y, 4] for y in range(8, -1, -1)] == [1, 2, 100, 6, 7, 8, 9, 10, 11]
    assert d[8, 5] == 2 and d[4, 9] == 10 and d[2, 2] == 100
    assert d[1, 2] == map_grid.unreachable_distance(costs), 'the boxed-in cell'


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_the_wave_finds_the_least_number_of_steps(seed):
    random = np.random.default_rng(seed)
    h, w = random.integers(2, 14, 2)
    costs = random.choice(np.array([0, 100, 252, 253, 254, 255], np.uint8), (h, w), p=[0.5, 0.1, 0.1, 0.1, 0.1, 0.1])
    seeds = np.column_stack([random.integers(0, w, 2), random.integers(0, h, 2)])
    free = costs < 253
    free[seeds[:, 1], seeds[:, 0]] = True
    index = np.arange(h * w).reshape(h, w)
    pairs = np.vstack(
        [
            np.column_stack([a[f].ravel(), b[f].ravel()])
            for a, b, f in (
                (index[:, 1:], index[:, :-1], free[:, 1:] & free[:, :-1]),
                (index[1:], index[:-1], free[1:] & free[:-1]),
            )
        ]
    )
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), (h * w, h * w)).tocsr()
    least = dijkstra(graph, False, index[seeds[:, 1], seeds[:, 0]], unweighted=True, min_only=True).reshape(h, w)
    d = map_grid.spread(costs, seeds, NONE)
    reached = np.isfinite(least)
    assert np.array_equal(d[reached], least[reached].astype(int))
    assert (d[~reached] >= costs.size).all()
    assert not (free & (d == costs.size)).any() and not (~free & (d < costs.size)).any()


def test_cells_under_the_robot_let_the_wave_through():
    costs = np.zeros((5, 9), np.uint8)
    costs[:, 4] = 254
    seed = cells((0, 2))
    assert map_grid.spread(costs, seed, NONE)[2, 8] == 46
    assert map_grid.spread(costs, seed, cells((4, 2)))[2, 8] == 8


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1))
def test_a_wave_over_a_window_is_the_whole_one_there_one_costmap_after_the_other(seed):
    random = np.random.default_rng(seed)
    waves = map_grid.Waves()
    for h, w in (random.integers(1, 30, 2), random.integers(1, 30, 2)):
        for share in random.uniform(0.0, 0.6, 2):
            costs = np.where(random.random((h, w)) < share, random.integers(253, 256, (h, w)), 100).astype(np.uint8)
            waves.over(costs)
            seeds, exempt = (
                np.column_stack([random.integers(0, w, n), random.integers(0, h, n)]) for n in random.integers(0, 4, 2)
            )
            (x0, xn), (y0, yn) = np.sort(random.integers(-3, 33, (2, 2)), axis=1).tolist()
            found = waves.spread(seeds, exempt, (x0, y0, xn, yn))
            there = np.s_[max(y0, 0) : max(yn, 0), max(x0, 0) : max(xn, 0)]
            assert found.shape == costs.shape
            assert np.array_equal(found[there], map_grid.spread(costs, seeds, exempt)[there])


@given(st.integers(0, 2**32 - 1), st.floats(0.05, 1.0))
def test_the_plans_cells_are_those_of_its_denser_points(seed, resolution):
    random = np.random.default_rng(seed)
    costs = np.where(random.random((12, 15)) < 0.1, 255, 0).astype(np.uint8)
    plan = np.cumsum(random.uniform(-2.0, 3.0, (8, 3)), axis=0) * resolution
    dense = map_grid.adjust_plan_resolution(plan, resolution)[:, :2]
    cells = np.floor(dense / resolution).astype(int)
    known = [0 <= x < 15 and 0 <= y < 12 and costs[y, x] != 255 for x, y in cells]
    first = known.index(True) if True in known else len(known)
    end = known.index(False, first) if False in known[first:] else len(known)
    taken = map_grid.plan_cells(plan, Costmap(costs, GridGeometry(15, 12, resolution, 0.0, 0.0)))
    assert taken.tolist() == cells[first:end].tolist()


# -- plans -------------------------------------------------------------------------------------------------------


def test_adjust_plan_of_the_peers_tests():
    assert len(map_grid.adjust_plan_resolution(np.empty((0, 2)), 0.0)) == 0
    dense = map_grid.adjust_plan_resolution([(1.0, 1.0), (5.0, 5.0)], 1.0)
    assert dense[0].tolist() == [1.0, 1.0] and dense[-1].tolist() == [5.0, 5.0]
    assert np.hypot(*np.diff(dense, axis=0).T).max() < 1.0
    for resolution, points in ((2.0, 2), (1.0, 2), (0.8, 3), (0.5, 3), (0.34, 4), (0.32, 5), (0.1, 11)):
        assert len(map_grid.adjust_plan_resolution([(0.0, 0.0), (0.0, 1.0)], resolution)) == points


points = st.lists(st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3)), min_size=1, max_size=12)


@given(points, st.floats(0.05, 2.0))
def test_a_denser_plan_keeps_its_points_in_order_and_has_no_gap(plan, resolution):
    plan = np.array(plan)
    dense = map_grid.adjust_plan_resolution(plan, resolution)
    assert np.hypot(*np.diff(dense[:, :2], axis=0).T).max(initial=0.0) <= resolution * (1 + 1e-9)
    place = -1
    for point in plan:
        place += 1 + int((dense[place + 1 :] == point).all(axis=1).argmax())
        assert (dense[place] == point).all()
    assert place == len(dense) - 1


def test_the_plans_first_run_over_known_cells_is_taken():
    costs = np.zeros((20, 20), np.uint8)
    costmap = Costmap(costs, GridGeometry(20, 20, 0.5, 0.0, 0.0))
    plan = [(-2.0, 1.2), (20.0, 1.2), (20.0, 5.2), (2.0, 5.2)]
    taken = map_grid.plan_cells(plan, costmap)
    assert taken[:, 1].tolist() == [2] * len(taken) and taken[0, 0] == 0 and taken[-1, 0] == 19
    costs[2, 10] = 255
    assert map_grid.plan_cells(plan, costmap)[-1].tolist() == [9, 2], 'unknown ends it'
    assert len(map_grid.plan_cells([(-2.0, 1.0), (-1.0, 1.0)], costmap)) == 0
    assert map_grid.plan_cells([(1.2, 1.2)], costmap).tolist() == [[2, 2]]
    assert pytest.approx(map_grid.obstacle_distance(costs)) == 400
