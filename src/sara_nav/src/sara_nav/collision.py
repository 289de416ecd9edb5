"""What a robot's footprint meets on a costmap: the world a local planner looks at, and the peer's footprint cost."""
import functools
import math

import numpy as np
from ahead_of_time import kernel

from sara_nav import outline
from sara_nav.footprint import cover
from sara_nav.geometry import Pose2D

LETHAL, UNKNOWN = 254, 255


class LocalWorld:
    """A costmap with a robot's footprint on it.

    footprint: corners (k, 2), metres, robot's frame. ``unknown_blocks``: unknown cells are obstacles. offset: pose of
    the global frame's origin in the costmap's frame; poses are in the global frame unless a method says otherwise.
    ``points`` (n, 2): all over the footprint, robot's frame. ``shift``: the offset as (x, y, yaw).
    """

    def __init__(self, costmap, footprint, unknown_blocks=True, offset=Pose2D(0.0, 0.0, 0.0)):
        self.costmap = costmap
        self.geometry = costmap.geometry
        self.footprint = np.ascontiguousarray(footprint, dtype=np.float64)
        self.unknown_blocks = bool(unknown_blocks)
        self.offset = offset
        self.shift = (float(offset.x), float(offset.y), float(offset.yaw))
        self.points = _covering(self.footprint.tobytes(), 0.5 * costmap.geometry.resolution)

    def to_local(self, poses):
        """Return poses (n, 3) of the global frame in the costmap's frame, float64 (n, 3), yaw not wrapped."""
        poses = np.array(poses, dtype=np.float64, ndmin=2)
        o = self.offset
        if o.x == o.y == o.yaw == 0.0:
            return poses
        c, s = math.cos(o.yaw), math.sin(o.yaw)
        with np.errstate(invalid='ignore'):
            return np.column_stack([o.x + c * poses[:, 0] - s * poses[:, 1], o.y + s * poses[:, 0] + c * poses[:, 1],
                                    o.yaw + poses[:, 2]])

    def touched(self, poses):
        """Return how many of the footprint's points lie on obstacles at each pose of poses (n, 3), int64 (n,)."""
        g = self.geometry
        return touched(self.costmap.costs, float(g.origin_x), float(g.origin_y), float(g.resolution), self.points,
                       self.to_local(poses), self.unknown_blocks)

    def collides(self, pose):
        """True when the footprint at a Pose2D overlaps an obstacle or leaves the map."""
        return bool(self.touched([[pose.x, pose.y, pose.yaw]])[0] > 0)

    def worsens(self, poses):
        """True when any later pose touches more than the first: so a robot already in contact can only leave."""
        g = self.geometry
        return worsens(self.costmap.costs, float(g.origin_x), float(g.origin_y), float(g.resolution), self.points, self.to_local(poses), self.unknown_blocks)

    def footprint_cost(self, x, y, yaw):
        """Return what base_local_planner's CostmapModel says of a pose in the costmap's frame.

        The highest cost on the outline (not inside it), or -1 lethal, -2 unknown, -3 off the map, whichever comes
        first along the outline.
        """
        g = self.geometry
        return float(outline.outline_cost(self.costmap.costs, float(g.origin_x), float(g.origin_y), float(g.resolution), self.footprint, 1.0,
                                          float(x), float(y), math.cos(yaw), math.sin(yaw)))


@functools.lru_cache(maxsize=16)
def _covering(footprint, spacing):
    """Return ``cover`` of a footprint's bytes, remembered, as worlds are made many times a second."""
    return cover(np.frombuffer(footprint).reshape(-1, 2), spacing)


@kernel
def touched(costs, origin_x, origin_y, resolution, points, poses, unknown_blocks):
    """Return for each pose how many of a footprint's points lie on an obstacle (int64 (n,)).

    points: (k, 2) metres in the robot's frame; poses: (n, 3) x, y, yaw in the map's frame. Off the map counts
    as an obstacle, unknown cells do when ``unknown_blocks``.
    """
    height, width = costs.shape
    result = np.zeros(len(poses), np.int64)
    low_x, low_y, high_x, high_y, radius = _box(points)
    for i in range(len(poses)):
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        if _far_off(costs, origin_x, origin_y, resolution, unknown_blocks, poses[i, 0], poses[i, 1], c, s, low_x, low_y, high_x, high_y, radius):
            continue
        for j in range(len(points)):
            x = poses[i, 0] + c * points[j, 0] - s * points[j, 1]
            y = poses[i, 1] + s * points[j, 0] + c * points[j, 1]
            u, v = (x - origin_x) / resolution, (y - origin_y) / resolution
            if not (0.0 <= u < width and 0.0 <= v < height):  # true for NaN
                result[i] += 1
            else:
                cost = costs[int(v), int(u)]
                if cost == LETHAL or (cost == UNKNOWN and unknown_blocks):
                    result[i] += 1
    return result


@kernel
def worsens(costs, origin_x, origin_y, resolution, points, poses, unknown_blocks):
    """Return whether any later pose touches more than the first; arguments as of ``touched``."""
    counts = touched(costs, origin_x, origin_y, resolution, points, poses, unknown_blocks)
    return counts.max() > counts[0]


@kernel
def _box(points):
    """Return what points (k, 2) are within: the least and greatest x and y, and the greatest distance from the origin."""
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    squared = 0.0
    for j in range(len(points)):
        x, y = points[j, 0], points[j, 1]
        low_x, low_y, high_x, high_y = min(low_x, x), min(low_y, y), max(high_x, x), max(high_y, y)
        squared = max(squared, x * x + y * y)
    return low_x, low_y, high_x, high_y, math.sqrt(squared)


@kernel
def _far_off(costs, origin_x, origin_y, resolution, unknown_blocks, x, y, c, s, low_x, low_y, high_x, high_y, radius):
    """True when a footprint within a box (robot's frame) surely touches nothing at a pose: all of it is on the map, and no obstacle's middle
    is nearer to the box than half the diagonal of a cell. False says nothing."""
    height, width = costs.shape
    u0, u1 = (x - radius - origin_x) / resolution - 1.0, (x + radius - origin_x) / resolution + 1.0
    v0, v1 = (y - radius - origin_y) / resolution - 1.0, (y + radius - origin_y) / resolution + 1.0
    if not (u0 >= 0.0 and v0 >= 0.0 and u1 < width and v1 < height and abs(c) <= 1.0):  # true for NaN
        return False
    edge = 0.7072 * resolution
    for row in range(int(v0), int(v1) + 1):
        dy = origin_y + (row + 0.5) * resolution - y
        for column in range(int(u0), int(u1) + 1):
            cost = costs[row, column]
            if cost == LETHAL or (cost == UNKNOWN and unknown_blocks):
                dx = origin_x + (column + 0.5) * resolution - x
                along, aside = c * dx + s * dy, c * dy - s * dx
                if low_x - edge <= along <= high_x + edge and low_y - edge <= aside <= high_y + edge:
                    return False
    return True


def warm():
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs = np.zeros((3, 3), np.uint8)
    touched(costs, 0.0, 0.0, 1.0, np.zeros((1, 2)), np.zeros((1, 3)), True)
    worsens(costs, 0.0, 0.0, 1.0, np.zeros((1, 2)), np.zeros((1, 3)), True)
    outline.warm()
