"""Global planning: ways are cheapest and free, straight where they can be, and refusals say why."""

import heapq
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sara_common.planar import Pose2D
from sara_nav.config.registry import UnknownPlanner
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import GridGeometry
from sara_nav.planners import grid_kernels as kernels
from sara_nav.planners.grid_planner import GridPlanner, GridPlannerConfig
from sara_nav.planners.navfn import NavfnConfig
from sara_nav.planners.planning import (
    GLOBAL_PLANNERS,
    PlanError,
    dense_plan,
    nearest_cell,
    path_length,
    plan_from_points,
    simplify,
)

grids = hnp.arrays(np.uint8, (9, 11), elements=st.sampled_from([0, 0, 0, 0, 60, 200, 252, 253, 254, 255]))
cells = st.tuples(st.integers(0, 10), st.integers(0, 8))


def weight(cost, unknown):
    if cost == 255:
        return (50.0 + 0.8 * 253) / 50.0 if unknown else math.inf
    return (50.0 + 0.8 * cost) / 50.0 if cost < 253 else math.inf


def cheapest(costs, start, goal, unknown):
    """Dijkstra's algorithm written out plainly, as the oracle."""
    best, heap = {start: 0.0}, [(0.0, start)]
    while heap:
        so_far, (x, y) = heapq.heappop(heap)
        if (x, y) == goal:
            return so_far
        here = weight(costs[y, x], unknown)
        here = 1.0 if here == math.inf else here
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            a, b = x + dx, y + dy
            if not (0 <= a < costs.shape[1] and 0 <= b < costs.shape[0]):
                continue
            if dx and dy and math.inf in (weight(costs[y, a], unknown), weight(costs[b, x], unknown)):
                continue
            total = so_far + math.hypot(dx, dy) * 0.5 * (here + weight(costs[b, a], unknown))
            if total < best.get((a, b), math.inf):
                best[a, b] = total
                heapq.heappush(heap, (total, (a, b)))
    return math.inf


@given(grids, cells, cells, st.booleans())
def test_astar_is_as_cheap_as_dijkstra(costs, start, goal, unknown):
    way = kernels.astar(costs, *start, *goal, unknown)
    expected = cheapest(costs, start, goal, unknown)
    if expected == math.inf:
        assert len(way) == 0
        return
    assert tuple(way[0]) == start and tuple(way[-1]) == goal
    total = 0.0
    for (x, y), (a, b) in zip(way, way[1:]):
        assert max(abs(a - x), abs(b - y)) == 1 and weight(costs[b, a], unknown) < math.inf
        here = weight(costs[y, x], unknown)
        total += math.hypot(a - x, b - y) * 0.5 * ((1.0 if here == math.inf else here) + weight(costs[b, a], unknown))
    assert total == pytest.approx(expected)


inside = st.tuples(st.floats(0.01, 10.99), st.floats(0.01, 8.99))


@settings(max_examples=100)
@given(grids, inside, inside, st.booleans())
def test_a_straight_line_costs_what_its_cells_do(costs, start, goal, unknown):
    ours = kernels.line_cost(costs, *start, *goal, unknown)
    samples = (np.arange(1000) + 0.5)[:, None] / 1000 * (np.subtract(goal, start)) + start
    table = np.array([weight(c, unknown) for c in range(256)])
    if ours < math.inf:
        along = table[costs[samples[:, 1].astype(int), samples[:, 0].astype(int)]]
        assert ours == pytest.approx(along.mean() * math.dist(start, goal), abs=0.1)
    else:
        near = {(int(x + e), int(y + f)) for x, y in samples for e in (-8e-3, 8e-3) for f in (-8e-3, 8e-3)}
        assert any(weight(costs[y, x], unknown) == math.inf for x, y in near if 0 <= x < 11 and 0 <= y < 9)


@given(grids, inside, inside, st.booleans())
def test_a_straightened_plan_meets_no_wall(costs, start, goal, unknown):
    costmap = Costmap(costs, GridGeometry(11, 9, 1.0, 0.0, 0.0))
    try:
        plan = GridPlanner(GridPlannerConfig(allow_unknown=unknown)).plan(
            costmap, Pose2D(*start, 0.0), Pose2D(*goal, 0.0)
        )
    except PlanError:
        return
    own = int(start[0]), int(start[1])
    for x, y, _ in plan:
        assert any(
            weight(costs[int(y + f), int(x + e)], unknown) < math.inf or (int(x + e), int(y + f)) == own
            for e in (-1e-9, 1e-9)
            for f in (-1e-9, 1e-9)
        )


