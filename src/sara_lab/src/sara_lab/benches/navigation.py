"""Navigation: each global planner on each shared map, inflation, updates of a local costmap, control cycles of each
local planner.
"""

import os
from collections.abc import Iterator
from pathlib import Path

from sara_bringup.paths import share
from sara_lab.benches import costmaps as bench_costmap
from sara_lab.benches import global_planners as bench_planners
from sara_lab.benches import local_planners as bench_local
from sara_lab.benches.peers import peers
from sara_lab.benches.timed import Limit, Timed

LOCAL_CASES = {
    'TrajectoryPlannerROS': 'trajectory_planner_20x20_1.7s',
    'TrajectoryPlannerROS 8x20': 'trajectory_planner_8x20_1.7s',
    'TrajectoryPlannerROS 8x20, 4 s': 'trajectory_planner_8x20_4.0s',
    'TrajectoryPlannerROS 8x20, dwa': 'trajectory_planner_dwa_8x20_1.7s',
}
"""Ours: the peer's, of the same samples and the same horizon."""
DEFAULT_PLANNER = 'RotateThenPursue'
LARGE = ('willow', '100by100_15')
CLASSIC = ('NavfnROS', 'NavfnROS, A*')
SLOWEST = 1.1
QUERIES, FEW = 30, 8  # plans of a figure that has a limit, and of one that has none


def shared_data() -> Path:
    """The folder of the peers' data: SARA_SHARED_DATA, else `shared/data` beside the project."""
    return Path(os.environ.get('SARA_SHARED_DATA', share('sara_nav').resolve().parents[1].parent / 'shared' / 'data'))


def plan_folders() -> list[Path]:
    """Where the peers' plans are looked for: the shared data, then the data of sara_nav's tests."""
    return [shared_data() / 'reference' / 'plans', share('sara_nav').resolve() / 'test' / 'data' / 'plans']


def plan_limit(name: str, planner: str) -> Limit | None:
    """Of a planner's times on a map, None where nothing is asked for."""
    if planner in CLASSIC:
        return Limit('ratio', 1.0 if name in LARGE and planner.endswith('A*') else SLOWEST)
    return Limit('median', 150.0) if (name, planner) == ('willow', 'LatticePlanner') else None


def global_planners() -> Iterator[Timed]:
    """Each planner on each map of the peers' figures; whole plans, without the costmap."""
    for name in peers()['plan_ms_median']:
        found = False
        for case in bench_planners.CASES:
            limit = plan_limit(name, case)
            for row in bench_planners.bench_rows(plan_folders(), [name], [case], QUERIES if limit else FEW):
                found = True
                yield Timed(
                    f'plan on {name}: {case}',
                    'ms',
                    row.median,
                    row.p99,
                    row.plans,
                    peer=row.peer,
                    limit=limit,
                )
        if not found:
            yield Timed(f'plan on {name}', text=f'{name}.npz is in none of {", ".join(map(str, plan_folders()))}')


def costmaps() -> Iterator[Timed]:
    """Inflation of 1000 x 1000 cells, and updates of a rolling 10 x 10 m costmap."""
    limits = {'scattered': Limit('median', 20.0), 'rectangles': Limit('median', 8.0)}
    for case in bench_costmap.CASES:
        median, p99, runs = bench_costmap.bench_case(case)
        limit = next((bound for word, bound in limits.items() if word in case), None)
        yield Timed(case, 'ms', median, p99, runs, peer=bench_costmap.PEER_MS.get(case), limit=limit)


def local_planners() -> Iterator[Timed]:
    """A whole control cycle of each local planner, distance grids included, and the trajectories it scores."""
    for case in bench_local.CASES:
        (median, p99, rate), cycles = bench_local.bench(400, cases=[case])[case], 400
        peer = peers()['local_planner'].get(LOCAL_CASES.get(case), {})
        yield Timed(
            f'cycle of {case}',
            'ms',
            median,
            p99,
            cycles,
            peer=peer.get('ms_per_cycle'),
            limit=Limit('p99', 10.0) if case == DEFAULT_PLANNER else None,
        )
        if rate > 2e3 / median:  # a planner that rolls trajectories out
            yield Timed(
                f'trajectories scored by {case}',
                '/s',
                rate,
                rate * median / p99,
                cycles,
                rate=True,
                peer=peer.get('trajectories_per_s'),
                limit=Limit('median', 1e5),
            )
