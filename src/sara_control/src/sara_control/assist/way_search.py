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
from sara_control.assist.local_grid import Field, LocalGrid, Outline, field_of, gap, gaps_beside, outline_of, too_near
from sara_control.assist.rollouts import BENDS_FOR, Wish, may_go

BENDS = (0.0, 0.35, -0.35, 1.6, -1.6)
"""1/m, of arcs."""
ARC, LOOKS = 0.21, 3
"""m of an arc, and how often the gap is looked at on it."""
TURN, TURN_COST = 0.4, 0.5
"""rad of a turn in place; m of way that it costs."""
STEADY = 0.3
"""How much bending otherwise than before counts, of what bending otherwise than asked does."""
LEADS = 0.75
"""Share of what the stick bends for that counts for where it leads."""
BESIDE = 2.0
"""Of ``room``, what it costs to be nearer than ``beside`` by as much as ``clear``."""
GREED = 2.0
"""How many times as much as the way behind the way left counts."""
STATES = 160
"""Kept until the search ends with the best it has."""
CELL, HEADINGS = 0.1, 24
"""m, and headings of a circle, by which states are told apart."""
SLOTS = 1 << 13


class Weights(NamedTuple):
    """margin, clear: m, see AssistConfig. beside: m to what is on the left and right. room: m of way that lack of room
    costs per m. effort: m that bending otherwise costs per rad. lost: m that a metre costs which was asked for and is
    not reached.
    """

    margin: float
    clear: float
    beside: tuple[float, float]
    room: float
    effort: float
    lost: float


class Way(NamedTuple):
    """poses: (n, 3) m, rad from where the body is. moves: (n - 1, 2) m (negative astern) and rad; a turn in place has
    no length. progress: m towards where the wish leads.
    """

    poses: np.ndarray
    moves: np.ndarray
    progress: float


class Tree(NamedTuple):
    """What was searched, an entry for each state: pose (n, 3); the move (n, 2), m and rad, that led there; the state
    before; m that the way there costs; the gap there, m; how many moves led there. `seen`, `best`: the cells that
    states fall into, and the least that a way there costs.
    """

    pose: np.ndarray
    move: np.ndarray
    parent: np.ndarray
    spent: np.ndarray
    gap: np.ndarray
    depth: np.ndarray
    seen: np.ndarray
    best: np.ndarray


class Aim(NamedTuple):
    """What is searched for: the wish; a unit vector to where it leads; the curvature (1/m) driven now; the Weights."""

    wish: Wish
    x: float
    y: float
    last: float
    weights: Weights


@kernel
def search(
    field: Field, outline: Outline, pose: tuple[float, float, float], wish: Wish, last: float, weights: Weights
) -> Way:
    """The Way from a pose (m, rad) that leads `wish.look` m on, or as far as any; last: curvature (1/m) driven now."""
    along = pose[2] + LEADS * wish.curvature * BENDS_FOR
    aim = Aim(wish, wish.sense * math.cos(along), wish.sense * math.sin(along), last, weights)
    tree = Tree(
        np.empty((STATES, 3)),
        np.zeros((STATES, 2)),
        np.full(STATES, -1),
        np.zeros(STATES),
        np.empty(STATES),
        np.zeros(STATES, np.int64),
        np.full(SLOTS, -1, np.int64),
        np.empty(SLOTS),
    )
    tree.pose[0, 0], tree.pose[0, 1], tree.pose[0, 2] = pose
    tree.gap[0] = gap(field, outline, pose[0], pose[1], pose[2])
    heap, count = [(GREED * wish.look, 0)], 1
    end, least = 0, weights.lost * wish.look
    while len(heap) > 0 and count < STATES - len(BENDS) - 2:
        _, n = heapq.heappop(heap)
        left = _left(tree, aim, n)
        if left <= 0.0:
            end = n
            break
        if tree.spent[n] + weights.lost * left < least - 1e-6:
            end, least = n, tree.spent[n] + weights.lost * left
        count = _grow(field, outline, tree, aim, (n, count), heap)
    return _traced(tree, aim, end)


@kernel
def _left(tree, aim, n):
    """m that are left of what the wish asks for at a state."""
    return aim.wish.look - ((tree.pose[n, 0] - tree.pose[0, 0]) * aim.x + (tree.pose[n, 1] - tree.pose[0, 1]) * aim.y)


