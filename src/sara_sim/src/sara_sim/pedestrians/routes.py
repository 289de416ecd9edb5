"""Paths through a map for somebody on foot: the shortest way to a place from anywhere, which keeps off the walls where
there is room.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, floor, hypot, inf
from typing import NamedTuple

import numpy as np

from sara_sim.world.world import World

CELL = 0.1  # m: finer maps are looked at in steps of this
BODY = 0.2  # m: half as wide as somebody who squeezes through
ROOM = 0.6  # m from walls from which on more room is no better
BESIDE = 3.0  # m of floor about places off the map
DEAR = 3.0  # times as long: a way along a wall


class RouteError(ValueError):
    """A place that nobody can walk to."""


class Route(NamedTuple):
    """The ways to one place: `left` (rows, columns), m to walk, dearer near walls, inf where there is none; `following`
    (cells), the index of the next cell.
    """

    left: np.ndarray
    following: np.ndarray


class Routes:
    """The ways through a World's map, and round about `places` (x, y; m) off it. What the map does not show is not
    looked at.
    """

    def __init__(self, world: World, places: Iterable[tuple[float, float]] = ()) -> None:
        from scipy import ndimage, sparse  # few chairs meet anybody, and it takes a tenth of a second

        stride = max(round(CELL / world.resolution), 1)
        self._size = stride * world.resolution
        rows, columns = (ceil(n / stride) for n in world.occupied.shape)
        grown = np.zeros((rows * stride, columns * stride), bool)
        grown[: world.occupied.shape[0], : world.occupied.shape[1]] = world.occupied
        walls = grown.reshape(rows, stride, columns, stride).any((1, 3))
        (left, right), (low, high) = (
            self._beyond([place[k] for place in places], world.origin[k], n) for k, n in ((0, columns), (1, rows))
        )
        walls = np.pad(walls, ((low, high), (left, right)))
        self._origin = world.origin[0] - left * self._size, world.origin[1] - low * self._size
        walls = np.pad(walls, 1, constant_values=True)  # beyond that nobody walks
        room = self._size * ndimage.distance_transform_edt(~walls)[1:-1, 1:-1]
        self._shape = room.shape
        self._free = room > BODY
        dear = 1.0 + (DEAR - 1.0) * np.clip((ROOM - room) / (ROOM - BODY), 0.0, 1.0)
        index = np.arange(room.size).reshape(room.shape)
        starts, ends, costs = [], [], []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            here = np.s_[: room.shape[0] - down, max(-right, 0) : room.shape[1] - max(right, 0)]
            there = np.s_[down:, max(right, 0) : room.shape[1] + min(right, 0)]
            both = self._free[here] & self._free[there]
            starts.append(index[here][both])
            ends.append(index[there][both])
            costs.append(self._size * hypot(down, right) * 0.5 * (dear[here] + dear[there])[both])
        edges = np.concatenate(costs), (np.concatenate(starts), np.concatenate(ends))
        self._graph = sparse.coo_array(edges, (room.size, room.size)).tocsr()
        self._known: dict = {}

    def _beyond(self, at, origin, cells):
        """Cells that are added before and behind the map, for places at these coordinates."""
        if not at:
            return 0, 0
        first, last = ((value - origin) / self._size for value in (min(at), max(at)))
        room = ceil(BESIDE / self._size)
        return max(room - floor(first), 0) if first < 0 else 0, max(ceil(last) + room - cells, 0) if last > cells else 0

    def to(self, place: tuple[float, float]) -> Route:
        """The ways to a place (x, y), m. Raises RouteError where nobody can stand there."""
        from scipy.sparse import csgraph

        cell = self._cell(*place)
        if cell is None or not self._free[cell]:
            raise RouteError(f'nobody can stand at {tuple(place)!r}: it is in a wall, beside one or off the map')
        if cell not in self._known:
            left, following = csgraph.dijkstra(
                self._graph, False, cell[0] * self._shape[1] + cell[1], return_predecessors=True
            )
            self._known[cell] = Route(left.reshape(self._shape), following)
        return self._known[cell]

    def left(self, route: Route, x: float, y: float) -> float:
        """m left to walk from (x, y), dearer near walls; inf without a way."""
        cell = self._cell(x, y)
        return inf if cell is None else float(route.left[cell])

    def ahead(self, route: Route, x: float, y: float, lookahead: float) -> tuple[float, float] | None:
        """The place (x, y) so far (m) ahead on the way from (x, y), the last one where it is nearer; None without a
        way.
        """
        cell = self._entered(route, x, y)
        if cell is None:
            return None
        index = cell[0] * self._shape[1] + cell[1]
        for _ in range(max(round(lookahead / self._size), 1)):
            if route.following[index] < 0:
                break
            index = route.following[index]
        row, column = divmod(int(index), self._shape[1])
        return self._origin[0] + self._size * (column + 0.5), self._origin[1] + self._size * (row + 0.5)

    def _entered(self, route, x, y):
        """The cell of a place with a way, or of the nearest one with a way where somebody was pushed off it."""
        row, column = round((y - self._origin[1]) / self._size - 0.5), round((x - self._origin[0]) / self._size - 0.5)
        best, nearest = None, inf
        for i in range(max(row - 3, 0), min(row + 4, self._shape[0])):
            for j in range(max(column - 3, 0), min(column + 4, self._shape[1])):
                off = (i - row) ** 2 + (j - column) ** 2
                if off < nearest and route.left[i, j] < inf:
                    best, nearest = (i, j), off
        return best

    def _cell(self, x, y):
        row, column = int((y - self._origin[1]) // self._size), int((x - self._origin[0]) // self._size)
        return (row, column) if 0 <= row < self._shape[0] and 0 <= column < self._shape[1] else None
