"""Bends of a drive begin and end gently, where there is room: their curvature rises and falls, as on the transition
curves of roads and railways, so that a robot drives them faster.

Each of the evenly spaced poses of the drive may move to its left or right by a bound. The sum of the squared changes of
curvature is then least, as in the graduation of Whittaker (1923, On a new method of graduation): each pose has a
weight, the multiplier of its bound; rounds of weighted least squares raise it where the bound is overstepped and lower
it where there is room. Straights and arcs alone stay what they are.
"""

from __future__ import annotations

import math

import numpy as np

from ahead_of_time import kernel
from sara_common.kernels import wrap
from sara_common.planar import Pose2D
from sara_nav.lattice.body import gap, place
from sara_nav.lattice.world import World, example_world

ROUNDS = 12
LIGHTEST, FIRST, HEAVIEST, FIXED = 1e-12, 1e-6, 1e3, 1e6
"""Weights of poses, against 1 of the squared changes: the least, that of the first round, the most, of what stays."""
LOWERED, RAISED = 0.05, 20.0
"""What a weight is multiplied by in a round, at least and at most."""
THIRD = (-1.0, 3.0, -3.0, 1.0)
"""Third difference of four values."""
LEAST_BOUND = 1e-3
"""m that a pose may be moved to the outside of a bend; with a lesser bound it stays."""
NEAR = 0.4
"""m of the drive about a pose whose bends say which side is inside."""
TRIES, LESS, ABOUT = 8, 0.3, 0.6
"""How often it is tried, with bounds how many times as great within how many m of where the gap was too small."""
UNMOVED, SLIDES = 1e-6, 8e-5
"""m, by which a pose that stays may be moved, and that wheels may slide from a pose to the next."""
SPARE = 0.002
"""m by which a gap may be less than what is asked for: poses are sampled elsewhere."""


@kernel
def sampled(start: np.ndarray, moves: np.ndarray, spacing: float) -> tuple[np.ndarray, float]:
    """Return (poses (n, 3) along moves (k, 2), length m and turn rad, all ahead or all astern, from a pose (3,); m
    between two of them, at most ``spacing``).
    """
    total = 0.0
    for k in range(len(moves)):
        total += abs(moves[k, 0])
    count = max(int(math.ceil(total / spacing - 1e-9)), 1)
    step, poses = total / count, np.empty((count + 1, 3))
    begin, k, passed = Pose2D(start[0], start[1], start[2]), 0, 0.0
    for i in range(count + 1):
        while k < len(moves) - 1 and passed + abs(moves[k, 0]) < i * step:
            passed += abs(moves[k, 0])
            begin = place(begin, moves[k, 0], moves[k, 1], 1.0)
            k += 1
        there = place(begin, moves[k, 0], moves[k, 1], min((i * step - passed) / abs(moves[k, 0]), 1.0))
        poses[i, 0], poses[i, 1], poses[i, 2] = there.x, there.y, there.yaw
    return poses, step


