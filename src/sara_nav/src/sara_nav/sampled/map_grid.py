"""How far each cell of the local costmap is from the plan, or from where the plan leaves the map.

A wave of 4-connected steps over the cells that are free to the robot's centre, as base_local_planner's MapGrid spreads
it (Marder-Eppstein et al. 2010): cells of cost 253 and more stop it, but for those the robot stands on. Distances are
counted in cells. A cell the wave met as an obstacle holds ``size`` (the number of cells of the map), one it never came
to ``size + 1``.
"""

import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.costmaps.costmap import Costmap

BLOCKED_FROM = 253
UNKNOWN = 255
OPEN, WALL, MET = 0, 1, 2
"""What ``ground`` says of a cell; MET: the wave has been there, or it is beyond the edge."""


def obstacle_distance(costs: np.ndarray) -> int:
    """Return what a distance grid over ``costs`` holds in cells that are obstacles."""
    return costs.size


def unreachable_distance(costs: np.ndarray) -> int:
    """Return what a distance grid over ``costs`` holds in cells the wave did not come to."""
    return costs.size + 1


class Work(NamedTuple):
    """What a wave is worked out in, with a border of MET cells all around; all but the ground flat."""

    ground: np.ndarray
    """uint8 (h + 2, w + 2): OPEN or WALL."""
    state: np.ndarray
    """uint8: the ground, and MET where the wave has been."""
    distance: np.ndarray
    """int32."""
    queue: np.ndarray
    """uint32 (h w,): cells that the wave has come to, in their order."""


class Waves:
    """Distance grids over a costmap. What they are worked out in is kept from one costmap to the next of its shape."""

    def __init__(self):
        self._ground = np.empty((0, 0), np.uint8)

    def over(self, costs: np.ndarray) -> None:
        """Take the costs (uint8) that waves are to run over from now on."""
        height, width = costs.shape
        if self._ground.shape != (height + 2, width + 2):
            self._ground = np.full((height + 2, width + 2), MET, np.uint8)
            self._inside = self._ground[1:-1, 1:-1].view(bool)
            cells = self._ground.size
            self._work = Work(
                self._ground, np.empty(cells, np.uint8), np.empty(cells, np.int32), np.empty(costs.size, np.uint32)
            )
        np.greater_equal(costs, BLOCKED_FROM, out=self._inside)  # 0 and 1 are OPEN and WALL

    def spread(self, seeds: np.ndarray, exempt: np.ndarray, window: tuple[int, int, int, int]) -> np.ndarray:
        """Return the distances int32, shape of costs, as ``spread`` does, but only in a window: x0, y0, xn, yn (cells,
        the last not included). The wave stops as soon as it knows them; elsewhere the array holds nothing of use.
        """
        return _wave(self._work, seeds, exempt, window)


def spread(costs: np.ndarray, seeds: np.ndarray, exempt: np.ndarray) -> np.ndarray:
    """Return the distances int32, shape of costs, from the nearest of seeds (n, 2) of (column, row).

    exempt (m, 2): cells the wave goes through whatever they cost (those under the robot).
    """
    waves = Waves()
    waves.over(costs)
    return waves.spread(seeds, exempt, (0, 0, costs.shape[1], costs.shape[0]))


@kernel
def _wave(work, seeds, exempt, window):
    """See ``Waves.spread``."""
    rows, stride = work.ground.shape
    x0, y0 = max(window[0], 0), max(window[1], 0)
    xn, yn = min(window[2], stride - 2), min(window[3], rows - 2)
    tail = _begin(work, seeds, exempt, (y0 * stride, (yn + 2) * stride))
    _run(work, tail, (x0, y0, xn, yn))
    result = np.empty((rows - 2, stride - 2), np.int32)
    for i in range(y0, yn):
        for j in range(x0, xn):
            result[i, j] = work.distance[(i + 1) * stride + j + 1]
    return result


@kernel
def _begin(work, seeds, exempt, lines):
    """Put the seeds into the queue; return how many are in it. lines: first and last index whose distances are asked
    for, the last not included.
    """
    rows, stride = work.ground.shape
    state = work.state
    state[:] = work.ground.ravel()
    work.distance[lines[0] : lines[1]] = (rows - 2) * (stride - 2) + 1
    for i in range(len(exempt)):
        state[(exempt[i, 1] + 1) * stride + exempt[i, 0] + 1] = OPEN
    tail = 0
    for i in range(len(seeds)):
        cell = (seeds[i, 1] + 1) * stride + seeds[i, 0] + 1
        if state[cell] != MET:
            state[cell] = MET
            work.queue[tail] = cell
            tail += 1
    return tail


