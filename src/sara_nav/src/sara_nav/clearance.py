"""How much room there is beside and before a robot at poses on its way: gaps between its outline and what a costmap shows.

The gap is the least distance from the footprint's outline to the edge of an obstacle's cell. What lies ahead is reckoned as range
sensors with wide cones see it: all that is within an angle of the way ahead counts as if it stood straight ahead at that distance, since an
echo does not say where in the cone it comes from.
"""
import math
from dataclasses import dataclass

import numpy as np
from ahead_of_time import kernel

LETHAL, UNKNOWN = 254, 255


@dataclass(frozen=True)
class Room:
    """Room at poses (n,): ``gap`` m, +Inf where nothing is near; ``x``, ``y`` (m, robot's frame) of what is nearest; ``ahead`` m before
    the leading edge, +Inf where nothing is."""

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
    sense = -1.0 if backward else 1.0
    front = float((sense * world.footprint[:, 0]).max())
    span = 0.6 * float(np.abs(world.footprint[:, 1]).max())  # over which the leading edge looks straight ahead
    edge = 0.5 * float(g.resolution)
    gap, x, y, ahead = _room(world.costmap.costs, float(g.origin_x), float(g.origin_y), float(g.resolution), world.footprint, poses,
                             world.unknown_blocks, sense, front, span, math.tan(angle), float(reach))
    return Room(np.maximum(gap - edge, 0.0), x, y, np.maximum(ahead - edge, 0.0))


def place_of(x, y, footprint):
    """Return where about the robot a point (m, robot's frame) is: 'front left', 'right', ..."""
    half_x, half_y = float(np.abs(footprint[:, 0]).max()), float(np.abs(footprint[:, 1]).max())
    # Beside the middle two thirds of the length is a side, before the middle two thirds of the width the front.
    along = 0 if abs(x) < 0.67 * half_x else (1 if x > 0.0 else -1)
    across = 0 if abs(y) < 0.67 * half_y else (1 if y > 0.0 else -1)
    if along == 0 and across == 0:
        along, across = (1 if x > 0.0 else -1), 0
    return {(1, 0): 'front', (1, 1): 'front left', (0, 1): 'left', (-1, 1): 'rear left', (-1, 0): 'rear', (-1, -1): 'rear right',
            (0, -1): 'right', (1, -1): 'front right'}[along, across]


@kernel
def _room(costs, origin_x, origin_y, resolution, corners, poses, unknown_blocks, sense, front, span, slope, reach):
    height, width = costs.shape
    n, k = len(poses), len(corners)
    gap, ahead = np.full(n, np.inf), np.full(n, np.inf)
    near_x, near_y = np.zeros(n), np.zeros(n)
    radius = 0.0
    for j in range(k):
        radius = max(radius, math.hypot(corners[j, 0], corners[j, 1]))
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
            if 0 < row < height - 1 and 0 < column < width - 1 and costs[row - 1, column] >= LETHAL and costs[row + 1, column] >= LETHAL and \
                    costs[row, column - 1] >= LETHAL and costs[row, column + 1] >= LETHAL:
                continue  # inside an obstacle
            wx, wy = origin_x + (column + 0.5) * resolution, origin_y + (row + 0.5) * resolution
            for i in range(n):
                dx, dy = wx - poses[i, 0], wy - poses[i, 1]
                if dx * dx + dy * dy > margin * margin:
                    continue
                c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
                bx, by = c * dx + s * dy, c * dy - s * dx
                beyond = sense * bx - front
                if beyond > 0.0:
                    beside = max(abs(by) - span, 0.0)
                    if beside <= slope * beyond:
                        ahead[i] = min(ahead[i], math.hypot(beyond, beside))
                squared, inside = np.inf, False
                for j in range(k):
                    ax, ay = corners[j, 0], corners[j, 1]
                    ex, ey = corners[(j + 1) % k, 0] - ax, corners[(j + 1) % k, 1] - ay
                    along = ((bx - ax) * ex + (by - ay) * ey) / max(ex * ex + ey * ey, 1e-12)
                    along = min(max(along, 0.0), 1.0)
                    squared = min(squared, (bx - ax - along * ex) ** 2 + (by - ay - along * ey) ** 2)
                    if (ay > by) != (ay + ey > by) and bx < ex * (by - ay) / ey + ax:
                        inside = not inside
                distance = -math.sqrt(squared) if inside else math.sqrt(squared)
                if distance < gap[i] and distance <= reach:
                    gap[i], near_x[i], near_y[i] = distance, bx, by
    return gap, near_x, near_y, ahead


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    corners = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])
    _room(np.zeros((3, 3), np.uint8), 0.0, 0.0, 1.0, corners, np.zeros((1, 3)), True, 1.0, 1.0, 1.0, 1.0, 1.0)