@kernel
def shifts(bends: np.ndarray, bounds: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Return how far (n,) to the left, m, evenly spaced poses are moved. bends: (n,) m, the turn (rad) about each times
    the spacing. bounds: (n,) m, how far each may be moved to the side (n,) that ``inside`` is of, > 0 to the left.
    """
    n = len(bends)
    weights, wanted, shift = np.empty(n), np.zeros(n), np.zeros(n)
    for i in range(n):
        weights[i] = FIXED if bounds[i] < LEAST_BOUND else FIRST
    for row in range(n - 3):
        change = bends[row + 2] - bends[row + 1]
        for i in range(4):
            wanted[row + i] -= THIRD[i] * change
    changes = squared_changes(n)
    for _ in range(ROUNDS):
        shift = solved(changes, weights, wanted)
        for i in range(n):
            if weights[i] < FIXED:
                bound = bounds[i] if shift[i] * inside[i] > 0.0 else LEAST_BOUND
                factor = min(max(abs(shift[i]) / bound, LOWERED), RAISED)
                weights[i] = min(max(weights[i] * factor, LIGHTEST), HEAVIEST)
    return shift


@kernel
def inside_of(bends: np.ndarray, step: float) -> np.ndarray:
    """Return the side (n,) to which the path bends about each pose, > 0 to the left: the mean of bends within NEAR."""
    n, about = len(bends), int(NEAR / step)
    side = np.zeros(n)
    for i in range(n):
        for j in range(max(i - about, 0), min(i + about + 1, n)):
            side[i] += bends[j]
    return side


@kernel
def squared_changes(n: int) -> np.ndarray:
    """Return the matrix of the squared third differences of n values: its diagonal and the three above it, (n, 4)."""
    bands = np.zeros((n, 4))
    for row in range(n - 3):
        for i in range(4):
            for j in range(i, 4):
                bands[row + i, j - i] += THIRD[i] * THIRD[j]
    return bands


@kernel
def solved(bands: np.ndarray, weights: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return x (n,) of (A + diag(weights)) x = right, A symmetric, of which ``bands`` (n, 4) are the diagonal and the
    three above it: by the decomposition L D L' (Golub and Van Loan, Matrix Computations, 4.3). Kernels cannot call
    scipy's.
    """
    n = len(weights)
    lower, diagonal, x = np.zeros((n, 4)), np.empty(n), right.copy()  # lower[i, k]: L[i + k, i]
    for i in range(n):
        diagonal[i] = bands[i, 0] + weights[i]
        for back in range(1, min(i, 3) + 1):
            diagonal[i] -= lower[i - back, back] ** 2 * diagonal[i - back]
            x[i] -= lower[i - back, back] * x[i - back]
        for k in range(1, min(n - 1 - i, 3) + 1):
            value = bands[i, k]
            for back in range(1, min(i, 3 - k) + 1):
                value -= lower[i - back, back] * lower[i - back, back + k] * diagonal[i - back]
            lower[i, k] = value / diagonal[i]
    for i in range(n - 1, -1, -1):
        x[i] /= diagonal[i]
        for k in range(1, min(n - 1 - i, 3) + 1):
            x[i] -= lower[i, k] * x[i + k]
    return x


@kernel
def chords_of(poses: np.ndarray, sense: float) -> np.ndarray:
    """Return (n + 1,) the yaws (rad, not wrapped) along the straight lines to each of poses (n, 3) from the one before,
    and from the last to one beyond, as the path goes on there with its yaw. sense: 1.0 ahead, -1.0 astern.
    """
    n = len(poses)
    chords, yaw = np.empty(n + 1), poses[0, 2]
    for i in range(1, n):
        dx, dy = sense * (poses[i, 0] - poses[i - 1, 0]), sense * (poses[i, 1] - poses[i - 1, 1])
        yaw += wrap(math.atan2(dy, dx) - yaw)
        chords[i] = yaw
    chords[0] = 2.0 * poses[0, 2] - chords[1]
    chords[n] = chords[n - 1] + 2.0 * wrap(poses[n - 1, 2] - chords[n - 1])
    return chords


@kernel
def moved(poses: np.ndarray, shift: np.ndarray, sense: float) -> np.ndarray:
    """Return poses (n, 3) moved to their left by shift (n,), m, and turned as the path that they then lie on; the first
    and the last are only moved. sense: 1.0 ahead, -1.0 astern.
    """
    n, result = len(poses), poses.copy()
    for i in range(n):
        result[i, 0] -= math.sin(poses[i, 2]) * shift[i]
        result[i, 1] += math.cos(poses[i, 2]) * shift[i]
    chords = chords_of(result, sense)
    for i in range(1, n - 1):
        near = chords[i] + chords[i + 1]
        # A mean of two chords is off by a sixth of the second difference of headings.
        if max(abs(shift[i - 1]), abs(shift[i]), abs(shift[i + 1])) > UNMOVED:
            result[i, 2] += wrap(0.5 * near - (chords[i - 1] + chords[min(i + 2, n)] - near) / 12.0 - result[i, 2])
    return result


@kernel
def with_transitions(
    world: World, poses: np.ndarray, sense: float, step: float, law: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return (poses (n, 3) of a drive, ``step`` m apart, with bends that begin and end gently; which of them (n,) were
    moved, or follow or precede one that was). sense: as of moved.

    law: (m that a pose is moved at most, where the gap is rules.clearance or more; m, the gap from which on it may be
    moved, and that is kept). Where a gap would become less than that, and less than it was, poses are moved less.
    """
    # One pose more at each end, where the drive is thought to go on, holds its heading there. Its curvature may change,
    # for there the robot is at rest.
    n, (most, keep) = len(poses), law
    bends, bounds, gaps = np.zeros(n + 2), np.zeros(n + 2), np.empty(n)
    room, chords = max(world.rules.clearance - keep, 1e-6), chords_of(poses, sense)
    for i in range(n):
        bends[i + 1] = step * (chords[i + 1] - chords[i])
        gaps[i] = gap(world, Pose2D(poses[i, 0], poses[i, 1], poses[i, 2]), 0.0)
        if 0 < i < n - 1:
            bounds[i + 1] = most * min(max((gaps[i] - keep) / room, 0.0), 1.0)
    bends[0], bends[n + 1] = bends[1], bends[n]
    inside, about = inside_of(bends, step), int(ABOUT / step)
    for _ in range(TRIES):
        shift = shifts(bends, bounds, inside)
        found = moved(poses, sense * shift[1:-1], sense)
        again, chords = bends.copy(), chords_of(found, sense)  # moved so far, a pose turns the path by a little else
        for i in range(2, n):
            again[i] = step * (chords[i] - chords[i - 1]) - (shift[i - 1] - 2.0 * shift[i] + shift[i + 1])
        shift = sense * shifts(again, bounds, inside)[1:-1]
        found, changed = moved(poses, shift, sense), beside(shift)
        misfits = misfits_of(world, found, changed, np.minimum(gaps, keep) - SPARE)
        if not misfits.any():
            return found, changed
        for i in range(n):
            if misfits[i]:
                for j in range(max(i - about, 0), min(i + about + 1, n)):
                    bounds[j + 1] *= LESS
    return poses, np.zeros(n, np.bool_)


@kernel
def beside(shift: np.ndarray) -> np.ndarray:
    """Return which (n,) of the poses that are moved by shift (n,), m, are moved, or follow or precede one that is."""
    changed = np.zeros(len(shift), np.bool_)
    for i in range(len(shift)):
        if abs(shift[i]) > UNMOVED:
            changed[max(i - 1, 0) : i + 2] = True
    return changed


@kernel
def misfits_of(world: World, poses: np.ndarray, changed: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return which (n,) of the ``changed`` ones of poses (n, 3) have a gap of less than ``kept`` (n,), m, or are
    reached from the one before by sliding wheels alone.
    """
    found = np.zeros(len(poses), np.bool_)
    for i in range(1, len(poses)):
        if changed[i]:
            near = gap(world, Pose2D(poses[i, 0], poses[i, 1], poses[i, 2]), 0.0) < kept[i]
            found[i] = near or (changed[i - 1] and slides(poses[i - 1], poses[i]) > SLIDES)
    return found


@kernel
def slides(before: np.ndarray, after: np.ndarray) -> float:
    """Return by how much (m) a wheel that rolls by an arc from one pose (3,) would have to slide to reach another."""
    dx, dy, middle = after[0] - before[0], after[1] - before[1], 0.5 * (before[2] + after[2])
    return abs(math.cos(middle) * dy - math.sin(middle) * dx)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    poses, step = sampled(np.full(3, 0.2), np.full((2, 2), 0.01), 0.005)
    with_transitions(example_world(), poses, 1.0, step, (0.02, 0.1))