def room():
    costs = np.zeros((100, 100), np.uint8)
    costs[[0, -1]] = 254
    costs[:, [0, -1]] = 254
    return Costmap(costs, GridGeometry(100, 100, 0.05, 0.0, 0.0))


coordinates = st.floats(0.3, 4.7)
poses = st.builds(Pose2D, coordinates, coordinates, st.floats(-3.0, 3.0))


@given(poses, poses)
def test_in_the_open_the_plan_is_the_straight_line(start, goal):
    plan = GridPlanner().plan(room(), start, goal)
    assert plan[0, :2] == pytest.approx((start.x, start.y)) or start.distance(goal) < 1e-6
    assert plan[-1] == pytest.approx((goal.x, goal.y, goal.yaw))
    assert path_length(plan) == pytest.approx(start.distance(goal), abs=1e-6)
    assert (np.hypot(*np.diff(plan[:, :2], axis=0).T) <= 0.05 + 1e-9).all()


def test_round_a_wall_no_point_is_in_it_and_it_is_short():
    costmap = room()
    costmap.costs[40:100, 48:52] = 253
    plan = GridPlanner().plan(costmap, Pose2D(1.0, 4.0, 0.0), Pose2D(4.0, 4.0, 0.0))
    assert all(costmap.cost_at(x, y) < 253 for x, y, _ in plan)
    shortest = 2.0 * math.hypot(1.4, 2.0) + 0.2
    assert path_length(plan) < 1.02 * shortest
    assert len(simplify(plan, 0.02)) <= 5


@pytest.mark.parametrize(
    'start, goal, reason',
    [
        ((1.0, 1.0), (9.0, 1.0), 'off the map'),
        ((-1.0, 1.0), (1.0, 1.0), 'robot .* off the map'),
        ((1.0, math.nan), (2.5, 2.5), "robot's pose .* not finite"),
        ((1.0, 1.0), (math.inf, 2.5), 'goal .* not finite'),
        ((1.0, 1.0), (2.5, 2.5), 'obstacle'),
        ((1.0, 1.0), (4.5, 4.5), 'no way'),
        ((1.0, 1.0), (3.5, 1.0), 'unknown'),
    ],
)
def test_no_plan_says_why(start, goal, reason):
    costmap = room()
    costmap.costs[45:55, 45:55] = 254
    costmap.costs[80:85, 80:] = costmap.costs[80:, 80:85] = 253
    costmap.costs[15:25, 65:75] = 255
    with pytest.raises(PlanError, match=reason):
        GridPlanner().plan(costmap, Pose2D(*start, 0.0), Pose2D(*goal, 0.0))


def test_unknown_space_is_crossed_only_when_allowed():
    costmap = room()
    costmap.costs[1:99, 50] = 255
    ends = Pose2D(1.0, 2.5, 0.0), Pose2D(4.0, 2.5, 0.0)
    with pytest.raises(PlanError):
        GridPlanner().plan(costmap, *ends)
    assert len(GridPlanner(GridPlannerConfig(allow_unknown=True)).plan(costmap, *ends)) > 50


def test_unknown_names_list_what_there_is():
    with pytest.raises(
        UnknownPlanner, match="base_global_planner is 'navfn/Nowhere', allowed are .* sara_nav/GridPlanner"
    ):
        GLOBAL_PLANNERS.find('navfn/Nowhere')


def test_planners_that_are_not_here_are_refused_by_name_with_what_to_use():
    assert GLOBAL_PLANNERS.names() == [
        'global_planner/GlobalPlanner',
        'navfn/NavfnROS',
        'sara_nav/GridPlanner',
        'sara_nav/LatticePlanner',
    ]
    with pytest.raises(UnknownPlanner, match='CarrotPlanner.* not here: use navfn/NavfnROS'):
        GLOBAL_PLANNERS.find('carrot_planner/CarrotPlanner')
    for name in (None, 3, ['navfn/NavfnROS']):
        with pytest.raises(UnknownPlanner, match='allowed are'):
            GLOBAL_PLANNERS.find(name)


