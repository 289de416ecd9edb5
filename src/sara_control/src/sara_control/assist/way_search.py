"""A short way that leads on where the rider wants to go: best-first search over arcs and turns in place.

The way is to get `look` metres on in the direction of the wish. Arcs cost their length, more where room is short, and
what they bend otherwise than wished; so the way stays the rider's where it can, leads square through doors, along walls
and round what stands before them. States are told apart by cell and heading (hybrid A*, Dolgov et al. 2010).
"""

from __future__ import annotations

import heapq
import math
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_control.assist.local_grid import Field, LocalGrid, Outline, field_of, gap, outline_of
from sara_control.assist.rollouts import Wish, may_go

BENDS = (0.0, 0.7, -0.7, 1.9, -1.9)
"""1/m, of arcs."""
ARC, LOOKS = 0.21, 3
"""m of an arc, and how often the gap is looked at on it."""
TURN, TURN_COST = 0.4, 0.5
"""rad of a turn in place; m of way that it costs."""
STEADY = 0.3
"""How much bending otherwise than before counts, of what bending otherwise than asked does."""
BENT_ARCS = 3
"""Arcs for which a stick that is held aside bends the way."""
GREED = 2.0
"""How many times as much as the way behind the way left counts."""
STATES = 450
"""Kept until the search ends with the best it has."""
CELL, HEADINGS = 0.1, 24
"""m, and headings of a circle, by which states are told apart."""
SLOTS = 1 << 13


class Weights(NamedTuple):
    """margin, clear: m, see AssistConfig. room: m of way that lack of room costs per m. effort: m that bending otherwise
    costs per rad. lost: m that costs a metre of what was asked for and is not reached.
    """

    margin: float
    clear: float
    room: float
    effort: float
    lost: float


class Way(NamedTuple):
    """poses: (n, 3) m, rad from where the body is; moves: (n - 1, 2) m (negative astern) and rad, a turn in place has no
    length. progress: m towards where the wish leads. nearest: m, least gap on the first part.
    """

    poses: np.ndarray
    moves: np.ndarray
    progress: float


@kernel
def direction_of(pose: tuple[float, float, float], wish: Wish, bends_for: float) -> tuple[float, float]:
    """Unit vector of where a wish leads."""
    along = pose[2] + wish.curvature * bends_for * 0.75
    return wish.sense * math.cos(along), wish.sense * math.sin(along)


@kernel
def search(
    field: Field, outline: Outline, pose: tuple[float, float, float], wish: Wish, last: float, weights: Weights
) -> Way:
    """The Way from a pose (m, rad) that leads `wish.look` m on, or as far as any; last: curvature (1/m) driven now."""
    states, moves = np.empty((STATES, 3)), np.zeros((STATES, 2))
    parents, spent, gaps, depth = np.full(STATES, -1), np.zeros(STATES), np.empty(STATES), np.zeros(STATES, np.int64)
    seen, best = np.full(SLOTS, -1, np.int64), np.empty(SLOTS)
    states[0, 0], states[0, 1], states[0, 2] = pose
    gaps[0] = gap(field, outline, pose[0], pose[1], pose[2])
    ux, uy = direction_of(pose, wish, 0.6)
    heap, count = [(GREED * wish.look, 0)], 1
    end, least = 0, weights.lost * wish.look
    while len(heap) > 0 and count < STATES - len(BENDS) - 2:
        _, n = heapq.heappop(heap)
        x, y, yaw = states[n, 0], states[n, 1], states[n, 2]
        left = wish.look - ((x - pose[0]) * ux + (y - pose[1]) * uy)
        if left <= 0.0:
            end = n
            break
        if spent[n] + weights.lost * left < least - 1e-6:
            end, least = n, spent[n] + weights.lost * left
        before = last if n == 0 else moves[n, 1] / ARC if moves[n, 0] != 0.0 else 0.0
        turned = n > 0 and moves[n, 0] == 0.0
        asked = wish.curvature if depth[n] < BENT_ARCS else 0.0
        for option in range(len(BENDS) + 2):
            length, turn, cost = _option(option, wish.sense, asked, before, weights)
            if turned and length == 0.0:
                if moves[n, 1] * turn < 0.0:
                    continue
                cost *= 0.5
            heading, total = yaw + 0.5 * turn, spent[n] + cost
            to_x, to_y, to_yaw = x + length * math.cos(heading), y + length * math.sin(heading), yaw + turn
            key = _key(to_x - pose[0], to_y - pose[1], to_yaw)
            at = _slot(seen, key)
            if seen[at] == key and best[at] <= total:
                continue
            lack, here = _lack(field, outline, states[n], gaps[n], (length, turn), weights)
            total += weights.room * lack
            if seen[at] == key and best[at] <= total or lack == np.inf:
                continue
            seen[at], best[at] = key, total
            states[count, 0], states[count, 1], states[count, 2] = to_x, to_y, to_yaw
            moves[count, 0], moves[count, 1] = length, turn
            parents[count], spent[count], gaps[count], depth[count] = n, total, here, depth[n] + 1
            ahead = wish.look - ((to_x - pose[0]) * ux + (to_y - pose[1]) * uy)
            heapq.heappush(heap, (total + GREED * max(ahead, 0.0), count))
            count += 1
    return _traced(states, moves, parents, end, (ux, uy))


