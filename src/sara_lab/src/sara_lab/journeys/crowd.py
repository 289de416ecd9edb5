"""Who walks about on a journey among pedestrians: people of the social force model, who see the chair and give way.

Some are distracted: 29.8 % of 1102 pedestrians did something else while they crossed a street (L. L. Thompson et al.,
Injury Prevention 19, 2013). One in twenty stops for nobody.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sara_lab.journeys.travel_cases import PERSON_AWAY, STROLL, grid_of, map_file, pairs, random_of
from sara_lab.judge.contact_watch import PERSON
from sara_nav.maps import map_io
from sara_sim.pedestrians.pedestrian import Pedestrian, PedestrianConfig
from sara_sim.pedestrians.routes import RouteError, Routes
from sara_sim.world.world import World

CROWD = {'flat': 2, 'school': 4, 'hall': 4}
DISTRACTED, NOTICES = 0.3, 1.0  # share of them; m at which they notice the chair
BLIND = 0.05  # share of those who stop for nobody


def crowd(name: str, number: int, start: Sequence[float] | None = None, count: int | None = None) -> list[Pedestrian]:
    """The pedestrians of journey `number` on a map: each walks between STROLL random places. start: the robot's (x, y;
    m), without it that journey's. count: how many, without it the map's CROWD.
    """
    world, random, found = World.from_yaml(map_file(name)), random_of(name, 'crowd', number), []
    routes, start = Routes(world), pairs(name)[number].start if start is None else start
    while len(found) < (CROWD[name] if count is None else count):
        luck = random.random()
        config = PedestrianConfig(
            f'{PERSON} {len(found) + 1}',
            _places(grid_of(name), routes, random, start),
            seed=int(random.integers(2**31)),
            notices=0.0 if luck < BLIND else NOTICES if luck < BLIND + DISTRACTED else math.inf,
        )
        found.append(Pedestrian(config, world, routes))
    return found


def _places(grid, routes, random, start):
    """Places that are joined by ways; the first is PERSON_AWAY from the chair's start."""
    free, places = np.argwhere(grid.data == map_io.FREE), []
    while len(places) < STROLL:
        row, column = free[random.integers(len(free))]
        place = tuple(map(float, grid.geometry.to_world(int(column), int(row))))
        if not places and math.dist(place, start[:2]) < PERSON_AWAY:
            continue
        try:
            way = routes.to(place)
        except RouteError:
            continue
        if not places or routes.left(way, *places[0]) < math.inf:
            places.append(place)
    return tuple(places)
