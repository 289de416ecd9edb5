"""navfn/NavfnROS: the peer's potential, whole and free plans down it, and refusals that say why."""
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sara_nav import potential
from sara_nav.costmap import Costmap
from sara_nav.geometry import Pose2D
from sara_nav.grid import GridGeometry
from sara_nav.navfn import NavfnConfig, NavfnROS, step_costs
from sara_nav.planning import GLOBAL_PLANNERS, PlanError

PLANS = Path(__file__).parents[1] / 'data' / 'plans'
FREE, INSCRIBED, LETHAL, UNKNOWN = 0, 253, 254, 255
grids = hnp.arrays(np.uint8, st.tuples(st.integers(1, 12), st.integers(1, 14)),
                   elements=st.sampled_from([0, 0, 0, 0, 0, 60, 200, 252, 253, 254, 255]))


def make(costs, resolution=0.1, x=-0.3, y=2.0):
    costs = np.ascontiguousarray(costs)
    return Costmap(costs, GridGeometry(costs.shape[1], costs.shape[0], resolution, x, y))


def full_potential(costs, source, allow_unknown):
    """The potential of the whole map, from a wave that runs until nothing is left; the edge closed as in the peer."""
    planner, costmap = NavfnROS(NavfnConfig(allow_unknown=allow_unknown)), make(costs)
    planner.explore(costmap, Pose2D(*costmap.geometry.to_world(*source), 0.0))
    return planner.potential


@pytest.mark.parametrize('which', range(4))
@pytest.mark.parametrize('unknown', [False, True])
def test_the_potential_is_navfn_s(which, unknown):
    with np.load(PLANS / 'navfn_potential.npz') as data:
        costs, source, expected = (data['pot_%d_%s' % (which, name)] for name in (
            'costmap', 'goal', 'unknown%d' % unknown))
    ours = full_potential(costs, tuple(source), unknown)
    reached = expected < potential.HIGH
    assert reached.sum() > 500
    np.testing.assert_array_equal(ours < potential.HIGH, reached)
    np.testing.assert_allclose(ours[reached], expected[reached], rtol=1e-4)


def passable(costs, unknown, start):
    """Cells a plan may use, as the issue's rule has it: below 253, or unknown if allowed, or where the robot is."""
    free = (costs < INSCRIBED) | ((costs == UNKNOWN) & unknown)
    free[start[1], start[0]] = True
    return free


def connected(free, start):
    """Cells reachable over sides: a flood written out plainly, as the oracle."""
    found, todo = {start}, [start]
    while todo:
        x, y = todo.pop()
        for a, b in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
            if (a, b) not in found and 0 <= a < free.shape[1] and 0 <= b < free.shape[0] and free[b, a]:
                found.add((a, b))
                todo.append((a, b))
    return found


@settings(max_examples=400)
@given(grids, st.data(), st.booleans())
def test_there_is_a_plan_where_there_is_a_way_and_it_is_free(costs, data, unknown):
    costmap = make(costs)
    g = costmap.geometry
    spots = st.builds(lambda u, v: (g.origin_x + u * g.width * 0.1, g.origin_y + v * g.height * 0.1),
                      st.floats(0.001, 0.999), st.floats(0.001, 0.999))
    start, goal = (Pose2D(*data.draw(spots), 0.5) for _ in range(2))
    first, last = g.to_cell(start.x, start.y), g.to_cell(goal.x, goal.y)
    free = passable(costs, unknown, first)
    closed = free.copy()
    if not any(c in (0, g.width - 1) or r in (0, g.height - 1) for c, r in (first, last)):
        closed[[0, -1]] = closed[:, [0, -1]] = False
    planner = NavfnROS(NavfnConfig(allow_unknown=unknown))
    if last not in connected(closed, first):
        with pytest.raises(PlanError):
            planner.plan(costmap, start, goal)
        return
    plan = planner.plan(costmap, start, goal)
    assert plan[0, :2] == pytest.approx((start.x, start.y)) and plan[-1] == pytest.approx((goal.x, goal.y, goal.yaw))
    assert (np.hypot(*np.diff(plan[:, :2], axis=0).T) < 0.1 * 2.2).all()
    for p, q in zip(plan[:-1, :2], plan[1:, :2]):
        for f in np.linspace(0.0, 1.0, 21):
            x, y = p + f * (q - p)
            # a point on a cell's very edge belongs to either cell
            assert any(free[cell[1], cell[0]] for cell in (g.to_cell(x + e, y + h) for e in (1e-9, -1e-9)
                                                           for h in (1e-9, -1e-9)) if cell), (x, y)
    assert planner.goal_used == goal


def test_the_plan_s_yaw_points_along_it():
    plan = NavfnROS().plan(make(np.zeros((40, 40), np.uint8)), Pose2D(0.5, 3.0, 1.0), Pose2D(2.5, 5.0, -2.0))
    along = np.arctan2(*np.diff(plan[:, :2], axis=0).T[::-1])
    assert plan[:-1, 2] == pytest.approx(along) and plan[-1, 2] == -2.0
    assert plan[:, 2][5:-5] == pytest.approx(math.pi / 4, abs=0.2)


def test_it_is_found_by_its_name():
    assert GLOBAL_PLANNERS.find('navfn/NavfnROS') is NavfnROS
    table = step_costs(True)
    assert table[[0, 1, 100, 252, 253, 254, 255]].tolist() == [50, 50, 130, 251, 254, 254, 253]
