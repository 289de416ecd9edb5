"""Global planners against the C++ ones on six maps: whole wherever any of them is, as cheap, and nowhere in an
obstacle.

The drawn maps' results are here, thinned; those of the public maps are looked for in $SARA_SHARED_DATA, else in
../shared/data beside the repository; without them their tests are skipped.
"""

import functools
import math
import os
from pathlib import Path

import numpy as np
import pytest

from sara_common.grids.images import read_image
from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import GridGeometry
from sara_nav.planners.global_planner import GlobalPlanner, GlobalPlannerConfig
from sara_nav.planners.navfn import NavfnConfig, NavfnROS
from sara_nav.planners.planning import PlanError

OURS = Path(__file__).resolve().parents[1] / 'data' / 'plans'
SHARED = Path(os.environ.get('SARA_SHARED_DATA', Path(__file__).resolve().parents[5] / 'shared' / 'data'))
MAPS = ('own_office', 'own_comb', 'depot', 'warehouse', 'willow', '100by100_15')
WHOLE = 2.1
"""Cells from start and goal within which a path that is whole begins and ends."""


@functools.lru_cache(maxsize=1)
def reference(name):
    """Return (Costmap, the file's arrays) of a map."""
    files = [
        path for path in (OURS / (name + '.npz'), SHARED / 'reference' / 'plans' / (name + '.npz')) if path.exists()
    ]
    if not files:
        pytest.skip(f"the C++ planners' results on {name} are not in {SHARED}")
    with np.load(files[0]) as data:
        entries = {key: data[key] for key in data.files}
    costs = np.ascontiguousarray(entries['costmap'])
    return Costmap(
        costs,
        GridGeometry(costs.shape[1], costs.shape[0], float(entries['resolution']), *map(float, entries['origin'])),
    ), entries


def measure(costmap, points, weight):
    """Return (integral of weight[cost] ds in m, highest cost) along points (n, 2), sampled every quarter cell."""
    g = costmap.geometry
    points = (points[:, :2] - (g.origin_x, g.origin_y)) / g.resolution
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    n = max(1, math.ceil(4.0 * length[-1]))
    along = (np.arange(n) + 0.5) / n * length[-1]
    columns, rows = (np.floor(np.interp(along, length, points[:, axis])).astype(int) for axis in (0, 1))
    costs = costmap.costs[rows, columns]
    return float(weight[costs].mean() * length[-1] * g.resolution), int(costs[1:-1].max(initial=0))


NAVFN = (50.0 + 0.8 * np.minimum(np.arange(256), 252)) / 50.0
GLOBAL = np.minimum(50.0 + 3.0 * np.arange(256), 252.0) / 50.0
GRADIENT, GRID = 'gp_dijkstra_quadratic_gradient', 'gp_dijkstra_quadratic_grid'


def plans(name, planner):
    """Yield (index, plan) of the map's queries. Fails where a peer has a whole path and ours is none or not whole."""
    costmap, data = reference(name)
    g = costmap.geometry
    for k, (first, last) in enumerate(zip(data['start_cell'].tolist(), data['goal_cell'].tolist())):
        start, goal = Pose2D(*g.to_world(*first), 0.4), Pose2D(*g.to_world(*last), -1.0)
        try:
            plan = planner.plan(costmap, start, goal)
        except PlanError as error:
            assert not data['complete'][k].any(), f'query {k}: {error}'
            continue
        for pose, point in ((start, plan[0]), (goal, plan[-1])):
            assert math.hypot(pose.x - point[0], pose.y - point[1]) <= WHOLE * g.resolution, f'query {k}'
        assert np.hypot(*np.diff(plan[:, :2], axis=0).T).max() <= 2.2 * g.resolution, f'query {k}'
        assert measure(costmap, plan, NAVFN)[1] < 253, f'query {k}'
        yield k, plan


