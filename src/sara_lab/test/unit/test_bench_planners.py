"""The benches of the planners: every planner is timed, beside its peer where there is one."""

import pytest

from sara_bringup.paths import share
from sara_lab.benches import global_planners, local_planners
from sara_nav.move_base.local_planners import LOCAL_PLANNERS

PLANS = share('sara_nav').resolve() / 'test' / 'data' / 'plans'


def test_the_bench_times_each_planner_beside_its_peer():
    ticks = iter(range(10**6))
    rows = list(
        global_planners.bench_rows([PLANS, '/nowhere'], maps=('own_comb',), queries=3, clock=lambda: next(ticks))
    )
    assert [row.planner for row in rows] == list(global_planners.CASES)
    for row in rows:
        assert (row.map, row.median, row.p99, row.plans) == ('own_comb', 1e3, 1e3, 3)  # each took one tick of a second
        assert row.peer is None if row.planner in ('GridPlanner', 'LatticePlanner') else 0.1 < row.peer < 10.0


def test_a_peer_that_gives_up_is_timed_where_it_found_a_way():
    (row,) = global_planners.bench_rows([PLANS], maps=('own_comb',), cases=['NavfnROS, A*'])
    assert row.plans == 17  # of 30
    assert row.peer == pytest.approx(0.637, abs=5e-4)


def test_the_bench_times_every_local_planner():
    result = local_planners.bench(cycles=5)
    assert set(result) == set(local_planners.CASES)
    ours = {name for name in LOCAL_PLANNERS.names() if not name.startswith('sara_lab/')}  # of the laboratory: not timed
    assert {name for name, _ in local_planners.CASES.values()} == ours
    assert all(0.0 < median <= p99 and rate > 0.0 for median, p99, rate in result.values())
