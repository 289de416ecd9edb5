"""How cost grows: planning with a map's cells, filtering with the number of inputs, a costmap's update with its window.

Each figure is a bench of its own; `exponents` says how steep a family of them is, and growth_plot draws it.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_lab.benches import costmaps as bench_costmap
from sara_lab.benches.timed import Timed, timed
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.state import SIZE, VX, VYAW
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.inputs.data import OdometryData
from sara_nav.costmaps import layered_costmap
from sara_nav.costmaps.costmap import Costmap, InflationConfig, inflate
from sara_nav.grids.grid import GridGeometry
from sara_nav.planners.planning import GLOBAL_PLANNERS

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock, Row

SIDES = (250, 500, 1000, 2000)  # cells
LATTICE_MOST = 1000  # cells: beyond, a plan of it takes longer than the rest of the bench
PLANNERS = {
    'NavfnROS': ('navfn/NavfnROS', {}),
    'NavfnROS, A*': ('navfn/NavfnROS', {'use_astar': True}),
    'LatticePlanner': ('sara_nav/LatticePlanner', {}),
}
INPUTS = (1, 2, 4, 8, 16)
WINDOWS = (4.0, 6.0, 10.0, 16.0, 24.0)  # m
RESOLUTION = 0.05
BLOCK = 36  # cells between the middles of two obstacles: 1.8 m
FAMILIES = {
    'planning': 'cells',
    'filtering': 'inputs',
    'costmap update': 'cells of the window',
    'amcl by particles': 'particles',
    'amcl by beams': 'beams',
}
"""Of which name begins so, what grows along it."""


def field(side: int, resolution: float = RESOLUTION) -> Costmap:
    """A Costmap of side x side cells, free but for a grid of posts of 0.3 m, inflated."""
    costs = np.zeros((side, side), np.uint8)
    for row in range(BLOCK, side - BLOCK // 2, BLOCK):
        for column in range(BLOCK, side - BLOCK // 2, BLOCK):
            costs[row - 3 : row + 3, column - 3 : column + 3] = 254
    costs = np.ascontiguousarray(inflate(costs, resolution, 0.5 * chosen().body.width, InflationConfig(0.55, 10.0)))
    return Costmap(costs, GridGeometry(side, side, resolution, 0.0, 0.0))


def _times(work, runs, clock):
    """ms of each of `runs`, after one that is not counted."""
    taken = []
    for _ in range(runs + 1):
        begin = clock()
        work()
        taken.append(1e3 * (clock() - begin))
    return taken[1:]


def planning(sides: Sequence[int] = SIDES, runs: int = 5, clock: Clock = time.process_time) -> Iterator[Timed]:
    """ms of a plan from corner to corner."""
    for side in sides:
        costmap = field(side)
        low, high = (
            RESOLUTION * (BLOCK / 2 + BLOCK * blocks) for blocks in (0, (side - BLOCK) // BLOCK)
        )  # between posts
        for name, (kind, changes) in PLANNERS.items():
            if name == 'LatticePlanner' and side > LATTICE_MOST:
                continue
            cls = GLOBAL_PLANNERS.find(kind)
            planner = cls(cls.config_class(**changes))
            work = lambda: planner.plan(costmap, Pose2D(low, low, 0.785), Pose2D(high, high, 0.785))  # noqa: B023, E731
            yield timed(f'planning by {name}, {side} x {side} cells', 'ms', _times(work, runs, clock))


def filtering(
    inputs: Sequence[int] = INPUTS, seconds: float = 4.0, runs: int = 7, clock: Clock = time.process_time
) -> Iterator[Timed]:
    """ms of CPU for a second of the EKF at 50 Hz with so many odometries of 50 Hz each (vx, vyaw)."""
    for count in inputs:
        times = np.array(_times(_filtered(count, seconds), runs, clock))
        yield timed(f'filtering a second, {count} input{"s" if count > 1 else ""}', 'ms', times / seconds)


def _filtered(count, seconds):
    """A function that runs an EKF of `count` odometries for so many seconds more."""
    covariance = 0.01 * np.eye(6)
    covariance.flags.writeable = False
    params = dict(frequency=50.0, two_d_mode=True, odom_frame='odom', base_link_frame='base_link', world_frame='odom')
    mask = [index in (VX, VYAW) for index in range(SIZE)]
    for k in range(count):
        params.update({f'odom{k}': f'odom{k}', f'odom{k}_config': mask})
    engine, now = FilterEngine(FilterConfig.from_params(params, 'ekf'), TransformBuffer()), [100.0]
    moving = dict(linear=(0.5, 0.0, 0.0), angular=(0.0, 0.0, 0.1), twist_covariance=covariance)

    def drive():
        for _ in range(int(50 * seconds)):
            now[0] += 0.02
            for k in range(count):
                engine.add_odometry(f'odom{k}', OdometryData(now[0] - 1e-4 * k, 'odom', 'base_link', **moving))
            engine.tick(now[0])

    return drive


def windows(sizes: Sequence[float] = WINDOWS, runs: int = 100, clock: Clock = time.process_time) -> Iterator[Timed]:
    """ms of an update of a rolling costmap with nine ranges."""
    layered_costmap.warm()
    for size in sizes:
        work, count = bench_costmap.nine_ranges(np.random.default_rng(0), True, size), [0]

        def update(work=work, count=count):
            work(count[0])
            count[0] += 1

        side = round(size / RESOLUTION)
        yield timed(f'costmap update with nine ranges, {side} x {side} cells', 'ms', _times(update, runs, clock))


def size_of(name: str) -> tuple[str, str, int] | None:
    """(family, series, size) of a figure's name, None where it is none of these."""
    for family in FAMILIES:
        if name.startswith(family) and ',' in name:
            series, _, size = name.rpartition(', ')
            count = int(size.split()[0])
            return family, series, count * count if ' x ' in size else count
    return None


def series(rows: Iterable[Row]) -> dict[str, dict[str, list[tuple[int, float]]]]:
    """{family: {series: [(size, ms at the peers' speed), ...]}} of rows."""
    found = {}
    for row in rows:
        known = None if row.skipped else size_of(row.name)
        if known:
            family, line, size = known
            found.setdefault(family, {}).setdefault(line, []).append((size, row.at_peers_speed(row.median)))
    return found


def exponent(points: Sequence[tuple[int, float]]) -> float:
    """The slope of log(time) over log(size)."""
    sizes, times = np.log(np.array(points, float)).T
    return float(np.polyfit(sizes, times, 1)[0])
