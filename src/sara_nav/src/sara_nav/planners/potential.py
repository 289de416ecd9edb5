"""The wave that gives every cell what driving there costs: the potential of navfn and global_planner.

A wave runs out from the robot. Each cell takes, from its lowest neighbour in x and its lowest in y, the value a plane
wave would give it, or the lower neighbour's plus the cell's own cost where only one counts. The plane wave's equation
is solved by the peers' quadratic fit, a step of cost h between neighbours that differ by d: low + h (0.7040 + 0.5307 r
- 0.2301 r^2), r = d/h. (The method: Kimmel and Sethian 1998; the fit and the priority blocks: K. Konolige's navfn.)

Cells wait in three blocks in place of a heap: those of this round, those of the next below a threshold of potential,
and those above it. So a round is a loop over an array, cells are taken very nearly in order, and the few taken too
early are taken again.

Arrays are flat over the map with one cell of obstacle put all round it, so that no neighbour has to be tested for being
off the map: index = (row + 1)(columns + 2) + column + 1. ``warm()`` compiles or loads all of it.
"""

from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel

HIGH = np.float32(1e10)
"""Potential of a cell that the wave has not reached."""
INVERSE_ROOT_2 = np.float32(0.707106781)


class Field(NamedTuple):
    """What a search is worked out in, flat; see above."""

    steps: np.ndarray
    """uint8: a cell's cost, from ``obstacle`` on impassable."""
    potential: np.ndarray
    """float32, HIGH where unreached."""
    pending: np.ndarray
    """uint8: not 0 where a cell waits."""
    width: int
    """Columns, with those of the border."""
    obstacle: int


class Wave(NamedTuple):
    """How a wave runs."""

    target: int
    """Index of the cell that is to be settled, -1 to fill everything."""
    increment: float
    """Width of a priority block."""
    quadratic: bool
    """The plane wave, else the lowest neighbour plus the cost."""


@kernel
def prepare(costs: np.ndarray, table: np.ndarray, outline: bool, field: Field) -> None:
    """Lay out a search: table (256,) turns costs (rows, columns) into steps; nothing is reached or waits.

    outline: the outermost cells of the map are obstacles too.
    """
    rows, columns = costs.shape
    width, steps, obstacle = field.width, field.steps, field.obstacle
    for i in range(width):
        steps[i] = obstacle
        steps[(rows + 1) * width + i] = obstacle
    for row in range(rows):
        at = (row + 1) * width
        steps[at] = obstacle
        steps[at + columns + 1] = obstacle
        line = costs[row]
        inner = steps[at + 1 : at + 1 + columns]
        for column in range(columns):
            inner[column] = table[line[column]]
        if outline:
            inner[0] = obstacle
            inner[columns - 1] = obstacle
            if row == 0 or row == rows - 1:
                inner[:] = obstacle
    field.potential[:] = HIGH
    field.pending[:] = 0


@kernel(inline='always')
def plane_wave(low: float, other: float, cost: float, quadratic: bool) -> tuple[float, float]:
    """Return a cell's potential from the lowest neighbour along one axis and along the other, and its own cost."""
    if low > other:
        low, other = other, low
    value = low + cost
    if quadratic and other < value:
        ratio = (other - low) / cost
        value = low + cost * (np.float32(0.7040) + ratio * (np.float32(0.5307) - ratio * np.float32(0.2301)))
    return low, value


@kernel
def spread(field: Field, blocks: tuple[np.ndarray, np.ndarray, np.ndarray], count: int, wave: Wave) -> int:
    """Run the wave from the ``count`` cells in the first block until the target is settled or nothing is left.

    field: as of ``prepare``, the sources' potential given. blocks: three uint32 buffers, each as long as the grid: of
    this round, of the next, of what is above the threshold. Returns the number of updates.
    """
    current, following, over = blocks
    threshold = float(field.obstacle)
    updates = 0
    waiting = 0
    while count > 0:
        updates += count
        count, waiting = _round(field, (current, following, over), (count, waiting), threshold, wave.quadratic)
        current, following = following, current
        if count == 0:  # all below the threshold is settled
            if wave.target >= 0 and field.potential[wave.target] < threshold:
                break
            threshold += wave.increment
            current, over = over, current
            count, waiting = waiting, 0
    return updates


@kernel
def _round(field, blocks, counts, threshold, quadratic):
    """Update the cells of this round, and call their neighbours up. counts: how many cells are in the first block and
    in the third. Returns how many are in the second and in the third then.
    """
    steps, potential, pending, width, obstacle = field
    current, following, over = blocks
    count, waiting = counts
    w, one = np.uint64(width), np.uint64(1)
    for i in range(count):
        pending[current[i]] = 0
    further = 0
    for i in range(count):
        n = np.uint64(current[i])
        step = steps[n]
        if step >= obstacle:
            continue
        left, right = potential[n - one], potential[n + one]
        below, above = potential[n - w], potential[n + w]
        low, value = plane_wave(min(left, right), min(below, above), np.float32(step), quadratic)
        if not low < value < potential[n]:
            continue
        potential[n] = value
        soon = value < threshold
        for m, there in ((n - one, left), (n + one, right), (n - w, below), (n + w, above)):
            step = steps[m]
            if there > value + INVERSE_ROOT_2 * np.float32(step) and pending[m] == 0 and step < obstacle:
                pending[m] = 1
                if soon:
                    following[further] = m
                    further += 1
                else:
                    over[waiting] = m
                    waiting += 1
    return further, waiting


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = Field(np.zeros(25, np.uint8), np.zeros(25, np.float32), np.zeros(25, np.uint8), 5, 2)
    prepare(np.zeros((3, 3), np.uint8), np.ones(256, np.uint8), True, field)
    spread(field, tuple(np.zeros(25, np.uint32) for _ in range(3)), 0, Wave(-1, 1.0, True))
