"""Where a robot can go on a map, how far that is, and from where it sees a frontier."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import radii
from sara_nav.grids.grid import FREE, INSCRIBED, LETHAL, UNKNOWN
from sara_nav.lattice.field import Field
from sara_nav.planners.potential import HIGH
from sara_slam.exploring.frontiers import Frontier, cells_of

NEAREST, BEST, FARTHEST = 0.6, 1.0, 2.0
"""m from a frontier's middle to base_link, from where it is looked at."""
DEARER = 3.0
"""m of way that are as bad as a metre nearer to or farther from a frontier's middle than BEST."""
EVERY = 2
"""Of the cells, each way, are tried as viewpoints."""
ASIDE = 0.0, 0.7, -0.7
"""rad that the robot may face beside a frontier's middle where it does not fit otherwise."""
APART = 0.4
"""m between the viewpoints that are tried for one frontier."""
BLOCK = 0.5
"""m: poses that are looked at together."""


class View(NamedTuple):
    """A pose (m, rad) from which a frontier is seen, and the way there, m."""

    pose: Pose2D
    way: float


class Surroundings:
    """What a robot with a footprint (k, 2) m can reach from a pose on a Costmap, unknown cells being obstacles.
    `costmap`: that one, but what is unknown where the robot stands is free, for its scanner may not see there.
    """

    def __init__(self, costmap: Costmap, pose: Pose2D, footprint: np.ndarray) -> None:
        inscribed, circumscribed = radii(footprint)
        self.costmap = _known_about(costmap, pose, circumscribed)
        field = Field(self.costmap, True, circumscribed)
        room = 0.5 * costmap.geometry.resolution - inscribed
        wave = field.wave_from([(pose.x, pose.y, 0.0)], lambda gaps: np.where(gaps + room > 0.0, 1.0, np.inf))
        corners = np.stack((wave[:-1, :-1], wave[:-1, 1:], wave[1:, :-1], wave[1:, 1:]))
        self._ways = np.where(corners.min(0) < HIGH, corners.min(0), np.inf)
        self._world = LocalWorld(costmap, footprint, True)
        self._standing = costmap, pose, footprint

    def way_to(self, x: float, y: float) -> float:
        """Length (m) of the shortest way of the circle within the footprint to a point (m); inf where there is none."""
        cell = self.costmap.geometry.to_cell(x, y)
        return math.inf if cell is None else float(self._ways[cell[1], cell[0]])

    def ways_to(self, points: np.ndarray) -> np.ndarray:
        """(n,) as way_to, of points (n, 2) on the map."""
        columns, rows = cells_of(points, self.costmap.geometry)
        return self._ways[rows, columns]

    def views(self, frontier: Frontier, most: int, apart_from: Sequence[Pose2D] = ()) -> list[View]:
        """Up to `most` Views of a frontier's middle, the best first: near, and about BEST from it, where the footprint
        fits and nothing stands between; APART from each other and from the poses of `apart_from`.
        """
        candidates = self._candidates(frontier.middle)
        found: list[View] = []
        for aside in ASIDE:
            for view in self._fitting(candidates, aside):
                if all(view.pose.distance(other) >= APART for other in (*apart_from, *(view.pose for view in found))):
                    found.append(view)
                if len(found) == most:
                    return found
        return found

    def stands(self, every: int, headings: int, room: float) -> tuple[np.ndarray, np.ndarray]:
        """(n, 3) poses that the circle within the footprint reaches on what is known and where no obstacle is within
        `room` (m) of the footprint, `every` cells apart and in so many headings; (n,) m, the ways there.
        """
        costmap, pose, footprint = self._standing
        g = costmap.geometry
        rows, columns = (c.ravel() for c in np.mgrid[every // 2 : g.height : every, every // 2 : g.width : every])
        reached = np.isfinite(self._ways[rows, columns])
        rows, columns = rows[reached], columns[reached]
        x, y = g.to_world(columns, rows)
        yaws = np.arange(headings) * (2.0 * math.pi / headings)
        poses = np.column_stack((np.tile(x, headings), np.tile(y, headings), np.repeat(yaws, len(x))))
        poses = np.concatenate((poses, [(pose.x, pose.y, yaw) for yaw in yaws]))
        ways = np.concatenate((np.tile(self._ways[rows, columns], headings), np.zeros(headings)))
        walls = (costmap.costs >= INSCRIBED) & (costmap.costs != UNKNOWN)
        near = ndimage.distance_transform_edt(~walls) * g.resolution < room
        blocked = Costmap(np.where(near, LETHAL, FREE).astype(np.uint8), g)
        fits = _fit(LocalWorld(blocked, footprint, True), poses)
        return poses[fits], ways[fits]

    def _candidates(self, middle):
        """(n, 4) x, y, yaw, way of reached places from which the middle (m) is in sight, the best first."""
        g = self.costmap.geometry
        reach = math.ceil(FARTHEST / g.resolution) + EVERY
        about = (
            np.arange(max(0, (at - reach) // EVERY * EVERY), min(size, at + reach), EVERY)
            for at, size in zip(g.to_cell_unbounded(*middle), (g.width, g.height))
        )
        columns, rows = (c.ravel() for c in np.meshgrid(*about))
        x, y = g.to_world(columns, rows)
        off = np.hypot(middle[0] - x, middle[1] - y)
        ways = self._ways[rows, columns]
        near = np.flatnonzero((off >= NEAREST) & (off <= FARTHEST) & np.isfinite(ways))
        order = near[np.argsort(ways[near] + DEARER * np.abs(off[near] - BEST), kind='stable')]
        places = np.column_stack((x, y))[order]
        seen = self._in_sight(places, middle)
        x, y = places[seen].T
        return np.column_stack((x, y, np.arctan2(middle[1] - y, middle[0] - x), ways[order][seen]))

    def _in_sight(self, places, middle):
        """bool (n,): nothing unknown or occupied lies between places (n, 2) and a point (m)."""
        g = self.costmap.geometry
        shares = np.linspace(0.0, 1.0, math.ceil(FARTHEST / (0.5 * g.resolution)))
        points = places[:, None] + shares[:, None] * (np.array(middle) - places[:, None])
        columns, rows = cells_of(points.reshape(-1, 2), g)
        return (self.costmap.costs[rows, columns] < INSCRIBED).reshape(len(places), len(shares)).all(1)

    def _fitting(self, candidates, aside) -> Iterator[View]:
        poses = np.ascontiguousarray(candidates[:, :3] + (0.0, 0.0, aside))
        if len(poses) == 0:
            return
        for k in np.flatnonzero(self._world.touched(poses) == 0):
            yield View(Pose2D(*poses[k].tolist()), float(candidates[k, 3]))


def _fit(world, poses):
    """bool (n,): at which of poses (n, 3) a LocalWorld's footprint touches nothing. Block by block, for what is near is
    looked for about all that are asked for together.
    """
    _, block = np.unique(np.floor(poses[:, :2] / BLOCK), axis=0, return_inverse=True)
    fits, order = np.empty(len(poses), bool), np.argsort(block, kind='stable')
    for of in np.split(order, np.cumsum(np.bincount(block))[:-1]):
        fits[of] = world.touched(poses[of]) == 0
    return fits


def _known_about(costmap, pose, radius):
    """The Costmap whose unknown cells within a radius (m) of a pose are free."""
    g, costs = costmap.geometry, costmap.costs.copy()
    x, y = g.to_world(np.arange(g.width), np.arange(g.height)[:, None])
    costs[(np.hypot(x - pose.x, y - pose.y) <= radius) & (costs == UNKNOWN)] = FREE
    return Costmap(costs, g)