def best_of(data, k, columns=None):
    """Return the least cost_m of the peers' complete paths of a query. columns: the peers asked; None: all."""
    good = data['complete'][k] & np.array([columns is None or peer in columns for peer in data['planners']])
    return data['cost_m'][k][good].min() if good.any() else math.inf


@pytest.mark.parametrize('name', MAPS)
@pytest.mark.parametrize('astar', [False, True])
def test_navfn_is_whole_free_and_as_cheap_as_the_best_peer(name, astar):
    costmap, data = reference(name)
    planned = []
    for k, plan in plans(name, NavfnROS(NavfnConfig(use_astar=astar))):
        planned.append(k)
        ratio = measure(costmap, plan, NAVFN)[0] / best_of(data, k)
        assert ratio <= 1.02, f'query {k}: {ratio:.4f}'
    assert len(planned) >= 29
    lost = [k for k in range(len(data['complete'])) if data['complete'][k].any() and not data['complete'][k].all()]
    assert set(planned).issuperset(lost)  # what some peer cuts short or fails
    if name in ('own_comb', 'warehouse'):  # 13 and 3 of NavfnROS's alone
        assert len(lost) >= 3


@pytest.mark.parametrize('name', MAPS)
def test_global_planner_is_whole_and_as_cheap_as_its_peer(name):
    """By the measure the planner minimises (cost_factor 3) paths cost what the peer's do on the mean, and none 4 %
    more: both potentials are off by 1 or 2 % where the wave comes from two sides, and choose between ways that are as
    good. With navfn's cost_factor 0.8 none costs 2 % more than the best peer's.
    """
    costmap, data = reference(name)
    paths = np.split(data['path_' + GRADIENT], data['path_' + GRADIENT + '_offset'][1:-1])
    ratios = [
        measure(costmap, plan, GLOBAL)[0] / measure(costmap, paths[k], GLOBAL)[0]
        for k, plan in plans(name, GlobalPlanner())
        if len(paths[k])
    ]
    assert len(ratios) >= 29 and np.mean(ratios) <= 1.005 and max(ratios) <= 1.04
    if name != '100by100_15':  # for the time it takes
        for k, plan in plans(name, GlobalPlanner(GlobalPlannerConfig(cost_factor=0.8))):
            assert measure(costmap, plan, NAVFN)[0] <= 1.02 * best_of(data, k), f'query {k}'


@pytest.mark.parametrize('name', ['own_office', 'own_comb', 'depot'])
def test_a_grid_path_costs_what_the_peer_s_does(name):
    costmap, data = reference(name)
    ratios = [
        measure(costmap, plan, NAVFN)[0] / best_of(data, k, (GRID,))
        for k, plan in plans(name, GlobalPlanner(GlobalPlannerConfig(use_grid_path=True)))
    ]
    assert len(ratios) >= 29 and 0.98 <= np.mean(ratios) <= 1.02


def test_the_peer_s_test_of_a_pinch_point_and_of_an_easy_plan():
    """navfn's path_calc_test: two plans on willow_costmap.pgm as it stands, whose greys are costs of steps."""
    picture = SHARED / 'maps' / 'willow_costmap.pgm'
    if not picture.exists():
        pytest.skip(f'{picture} is not there')
    steps = read_image(str(picture))
    assert steps.shape == (1217, 1132) and set(np.unique(steps)) == {50, 253, 254}
    costs = np.select([steps == 50, steps == 253], [0, 255], 254).astype(np.uint8)  # navfn makes these steps of them
    costmap = Costmap(costs, GridGeometry(1132, 1217, 1.0, 0.0, 0.0))
    for start in ((428, 746), (350, 400)):
        ends = Pose2D(start[0] + 0.5, start[1] + 0.5, 0.0), Pose2D(350.5, 450.5, 0.0)
        for first, last in (ends, ends[::-1]):
            plan = NavfnROS().plan(costmap, first, last)
            assert plan[0, :2].tolist() == [first.x, first.y] and plan[-1, :2].tolist() == [last.x, last.y]
            assert measure(costmap, plan, NAVFN)[1] in (0, 255)
