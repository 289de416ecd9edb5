"""Where somebody drives to who draws a map with ultrasonic sensors and sees it grow: each time to where the sensors
would hear most walls that have not been heard yet, for the time that it takes.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from sara_bringup.lockstep.ranges import mountings
from sara_common.planar import Pose2D, is_apart
from sara_common.platforms import chosen
from sara_lab.judge.heard_walls import HeardWalls
from sara_lab.judge.passed_walls import SeenWalls
from sara_nav.maps.map_io import FREE, GridMap
from sara_slam.exploring.cones import sensors_at
from sara_slam.exploring.frontiers import cells_of
from sara_slam.exploring.pace import Pace

Pose = tuple[float, float, float]

PASSED, ROOM = 0.36, 0.10
"""m: from walls where the chair's middle may be; about the body where it stands."""
APART, HEADINGS = 4, 16
"""Cells between places where it may stand, and its headings there."""
AGAIN = 0.5
"""What it is worth to hear a piece of a wall once more, each time."""
FINISHING, EVERYWHERE = 0.15, 1.0
"""What it is worth to hear a piece of a wall that has not been passed: what has is finished first; all rooms alike."""
FINISH_S = 240.0
"""s before its end from which on nothing else is begun."""
MOVED_M, MOVED_RAD = 0.05, 0.1
"""Between two poses from which something is heard."""
LEAST = 0.15
"""m of wall for which a place is driven to."""
PACE = Pace(0.3, 0.4, 4.0)
"""By which ways are weighed."""
AHEAD, DETOUR = 3.0, 0.1
"""m up to which a straight way counts by what is heard on it; that it may be longer than straight."""


