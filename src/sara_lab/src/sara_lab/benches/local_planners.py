"""How long a control cycle of each local planner takes, for `make bench`.

The setting is that of the peer's figures in speed.json: 10 m x 10 m of local costmap at 0.05 m with obstacles about a
curved way, default samples, SARA's footprint, the robot on the way at speed; every cycle is a whole one, distance grids
included. Time is the process's CPU time, so that other work on the machine does not count.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_nav.costmaps.costmap import Costmap, InflationConfig, inflate
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import GridGeometry
from sara_nav.move_base import local_planners as local_planner
from sara_nav.planners.local_command import DRIVING, LOCAL_PLANNERS

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock

CASES = {
    'TrajectoryPlannerROS': ('base_local_planner/TrajectoryPlannerROS', {}),
    'TrajectoryPlannerROS 8x20': ('base_local_planner/TrajectoryPlannerROS', {'vx_samples': 8}),
    'TrajectoryPlannerROS 8x20, 4 s': ('base_local_planner/TrajectoryPlannerROS', {'vx_samples': 8, 'sim_time': 4.0}),
    'TrajectoryPlannerROS 8x20, dwa': ('base_local_planner/TrajectoryPlannerROS', {'vx_samples': 8, 'dwa': True}),
    'DWAPlannerROS': ('dwa_local_planner/DWAPlannerROS', {}),
    'DWAPlannerROS 20x40': ('dwa_local_planner/DWAPlannerROS', {'vx_samples': 20, 'vth_samples': 40}),
    'RotateThenPursue': ('sara_nav/RotateThenPursue', {}),
}
"""What is timed: a planner by name and what differs from its defaults; the first four are the peer's cases."""


def make_world(seed: int = 0) -> tuple[LocalWorld, np.ndarray]:
    """Return (LocalWorld, plan (n, 3)): a way that winds between obstacles, the same for every seed."""
    random = np.random.default_rng(seed)
    along = np.linspace(-4.5, 4.5, 181)
    plan = np.column_stack([along, 0.4 * np.sin(along), np.arctan(0.4 * np.cos(along))])
    costs = np.zeros((200, 200), np.uint8)
    for x, y in random.uniform(-4.8, 4.8, (60, 2)):
        if np.hypot(*(plan[:, :2] - (x, y)).T).min() > 0.75:
            column, row = int((x + 5.0) / 0.05), int((y + 5.0) / 0.05)
            costs[row : row + 3, column : column + 3] = 254
    costs = np.ascontiguousarray(inflate(costs, 0.05, 0.5 * chosen().body.width, InflationConfig(0.55, 10.0)))
    return LocalWorld(Costmap(costs, GridGeometry(200, 200, 0.05, -5.0, -5.0)), np.array(chosen().footprint)), plan


def samples_of(config: object) -> int:
    """Return how many trajectories a cycle scores with this configuration, as the peer's figures count them."""
    if hasattr(config, 'vtheta_samples'):
        return (config.vx_samples + 1) * config.vtheta_samples
    return config.vx_samples * config.vth_samples if hasattr(config, 'vth_samples') else 1


def bench(
    cycles: int = 400, clock: Clock = time.process_time, cases: Sequence[str] = tuple(CASES)
) -> dict[str, tuple[float, float, float]]:
    """Return {case: (median ms, 99th percentile ms, trajectories scored per second)} over ``cycles`` control cycles
    each.

    Trajectories per second: nominal samples (samples_of) over the median. Kernels are compiled before anything is
    timed.
    """
    local_planner.warm()
    world, plan = make_world()
    result = {}
    for case in cases:
        name, changes = CASES[case]
        cls = LOCAL_PLANNERS.find(name)
        planner = cls(cls.config_class(**changes))
        planner.start(plan)
        taken = []
        for i in range(cycles + 5):
            row = plan[20 + (i % 100)]
            pose = Pose2D(row[0], row[1], row[2] + 0.2 * math.sin(0.7 * i))
            begin = clock()
            command = planner.update(0.05 * i, 0.05, pose, (0.3, 0.0), 0.0, world)
            taken.append(1e3 * (clock() - begin))
            if command.state != DRIVING or i % 100 == 99:
                planner.start(plan)
        taken = np.array(taken[5:])
        median = float(np.median(taken))
        result[case] = median, float(np.percentile(taken, 99.0)), 1e3 * samples_of(planner.config) / max(median, 1e-6)
    return result


def main() -> None:
    """Print the table."""
    print(f'{"one control cycle":32} {"median ms":>10} {"p99 ms":>10} {"trajectories/s":>16}')
    for case, (median, p99, rate) in bench().items():
        print(f'{case:32} {median:10.2f} {p99:10.2f} {rate:16.0f}')
