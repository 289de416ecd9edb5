"""Where the chair's body can stand on a map, and whether it can get from one pose to another: for drawing trials that
are hard but fair.

Poses are laid on a grid of the map's cells and HEADINGS headings (a configuration space, Lozano-Perez 1983). The body
may turn in place from a heading to the next and drive along its heading, ahead or astern, as far as the next cell that
lies there; nothing else, so that what is connected here can be driven indeed, and no planner of ours is asked.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.signal import fftconvolve

from ahead_of_time import kernel

HEADINGS = 32
LONGEST_STEP = 5  # cells: within so many a heading's line meets another cell nearly exactly


class BodySpace:
    """`occupied`: (rows, columns) bool, row 0 lowest. `resolution`, `origin`: m. `body`: length, width, m. `margin`: m
    about the body that stays free. `apart`: ((rows, columns) bool, m): other things, and how far the body stays away
    from those. `headings`: how many are told apart.
    """

    def __init__(
        self,
        occupied: np.ndarray,
        resolution: float,
        origin: tuple[float, float],
        body: tuple[float, float],
        margin: float,
        apart: tuple[np.ndarray, float] | None = None,
        headings: int = HEADINGS,
    ) -> None:
        self.resolution, self.origin = resolution, origin
        self.free = np.empty((headings, *occupied.shape), np.bool_)
        for k in range(headings):
            blocked = _spread(occupied, resolution, body, margin, 2.0 * math.pi * k / headings)
            if apart is not None:
                blocked |= _spread(apart[0], resolution, body, apart[1], 2.0 * math.pi * k / headings)
            self.free[k] = ~blocked
        self._label = np.zeros(self.free.shape, np.int32)
        self._labels = 0
        self._steps = np.array([_step(2.0 * math.pi * k / headings) for k in range(headings)])

    def connected(self, start: Sequence[float], goal: Sequence[float]) -> bool:
        """Whether the body gets from one pose (x, y, yaw) to the other."""
        a, b = self._reached(start), self._reached(goal)
        return a != 0 and a == b

    def _reached(self, pose):
        """The label of all that is connected with a pose; 0: the body cannot stand there."""
        column, row = (int((value - low) / self.resolution) for value, low in zip(pose[:2], self.origin))
        heading = pose[2] / (2.0 * math.pi) * len(self.free)
        if not (0 <= row < self.free.shape[1] and 0 <= column < self.free.shape[2]):
            return 0
        for k in (round(heading), math.floor(heading), math.ceil(heading)):
            cell = k % len(self.free), row, column
            if self.free[cell]:
                if not self._label[cell]:
                    self._labels += 1
                    _flood(self.free, self._label, self._steps, *cell, self._labels)
                return int(self._label[cell])
        return 0


def _spread(occupied, size, body, margin, yaw):
    """(rows, columns) bool: cells on whose middle the body, turned by yaw, with its margin overlaps an obstacle."""
    half, side = 0.5 * body[0] + margin, 0.5 * body[1] + margin
    reach = math.ceil((math.hypot(half, side)) / size) + 1
    dx, dy = np.meshgrid(size * np.arange(-reach, reach + 1), size * np.arange(-reach, reach + 1))
    c, s = math.cos(yaw), math.sin(yaw)
    cell = (
        0.5 * size * (abs(c) + abs(s))
    )  # a square's reach along an axis of the body; on the map's own axes, the body's reach along theirs
    kernel = (
        (np.abs(c * dx + s * dy) < half + cell)
        & (np.abs(c * dy - s * dx) < side + cell)
        & (np.abs(dx) < half * abs(c) + side * abs(s) + 0.5 * size)
        & (np.abs(dy) < half * abs(s) + side * abs(c) + 0.5 * size)
    )
    return fftconvolve(occupied.astype(np.float32), kernel[::-1, ::-1].astype(np.float32), 'same') > 0.5


def _step(yaw):
    """(columns, rows) to the cell within LONGEST_STEP that lies most exactly in the direction of yaw, the nearest of
    those.
    """
    choices = [
        (i, j)
        for i in range(-LONGEST_STEP, LONGEST_STEP + 1)
        for j in range(-LONGEST_STEP, LONGEST_STEP + 1)
        if (i, j) != (0, 0)
    ]
    return min(
        choices,
        key=lambda cell: (
            round(abs(math.remainder(math.atan2(cell[1], cell[0]) - yaw, 2.0 * math.pi)), 3),
            math.hypot(*cell),
        ),
    )


@kernel
def _flood(free, label, steps, k, row, column, number):
    """Label every pose that is connected with (k, row, column)."""
    headings, rows, columns = free.shape
    stack = np.empty((free.size, 3), np.int16)
    stack[0, 0], stack[0, 1], stack[0, 2] = k, row, column
    label[k, row, column] = number
    count = 1
    while count:
        count -= 1
        k, row, column = int(stack[count, 0]), int(stack[count, 1]), int(stack[count, 2])
        for move in range(4):
            to, j, i = k, row, column
            if move < 2:
                to = (k + (1 if move else -1)) % headings
                passable = free[to, row, column]
            else:
                sign = 1 if move == 3 else -1
                far = max(abs(steps[k, 0]), abs(steps[k, 1]))
                passable = True
                for part in range(1, far + 1):
                    i = column + sign * int(round(steps[k, 0] * part / far))
                    j = row + sign * int(round(steps[k, 1] * part / far))
                    if not (0 <= j < rows and 0 <= i < columns and free[k, j, i]):
                        passable = False
                        break
            if passable and not label[to, j, i]:
                label[to, j, i] = number
                stack[count, 0], stack[count, 1], stack[count, 2] = to, j, i
                count += 1
    return 0


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    free = np.ones((2, 2, 2), np.bool_)
    _flood(free, np.zeros(free.shape, np.int32), np.ones((2, 2), np.int64), 0, 0, 0, 1)
