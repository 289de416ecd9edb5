"""The least time in which a path is driven: from rest to rest within the limits of speed, turn rate and accelerations.

A stretch between two stops has a curvature k(s) that is known; its steps, which no turn acceleration could follow, are
rounded by a moving average so short that it moves the path by ROUNDING at most. The speed v is bound by v <= the
limit, k v <= turn rate, k v^2 <= lateral, and |dv/dt|, |d(k v)/dt| <= the accelerations. A pass forward and one
backward find the greatest such v(s) (Bobrow, Dubowsky and Gibson, IJRR 4(3), 1985). Since d(k v)/dt = k' v^2 + k dv/dt,
the turn acceleration is shared out between the two terms, by the best of SHARES. Jerk is not limited.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_lab.ideal.moves import Limits, example
from sara_nav.lattice.moves import kind_of

STEP = 0.02  # m between the points of a stretch
ROUNDING, LONGEST_ROUNDING = 0.02, 0.6  # m
SHARES = (0.5, 0.7, 0.85, 0.95)  # of the turn acceleration, for changes of curvature


@kernel
def turn_seconds(limits: Limits, turn: float) -> float:
    """s of a turn in place (rad) from rest to rest: a trapezoid or a triangle of turn rate."""
    turn, ramp = abs(turn), limits.turn**2 / limits.turn_acceleration
    if turn < ramp:
        return 2.0 * math.sqrt(turn / limits.turn_acceleration)
    return turn / limits.turn + limits.turn / limits.turn_acceleration


@kernel
def curvature(moves: np.ndarray, first: int, last: int) -> tuple[np.ndarray, float]:
    """((n,) 1/m at the middles of n equal steps along moves first..last - 1 of one kind, rounded; m of a step)."""
    length, sharpest = 0.0, 1e-6
    for k in range(first, last):
        length += abs(moves[k, 0])
        sharpest = max(sharpest, abs(moves[k, 1] / moves[k, 0]))
    count = max(4, int(math.ceil(length / STEP)))
    step, bends = length / count, np.zeros(count)
    k, passed, total = first, 0.0, 0.0
    for i in range(count):
        while k < last - 1 and passed + abs(moves[k, 0]) < (i + 0.5) * step:
            passed += abs(moves[k, 0])
            k += 1
        bends[i] = moves[k, 1] / abs(moves[k, 0])
    for k in range(first, last):
        total += moves[k, 1]
    half = int(0.5 * min(LONGEST_ROUNDING, math.sqrt(24.0 * ROUNDING / sharpest)) / step)
    rounded = np.zeros(count)
    for i in range(count):
        for j in range(i - half, i + half + 1):
            rounded[i] += bends[min(max(j, 0), count - 1)]
        rounded[i] /= 2 * half + 1
    return rounded + (total - rounded.sum() * step) / length, step


@kernel
def _greatest(bends, step, top, limits, share):
    """s along a stretch whose curvature (n,) and top speed are known, with that share of the turn acceleration."""
    count, slope = len(bends), 0.0
    square = np.zeros(count + 1)
    bend = np.zeros(count + 1)
    for i in range(1, count):
        bend[i] = max(abs(bends[i - 1]), abs(bends[i]), 1e-9)
        slope = abs(bends[i] - bends[i - 1]) / step + 1e-9
        square[i] = min(
            top**2, (limits.turn / bend[i]) ** 2, limits.lateral / bend[i], share * limits.turn_acceleration / slope
        )
    bend[0], bend[count] = max(abs(bends[0]), 1e-9), max(abs(bends[-1]), 1e-9)
    for i in range(count):
        slope = max(abs(bends[min(i + 1, count - 1)] - bends[i]), abs(bends[i] - bends[max(i - 1, 0)])) / step
        left = max(limits.turn_acceleration - slope * square[i], 0.0) / bend[i]
        square[i + 1] = min(square[i + 1], square[i] + 2.0 * step * min(limits.acceleration, left))
    for i in range(count, 0, -1):
        slope = max(abs(bends[min(i, count - 1)] - bends[i - 1]), abs(bends[i - 1] - bends[max(i - 2, 0)])) / step
        left = max(limits.turn_acceleration - slope * square[i], 0.0) / bend[i]
        square[i - 1] = min(square[i - 1], square[i] + 2.0 * step * min(limits.braking, left))
    seconds = 0.0
    for i in range(count):
        seconds += 2.0 * step / max(math.sqrt(square[i]) + math.sqrt(square[i + 1]), 1e-6)
    return seconds


@kernel
def drive_seconds(moves: np.ndarray, first: int, last: int, limits: Limits) -> float:
    """s of moves first..last - 1 (n, 2), all ahead or all astern, from rest to rest."""
    bends, step = curvature(moves, first, last)
    top = limits.ahead if moves[first, 0] > 0.0 else limits.astern
    best = np.inf
    for share in SHARES:
        best = min(best, _greatest(bends, step, top, limits, share))
    return best


@kernel
def seconds_along(moves: np.ndarray, limits: Limits) -> float:
    """s of moves (n, 2) from rest to rest; the chair stops between kinds."""
    total, first = 0.0, 0
    while first < len(moves):
        kind, last, turn = kind_of(moves[first, 0]), first, 0.0
        while last < len(moves) and kind_of(moves[last, 0]) == kind:
            turn += moves[last, 1]
            last += 1
        total += turn_seconds(limits, turn) if kind == 0 else drive_seconds(moves, first, last, limits)
        first = last
    return total


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    seconds_along(np.ones((2, 2)), example()[1])
