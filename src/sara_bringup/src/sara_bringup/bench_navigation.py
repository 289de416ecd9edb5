"""How long navigation takes, beside the C++ peers: planners, inflation, a costmap's update with nine ranges, a control cycle.

Each row has our time, the peer's, and the ratio (ours / our yardstick) / (the peer's / the yardstick on its machine), which is what
different machines can be compared by. Where the peers were not timed the row ends with our time.
"""
import json
import math
import time
from dataclasses import dataclass

import numpy as np

from sara_bringup.paths import parameters, share
from sara_bringup.ranges import mountings
from sara_nav import bench_local, map_io
from sara_nav.costmap import InflationConfig, inflate
from sara_nav.footprint import radii
from sara_nav.geometry import Pose2D
from sara_nav.layered_costmap import warm
from sara_nav.layers.range_sensor import RangeReading, RangeSensorLayer
from sara_nav.parameters import Parameters
from sara_nav.settings import read_settings

LOCAL_CASES = {"TrajectoryPlannerROS": "trajectory_planner_20x20_1.7s", "TrajectoryPlannerROS 8x20": "trajectory_planner_8x20_1.7s",
               "TrajectoryPlannerROS 8x20, 4 s": "trajectory_planner_8x20_4.0s", "TrajectoryPlannerROS 8x20, dwa": "trajectory_planner_dwa_8x20_1.7s"}
"""Ours: the peer's, of the same samples and the same horizon."""
FIELD_OF_VIEW, SHORTEST, LONGEST = math.radians(60.0), 0.16, 6.0


@dataclass(frozen=True)
class Row:
    """`ours`, `peer`: ms, the latter None where there is no figure. `text`: what else there is to say; instead of figures where `ours` is None."""

    name: str
    ours: float = None
    peer: float = None
    text: str = ""

    def ratio(self, yardstick, peers_yardstick):
        """How many times as long as the peer's, both measured by the yardstick (ms) of their own machine; None without a peer."""
        return self.ours / yardstick * peers_yardstick / self.peer if self.ours is not None and self.peer else None


def peers():
    """The peers' figures."""
    return json.loads((share() / "data" / "peers_speed.json").read_text())


def median_ms(work, runs):
    """Median and 99th percentile of the milliseconds of the process's own time that `work(run)` takes."""
    taken = []
    for run in range(runs):
        start = time.process_time()
        work(run)
        taken.append(1e3 * (time.process_time() - start))
    return float(np.median(taken)), float(np.percentile(taken, 99))


def inflation(figures, side=1000, share_lethal=0.05):
    """The peers' four cases: scattered cells and rectangles, 5 % of 1000 x 1000 cells of 0.05 m, two radii; SARA's rectangle, k = 5."""
    random = np.random.default_rng(1)
    scattered = np.where(random.random((side, side)) < share_lethal, np.uint8(254), np.uint8(0))
    rectangles = np.zeros((side, side), np.uint8)
    while rectangles.mean() < share_lethal * 254:
        (x, y), (width, height) = random.integers(0, side, 2), random.integers(5, 60, 2)
        rectangles[y:y + height, x:x + width] = 254
    inscribed = radii(bench_local.FOOTPRINT)[0]
    for kind, costs in (("scattered_cells", scattered), ("rectangles", rectangles)):
        for radius in (0.55, 0.70):
            config = InflationConfig(radius, 5.0)
            inflate(costs, 0.05, inscribed, config)
            ours, _ = median_ms(lambda _: inflate(costs, 0.05, inscribed, config), 7)
            yield Row(f"inflation {side} x {side}, {kind.replace('_', ' ')}, {radius:.2f} m", ours,
                      figures["inflation_1000x1000_ms"][f"{kind}_5pct_radius_{radius:.2f}"])


def nine_ranges(updates=200):
    """The chair drives along the school's corridor at 0.5 m/s; before each update, at 5 Hz, each of the nine sensors tells of an echo."""
    places = mountings()
    tree = parameters("sara_nav", "sara_nav.yaml")
    for name in ("global_costmap", "local_costmap"):
        for layer in tree[name].values():
            if isinstance(layer, dict) and "topics" in layer:
                layer["topics"] = [f"/{sensor}_range" for sensor in sorted(places)]
    settings, school = read_settings(Parameters(tree)), map_io.load_map(str(share() / "maps" / "school.yaml"))
    warm()
    for name in ("local", "global"):
        costmap = getattr(settings, f"{name}_costmap").make(school)
        layers = [layer for layer in costmap.layers.values() if isinstance(layer, RangeSensorLayer)]
        random = np.random.default_rng(2)
        costmap.update(0.0, Pose2D(2.0, 7.1, 0.0))

        def update(run):
            stamp, base = 0.2 * (run + 1), Pose2D(2.0 + 0.1 * run, 7.1, 0.0)
            for sensor, (x, y, yaw) in places.items():
                reading = RangeReading(f"/{sensor}_range", stamp, base.x + x, base.y + y, yaw, float(random.uniform(0.3, 3.0)), SHORTEST, LONGEST,
                                       FIELD_OF_VIEW)
                for layer in layers:
                    layer.add_range(reading)
            costmap.update(stamp, base)

        ours, p99 = median_ms(update, updates)
        size = costmap.geometry
        yield Row(f"update of the {name} costmap, nine ranges", ours, None, f"p99 {p99:.2f} ms; {size.width} x {size.height} cells")


def control_cycles(figures):
    """One cycle of each local planner."""
    for case, (median, p99, rate) in bench_local.bench().items():
        peer = figures["local_planner"].get(LOCAL_CASES.get(case), {})
        text = f"p99 {p99:.2f} ms" + (f"; {rate:.0f} trajectories/s" if rate > 2e3 / median else "")
        yield Row(f"cycle of {case}", median, peer.get("ms_per_cycle"), text + (f" (peer {peer['trajectories_per_s']})" if peer else ""))


def rows():
    """All rows, one by one, as they are measured."""
    figures = peers()
    yield from inflation(figures)
    yield from nine_ranges()
    yield from control_cycles(figures)


def line(row, yardstick, peers_yardstick):
    """The row as text."""
    if row.ours is None:
        return f"{row.name:52} {row.text}"
    ratio = row.ratio(yardstick, peers_yardstick)
    return f"{row.name:52} {row.ours:10.3f} " + (f"{row.peer:10.3f} {ratio:7.2f}" if ratio is not None else f"{'':10} {'':7}") + f"  {row.text}"


def table(yardstick):
    """Measure, and print row by row. `yardstick`: ms, of this run. Returns the rows as plain data."""
    peers_yardstick, result = peers()["yardstick_ms"], []
    print(f"\nnavigation; times in ms, ratios by the yardstick ({yardstick:.0f} ms here, {peers_yardstick} ms where the peers were timed)")
    print(f"{'':52} {'ours':>10} {'peer':>10} {'ratio':>7}", flush=True)
    for row in rows():
        print(line(row, yardstick, peers_yardstick), flush=True)
        result.append({"name": row.name, "ours_ms": row.ours, "peer_ms": row.peer, "ratio": row.ratio(yardstick, peers_yardstick), "text": row.text})
    return result
