"""global_planner/GlobalPlanner: every parameter does what it says, and refusals say why."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from ahead_of_time import compilations
from sara_common.planar import Pose2D, wrap
from sara_nav.planners import potential
from sara_nav.planners.global_planner import GlobalPlanner, GlobalPlannerConfig
from sara_nav.planners.orientation import orient
from sara_nav.planners.planning import GLOBAL_PLANNERS, PlanError, path_length

sys.path.append(str(Path(__file__).resolve().parent))
from costmap_cases import connected, make  # noqa: E402  pylint: disable=wrong-import-position

grids = hnp.arrays(
    np.uint8,
    st.tuples(st.integers(1, 12), st.integers(1, 14)),
    elements=st.sampled_from([0, 0, 0, 0, 0, 60, 200, 251, 252, 253, 254, 255]),
)


def free_room(side=60):
    return make(np.zeros((side, side), np.uint8), 0.05, 0.0, 0.0)


def planner(**values):
    config = GlobalPlannerConfig(**values)
    assert config.faults() == []
    return GlobalPlanner(config)


START, GOAL = Pose2D(0.52, 0.51, 0.4), Pose2D(2.48, 2.07, -1.2)


@settings(max_examples=150)
@given(
    grids,
    st.data(),
    st.booleans(),
    st.booleans(),
    st.booleans(),
    st.booleans(),
    st.integers(1, 255),
    st.integers(1, 255),
    st.floats(0.01, 5.0),
)
def test_there_is_a_plan_where_there_is_a_way_and_it_is_free(
    costs, data, unknown, grid, old, outline, lethal, neutral, factor
):
    costmap = make(costs)
    g = costmap.geometry
    spots = st.builds(
        lambda u, v: Pose2D(g.origin_x + u * g.width * 0.1, g.origin_y + v * g.height * 0.1, 0.5),
        st.floats(0.001, 0.999),
        st.floats(0.001, 0.999),
    )
    start, goal = data.draw(spots), data.draw(spots)
    first, last = g.to_cell(start.x, start.y), g.to_cell(goal.x, goal.y)
    free = (costs < lethal - 1) & (costs < 255) | ((costs == 255) & unknown)
    free[first[1], first[0]] = True
    closed = free.copy()
    if outline and not any(c in (0, g.width - 1) or r in (0, g.height - 1) for c, r in (first, last)):
        closed[[0, -1]] = closed[:, [0, -1]] = False
    ours = planner(
        allow_unknown=unknown,
        use_grid_path=grid,
        old_navfn_behavior=old,
        outline_map=outline,
        lethal_cost=lethal,
        neutral_cost=neutral,
        cost_factor=factor,
        use_quadratic=data.draw(st.booleans()),
    )
    if last not in connected(closed, first):
        with pytest.raises(PlanError):
            ours.plan(costmap, start, goal)
        return
    plan = ours.plan(costmap, start, goal)
    assert plan[0, :2] == pytest.approx((start.x, start.y)) and plan[-1] == pytest.approx((goal.x, goal.y, goal.yaw))
    assert (np.hypot(*np.diff(plan[:, :2], axis=0).T) < 0.1 * 2.2).all()
    for p, q in zip(plan[:-1, :2], plan[1:, :2]):
        for f in np.linspace(0.0, 1.0, 21):
            x, y = p + f * (q - p)
            assert any(
                free[cell[1], cell[0]]
                for cell in (g.to_cell(x + e, y + h) for e in (1e-9, -1e-9) for h in (1e-9, -1e-9))
                if cell
            ), (x, y)


def test_it_is_found_by_its_name_and_its_a_star_is_refused():
    assert GLOBAL_PLANNERS.find('global_planner/GlobalPlanner') is GlobalPlanner
    assert GlobalPlannerConfig(use_dijkstra=False).faults() == [
        'use_dijkstra is False, allowed is True: for A*, use navfn/NavfnROS with use_astar'
    ]


@pytest.mark.parametrize(
    'name, value',
    [
        ('lethal_cost', 0),
        ('lethal_cost', 256),
        ('neutral_cost', 0),
        ('cost_factor', 0.0),
        ('cost_factor', 6.0),
        ('cost_factor', math.nan),
        ('orientation_mode', 7),
        ('orientation_window_size', 0),
        ('publish_scale', 0),
        ('publish_scale', 128),
        ('default_tolerance', -1.0),
    ],
)
def test_bad_parameters_are_named(name, value):
    faults = GlobalPlannerConfig(**{name: value}).faults()
    assert len(faults) == 1 and name in faults[0]


@pytest.mark.parametrize(
    'start, goal, reason',
    [
        ((1.0, 1.0), (9.0, 1.0), 'goal .* off the map'),
        ((-1.0, 1.0), (1.0, 1.0), 'robot .* off the map'),
        ((1.0, 1.0), (1.5, 1.5), 'goal .* in an obstacle'),
        ((1.0, 1.0), (2.0, 0.4), 'on a cell of cost 252'),
        ((math.nan, 1.0), (1.0, 1.0), "robot's pose .* not finite"),
    ],
)
def test_no_plan_says_why(start, goal, reason):
    costmap = free_room()
    costmap.costs[25:35, 25:35] = 254
    costmap.costs[5:12, 35:45] = 252
    with pytest.raises(PlanError, match=reason):
        planner().plan(costmap, Pose2D(*start, 0.0), Pose2D(*goal, 0.0))


def test_lethal_cost_says_what_is_driven_through():
    costmap = free_room()
    costmap.costs[30] = 200
    ends = Pose2D(1.0, 1.0, 0.0), Pose2D(1.0, 2.0, 0.0)
    planner(lethal_cost=202).plan(costmap, *ends)
    with pytest.raises(PlanError):
        planner(lethal_cost=201).plan(costmap, *ends)


def test_neutral_cost_and_cost_factor_say_how_far_a_cost_is_worth_going_round():
    costmap = free_room()
    costmap.costs[26:34, 8:52] = 60  # a strip 0.4 m wide and 2.2 m long across the straight way
    ends = Pose2D(1.5, 0.5, 0.0), Pose2D(1.5, 2.5, 0.0)
    through = planner(neutral_cost=200, cost_factor=0.5).plan(costmap, *ends)
    assert path_length(through) == pytest.approx(2.0, rel=0.01)
    around = planner(neutral_cost=5, cost_factor=4.0).plan(costmap, *ends)
    assert path_length(around) > 2.8 and max(costmap.cost_at(x, y) for x, y, _ in around) == 0


def test_the_grid_path_runs_over_cells_centres():
    plan = planner(use_grid_path=True).plan(free_room(), START, GOAL)
    cells = plan[1:-1, :2] / 0.05
    assert cells % 1.0 == pytest.approx(np.full(cells.shape, 0.5))
    steps = np.abs(np.diff(cells, axis=0)).round()
    assert set(steps.max(axis=1)) == {1.0}


def test_without_the_quadratic_wave_costs_add_up_from_side_to_side():
    plain = planner(use_quadratic=False, old_navfn_behavior=True, outline_map=False)
    plain.plan(free_room(), Pose2D(1.525, 1.525, 0.0), Pose2D(0.025, 0.025, 0.0))
    rows, columns = np.mgrid[0:60, 0:60]
    expected = 50.0 * (abs(rows - 30) + abs(columns - 30))
    reached = plain.potential < potential.HIGH
    assert plain.potential[reached] == pytest.approx(expected[reached])
    assert reached[0, 0]


def test_the_wave_starts_from_the_exact_position_unless_it_behaves_as_navfn_did():
    at = Pose2D(1.5, 1.5, 0.0)  # where four cells meet
    exact, old = planner(), planner(old_navfn_behavior=True)
    for one in (exact, old):
        one.plan(free_room(), at, Pose2D(0.5, 0.5, 0.0))
    assert exact.potential[29:31, 29:31] == pytest.approx(np.full((2, 2), 50.0 * math.sqrt(0.5)), abs=10.1)
    assert exact.potential.argmin() == 30 * 60 + 30  # the cell the robot is in is the lowest
    assert old.potential[30, 30] == 0.0 and old.potential[29, 30] == 50.0


def test_the_outline_can_be_opened():
    costmap = free_room(20)
    costmap.costs[8:12, 1:-1] = 254
    ends = Pose2D(0.5, 0.2, 0.0), Pose2D(0.5, 0.8, 0.0)
    with pytest.raises(PlanError):
        planner().plan(costmap, *ends)
    assert len(planner(outline_map=False).plan(costmap, *ends)) > 20


def test_the_tolerance_moves_a_goal_out_of_an_obstacle():
    costmap = free_room()
    costmap.costs[25:35, 25:35] = 254
    one = planner(default_tolerance=0.5)
    plan = one.plan(costmap, START, Pose2D(1.3, 1.5, 0.9))
    assert plan[-1].tolist() == [one.goal_used.x, one.goal_used.y, 0.9]
    assert one.goal_used.x == pytest.approx(1.225) and one.goal_used.y == pytest.approx(1.475, abs=0.051)


def test_orientation_modes():
    """None to Rightward in the order of the peer's dynamic_reconfigure enumeration."""
    along = planner().plan(free_room(), START, GOAL)
    heading = np.arctan2(*np.diff(along[:, :2], axis=0).T[::-1])
    turns = {4: math.pi, 5: -math.pi / 2, 6: math.pi / 2}
    for mode in range(7):
        plan = planner(orientation_mode=mode).plan(free_room(), START, GOAL)
        assert plan[-1, 2] == GOAL.yaw and np.array_equal(plan[:, :2], along[:, :2])
        if mode == 0:
            assert not plan[:-1, 2].any()
        elif mode == 2:
            assert plan[0, 2] == pytest.approx(START.yaw)
            assert np.diff(plan[:, 2]) == pytest.approx(
                np.full(len(plan) - 1, (GOAL.yaw - START.yaw) / (len(plan) - 1))
            )
        elif mode != 3:
            off = wrap(plan[1:-1, 2] - heading[1:] - turns.get(mode, 0.0))
            assert np.abs(off).max() < 0.3 and np.abs(off).mean() < 0.05


