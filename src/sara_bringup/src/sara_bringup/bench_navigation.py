"""How long navigation takes, beside the C++ peers: each planner on each map, inflation, a costmap's update with nine ranges, a control cycle.

Each row has our time, the peer's, and the ratio (ours / our yardstick) / (the peer's / the yardstick on its machine), which is what
different machines can be compared by. Where the peers were not timed the row ends with our time.
"""
import json
import os
from dataclasses import dataclass
from pathlib import Path

from sara_bringup.paths import share
from sara_nav import bench_costmap, bench_local, bench_planners

LOCAL_CASES = {"TrajectoryPlannerROS": "trajectory_planner_20x20_1.7s", "TrajectoryPlannerROS 8x20": "trajectory_planner_8x20_1.7s",
               "TrajectoryPlannerROS 8x20, 4 s": "trajectory_planner_8x20_4.0s", "TrajectoryPlannerROS 8x20, dwa": "trajectory_planner_dwa_8x20_1.7s"}
"""Ours: the peer's, of the same samples and the same horizon."""


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


def plan_folders():
    """Where the peers' plans are looked for: the data of sara_nav's tests, and `shared/data` beside the project (or SARA_SHARED_DATA)."""
    package = share("sara_nav").resolve()
    shared = os.environ.get("SARA_SHARED_DATA", package.parents[1].parent / "shared" / "data")
    return [Path(shared) / "reference" / "plans", package / "test" / "data" / "plans"]


def planners(figures):
    """Each planner on each map of the peers' figures."""
    folders = plan_folders()
    for name, entry in figures["plan_ms_median"].items():
        found = False
        for row in bench_planners.bench_rows(folders, [name]):
            found = True
            peer = entry.get(bench_planners.CASES[row.planner][2])
            yield Row(f"plan on {name}: {row.planner}", row.median, peer, f"p99 {row.p99:.2f} ms; {entry['cells'][0]} x {entry['cells'][1]} cells, {row.plans} plans")
        if not found:
            yield Row(f"plan on {name}", text=f"not timed: {name}.npz is in none of {', '.join(map(str, folders))}")


def costmaps():
    """Inflation, and updates of a local costmap."""
    for case, (median, p99) in bench_costmap.bench().items():
        yield Row(case if case.startswith("update") else f"{case}, 1000 x 1000", median, bench_costmap.PEER_MS.get(case), f"p99 {p99:.2f} ms")


def control_cycles(figures):
    """One cycle of each local planner."""
    for case, (median, p99, rate) in bench_local.bench().items():
        peer = figures["local_planner"].get(LOCAL_CASES.get(case), {})
        text = f"p99 {p99:.2f} ms" + (f"; {rate:.0f} trajectories/s" if rate > 2e3 / median else "")
        yield Row(f"cycle of {case}", median, peer.get("ms_per_cycle"), text + (f" (peer {peer['trajectories_per_s']})" if peer else ""))


def rows():
    """All rows, one by one, as they are measured."""
    figures = peers()
    yield from planners(figures)
    yield from costmaps()
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