@kernel
def _grow(field, outline, tree, aim, numbers, heap):
    """Adds the states that moves from state n lead to; returns how many there are. numbers: n, how many there were."""
    n, count = numbers
    turned = n > 0 and tree.move[n, 0] == 0.0
    for option in range(len(BENDS) + 2):
        length, turn, cost = _option(tree, aim, n, option)
        if turned and length == 0.0:
            if tree.move[n, 1] * turn < 0.0:
                continue
            cost *= 0.5
        total, heading, yaw = tree.spent[n] + cost, tree.pose[n, 2] + 0.5 * turn, tree.pose[n, 2] + turn
        x, y = tree.pose[n, 0] + length * math.cos(heading), tree.pose[n, 1] + length * math.sin(heading)
        key = _key(x - tree.pose[0, 0], y - tree.pose[0, 1], yaw)
        at = _slot(tree.seen, key)
        if tree.seen[at] == key and tree.best[at] <= total:
            continue
        lack, here = _lack(
            field,
            outline,
            (tree.pose[n, 0], tree.pose[n, 1], tree.pose[n, 2], tree.gap[n]),
            (length, turn),
            aim.weights,
        )
        total += aim.weights.room * lack
        if lack == np.inf or tree.seen[at] == key and tree.best[at] <= total:
            continue
        tree.seen[at], tree.best[at] = key, total
        tree.pose[count, 0], tree.pose[count, 1], tree.pose[count, 2] = x, y, yaw
        tree.move[count, 0], tree.move[count, 1] = length, turn
        tree.parent[count], tree.spent[count], tree.gap[count], tree.depth[count] = n, total, here, tree.depth[n] + 1
        heapq.heappush(heap, (total + GREED * max(_left(tree, aim, count), 0.0), count))
        count += 1
    return count


@kernel
def _option(tree, aim, n, option):
    """(m, rad, m that it costs in the open) of an arc, or of a turn in place, from state n."""
    if option >= len(BENDS):
        return 0.0, TURN if option == len(BENDS) else -TURN, TURN_COST
    bend = BENDS[option]
    before = aim.last if n == 0 else tree.move[n, 1] / ARC if tree.move[n, 0] != 0.0 else 0.0
    asked = aim.wish.curvature if tree.depth[n] * ARC < BENDS_FOR - 1e-6 else 0.0
    other = aim.weights.effort * ARC * (abs(bend - asked) + STEADY * abs(bend - before))
    return aim.wish.sense * ARC, bend * ARC, ARC + other


@kernel
def _lack(field, outline, state, move, weights):
    """(m of a move (m, rad) weighed by how much room is lacking, gap at its end); inf where it is not free. state: the
    pose it begins at and the gap there.
    """
    x, y, yaw, here = state
    lack, step, turn = 0.0, move[0] / LOOKS, move[1] / LOOKS
    for _ in range(LOOKS):
        x, y, yaw = x + step * math.cos(yaw + 0.5 * turn), y + step * math.sin(yaw + 0.5 * turn), yaw + turn
        gaps = gaps_beside(field, outline, x, y, yaw)
        then = min(gaps)
        if not may_go(then, here, weights.margin):
            return np.inf, here
        here = then
        share = max(0.0, 1.0 - here / weights.clear)
        lack += (share * share + BESIDE * too_near(gaps, weights.beside) / weights.clear) * abs(step)
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
def _traced(tree, aim, end):
    """The Way to a state."""
    count, at = 1, end
    while tree.parent[at] >= 0:
        count, at = count + 1, tree.parent[at]
    poses, moves = np.empty((count, 3)), np.empty((count - 1, 2))
    at = end
    for k in range(count - 1, -1, -1):
        poses[k] = tree.pose[at]
        if k > 0:
            moves[k - 1] = tree.move[at]
        at = tree.parent[at]
    return Way(poses, moves, aim.wish.look - _left(tree, aim, end))


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    field = field_of(LocalGrid(np.zeros((3, 3), bool), 0.1, 0.0, 0.0), 0.2)
    weights = Weights(0.1, 0.1, (0.0, 0.1), 0.1, 0.1, 0.1)
    search(field, outline_of(1.0, 0.5, 0.1), (0.0, 0.0, 0.0), Wish(1.0, 0.1, 1.0), 0.1, weights)
