"""What a drive passed of a map's walls and doors, and whether a map that was made of it shows them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sara_lab.judge.walls import MAPPED, STRAY, aligned, faces, occupied_points, placed
from sara_nav.maps.map_io import FREE, OCCUPIED, GridMap

REACH = 2.4
"""m from base_link up to which a wall was passed; nine ultrasonic sensors are believed that far."""
STEEPEST = math.radians(60.0)
"""Between a wall's normal and the way to the robot."""
PLACES = 0.2
"""m between places of a drive that are looked from."""
SPACING = 0.04
"""m along a line of sight."""
DOOR = (0.75, 0.85)
"""m that a door is wide."""
DEEP = 0.30
"""m that the wall about a door is thick at most."""
SPARE = 0.10
"""m at each side of a door that may be occupied: a body of 0.58 m passes between."""

Pose = tuple[float, float, float]


def _normals(occupied: np.ndarray, grid: GridMap, points: np.ndarray) -> np.ndarray:
    """(n, 2) unit vectors from points on faces of the true map to its free side."""
    g = grid.geometry
    x, y = (points[:, 0] - g.origin_x) / g.resolution, (points[:, 1] - g.origin_y) / g.resolution
    across = np.abs(x - np.round(x)) < 1e-6  # on a face between columns
    dx, dy = np.where(across, 0.5, 0.0), np.where(across, 0.0, 0.5)
    padded = np.pad(occupied, 1)
    after = padded[np.floor(y + dy).astype(int) + 1, np.floor(x + dx).astype(int) + 1]
    sign = np.where(after, -1.0, 1.0)
    return np.stack((2.0 * dx * sign, 2.0 * dy * sign), 1)


class SeenWalls:
    """A map's true walls, and which of them are seen. `points` (n, 2) m: places on the walls; `normals`: to the free
    side of each.
    """

    def __init__(self, true: GridMap):
        self._occupied, self._geometry = true.data == OCCUPIED, true.geometry
        self.points = faces(self._occupied, true.geometry)
        self.normals, self._tree = _normals(self._occupied, true, self.points), cKDTree(self.points)

    def seen_from(self, place: np.ndarray, reach: float = REACH) -> np.ndarray:
        """Numbers of the points within reach (m) of a place (x, y), in line of sight and no steeper than STEEPEST."""
        g = self._geometry
        near = np.array(self._tree.query_ball_point(place, reach), int)
        to = place - self.points[near]
        near = near[(to * self.normals[near]).sum(1) > math.cos(STEEPEST) * np.hypot(*to.T)]
        shares = np.linspace(0.0, 1.0, round(reach / SPACING) + 1)[:, None, None]
        ends = self.points[near] + 0.1 * g.resolution * self.normals[near]
        sight = (1.0 - shares) * ends + shares * place
        column = np.floor((sight[..., 0] - g.origin_x) / g.resolution).astype(int).clip(0, g.width - 1)
        row = np.floor((sight[..., 1] - g.origin_y) / g.resolution).astype(int).clip(0, g.height - 1)
        return near[~self._occupied[row, column].any(0)]


def passed(true: GridMap, poses: np.ndarray) -> np.ndarray:
    """(n, 2) m: places on a map's true walls that are seen from the robot's true places (m, 2 or more)."""
    walls = SeenWalls(true)
    seen = np.zeros(len(walls.points), bool)
    for place in np.unique(np.round(poses[:, :2] / PLACES), axis=0) * PLACES:
        seen[walls.seen_from(place)] = True
    return walls.points[seen]


class Door(NamedTuple):
    """Its middle, m; along: 0 where its wall runs along x, 1 along y; wide and deep, m."""

    x: float
    y: float
    along: int
    wide: float
    deep: float


def doors(true: GridMap) -> list[Door]:
    """Gaps as wide as a DOOR between the ends of two walls no thicker than DEEP."""
    g, found = true.geometry, []
    for along in (0, 1):
        lines = (true.data == OCCUPIED) if along == 0 else (true.data == OCCUPIED).T
        gaps: dict[tuple[int, int], list[int]] = {}
        for number, line in enumerate(lines):
            edges = np.flatnonzero(np.diff(line.astype(np.int8)))
            for begin, end in zip(edges, edges[1:]):
                if not line[begin + 1] and DOOR[0] <= (end - begin) * g.resolution <= DOOR[1]:
                    gaps.setdefault((int(begin), int(end)), []).append(number)
        for (begin, end), numbers in gaps.items():
            for run in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1):
                if len(run) * g.resolution <= DEEP:
                    middle = g.resolution * np.array((0.5 * (begin + end) + 1.0, 0.5 * (run[0] + run[-1]) + 0.5))
                    x, y = middle if along == 0 else middle[::-1]
                    wide, deep = (end - begin) * g.resolution, len(run) * g.resolution
                    found.append(Door(float(x) + g.origin_x, float(y) + g.origin_y, along, wide, deep))
    return found


def _inside(door, points, spare, before):
    x, y = points[:, 0] - door.x, points[:, 1] - door.y
    u, v = (x, y) if door.along == 0 else (y, x)
    return (np.abs(u) < 0.5 * door.wide - spare) & (np.abs(v) < 0.5 * door.deep + before)


class MapErrors(NamedTuple):
    """pose: (x, y, yaw) of the map's frame in the true one, by its walls. pose_rms: m, of the robot's places. median,
    p95: m of occupied cells off the next wall. mapped: share of the walls passed. false: occupied cells that are no
    walls, for each free cell. doors, shut: that the robot went through, and those of them that the map has shut.
    """

    pose: Pose
    pose_rms: float
    median: float
    p95: float
    mapped: float
    false: float
    doors: int
    shut: int


def judged(made: GridMap, places: np.ndarray, true: GridMap, poses: np.ndarray) -> MapErrors:
    """The MapErrors of a map that was made. places (n, 2), m: of the robot in it; poses (n, 2 or more): where the robot
    truly was then.
    """
    walls, points = cKDTree(faces(true.data == OCCUPIED, true.geometry)), occupied_points(made)
    first = laid_on(places, poses[:, :2])
    pose = aligned(points, walls, first) if len(points) else first
    there = placed(points, pose)
    off = walls.query(there)[0] if len(points) else np.array([math.inf])
    near = cKDTree(there).query(passed(true, poses))[0] if len(points) else np.array([math.inf])
    rms = float(np.sqrt((np.hypot(*(placed(places, pose) - poses[:, :2]).T) ** 2).mean()))
    through = [door for door in doors(true) if _inside(door, poses[:, :2], 0.0, 0.0).any()]
    shut = sum(bool(_inside(door, there, SPARE, SPARE).any()) for door in through)
    strays = float((off > STRAY).sum() / max((made.data == FREE).sum(), 1))
    return MapErrors(
        pose,
        rms,
        float(np.median(off)),
        float(np.percentile(off, 95)),
        float((near <= MAPPED).mean()),
        strays,
        len(through),
        shut,
    )


def laid_on(places: np.ndarray, others: np.ndarray) -> Pose:
    """The pose (x, y, yaw) of the frame of places (n, 2) in that of others, by which they are nearest to these, one to
    one (least squares).
    """
    a, b = places.mean(0), others.mean(0)
    H = (places - a).T @ (others - b)
    yaw = math.atan2(H[0, 1] - H[1, 0], H[0, 0] + H[1, 1])
    c, s = math.cos(yaw), math.sin(yaw)
    return float(b[0] - c * a[0] + s * a[1]), float(b[1] - s * a[0] - c * a[1]), yaw
