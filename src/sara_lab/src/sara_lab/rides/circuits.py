"""Three circuits for riders, in the manner of those on which difficult drivers tried SWADAPT (INSA and Rennes): a
slalom and a corridor; a door, a U-turn and the door again; an office with tables.

Somebody who sees the way passes them with room to spare. The straight lines between the goals, which somebody takes
who sees nothing, lead past corners too near for the body.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from sara_lab.journeys.tight_places import block
from sara_nav.maps import map_io
from sara_sim.riders.riders import Place, Task
from sara_sim.riders.way import rounded

ROUND = 0.7  # m before a corner of the way at which it begins to be rounded


class Circuit(NamedTuple):
    """grid: the map. start: pose (x, y, yaw), m, rad. task: way, goals and narrow places. checkpoints: places (x, y)
    that are to be passed within CHECKED, one after the other; the last is the end.
    """

    grid: map_io.GridMap
    start: tuple[float, float, float]
    task: Task
    checkpoints: tuple[Place, ...]


def _circuit(grid, yaw, corners, goals, narrow=()):
    """The Circuit along a way with these corners, from the first; its checkpoints are the goals."""
    task = Task(rounded(corners, ROUND), tuple(goals), tuple(narrow))
    return Circuit(grid, (*corners[0], yaw), task, tuple(goals))


def _slalom():
    """Three posts in a hall, then a corridor of 1.20 m, a lobby, and another corridor of 1.25 m to the left."""
    hall, lobby = (0.0, 0.0, 11.0, 3.4), (14.4, 0.75, 16.3, 2.65)
    corridors = (11.0, 1.1, 14.4, 2.3), (14.7, 2.65, 15.95, 6.2)
    posts = (2.9, 1.3, 3.3, 1.7), (5.5, 1.7, 5.9, 2.1), (8.1, 1.3, 8.5, 1.7)
    grid = block((16.3, 6.2), (hall, lobby, *corridors), posts)
    way = (1.0, 1.7), (1.7, 1.9), (3.1, 2.5), (5.7, 0.9), (8.3, 2.5), (10.1, 1.7), (15.33, 1.7), (15.33, 5.2)
    return _circuit(grid, 0.0, way, ((10.2, 1.7), (15.4, 1.7), (15.33, 5.2)))


def _door():
    """Through a door of 0.90 m, round a table, and out again by the same door."""
    rooms = (0.0, 0.0, 4.8, 4.4), (4.8, 1.75, 5.0, 2.65), (5.0, 0.0, 10.6, 4.4)
    grid = block((10.6, 4.4), rooms, ((7.8, 1.8, 8.6, 2.6),))
    way = (1.2, 1.0), (2.6, 2.2), (6.4, 2.2), (7.8, 0.9), (8.9, 0.9), (9.7, 1.6), (9.7, 2.8), (8.9, 3.5), (7.8, 3.5)
    way = (*way, (6.4, 2.2), (2.8, 2.2), (1.2, 3.4))
    goals = (6.2, 2.0), (9.5, 2.0), (8.0, 3.4), (6.2, 2.5), (1.4, 3.3)
    return _circuit(grid, 0.0, way, goals, ((4.9, 2.2),))


def _office():
    """Tables with aisles of 1.2 to 1.3 m, and chairs that stand about."""
    tables = (2.2, 1.0, 3.8, 1.8), (2.2, 3.0, 3.8, 3.8), (5.8, 1.3, 6.6, 2.9), (5.2, 4.2, 6.8, 5.0)
    chairs = (4.0, 3.2, 4.4, 3.6), (7.7, 2.3, 8.1, 2.7), (3.2, 0.2, 3.6, 0.6)
    grid = block((9.8, 6.0), ((0.0, 0.0, 9.8, 6.0),), (*tables, *chairs))
    way = (1.0, 2.0), (1.8, 2.4), (4.0, 2.4), (4.9, 3.0), (5.8, 3.6), (7.6, 3.6), (8.9, 2.9), (8.9, 1.5), (7.6, 0.7)
    way = (*way, (4.9, 0.75))
    goals = (4.4, 2.4), (7.4, 3.5), (8.8, 1.8), (6.9, 0.65), (4.9, 0.75)
    return _circuit(grid, 0.0, way, goals)


@cache
def circuits() -> dict[str, Circuit]:
    """All by name."""
    return {'slalom': _slalom(), 'door': _door(), 'office': _office()}
