"""What a plan asks for, in the order it is to be driven: legs forward or in reverse, and turns in place between them.

A plan is (n, 3): x, y and the robot's yaw. Against the yaw it is driven in reverse; rows at one place with other yaws
are a turn in place, whose rows add up to the way round that was planned. A plan whose yaw has nothing to do with its
direction (the peers' planners do not plan it) is driven forward. Its last row is the goal, whose yaw is nobody's
direction.
"""

import math
from dataclasses import dataclass

import numpy as np

from sara_common.planar import wrap
from sara_common.repeatable import directions

SAME_PLACE = 0.005
"""Rows nearer to each other than this (m) are at one place."""
SHORTEST_LEG = 0.01
SMALLEST_TURN = 0.01
CORNER_REACH = 0.15
"""A bend within this way (m) is a corner: what is sharper than ``corner_angle`` there is driven as stop, turn, go."""


@dataclass(frozen=True)
class Turn:
    """Turn in place to ``yaw`` (rad); ``angle``: by how much the plan turns there, with its sense, to tell the way
    round.
    """

    yaw: float
    angle: float


@dataclass(frozen=True)
class Stretch:
    """Drive along points (n, 2) without stopping, in reverse when ``backward``. ``planned``: the plan's yaw was
    planned, too.
    """

    points: np.ndarray
    backward: bool
    planned: bool


def stages(plan: np.ndarray, corner_angle: float) -> list[Turn | Stretch]:
    """Return the list of Turn and Stretch that a plan (n, 3) is; the turn onto the goal's yaw at its end is not in
    it.
    """
    plan = np.asarray(plan, float)
    xy, yaw = plan[:, :2], plan[:, 2]
    steps = np.diff(xy, axis=0)
    length, direction = np.hypot(*steps.T), directions(steps)
    off = wrap(direction - yaw[:-1])
    turning = (length < SAME_PLACE) & ~((length > 1e-6) & (np.abs(off) < 1e-3))
    moves = ~turning
    planned = bool(np.all(np.minimum(np.abs(off[moves]), np.pi - np.abs(off[moves])) < 0.6))
    backward = (np.abs(off) > 0.5 * np.pi) & planned
    # A turn in place no sharper than a corner, between two legs the same way, is a bend of one leg.
    result, i, n = [], 0, len(steps)
    if planned:
        turning, backward = _without_small_turns(turning, backward, yaw, corner_angle)
    while i < n:
        j = i
        while j < n and turning[j] == turning[i] and (turning[i] or backward[j] == backward[i]):
            j += 1
        if turning[i]:
            angle = float(wrap(np.diff(yaw[i : j + 1])).sum())
            if planned and j < n and abs(angle) > SMALLEST_TURN:
                result.append(Turn(float(yaw[j]), angle))
        elif length[i:j].sum() > SHORTEST_LEG:
            result += [Stretch(part, bool(backward[i]), planned) for part in _split(xy[i : j + 1], corner_angle)]
        i = j
    return result


def _without_small_turns(turning, backward, yaw, corner_angle):
    """Return (turning, backward) with the turns in place of at most corner_angle that lie between legs of one sense
    taken for driving.
    """
    turning, backward = turning.copy(), backward.copy()
    i, n = 0, len(turning)
    while i < n:
        j = i
        while j < n and turning[j] == turning[i]:
            j += 1
        if (
            turning[i]
            and i > 0
            and j < n
            and backward[i - 1] == backward[j]
            and abs(wrap(np.diff(yaw[i : j + 1])).sum()) <= corner_angle
        ):
            turning[i:j], backward[i:j] = False, backward[j]
        i = j
    return turning, backward


def final_angle(plan: np.ndarray) -> float:
    """Return by how much (rad, with its sense) a plan (n, 3) turns in place at its end, 0.0 when it does not."""
    plan = np.asarray(plan, float)
    i = len(plan) - 1
    while i > 0 and math.dist(plan[i - 1, :2], plan[i, :2]) < SAME_PLACE:
        i -= 1
    return float(wrap(np.diff(plan[i:, 2])).sum())


def _split(points, corner_angle):
    """Return the parts of a polyline (n, 2) between its corners."""
    points = points[np.append(True, np.hypot(*np.diff(points, axis=0).T) > 1e-6)]
    if len(points) < 3:
        return [points]
    steps = np.diff(points, axis=0)
    along = np.append(0.0, np.hypot(*steps.T).cumsum())
    heading = np.unwrap(directions(steps))
    parts, first, k = [], 0, 1
    while k < len(heading):
        # From the vertex on, the bend that comes within reach; the corner is put where the sharpest part of it is.
        last = int(np.searchsorted(along[:-1], along[k] + CORNER_REACH, side='right')) - 1
        if abs(heading[last] - heading[k - 1]) > corner_angle:
            corner = k + int(np.argmax(np.abs(np.diff(heading[k - 1 : last + 1]))))
            if along[corner] - along[first] > SHORTEST_LEG:
                parts.append((first, corner))
                first = corner
            k = last + 1
        else:
            k += 1
    if along[-1] - along[first] > SHORTEST_LEG or not parts:
        parts.append((first, len(points) - 1))
    return [_straight_ends(points[a : b + 1], along[a : b + 1], a > 0, b < len(points) - 1) for a, b in parts]


def _straight_ends(points, along, first, last):
    """Return the points (n, 2) without those next to a corner at either end: a corner that is rounded off leaves no
    bend to the legs.
    """
    keep = np.ones(len(points), bool)
    if first:
        keep[1:-1] &= along[1:-1] > along[0] + 0.5 * CORNER_REACH
    if last:
        keep[1:-1] &= along[1:-1] < along[-1] - 0.5 * CORNER_REACH
    return points[keep]