@given(
    hnp.arrays(bool, st.tuples(st.integers(1, 8), st.integers(1, 8))),
    st.floats(-2.0, 4.0),
    st.floats(-2.0, 4.0),
    st.floats(0.0, 3.0),
)
def test_the_nearest_cell_is_the_nearest(free, x, y, tolerance):
    g = GridGeometry(free.shape[1], free.shape[0], 0.25, -0.5, 0.3)
    off = {(c, r): math.hypot(g.to_world(c, r)[0] - x, g.to_world(c, r)[1] - y) for r, c in np.argwhere(free).tolist()}
    found = nearest_cell(free, g, x, y, tolerance)
    if tolerance == 0.0 or not off or min(off.values()) > tolerance:
        assert found is None
    else:
        assert off[found] == pytest.approx(min(off.values()))


@pytest.mark.parametrize('x, tolerance', [(math.nan, 1.0), (0.0, math.nan), (1e300, 1.0), (0.0, -1.0)])
def test_no_cell_is_near_nowhere(x, tolerance):
    assert nearest_cell(np.ones((3, 3), bool), GridGeometry(3, 3, 0.1, 0.0, 0.0), x, 0.0, tolerance) is None
    assert nearest_cell(np.ones((3, 3), bool), GridGeometry(3, 3, 0.1, 0.0, 0.0), 0.16, 0.14, math.inf) == (1, 1)


def test_the_grid_planner_moves_a_goal_within_its_tolerance_and_says_where_to():
    costmap = room()
    costmap.costs[40:60, 40:60] = 254
    planner = GridPlanner(GridPlannerConfig(default_tolerance=0.6))
    plan = planner.plan(costmap, Pose2D(1.0, 2.4, 0.0), Pose2D(2.3, 2.4, 0.2))
    assert (planner.goal_used.x, planner.goal_used.y) == pytest.approx((1.975, 2.375), abs=0.051)
    assert plan[-1] == pytest.approx((planner.goal_used.x, planner.goal_used.y, 0.2))
    with pytest.raises(PlanError, match='in an obstacle'):
        GridPlanner(GridPlannerConfig(default_tolerance=0.1)).plan(
            costmap, Pose2D(1.0, 2.4, 0.0), Pose2D(2.3, 2.4, 0.2)
        )


@given(
    hnp.arrays(np.uint8, (9, 11), elements=st.sampled_from([0, 0, 0, 0, 60, 253, 254, 255])),
    cells,
    cells,
    st.booleans(),
)
def test_a_star_goes_where_the_wave_comes(costs, start, goal, unknown):
    costmap = Costmap(costs, GridGeometry(11, 9, 0.1, 0.0, 0.0))
    planner = GridPlanner(GridPlannerConfig(allow_unknown=unknown))
    reached = planner.explore(costmap, Pose2D(*costmap.geometry.to_world(*start), 0.0))[goal[1], goal[0]]
    assert reached == (len(kernels.astar(costs, *start, *goal, unknown)) > 0)


def test_a_plan_holds_no_point_twice():
    plan = plan_from_points([(0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 1.0)], 0.3)
    assert plan.tolist() == [[0.0, 0.0, 0.0], [1.0, 0.0, math.pi / 2], [1.0, 1.0, 0.3]]
    assert NavfnConfig().faults() == []


polylines = hnp.arrays(float, st.tuples(st.integers(2, 12), st.just(2)), elements=st.floats(-5.0, 5.0))


@given(polylines, st.floats(0.01, 1.0))
def test_simplified_paths_stay_within_the_tolerance(points, tolerance):
    kept = simplify(points, tolerance)
    assert (kept[0] == points[0]).all() and (kept[-1] == points[-1]).all()
    for x, y in points:
        off = []
        for (x0, y0), (x1, y1) in zip(kept, kept[1:]):
            length2 = (x1 - x0) ** 2 + (y1 - y0) ** 2
            f = min(max(((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / length2, 0.0), 1.0) if length2 > 0.0 else 0.0
            off.append(math.hypot(x - x0 - f * (x1 - x0), y - y0 - f * (y1 - y0)))
        assert min(off) <= tolerance + 1e-9


def test_dense_plan_points_along_the_path():
    plan = dense_plan([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], 0.3)
    assert plan[5, 2] == 0.0 and plan[-2, 2] == pytest.approx(math.pi / 2) and plan[-1].tolist() == [1.0, 1.0, 0.3]
