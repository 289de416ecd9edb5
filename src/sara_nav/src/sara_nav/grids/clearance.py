"""How much room there is beside and before a robot at poses on its way: gaps between its outline and what a costmap
shows.

The gap is the least distance from the footprint's outline to the edge of an obstacle's cell. What lies ahead is
reckoned as range
sensors with wide cones see it: all that is within an angle of the way ahead counts as if it stood straight ahead at
that distance, since an echo does not say where in the cone it comes from.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np

from ahead_of_time import kernel

LETHAL, UNKNOWN = 254, 255


@dataclass(frozen=True)
class Room:
    """Room at poses (n,): ``gap`` m, +Inf where nothing is near; ``x``, ``y`` (m, robot's frame) of what is nearest;
    ``ahead`` m before the leading edge, +Inf where nothing is.
    """

    gap: np.ndarray
    x: np.ndarray
    y: np.ndarray
    ahead: np.ndarray


def room(world, poses, backward, angle, reach):
    """Return the Room of a LocalWorld at poses (n, 3) of the global frame.

    backward: the rear leads. angle (rad): half the width of what counts as ahead. reach (m): how far is looked.
    """
    g = world.geometry
    poses = np.ascontiguousarray(world.to_local(poses))
    front, span = lead(world.footprint, backward)
    return Room(
        *gaps(
            world.costmap.costs,
            float(g.origin_x),
            float(g.origin_y),
            float(g.resolution),
            world.footprint,
            poses,
            world.unknown_blocks,
            -1.0 if backward else 1.0,
            front,
            span,
            math.tan(angle),
            float(reach),
        )
    )


def lead(footprint, backward):
    """Return how far (m) the edge of a footprint (k, 2) that leads is before its origin, and over how much of it, on
    each side, one looks straight ahead.
    """
    return _lead(footprint.tobytes(), bool(backward))


@functools.lru_cache(maxsize=32)
def _lead(footprint, backward):
    corners = np.frombuffer(footprint).reshape(-1, 2)
    return float(((-1.0 if backward else 1.0) * corners[:, 0]).max()), 0.6 * float(np.abs(corners[:, 1]).max())


def place_of(x, y, footprint):
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
def gaps(costs, origin_x, origin_y, resolution, corners, poses, unknown_blocks, sense, front, span, slope, reach):
    """Return a Room's gap, x, y and ahead (n,) at poses (n, 3) of the costmap's frame. sense: -1.0 when the rear leads.
    slope: tangent of the angle.
    """
    height, width = costs.shape
    n, k = len(poses), len(corners)
    gap, ahead = np.full(n, np.inf), np.full(n, np.inf)
    near_x, near_y = np.zeros(n), np.zeros(n)
    edges, radius = _edges(corners)
    low_x, high_x, low_y, high_y = corners[:, 0].min(), corners[:, 0].max(), corners[:, 1].min(), corners[:, 1].max()
    cosines, sines = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    margin = radius + reach
    x0 = max(int((poses[:, 0].min() - margin - origin_x) / resolution), 0)
    x1 = min(int((poses[:, 0].max() + margin - origin_x) / resolution), width - 1)
    y0 = max(int((poses[:, 1].min() - margin - origin_y) / resolution), 0)
    y1 = min(int((poses[:, 1].max() + margin - origin_y) / resolution), height - 1)
    for row in range(y0, y1 + 1):
        for column in range(x0, x1 + 1):
            cost = costs[row, column]
            if not (cost == LETHAL or (cost == UNKNOWN and unknown_blocks)):
                continue
            if (
                0 < row < height - 1
                and 0 < column < width - 1
                and costs[row - 1, column] >= LETHAL
                and costs[row + 1, column] >= LETHAL
                and costs[row, column - 1] >= LETHAL
                and costs[row, column + 1] >= LETHAL
            ):
                continue  # inside an obstacle
            wx, wy = origin_x + (column + 0.5) * resolution, origin_y + (row + 0.5) * resolution
            for i in range(n):
                dx, dy = wx - poses[i, 0], wy - poses[i, 1]
                away = dx * dx + dy * dy
                if away > margin * margin:
                    continue
                c, s = cosines[i], sines[i]
                bx, by = c * dx + s * dy, c * dy - s * dx
                beyond = sense * bx - front
                if 0.0 < beyond < ahead[i]:
                    beside = max(abs(by) - span, 0.0)
                    if beside <= slope * beyond:
                        ahead[i] = min(ahead[i], math.hypot(beyond, beside))
                nearer = min(gap[i], reach) + 1e-9
                off_x, off_y = max(low_x - bx, bx - high_x, 0.0), max(low_y - by, by - high_y, 0.0)
                if off_x * off_x + off_y * off_y > nearer * nearer:
                    continue  # no part of the outline is as near as what was found, for none is outside its box
                squared, inside = np.inf, False
                for j in range(k):
                    ax, ay, ex, ey, length = edges[j, 0], edges[j, 1], edges[j, 2], edges[j, 3], edges[j, 4]
                    along = ((bx - ax) * ex + (by - ay) * ey) / length
                    along = min(max(along, 0.0), 1.0)
                    squared = min(squared, (bx - ax - along * ex) ** 2 + (by - ay - along * ey) ** 2)
                    if (ay > by) != (ay + ey > by) and bx < ex * (by - ay) / ey + ax:
                        inside = not inside
                distance = -math.sqrt(squared) if inside else math.sqrt(squared)
                if distance < gap[i] and distance <= reach:
                    gap[i], near_x[i], near_y[i] = distance, bx, by
    for i in range(n):  # to the edge of the cell, not to its middle
        gap[i], ahead[i] = max(gap[i] - 0.5 * resolution, 0.0), max(ahead[i] - 0.5 * resolution, 0.0)
    return gap, near_x, near_y, ahead


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


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    corners = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])
    gaps(np.zeros((3, 3), np.uint8), 0.0, 0.0, 1.0, corners, np.zeros((1, 3)), True, 1.0, 1.0, 1.0, 1.0, 1.0)
