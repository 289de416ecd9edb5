"""How long costmaps take, for `make bench`: inflation as in the peer's figures of speed.json, and updates of a local
costmap.

Inflation: 1000 x 1000 cells of 0.05 m, SARA's footprint, cost_scaling_factor 5, 5 % of the cells lethal, either
scattered or as rectangles. Time is the process's CPU time, so that other work on the machine does not count.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_nav.costmaps import layered_costmap
from sara_nav.costmaps.costmap import LETHAL, InflationConfig, inflate
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig, SourceConfig
from sara_nav.costmaps.layers.range_sensor import RangeReading, RangeSensorConfig, RangeSensorLayer
from sara_nav.costmaps.observations import Observation
from sara_nav.grids.footprint import pad_footprint

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock

SENSORS = 9
PEER_MS = {
    'inflation, scattered cells, 0.55 m': 44.18,
    'inflation, scattered cells, 0.70 m': 43.45,
    'inflation, rectangles, 0.55 m': 5.28,
    'inflation, rectangles, 0.70 m': 6.79,
}
"""The C++ InflationLayer's medians on the machine of speed.json."""


def obstacles(scattered: bool, seed: int = 0) -> np.ndarray:
    """Return costs (1000, 1000) uint8 of which 5 % are lethal: single cells, or rectangles of up to 40 cells a side."""
    random = np.random.default_rng(seed)
    costs = np.zeros((1000, 1000), np.uint8)
    if scattered:
        costs[random.random(costs.shape) < 0.05] = LETHAL
    while (costs == LETHAL).mean() < 0.05:
        row, column, height, width = random.integers(0, 960, 2).tolist() + random.integers(1, 41, 2).tolist()
        costs[row : row + height, column : column + width] = LETHAL
    return costs


def _taken(work, runs, clock):
    """Return the milliseconds (runs,) that ``work(i)`` took, after two that are not counted."""
    taken = []
    for i in range(runs + 2):
        begin = clock()
        work(i)
        taken.append(1e3 * (clock() - begin))
    return np.array(taken[2:])


def nine_ranges(random: np.random.Generator, moving: bool, size: float = 10.0) -> Callable[[int], object]:
    """Return work(i): an update of a rolling costmap of ``size`` m a side with a reading of each of nine sensors about
    the robot.
    """
    layer = RangeSensorLayer('ultrasonic', RangeSensorConfig(topics=tuple(f'/s{i}' for i in range(SENSORS))))
    costmap = LayeredCostmap(
        CostmapConfig(rolling_window=True, width=size, height=size),
        [layer, InflationLayer('inflation', InflationConfig(0.75, 4.0))],
        _outline(),
    )

    def update(i):
        pose = Pose2D(0.06 * i if moving else 0.0, 0.0, 0.02 * i if moving else 0.0)
        for k in range(SENSORS):
            at = pose.compose(Pose2D(0.0, 0.0, k * 2.0 * math.pi / SENSORS))
            echo = random.uniform(0.2, 3.0)
            layer.add_range(
                RangeReading(
                    f'/s{k}',
                    0.2 * i,
                    at.x,
                    at.y,
                    at.yaw,
                    echo if echo <= 2.5 else math.inf,
                    0.16,
                    2.5,
                    math.radians(60.0),
                )
            )
        costmap.update(0.2 * i, pose)

    return update


def laser(random: np.random.Generator) -> Callable[[int], object]:
    """Return work(i): an update of the same costmap with a scan of 720 rays, marking and clearing."""
    layer = ObstacleLayer('obstacles', ObstacleConfig(sources=(SourceConfig('scan', clearing=True),)))
    costmap = LayeredCostmap(
        CostmapConfig(rolling_window=True), [layer, InflationLayer('inflation', InflationConfig(0.75, 4.0))], _outline()
    )
    angle = np.linspace(-math.pi, math.pi, 720)

    def update(i):
        distance = 2.0 + 0.3 * np.sin(5.0 * angle + 0.1 * i) + random.normal(0.0, 0.01, 720)
        points = np.column_stack([0.06 * i + distance * np.cos(angle), distance * np.sin(angle), np.full(720, 0.2)])
        layer.add_observation(Observation('scan', 0.2 * i, (0.06 * i, 0.0, 0.2), points))
        costmap.update(0.2 * i, Pose2D(0.06 * i, 0.0, 0.0))

    return update


def _outline():
    """The robot's corners, as it is kept clear."""
    return pad_footprint(np.array(chosen().footprint), 0.01)


def _inflating(scattered, radius):
    """Return work(i): the inflation of the whole grid."""
    costs, config = obstacles(scattered), InflationConfig(radius, 5.0)
    return lambda i: inflate(costs, 0.05, 0.5 * chosen().body.width, config)


CASES = {
    'inflation, scattered cells, 0.55 m': lambda random: _inflating(True, 0.55),
    'inflation, scattered cells, 0.70 m': lambda random: _inflating(True, 0.70),
    'inflation, rectangles, 0.55 m': lambda random: _inflating(False, 0.55),
    'inflation, rectangles, 0.70 m': lambda random: _inflating(False, 0.70),
    'update with nine ranges, standing': lambda random: nine_ranges(random, False),
    'update with nine ranges, driving': lambda random: nine_ranges(random, True),
    'update with a scan of 720 rays, driving': laser,
}
"""What is timed: work(i), made of a random generator."""


def bench_case(case: str, runs: int = 300, clock: Clock = time.process_time) -> tuple[float, float, int]:
    """Return (median ms, 99th percentile ms, runs) of a case. Kernels are compiled before anything is timed."""
    layered_costmap.warm()
    taken = _taken(
        CASES[case](np.random.default_rng(0)), max(15, runs // 20) if case.startswith('inflation') else runs, clock
    )
    return float(np.median(taken)), float(np.percentile(taken, 99.0)), len(taken)


def bench(runs: int = 300, clock: Clock = time.process_time) -> dict[str, tuple[float, float]]:
    """Return {case: (median ms, 99th percentile ms)}."""
    return {case: bench_case(case, runs, clock)[:2] for case in CASES}


def main() -> None:
    """Print the table."""
    print(f'{"":42} {"median ms":>10} {"p99 ms":>10} {"C++ ms":>10}')
    for case, (median, p99) in bench().items():
        print(f'{case:42} {median:10.2f} {p99:10.2f} {PEER_MS.get(case, ""):>10}')


if __name__ == '__main__':
    main()
