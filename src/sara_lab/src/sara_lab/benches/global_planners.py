"""How long each global planner takes on the shared maps, beside the C++ peers, for `make bench`.

A file MAP.npz of the peers' reference results (test/data/README.md, `plans/`) holds the costmap, the pairs of start and
goal, and how long the peers took (`time_s`, by `planners`). Timed are the pairs between which the peer found a way. A
time is a whole plan: the wave, the way down it, the poses; without the costmap, as the peers' are. It is the process's
CPU time, so that other work on the machine does not count.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import GridGeometry
from sara_nav.planners.planning import GLOBAL_PLANNERS, PlanError

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock

CASES = {
    'NavfnROS': ('navfn/NavfnROS', {}, 'navfn_dijkstra'),
    'NavfnROS, A*': ('navfn/NavfnROS', {'use_astar': True}, 'navfn_astar'),
    'GlobalPlanner': ('global_planner/GlobalPlanner', {}, 'gp_dijkstra_quadratic_gradient'),
    'GlobalPlanner, grid path': ('global_planner/GlobalPlanner', {'use_grid_path': True}, 'gp_dijkstra_quadratic_grid'),
    'GridPlanner': ('sara_nav/GridPlanner', {'allow_unknown': True}, None),
    'LatticePlanner': ('sara_nav/LatticePlanner', {'allow_unknown': True}, None),
}
"""What is timed: a planner by name, what differs from its defaults, and the peer it stands beside."""


@dataclass(frozen=True)
class PlannerRow:
    """One line: median and 99th percentile (ms) over ``plans`` queries; ``peer``: the peer's median of the same on its
    machine, or None.
    """

    map: str
    planner: str
    median: float
    p99: float
    peer: float
    plans: int


def bench_rows(
    folders: Iterable[Path | str],
    maps: Sequence[str] | None = None,
    cases: object = tuple(CASES),
    queries: int = 30,
    clock: Clock = time.process_time,
) -> Iterator[PlannerRow]:
    """Yield a PlannerRow for each map and case.

    folders: where MAP.npz files are looked for; of two of the same name the first is taken. maps: names, None for all.
    Kernels are compiled, and each planner has planned once on the map, before anything is timed.
    """
    files = {}
    for folder in folders:
        for path in sorted(Path(folder).glob('*.npz')):
            if path.stem not in files and (maps is None or path.stem in maps):
                with np.load(path) as data:
                    if 'start_cell' in data.files:
                        files[path.stem] = path
    for name, path in files.items():
        with np.load(path) as data:
            entries = {key: data[key] for key in data.files if not key.startswith('path_')}
        costs = np.ascontiguousarray(entries['costmap'])
        geometry = GridGeometry(
            costs.shape[1], costs.shape[0], float(entries['resolution']), *map(float, entries['origin'])
        )
        for case in cases:
            some = _timed(entries, CASES[case][2], queries)
            taken = _times(Costmap(costs, geometry), entries, case, some, clock)
            yield PlannerRow(
                name,
                case,
                float(np.median(taken)),
                float(np.percentile(taken, 99.0)),
                _peer(entries, CASES[case][2], some),
                len(taken),
            )


def _timed(entries, column, queries):
    """Return the numbers of the first ``queries`` pairs between which the peer found a way, of all where there is no
    peer.
    """
    if column is None or 'complete' not in entries:
        return np.arange(len(entries['start_cell']))[:queries]
    return np.flatnonzero(entries['complete'][:, entries['planners'].tolist().index(column)])[:queries]


def _times(costmap, entries, case, some, clock):
    """Return how long (ms) each of some queries took."""
    name, changes, _ = CASES[case]
    cls = GLOBAL_PLANNERS.find(name)
    planner = cls(cls.config_class(**changes))
    ends = [
        [Pose2D(*costmap.geometry.to_world(*cell), 0.0) for cell in pair]
        for pair in zip(entries['start_cell'][some].tolist(), entries['goal_cell'][some].tolist())
    ]
    taken = []
    for start, goal in ends[:1] + ends:
        begin = clock()
        with contextlib.suppress(PlanError):  # finding that there is no path takes its time, too
            planner.plan(costmap, start, goal)
        taken.append(1e3 * (clock() - begin))
    return taken[1:]


def _peer(entries, column, some):
    """Return the peer's median time (ms) of some queries, or None where it was not taken."""
    if column is None or 'time_s' not in entries:
        return None
    return 1e3 * float(np.median(entries['time_s'][some, entries['planners'].tolist().index(column)]))


def main() -> None:
    """Print the table of the folders named on the command line."""
    import sys

    for row in bench_rows(sys.argv[1:]):
        peer = f'peer {row.peer:.2f} ms' if row.peer else 'no peer'
        print(f'{row.map:12} {row.planner:26} {row.median:8.2f} ms, p99 {row.p99:8.2f} ms, {peer}')


if __name__ == '__main__':
    main()
