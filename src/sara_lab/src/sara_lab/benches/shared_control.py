"""How long shared control takes for a command, for `make bench`: where help is needed, in a room full of pillars."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from sara_common.platforms import parameters
from sara_control.assist.help_profiles import HelpProfiles
from sara_control.assist.local_grid import LocalGrid
from sara_control.assist.shared_control import SharedControl
from sara_lab.benches.timed import Limit, timed

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock, Timed

SIDE, CELL, PILLARS = 6.0, 0.05, 25  # m, m, -
RUNS = 1000


def pillars(seed: int) -> LocalGrid:
    """A room (m) with pillars of 0.15 m, none near its middle."""
    random = np.random.default_rng(seed)
    cells = round(SIDE / CELL)
    blocked = np.zeros((cells, cells), bool)
    blocked[[0, -1]] = blocked[:, [0, -1]] = True
    for x, y in random.uniform(0.0, SIDE, (PILLARS, 2)):
        if math.hypot(x - 0.5 * SIDE, y - 0.5 * SIDE) > 0.8:
            row, column = int(y / CELL), int(x / CELL)
            blocked[row : row + 3, column : column + 3] = True
    return LocalGrid(blocked, CELL, 0.0, 0.0)


def law(clock: Clock = time.process_time) -> Iterator[Timed]:
    """A step among pillars, from poses about the middle at which something is in the way; and a new grid."""
    assist = SharedControl(HelpProfiles.from_params(parameters('sara_control', 'assist.yaml')).config)
    random = np.random.default_rng(0)
    steps, grids, k = [], [], 0
    while len(steps) < RUNS:
        if k % 10 == 0:
            grid = pillars(k)
            began = clock()
            assist.on_grid(grid, 0.0)
            grids.append(1e3 * (clock() - began))
        k += 1
        wish = random.uniform(0.1, 0.4), random.uniform(-0.4, 0.4)
        pose = 0.5 * SIDE, 0.5 * SIDE, random.uniform(-math.pi, math.pi)
        assist.let_go()
        began = clock()
        result = assist.step(0.0, wish, pose)
        if result.correction is not None:
            steps.append(1e3 * (clock() - began))
    yield timed('shared control: a command that is corrected', 'ms', steps, limit=Limit('p99', 2.0))
    yield timed('shared control: a costmap of 6 m taken in', 'ms', grids)