@kernel
def _run(work, tail, window):
    """Spread the wave from the ``tail`` cells in the queue until all cells of the window are met."""
    state, distance, queue = work.state, work.distance, work.queue
    rows, stride = work.ground.shape
    size = (rows - 2) * (stride - 2)
    x0, y0, xn, yn = window
    # A wall of the window may be met from beside it.
    left, right, top = max(x0 - 1, 0), min(xn + 1, stride - 2), min(yn + 1, rows - 2)
    column, row, step, head = left, max(y0 - 1, 0), 0, 0
    # Without a sign, so that no index is asked whether it counts from the end.
    one, line = np.uint32(1), np.uint32(stride)
    while head < tail and row < top:
        # What is met stays met: nothing is looked at twice.
        while row < top and state[(row + 1) * stride + column + 1] != OPEN:
            column += 1
            if column == right:
                column = left
                row += 1
        end = tail
        while head < end:
            cell = queue[head]
            head += 1
            distance[cell] = step
            tail = _meet(cell - one, state, distance, queue, tail, size)
            tail = _meet(cell + one, state, distance, queue, tail, size)
            tail = _meet(cell - line, state, distance, queue, tail, size)
            tail = _meet(cell + line, state, distance, queue, tail, size)
        step += 1


@kernel
def _meet(cell, state, distance, queue, tail, size):
    """Put a cell the wave comes to at the queue's end unless it was there; return the end."""
    found = state[cell]
    if found != MET:
        state[cell] = MET
        if found == OPEN:
            queue[tail] = cell
            return tail + 1
        distance[cell] = size
    return tail


def adjust_plan_resolution(plan: np.ndarray, resolution: float) -> np.ndarray:
    """Return the plan (n, k) with points put evenly between those further apart than ``resolution`` (m).

    Points put in take every column but x and y from the point that follows them.
    """
    plan = np.asarray(plan, float)
    if len(plan) < 2:
        return plan.copy()
    gap = np.diff(plan[:, :2], axis=0)
    length = np.hypot(*gap.T)
    steps = np.where(length > resolution, np.ceil(length / resolution), 1.0).astype(int)
    segment = np.repeat(np.arange(len(steps)), steps)
    place = np.arange(len(segment)) - np.repeat(np.cumsum(steps) - steps, steps) + 1
    result = plan[1:][segment]
    inner = place < steps[segment]
    share = (place / steps[segment])[:, None]
    result[inner, :2] = (plan[:-1, :2][segment] + share * gap[segment])[inner]
    return np.vstack([plan[:1], result])


def plan_cells(plan: np.ndarray, costmap: Costmap) -> np.ndarray:
    """Return the cells int64 (n, 2) of the plan's first run over known cells of the map, empty when it has none.

    plan (m, 2 or more) in the costmap's frame. The run ends where the plan leaves the map or enters unknown cells:
    its last cell is the local goal.
    """
    g = costmap.geometry
    return _known_run(
        np.ascontiguousarray(plan, float), costmap.costs, (float(g.origin_x), float(g.origin_y), float(g.resolution))
    )


@kernel
def _known_run(plan, costs, grid):
    """See ``plan_cells``: the points are those of ``adjust_plan_resolution``. grid: origin x, y, resolution (m)."""
    origin_x, origin_y, resolution = grid
    height, width = costs.shape
    steps = np.ones(len(plan), np.int64)
    for i in range(1, len(plan)):
        length = math.hypot(plan[i, 0] - plan[i - 1, 0], plan[i, 1] - plan[i - 1, 1])
        if length > resolution:
            steps[i] = math.ceil(length / resolution)
    cells = np.empty((steps.sum(), 2), np.int64)
    n = 0
    for i in range(len(plan)):
        for place in range(1, steps[i] + 1):
            x, y = plan[i, 0], plan[i, 1]
            if place < steps[i]:
                share = place / steps[i]
                x = plan[i - 1, 0] + share * (x - plan[i - 1, 0])
                y = plan[i - 1, 1] + share * (y - plan[i - 1, 1])
            column, row = math.floor((x - origin_x) / resolution), math.floor((y - origin_y) / resolution)
            if 0 <= column < width and 0 <= row < height and costs[row, column] != UNKNOWN:
                cells[n, 0], cells[n, 1] = column, row
                n += 1
            elif n:
                return cells[:n].copy()
    return cells[:n].copy()


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs, cells = np.zeros((3, 3), np.uint8), np.zeros((1, 2), np.int64)
    spread(costs, cells, cells)
    for columns in (2, 3):
        _known_run(np.zeros((2, columns)), costs, (0.0, 0.0, 1.0))
