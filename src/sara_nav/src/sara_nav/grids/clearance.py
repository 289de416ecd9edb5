"""How much room there is beside and before a robot at poses on its path: gaps between its outline and what a costmap
shows.

The gap is the least distance from the footprint's outline to the edge of an obstacle's cell. What lies ahead is taken
as range sensors with wide cones see it: all that is within an angle of straight ahead counts as if it stood straight
ahead at that distance, since an echo does not say where in the cone it comes from. Walls along which the robot drives
do not count: they send no echo back.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_nav.grids.collision import Ground, LocalWorld, blocks
from sara_nav.grids.grid import LETHAL, Grid

GAP, NEAR_X, NEAR_Y, AHEAD = 0, 1, 2, 3
"""Rows of what ``gaps`` finds; see Room."""
WALL_BEHIND = (0.2, 0.4)
"""m towards the robot at which a wall must go on that it drives along."""
CONVERGING, DIVERGING = math.tan(math.radians(10.0)), math.tan(math.radians(30.0))
"""Such a wall comes nearer to the path, or goes away from it, by no more than this (m/m). At the edge of a cone, 30 deg
off, a parallel wall is met at 60 deg; beyond, smooth walls send no echo back."""


@dataclass(frozen=True)
class Room:
    """Room at poses (n,): ``gap`` m, +Inf where nothing is near; ``x``, ``y`` (m, robot's frame) of what is nearest;
    ``ahead`` m before the leading edge, +Inf where nothing is.
    """

    gap: np.ndarray
    x: np.ndarray
    y: np.ndarray
    ahead: np.ndarray


class Ahead(NamedTuple):
    """What counts as ahead, and how far is looked."""

    sense: float
    """1.0, or -1.0 when the rear leads."""
    front: float
    """m of the leading edge before the origin; see ``lead``."""
    span: float
    """m to each side over which one looks straight ahead; see ``lead``."""
    slope: float
    """Tangent of half the angle that counts as ahead."""
    reach: float
    """m from the outline up to which gaps are found."""


def room(world: LocalWorld, poses: np.ndarray, backward: bool, angle: float, reach: float) -> Room:
    """Return the Room of a LocalWorld at poses (n, 3) of the global frame.

    backward: the rear leads. angle (rad): half the width of what counts as ahead. reach (m): how far is looked.
    """
    poses = np.ascontiguousarray(world.to_local(poses))
    front, span = lead(world.footprint, backward)
    ahead = Ahead(-1.0 if backward else 1.0, front, span, math.tan(angle), float(reach))
    return Room(*gaps(world.ground, world.footprint, poses, ahead))


def lead(footprint: np.ndarray, backward: bool) -> tuple[float, float]:
    """Return how far (m) the edge of a footprint (k, 2) that leads is before its origin, and over how much of it, on
    each side, one looks straight ahead.
    """
    return _lead(footprint.tobytes(), bool(backward))


@functools.lru_cache(maxsize=32)
def _lead(footprint, backward):
    corners = np.frombuffer(footprint).reshape(-1, 2)
    return float(((-1.0 if backward else 1.0) * corners[:, 0]).max()), 0.6 * float(np.abs(corners[:, 1]).max())


def place_of(x: float, y: float, footprint: np.ndarray) -> str:
    """Return where about the robot a point (m, robot's frame) is: 'front left', 'right', ..."""
    half_x, half_y = float(np.abs(footprint[:, 0]).max()), float(np.abs(footprint[:, 1]).max())
    # Beside the middle two thirds of the length is a side, before the middle two thirds of the width the front.
    along = 0 if abs(x) < 0.67 * half_x else (1 if x > 0.0 else -1)
    across = 0 if abs(y) < 0.67 * half_y else (1 if y > 0.0 else -1)
    if along == 0 and across == 0:
        along, across = (1 if x > 0.0 else -1), 0
    return {
        (1, 0): 'front',
        (1, 1): 'front left',
        (0, 1): 'left',
        (-1, 1): 'rear left',
        (-1, 0): 'rear',
        (-1, -1): 'rear right',
        (0, -1): 'right',
        (1, -1): 'front right',
    }[along, across]


@kernel
def gaps(
    ground: Ground, corners: np.ndarray, poses: np.ndarray, ahead: Ahead
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return a Room's gap, x, y and ahead (n,) at poses (n, 3) of the costmap's frame.

    ground: a Ground (collision.py). corners: the footprint's (k, 2), m. ahead: an Ahead.
    """
    costs = ground.costs
    origin_x, origin_y, resolution = ground.grid
    height, width = costs.shape
    n = len(poses)
    found = np.zeros((4, n))
    found[GAP] = found[AHEAD] = np.inf
    body, radius = _edges(corners)
    box = corners[:, 0].min(), corners[:, 0].max(), corners[:, 1].min(), corners[:, 1].max()
    cosines, sines = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    margin = radius + ahead.reach
    x0 = max(int((poses[:, 0].min() - margin - origin_x) / resolution), 0)
    x1 = min(int((poses[:, 0].max() + margin - origin_x) / resolution), width - 1)
    y0 = max(int((poses[:, 1].min() - margin - origin_y) / resolution), 0)
    y1 = min(int((poses[:, 1].max() + margin - origin_y) / resolution), height - 1)
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            if not _is_edge(costs, ground.unknown_blocks, column, row):
                continue
            wx, wy = origin_x + (column + 0.5) * resolution, origin_y + (row + 0.5) * resolution
            for i in range(n):
                dx, dy = wx - poses[i, 0], wy - poses[i, 1]
                if dx * dx + dy * dy > margin * margin:
                    continue
                c, s = cosines[i], sines[i]
                point = c * dx + s * dy, c * dy - s * dx
                distance = _distance_ahead(point, ahead)
                if distance < found[AHEAD, i] and not _along_wall(ground, (wx, wy, c, s), point[1], ahead):
                    found[AHEAD, i] = distance
                _look_beside(found, i, point, body, box, ahead.reach)
    for i in range(n):  # to the edge of the cell, not to its middle
        found[GAP, i] = max(found[GAP, i] - 0.5 * resolution, 0.0)
        found[AHEAD, i] = max(found[AHEAD, i] - 0.5 * resolution, 0.0)
    return found[GAP], found[NEAR_X], found[NEAR_Y], found[AHEAD]


@kernel
def _is_obstacle(costs, unknown_blocks, column, row):
    """True for a cell of the costmap that shows an obstacle."""
    height, width = costs.shape
    return 0 <= row < height and 0 <= column < width and blocks(costs[row, column], unknown_blocks)


@kernel
def _is_edge(costs, unknown_blocks, column, row):
    """True for a cell of an obstacle that is not surrounded by others."""
    if not _is_obstacle(costs, unknown_blocks, column, row):
        return False
    height, width = costs.shape
    return not (
        0 < row < height - 1
        and 0 < column < width - 1
        and costs[row - 1, column] >= LETHAL
        and costs[row + 1, column] >= LETHAL
        and costs[row, column - 1] >= LETHAL
        and costs[row, column + 1] >= LETHAL
    )


@kernel
def _distance_ahead(point, ahead):
    """Return how far (m) an obstacle's point (m, robot's frame) stands ahead, +Inf where it does not.

    ahead: an Ahead.
    """
    beyond, beside = ahead.sense * point[0] - ahead.front, max(abs(point[1]) - ahead.span, 0.0)
    return math.hypot(beyond, beside) if beyond > 0.0 and beside <= ahead.slope * beyond else np.inf


@kernel
def _along_wall(ground, place, offset, ahead):
    """True for a point of a wall along which the robot drives: obstacles go on from there towards the robot.

    place: x, y (m) of the point in the costmap's frame, cosine and sine of the robot's yaw there. offset: m left of the
    path. ahead: an Ahead; what it looks straight ahead at is no such wall.
    """
    if abs(offset) <= ahead.span:
        return False
    origin_x, origin_y, resolution = ground.grid
    x, y, c, s = place
    outward = math.copysign(1.0, offset)
    for back in WALL_BEHIND:
        side, farthest, goes_on = -DIVERGING * back, max(CONVERGING * back, resolution), False
        while side <= farthest and not goes_on:
            dx, dy = -ahead.sense * back, outward * side
            column = int(math.floor((x + c * dx - s * dy - origin_x) / resolution))
            row = int(math.floor((y + s * dx + c * dy - origin_y) / resolution))
            goes_on = _is_obstacle(ground.costs, ground.unknown_blocks, column, row)
            side += resolution
        if not goes_on:
            return False
    return True


@kernel
def _look_beside(found, i, point, edges, box, reach):
    """Enter an obstacle's point (m, robot's frame) into the gap in what was found (4, n) at pose i.

    edges: of ``_edges``. box: least and greatest x, least and greatest y of the outline. reach (m): see Ahead.
    """
    x, y = point
    low_x, high_x, low_y, high_y = box
    nearer = min(found[GAP, i], reach) + 1e-9
    off_x, off_y = max(low_x - x, x - high_x, 0.0), max(low_y - y, y - high_y, 0.0)
    if off_x * off_x + off_y * off_y > nearer * nearer:
        return  # no part of the outline is as near as what was found, for none is outside its box
    distance = _distance(edges, x, y)
    if distance < found[GAP, i] and distance <= reach:
        found[GAP, i], found[NEAR_X, i], found[NEAR_Y, i] = distance, x, y


@kernel
def _distance(edges, x, y):
    """Return the distance (m) of a point (m) from an outline, negative within it. edges: of ``_edges``."""
    squared, inside = np.inf, False
    for j in range(len(edges)):
        ax, ay, ex, ey, length = edges[j, 0], edges[j, 1], edges[j, 2], edges[j, 3], edges[j, 4]
        along = ((x - ax) * ex + (y - ay) * ey) / length
        along = min(max(along, 0.0), 1.0)
        squared = min(squared, (x - ax - along * ex) ** 2 + (y - ay - along * ey) ** 2)
        if (ay > y) != (ay + ey > y) and x < ex * (y - ay) / ey + ax:
            inside = not inside
    return -math.sqrt(squared) if inside else math.sqrt(squared)


@kernel
def _edges(corners):
    """Return the edges of an outline (k, 2), float64 (k, 5): where each begins, how it goes on, its length squared; and
    the outline's greatest radius.
    """
    k = len(corners)
    edges, radius = np.empty((k, 5)), 0.0
    for j in range(k):
        x, y = corners[j, 0], corners[j, 1]
        radius = max(radius, math.hypot(x, y))
        dx, dy = corners[(j + 1) % k, 0] - x, corners[(j + 1) % k, 1] - y
        edges[j, 0], edges[j, 1], edges[j, 2], edges[j, 3], edges[j, 4] = x, y, dx, dy, max(dx * dx + dy * dy, 1e-12)
    return edges, radius


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    corners = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])
    ground = Ground(np.zeros((3, 3), np.uint8), Grid(0.0, 0.0, 1.0), True)
    gaps(ground, corners, np.zeros((1, 3)), Ahead(1.0, 1.0, 1.0, 1.0, 1.0))