points = hnp.arrays(float, st.tuples(st.integers(1, 30), st.just(2)), elements=st.floats(-5.0, 5.0))
yaws = st.floats(-3.0, 3.0)


@given(points, yaws, yaws, st.integers(0, 6), st.integers(1, 255))
def test_any_path_can_be_oriented(path, start, goal, mode, window):
    plan = orient(path, start, goal, mode, window)
    assert plan.shape == (len(path), 3) and np.isfinite(plan).all() and plan[-1, 2] == goal
    assert np.array_equal(plan[:, :2], path)
    if mode in (2, 3) and len(path) > 2:  # even turns
        change = wrap(np.diff(plan[:, 2]))
        if mode == 2:
            assert np.ptp(change) < 1e-6 or np.ptp(np.abs(change)) < 1e-6


def test_forward_then_interpolate_turns_on_the_last_straight():
    corner = np.vstack(
        [np.column_stack([np.arange(20), np.zeros(20)]), np.column_stack([np.full(10, 19), np.arange(1, 11)])]
    )
    plan = orient(corner, 2.0, math.pi, 3)
    assert (plan[:18, 2] == 0.0).all()
    turn = plan[21:, 2]
    assert (np.diff(turn) > 0.0).all() and turn[-1] == math.pi
    straight = orient(np.column_stack([np.arange(20), np.zeros(20)]), 0.5, -0.5, 3)
    assert straight[0, 2] == 0.5 and np.diff(straight[:, 2]) == pytest.approx(np.full(19, -1.0 / 19))


def test_a_wide_window_smooths_headings():
    legs = np.array([(1, 0)] * 4 + [(0, 1)] * 4, float)
    staircase = np.cumsum(np.vstack([legs] * 6), axis=0)
    narrow, wide = (orient(staircase, 0.0, 0.0, 1, window)[8:-8, 2] for window in (1, 4))
    assert np.ptp(narrow) > 1.5
    assert wide == pytest.approx(np.full(len(wide), math.pi / 4))


def test_nothing_compiles_while_planning():
    from sara_nav.planners import gradient_path

    for values in ({}, {'use_grid_path': True}, {'use_quadratic': False}, {'lethal_cost': 200}):
        planner(**values).plan(free_room(), START, GOAL)
    for kernel in (potential.prepare, potential.spread, gradient_path.descend, gradient_path.descend_grid):
        assert compilations(kernel) <= 1
