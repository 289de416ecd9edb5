"""A task: a world, a start and a goal, which the body can reach."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sara_common.platforms import chosen
from sara_lab.ideal.ideal import ideal, space_of
from sara_lab.journeys.ideal_times import default_limits
from sara_lab.journeys.travel_cases import WAY_MARGIN, disc_costmap, way_on
from sara_lab.judge.body_space import BodySpace
from sara_nav.maps import map_io
from sara_nav.maps.map_io import GridMap


@dataclass(frozen=True)
class Task:
    """`kind`: a group of worlds; `name`: of this one; `number`: draws the chair. `start`, `goal`: (x, y, yaw), m, rad,
    in the map's frame. `way`: m, the shortest for a disc as wide as the body; `ideal`: s, the ideal time. `scale`: by
    which the world was made larger.
    """

    kind: str
    name: str
    number: int
    grid: GridMap
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    way: float
    ideal: float
    scale: float = 1.0


def task_of(
    kind: str, name: str, number: int, grid: GridMap, ends: Sequence[tuple[float, float, float]], scale: float = 1.0
) -> Task | None:
    """The Task from the first of `ends` (poses x, y, yaw) to the second; None where the ideal motion, which leaves
    WAY_MARGIN about the body, finds no way. Unknown cells are taken for occupied.
    """
    start, goal = ends
    geometry, occupied = grid.geometry, grid.data != map_io.FREE
    cells = occupied, geometry.resolution, (geometry.origin_x, geometry.origin_y), chosen().size
    if not BodySpace(*cells, WAY_MARGIN).connected(start, goal):
        return None
    radius = 0.5 * chosen().body.width
    way = way_on(disc_costmap(grid, radius), start, goal)[1]
    if math.isnan(way):
        return None
    seconds = ideal(space_of(*cells, WAY_MARGIN), default_limits(), start, goal, radius).seconds
    return None if math.isnan(seconds) else Task(kind, name, number, grid, start, goal, way, seconds, scale)