@kernel
def _option(option, sense, asked, before, weights):
    """(m, rad, m that it costs in the open) of an arc, or of a turn in place. asked, before: 1/m, what the rider bends
    and what was bent before.
    """
    if option >= len(BENDS):
        return 0.0, TURN if option == len(BENDS) else -TURN, TURN_COST
    bend = BENDS[option]
    other = weights.effort * ARC * (abs(bend - asked) + STEADY * abs(bend - before))
    return sense * ARC, bend * ARC, ARC + other


@kernel
def _lack(field, outline, state, before, move, weights):
    """(m, weighed by how much room is lacking, of a move (m, rad) from a state; gap at its end); inf where it is not
    free.
    """
    x, y, yaw, lack, here = state[0], state[1], state[2], 0.0, before
    step, turn = move[0] / LOOKS, move[1] / LOOKS
    for _ in range(LOOKS):
        x, y, yaw = x + step * math.cos(yaw + 0.5 * turn), y + step * math.sin(yaw + 0.5 * turn), yaw + turn
        then = gap(field, outline, x, y, yaw)
        if not may_go(then, here, weights.margin):
            return np.inf, here
        here = then
        share = max(0.0, 1.0 - here / weights.clear)
        lack += share * share * abs(step)
    return lack, here


@kernel
def _key(dx, dy, yaw):
    heading = int(round(yaw * HEADINGS / (2.0 * math.pi))) % HEADINGS
    return (np.int64(math.floor(dx / CELL) + 1000) * 4000 + np.int64(math.floor(dy / CELL) + 1000)) * HEADINGS + heading


@kernel
def _slot(seen, key):
    at = (key * 2654435761) % SLOTS
    while seen[at] >= 0 and seen[at] != key:
        at = (at + 1) % SLOTS
    return at


@kernel
def _traced(states, moves, parents, end, direction):
    count, at = 1, end
    while parents[at] >= 0:
        count, at = count + 1, parents[at]
    poses, steps = np.empty((count, 3)), np.empty((count - 1, 2))
    at = end
    for k in range(count - 1, -1, -1):
        poses[k] = states[at]
        if k > 0:
            steps[k - 1] = moves[at]
        at = parents[at]
    dx, dy = poses[count - 1, 0] - poses[0, 0], poses[count - 1, 1] - poses[0, 1]
    return Way(poses, steps, dx * direction[0] + dy * direction[1])


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = field_of(LocalGrid(np.zeros((3, 3), bool), 0.1, 0.0, 0.0), 0.2)
    search(field, outline_of(1.0, 0.5, 0.1), (0.0, 0.0, 0.0), Wish(1.0, 0.1, 1.0), 0.1, Weights(*(0.1,) * 5))
