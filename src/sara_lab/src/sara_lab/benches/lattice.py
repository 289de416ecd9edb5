"""What LatticePlanner finds on maps, from random poses that fit to random poses that fit, beside navfn's shortest ways
of a point.

    python3 -m sara_lab.benches.lattice MAP.yaml... [--pairs 150] [--seed 7]

Poses are drawn over the whole map with any yaw, so that many stand where there is no room to turn. Pairs that navfn
finds no way between are left out. Every plan is looked at each centimetre and fiftieth of a radian for whether the
padded footprint touches anything. Times are CPU times of a whole plan, without the costmap.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_common.platforms import chosen
from sara_common.repeatable import cos_sin
from sara_nav.costmaps.costmap import InflationConfig, build
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import pad_footprint, radii
from sara_nav.lattice.planner import LatticePlanner
from sara_nav.maps.map_io import GridMap, load_map
from sara_nav.planners.navfn import NavfnConfig, NavfnROS
from sara_nav.planners.planning import PlanError, path_length

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock

PADDING = 0.01


@dataclass(frozen=True)
class LatticeRow:
    """One map: pairs tried, plans found, plans that touch something; times (ms); longer: how much (m) plans are longer
    than navfn's on the mean; astern: m driven astern in all.
    """

    map: str
    pairs: int
    found: int
    touching: int
    median: float
    p99: float
    longest: float
    longer: float
    astern: float


def fine(plan: np.ndarray, metres: float = 0.01, radians: float = 0.02) -> np.ndarray:
    """Return poses (m, 3) along a plan (n, 3), no further apart than that."""
    rows = [plan[:1]]
    for a, b in zip(plan[:-1], plan[1:]):
        turn = wrap(b[2] - a[2])
        n = max(1, math.ceil(max(math.hypot(*(b - a)[:2]) / metres, abs(turn) / radians)))
        rows.append(a + np.arange(1, n + 1)[:, None] / n * np.array([b[0] - a[0], b[1] - a[1], turn]))
    return np.vstack(rows)


def free_poses(world: LocalWorld, count: int, random: np.random.Generator) -> list[Pose2D]:
    """Return ``count`` Pose2Ds at which the LocalWorld's footprint touches nothing."""
    g, found = world.geometry, []
    while len(found) < count:
        x, y = (float(o + random.uniform() * s) for o, s in zip((g.origin_x, g.origin_y), g.size))
        pose = Pose2D(x, y, float(random.uniform(-math.pi, math.pi)))
        if not world.collides(pose):
            found.append(pose)
    return found


def bench(name: str, grid_map: GridMap, pairs: int, seed: int, clock: Clock = time.process_time) -> LatticeRow:
    """Return the LatticeRow of a GridMap."""
    footprint = pad_footprint(np.array(chosen().footprint), PADDING)
    costmap = build(grid_map, radii(footprint)[0], inflation=InflationConfig())
    world, navfn, planner = LocalWorld(costmap, footprint), NavfnROS(NavfnConfig(allow_unknown=False)), LatticePlanner()
    planner.set_footprint(footprint)
    poses = free_poses(world, 2 * pairs, np.random.default_rng(seed))
    times, longer, touching, astern = [], [], 0, 0.0
    for start, goal in zip(poses[::2], poses[1::2]):
        try:
            shortest = path_length(navfn.plan(costmap, start, goal))
        except PlanError:
            continue
        begin = clock()
        try:
            plan = planner.plan(costmap, start, goal)
        except PlanError:
            plan = None
        times.append(1e3 * (clock() - begin))
        if plan is not None:
            longer.append(path_length(plan) - shortest)
            touching += bool(world.touched(fine(plan)).any())
            steps = np.diff(plan, axis=0)
            c, s = cos_sin(plan[:-1, 2])
            along = c * steps[:, 0] + s * steps[:, 1]
            astern -= float(along[along < 0.0].sum())
    return LatticeRow(
        name,
        len(times),
        len(longer),
        touching,
        float(np.median(times)),
        float(np.percentile(times, 99.0)),
        max(times),
        float(np.mean(longer)),
        astern,
    )


def main() -> None:
    """Print a line for each map named on the command line."""
    parser = argparse.ArgumentParser(prog='bench_lattice', description=__doc__.splitlines()[0])
    parser.add_argument('maps', nargs='+', metavar='MAP.yaml')
    parser.add_argument('--pairs', type=int, default=150)
    parser.add_argument('--seed', type=int, default=7)
    question = parser.parse_args()
    for path in question.maps:
        row = bench(path, load_map(path), question.pairs, question.seed)
        print(
            f'{row.map.split("/")[-1]}: {row.found} of {row.pairs} found, {row.touching} touch; '
            f'median {row.median:.1f} ms, p99 {row.p99:.1f} ms, longest {row.longest:.0f} ms; '
            f"{row.longer:.2f} m longer than navfn's, {row.astern:.1f} m astern in all",
            flush=True,
        )


if __name__ == '__main__':
    main()