class Survey:
    """Of a map that is driven through. `hear` is told where the chair is, `next_stop` tells where to go. `farther`:
    what it is worth to hear a piece of a wall that has not been passed.
    """

    def __init__(self, grid: GridMap, farther: float = FINISHING):
        self._grid, self._walls, self._farther = grid, HeardWalls(grid), farther
        self._mounts = np.array(list(mountings(chosen()).values()))[:, :3]
        self._clear = distance_transform_edt(grid.data == FREE) * grid.geometry.resolution
        self._graph = _neighbours(self._clear >= PASSED)
        self.stands = self._stands()
        self._row = {key: number for number, key in enumerate(self._keys(self.stands))}
        self._near = self._heard_from(self.stands)
        self._seen = SeenWalls(grid)
        self._beside = self._cells(self._seen.points + 0.3 * grid.geometry.resolution * self._seen.normals)
        self._left, self._passed = np.ones(grid.data.size), np.zeros(grid.data.size, bool)
        self._tried = np.zeros(len(self.stands), bool)
        self._last: Pose | None = None

    def _stands(self):
        """(n, 3) poses in which the body has room."""
        g, outline = self._grid.geometry, _outline()
        rows, columns = np.nonzero(self._clear >= PASSED)
        some = (rows % APART == 0) & (columns % APART == 0)
        x = g.origin_x + g.resolution * (columns[some] + 0.5)
        y = g.origin_y + g.resolution * (rows[some] + 0.5)
        found = []
        for heading in np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS):
            c, s = math.cos(heading), math.sin(heading)
            px = x[:, None] + c * outline[:, 0] - s * outline[:, 1]
            py = y[:, None] + s * outline[:, 0] + c * outline[:, 1]
            column = ((px - g.origin_x) / g.resolution).astype(int).clip(0, g.width - 1)
            row = ((py - g.origin_y) / g.resolution).astype(int).clip(0, g.height - 1)
            fits = (self._clear[row, column] >= ROOM).all(1)
            found.append(np.stack((x[fits], y[fits], np.full(int(fits.sum()), heading)), 1))
        return np.concatenate(found)

    def _keys(self, poses):
        """(place, heading) each, as numbers that are the same for poses near by."""
        g = self._grid.geometry
        column = np.floor((poses[:, 0] - g.origin_x) / (APART * g.resolution)).astype(int)
        row = np.floor((poses[:, 1] - g.origin_y) / (APART * g.resolution)).astype(int)
        heading = np.round(poses[:, 2] * HEADINGS / (2.0 * math.pi)).astype(int) % HEADINGS
        return zip(column.tolist(), row.tolist(), heading.tolist())

    def _heard_from(self, poses):
        """Sparse (poses, cells): 1 where a wall beside that free cell is heard."""
        g, count = self._grid.geometry, len(self._mounts)
        sensors = sensors_at(poses[:, None], self._mounts).reshape(-1, 3)
        places, sensor = self._walls.heard(sensors)
        back = sensors[sensor, :2] - places
        places = places + 0.3 * g.resolution * back / np.hypot(*back.T)[:, None]
        cells = self._cells(places)
        found = csr_matrix((np.ones(len(cells)), (sensor // count, cells)), (len(poses), g.width * g.height))
        found.data[:] = 1.0  # those of a cell were added up
        return found

    def _cells(self, places):
        """(n,) numbers of the cells at places (n, 2)."""
        g = self._grid.geometry
        columns, rows = cells_of(places, g)
        return rows.clip(0, g.height - 1) * g.width + columns.clip(0, g.width - 1)

    def hear(self, pose: Pose) -> None:
        """The chair is at a pose (x, y, yaw)."""
        last = self._last
        if last and not is_apart(last, pose, MOVED_M, MOVED_RAD):
            return
        self._last = pose
        self._left[self._heard_from(np.array([pose])).indices] *= AGAIN
        self._passed[self._beside[self._seen.seen_from(np.array(pose[:2]))]] = True

    def next_stop(self, pose: Pose, seconds_left: float = math.inf) -> Pose | None:
        """Where to go from a pose; None where all is heard. It tells no place twice."""
        way, seconds = self._journeys(pose)
        off = np.abs(self.stands[:, :2] - pose[:2])
        straight = (way <= off.sum(1) + DETOUR) & (np.hypot(*off.T) <= AHEAD)
        farther = self._farther if seconds_left > FINISH_S else 0.0
        left = np.where(self._passed, 1.0, farther) * self._left * self._grid.geometry.resolution
        there = self._near @ left
        gain = there + self._on_the_way(pose, straight, left)
        worth = np.where((there >= LEAST) & ~self._tried, gain / seconds, 0.0)
        best = int(np.argmax(worth))
        if not worth[best] > 0.0:
            return None
        self._tried[best] = True
        return tuple(self.stands[best].tolist())

    def _journeys(self, pose):
        """(stands,) m along rows and columns, and s, from a pose to each."""
        g = self._grid.geometry
        column, row = g.to_cell(*pose[:2])
        from_here = dijkstra(self._graph, indices=row * g.width + column) * g.resolution
        way = from_here[self._cells(self.stands[:, :2])]
        return way, PACE.seconds_to(self.stands, way, Pose2D(*pose), g.resolution)

    def _on_the_way(self, pose, straight, left):
        """(stands,) what is heard on the way to those of them that are straight ahead of a pose is worth, of `left`."""
        gain = np.zeros(len(self.stands))
        numbers = np.flatnonzero(straight)
        places, which = np.unique(self.stands[numbers, :2], axis=0, return_inverse=True)
        heard = [left[self._heard_between(pose, place)].sum() for place in places]
        gain[numbers] = np.array(heard)[which] if len(numbers) else 0.0
        return gain

    def _heard_between(self, pose, place):
        """Cells that are heard from stands on the straight way from a pose to a place."""
        near, step = self._near, APART * self._grid.geometry.resolution
        dx, dy = place - pose[:2]
        bearing, far = math.atan2(dy, dx), np.arange(step, math.hypot(dx, dy), step)
        poses = np.stack((pose[0] + far * math.cos(bearing), pose[1] + far * math.sin(bearing), 0.0 * far + bearing), 1)
        rows = [self._row[key] for key in self._keys(poses) if key in self._row]
        cells = [near.indices[near.indptr[row] : near.indptr[row + 1]] for row in rows]
        return np.unique(np.concatenate(cells)) if cells else np.empty(0, int)


def _outline():
    """(n, 2) m: places on the body's outline."""
    length, width = chosen().size
    along, across = np.linspace(-0.5, 0.5, 23) * length, np.linspace(-0.5, 0.5, 13) * width
    return np.concatenate(
        [np.stack((along, 0.0 * along + side * 0.5 * width), 1) for side in (-1.0, 1.0)]
        + [np.stack((0.0 * across + end * 0.5 * length, across), 1) for end in (-1.0, 1.0)]
    )


def _neighbours(passable):
    """Sparse (cells, cells): 1 between neighbours that can be passed."""
    cells = np.arange(passable.size).reshape(passable.shape)
    pairs = [
        np.stack((cells[:, :-1], cells[:, 1:]), -1)[passable[:, :-1] & passable[:, 1:]],
        np.stack((cells[:-1], cells[1:]), -1)[passable[:-1] & passable[1:]],
    ]
    first, second = np.concatenate(pairs).T
    ones = np.ones(2 * len(first))
    return csr_matrix((ones, (np.r_[first, second], np.r_[second, first])), (passable.size, passable.size))
