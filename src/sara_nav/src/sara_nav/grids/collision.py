"""What a robot's footprint meets on a costmap: the world a local planner looks at, and the peer's footprint cost."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple, Protocol

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import Pose2D
from sara_nav.grids import outline, polygon
from sara_nav.grids.footprint import cover, depths
from sara_nav.grids.grid import LETHAL, UNKNOWN, Grid, GridGeometry

Box = tuple[float, float, float, float, float]
"""What points are within; see ``box_of``."""


class CostGrid(Protocol):
    """What is needed of a Costmap."""

    costs: np.ndarray
    geometry: GridGeometry


class Ground(NamedTuple):
    """A costmap as kernels take it."""

    costs: np.ndarray
    """uint8 (h, w): 254 obstacle, 255 unknown."""
    grid: Grid
    unknown_blocks: bool
    """Unknown cells count as obstacles."""


class Cover(NamedTuple):
    """A footprint as kernels take it: points all over it."""

    points: np.ndarray
    """(k, 2), m, robot's frame."""
    weights: np.ndarray
    """int64 (k,): what each counts that lies on an obstacle: 1 at the outline, one more with each spacing of the points
    that it lies deeper inside."""
    box: Box


class SlowPlaces(Protocol):
    """Where the robot drives slower."""

    def share(self, poses: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(n,) the share of the greatest speed at poses (n, 3) of a body that covers points (k, 2), m."""


class LocalWorld:
    """A costmap with a robot's footprint on it.

    footprint: corners (k, 2), metres, robot's frame. ``unknown_blocks``: unknown cells are obstacles. offset: pose of
    the global frame's origin in the costmap's frame; poses are in the global frame unless a method says otherwise.
    ``cover``: the footprint's Cover; ``radius``: of its farthest corner. ``shift``: the offset as (x, y, yaw).
    ``slow``: SlowPlaces in the costmap's frame.
    """

    def __init__(
        self,
        costmap: CostGrid,
        footprint: np.ndarray,
        unknown_blocks: bool = True,
        offset: Pose2D = Pose2D(0.0, 0.0, 0.0),
        slow: tuple[SlowPlaces, ...] = (),
    ) -> None:
        self.costmap = costmap
        self.geometry = costmap.geometry
        self.footprint = np.ascontiguousarray(footprint, dtype=np.float64)
        self.unknown_blocks = bool(unknown_blocks)
        self.offset, self.slow = offset, slow
        self.shift = (float(offset.x), float(offset.y), float(offset.yaw))
        self.cover, self.radius = _covering(self.footprint.tobytes(), 0.5 * costmap.geometry.resolution)

    @property
    def ground(self) -> Ground:
        """The costmap, for kernels."""
        return Ground(self.costmap.costs, self.geometry.grid, self.unknown_blocks)

    def to_local(self, poses: np.ndarray) -> np.ndarray:
        """Return poses (n, 3) of the global frame in the costmap's frame, float64 (n, 3), yaw not wrapped."""
        return moved(np.array(poses, dtype=np.float64, ndmin=2, order='C'), self.shift)

    def speed_share(self, poses: np.ndarray) -> np.ndarray:
        """Return the share, above 0 to 1, of the greatest speed that is allowed at each pose of poses (n, 3)."""
        shares = [places.share(self.to_local(poses), self.cover.points) for places in self.slow]
        return np.min(shares, axis=0) if shares else np.ones(len(poses))

    def touched(self, poses: np.ndarray) -> np.ndarray:
        """Return how much of the footprint lies on obstacles, and how deep, at each pose of poses (n, 3), int64 (n,):
        the sum of its Cover's weights there; 0: it touches nothing.
        """
        return touched(self.ground, self.cover, self.to_local(poses))

    def collides(self, pose: Pose2D) -> bool:
        """True when the footprint at a Pose2D overlaps an obstacle or leaves the map."""
        return bool(self.touched([[pose.x, pose.y, pose.yaw]])[0] > 0)

    def worsens(self, poses: np.ndarray) -> bool:
        """True when any later pose touches more, or deeper, than the first: so a robot already in contact can only
        leave, by the side that it came in; by any from what lies half its width inside or deeper.
        """
        return worsens(self.ground, self.cover, self.to_local(poses))

    def footprint_cost(self, x: float, y: float, yaw: float) -> float:
        """Return what base_local_planner's CostmapModel says of a pose in the costmap's frame.

        The highest cost on the outline (not inside it), or -1 lethal, -2 unknown, -3 off the map, whichever comes
        first along the outline.
        """
        placed = outline.Placed(1.0, float(x), float(y), math.cos(yaw), math.sin(yaw))
        return float(outline.outline_cost(self.costmap.costs, self.geometry.grid, self.footprint, placed))


@functools.lru_cache(maxsize=16)
def _covering(footprint, spacing):
    """Return the Cover of a footprint's bytes and the outline's radius, remembered, as worlds are made many times a
    second.
    """
    corners = np.frombuffer(footprint).reshape(-1, 2)
    points = cover(corners, spacing)
    weights = 1 + np.floor(depths(corners, points) / spacing + 1e-6).astype(np.int64)
    return Cover(points, weights, box_of(points)), float(np.hypot(*corners.T).max())


def box_of(points: np.ndarray) -> Box:
    """Return what points (k, 2) are within: the least x and y, the greatest x and y, and the greatest distance from the
    origin (five floats).
    """
    return (
        *map(float, points.min(axis=0)),
        *map(float, points.max(axis=0)),
        math.sqrt(float((points**2).sum(axis=1).max())),
    )


@kernel
def blocks(cost: int, unknown_blocks: bool) -> bool:
    """Return whether a cell of that cost is an obstacle; see Ground."""
    return cost == LETHAL or (cost == UNKNOWN and unknown_blocks)


@kernel
def moved(poses: np.ndarray, offset: tuple[float, float, float]) -> np.ndarray:
    """Return poses (n, 3) as seen in the frame in which the origin of theirs is at ``offset`` (x, y, yaw)."""
    if offset[0] == 0.0 and offset[1] == 0.0 and offset[2] == 0.0:
        return poses
    c, s = math.cos(offset[2]), math.sin(offset[2])
    result = np.empty_like(poses)
    for i in range(len(poses)):
        result[i, 0] = offset[0] + c * poses[i, 0] - s * poses[i, 1]
        result[i, 1] = offset[1] + s * poses[i, 0] + c * poses[i, 1]
        result[i, 2] = offset[2] + poses[i, 2]
    return result


@kernel
def touched(ground: Ground, cover: Cover, poses: np.ndarray) -> np.ndarray:
    """Return for each pose the sum of the weights of a Cover's points that lie on an obstacle (int64 (n,)).

    ground: a Ground. poses: (n, 3) x, y, yaw in the map's frame. Off the map counts as an obstacle.
    """
    points, weights, box = cover
    costs, unknown_blocks = ground.costs, ground.unknown_blocks
    origin_x, origin_y, resolution = ground.grid
    height, width = costs.shape
    result = np.zeros(len(poses), np.int64)
    near = _obstacles(ground, poses, box[4])
    for i in range(len(poses)):
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        if _far_off(near, ground, (poses[i, 0], poses[i, 1], c, s), box):
            continue
        for j in range(len(points)):
            x = poses[i, 0] + c * points[j, 0] - s * points[j, 1]
            y = poses[i, 1] + s * points[j, 0] + c * points[j, 1]
            u, v = (x - origin_x) / resolution, (y - origin_y) / resolution
            if not (0.0 <= u < width and 0.0 <= v < height):  # true for NaN
                result[i] += weights[j]
            else:
                if blocks(costs[int(v), int(u)], unknown_blocks):
                    result[i] += weights[j]
    return result


@kernel
def worsens(ground: Ground, cover: Cover, poses: np.ndarray) -> bool:
    """Return whether any later pose touches more than the first; arguments as of ``touched``."""
    counts = touched(ground, cover, poses)
    return counts.max() > counts[0]


@kernel
def _obstacles(ground, poses, radius):
    """Return the middles (k, 2), m, of the obstacles' cells in a window that holds all that is within a radius of any
    of the poses.
    """
    costs, unknown_blocks = ground.costs, ground.unknown_blocks
    origin_x, origin_y, resolution = ground.grid
    height, width = costs.shape
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for i in range(len(poses)):
        x, y = poses[i, 0], poses[i, 1]
        low_x, low_y, high_x, high_y = min(low_x, x), min(low_y, y), max(high_x, x), max(high_y, y)
    margin = radius + resolution
    x0, xn = (
        _within((low_x - margin - origin_x) / resolution, width),
        _within((high_x + margin - origin_x) / resolution + 1.0, width),
    )
    y0, yn = (
        _within((low_y - margin - origin_y) / resolution, height),
        _within((high_y + margin - origin_y) / resolution + 1.0, height),
    )
    found = np.empty((max(xn - x0, 0) * max(yn - y0, 0), 2))
    count = 0
    for row in range(y0, yn):
        for column in range(x0, xn):
            if blocks(costs[row, column], unknown_blocks):
                found[count, 0], found[count, 1] = (
                    origin_x + (column + 0.5) * resolution,
                    origin_y + (row + 0.5) * resolution,
                )
                count += 1
    return found[:count]


@kernel
def _within(place, cells):
    """Return the cell (int) of a place that may be anywhere, at infinity too, limited to 0..cells."""
    return int(min(max(place, 0.0), float(cells)))


@kernel
def _far_off(near, ground, pose, box):
    """True when a footprint within a box surely touches nothing at a pose (x, y, cosine and sine of the yaw): it is
    all on the map, and the middle of no obstacle near (k, 2) is nearer to the box than half the diagonal of a cell.
    False says nothing.
    """
    x, y, c, s = pose
    origin_x, origin_y, resolution = ground.grid
    height, width = ground.costs.shape
    low_x, low_y, high_x, high_y, radius = box
    u0, u1 = (x - radius - origin_x) / resolution - 1.0, (x + radius - origin_x) / resolution + 1.0
    v0, v1 = (y - radius - origin_y) / resolution - 1.0, (y + radius - origin_y) / resolution + 1.0
    if not (u0 >= 0.0 and v0 >= 0.0 and u1 < width and v1 < height and abs(c) <= 1.0):  # true for NaN
        return False
    edge = 0.7072 * resolution
    for k in range(len(near)):
        dx, dy = near[k, 0] - x, near[k, 1] - y
        along, aside = c * dx + s * dy, c * dy - s * dx
        if low_x - edge <= along <= high_x + edge and low_y - edge <= aside <= high_y + edge:
            return False
    return True


def example_cover() -> Cover:
    """Return a Cover of the types that kernels take."""
    return Cover(np.zeros((1, 2)), np.ones(1, np.int64), (0.0,) * 5)


def warm() -> None:
    """Compile, or load from the cache, every kernel for the types it is called with."""
    costs = np.zeros((3, 3), np.uint8)
    moved(np.zeros((1, 3)), (0.0, 0.0, 0.0))
    ground = Ground(costs, Grid(0.0, 0.0, 1.0), True)
    cover = example_cover()
    touched(ground, cover, np.zeros((1, 3)))
    worsens(ground, cover, np.zeros((1, 3)))
    outline.warm()
    polygon.warm()
