"""Pedestrians: they walk from place to place, see the chair and each other, give way, and stop for nobody only where
they are told to.

How they accelerate is the social force model's (social_force.py). Ours is what it leaves open: where they walk
(routes.py), and round which corner of a chair that stands in the way; that nobody walks into a wall, or into a chair
that they have noticed; and that somebody whose way is barred for PATIENCE_S turns round and goes elsewhere.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import atan2, hypot, inf
from typing import NamedTuple

import numpy as np

from sara_common.config import is_number
from sara_sim.pedestrians import social_force
from sara_sim.pedestrians.routes import RouteError, Routes
from sara_sim.pedestrians.social_force import Floor
from sara_sim.world.obstacles import Body, ObstacleError, Obstacles, Thing
from sara_sim.world.rays import hit_shape
from sara_sim.world.world import World

LOOKAHEAD = 0.6  # m on the way, where they head
THERE = 0.4  # m from a place: they have come to it
ROUND = 2.0  # m ahead on the way: where they want to be beyond a chair that stands in it
LEEWAY, PASSED = 0.03, 0.15  # m about the corner that they walk round; nearer to it, they are there
BEFORE = 0.5  # m in front of the place: they slow down
DECIDES_S = 0.1  # they think about where to go
PATIENCE_S, ADVANCE = 3.0, 0.3  # s without so many m of progress: the way is barred
SLOWEST = 0.3  # m/s that they like to walk at, at least
SHOULDER = 0.2  # m that somebody keeps from walls with their middle,
CLOSE = 0.10  # and from what they have noticed with their edge; who is nearer steps back from it
KEPT = 360000  # steps of their past, an hour
TURNS = 0.05  # m/s: who is slower looks where they looked


@dataclass(frozen=True)
class PedestrianConfig:
    """Somebody of `radius` (m) who walks between `places` ((x, y), m), two or more, in an order drawn from `seed`, and
    stays at each for a time between `waits` (s); the first is where they begin.

    `speed`: m/s that they like to walk at, None: drawn as the model has it. `notices`: m, the distance within which
    they see the chair; inf: as far as the model has it, 0: they stop for nobody. `starts_within`: m; they begin to walk
    once the chair's middle is so near, inf: at once.
    """

    name: str
    places: tuple
    seed: int = 0
    speed: float | None = None
    notices: float = inf
    waits: tuple[float, float] = (2.0, 8.0)
    radius: float = 0.25
    starts_within: float = inf

    def __post_init__(self):
        for field in ('places', 'waits'):
            value = getattr(self, field)
            if isinstance(value, (list, tuple)):
                value = tuple(tuple(part) if isinstance(part, (list, tuple)) else part for part in value)
                object.__setattr__(self, field, value)
        faults = self.validate()
        if faults:
            raise ObstacleError('; '.join(f'pedestrian {self.name!r}: {fault}' for fault in faults))

    def validate(self) -> list[str]:
        """A sentence for every fault found."""

        def pair(value):
            return isinstance(value, tuple) and len(value) == 2 and all(map(is_number, value))

        faults, places = [], self.places
        if not (isinstance(places, tuple) and len(places) > 1 and all(map(pair, places)) and len(set(places)) > 1):
            faults.append(f'places are {places!r}, allowed are two different points [x, y] in m or more')
        if not isinstance(self.seed, int) or isinstance(self.seed, bool) or self.seed < 0:
            faults.append(f'seed is {self.seed!r}, allowed are whole numbers from 0')
        if self.speed is not None and not (is_number(self.speed) and self.speed > 0.0):
            faults.append(f'speed is {self.speed!r}, allowed are speeds above 0 m/s')
        if isinstance(self.notices, bool) or not isinstance(self.notices, (int, float)) or not self.notices >= 0.0:
            faults.append(f'notices is {self.notices!r}, allowed are lengths from 0 m')
        within = self.starts_within
        if isinstance(within, bool) or not isinstance(within, (int, float)) or not within > 0.0:
            faults.append(f'starts_within is {within!r}, allowed are lengths above 0 m')
        if not (pair(self.waits) and 0.0 <= self.waits[0] <= self.waits[1]):
            faults.append(f'waits are {self.waits!r}, allowed is [shortest, longest] in s')
        if not (is_number(self.radius) and self.radius > 0.0):
            faults.append(f'radius is {self.radius!r}, allowed are lengths above 0 m')
        return faults


class Pedestrian(Thing):
    """One of them, on a World's map. Raises ObstacleError where a place is in a wall, or no way leads there."""

    walks, lasting = True, False

    def __init__(self, config: PedestrianConfig, world: World, routes: Routes | None = None) -> None:
        """`routes`: of the same World, which many may share."""
        social_force.warm()  # here and not in the middle of a drive
        self.config, self.name, self.radius = config, config.name, float(config.radius)
        self._routes = Routes(world, config.places) if routes is None else routes
        self._floor = Floor.of(world)
        try:
            self._ways = [self._routes.to(place) for place in config.places]
        except RouteError as error:
            raise ObstacleError(f'pedestrian {config.name!r}: {error}') from error
        x, y = config.places[0]
        if any(self._routes.left(way, x, y) == inf for way in self._ways):
            raise ObstacleError(f'pedestrian {config.name!r}: no way leads from {(x, y)!r} to every other place')
        self._random = np.random.default_rng([config.seed, 11])
        speed = self._random.normal(*social_force.SPEED)
        self.speed = float(max(speed, SLOWEST)) if config.speed is None else float(config.speed)
        self._velocity = self._wish = (0.0, 0.0)  # m/s, the second as they would like it
        self._decided = -inf
        self._t, self._track = [-inf], [(float(x), float(y), 0.0)]
        self._at, self._goal = 0, None  # indices of places: where they were last, where they walk to
        self._waits_until = 0.0 if config.starts_within == inf else inf
        self._best, self._since = inf, 0.0  # m left to walk, and since when it has not become less

    def pose(self, t: float) -> tuple[float, float, float]:
        """(x, y, yaw) at `t` s, m, rad: where they were, or are."""
        return self._track[bisect_right(self._t, t) - 1]

    def step(self, t: float, chair: Body, things: Obstacles) -> None:
        """Walk on to `t` s; `chair`: where it is; `things`: what else is there."""
        seconds = t - self._t[-1] if len(self._t) > 1 else 0.0
        x, y, yaw = self._track[-1]
        if self._waits_until == inf and hypot(chair.x - x, chair.y - y) <= self.config.starts_within:
            self._waits_until = t
        if t - self._decided >= DECIDES_S - 1e-9:
            self._decided, self._wish = t, self._decide(t, x, y, chair)
        if seconds > 0.0:
            x, y, yaw = self._moved(seconds, (x, y, yaw), self._seen(chair, things))
        self._t.append(t)
        self._track.append((x, y, yaw))
        if len(self._t) > KEPT:  # the place where they began stays
            del self._t[1 : KEPT // 2], self._track[1 : KEPT // 2]

    def _decide(self, t, x, y, chair):
        """The velocity they would like, m/s."""
        if t < self._waits_until:
            return 0.0, 0.0
        if self._goal is None:
            self._choose(t, [k for k in range(len(self._ways)) if k != self._at])
        place = self.config.places[self._goal]
        if hypot(place[0] - x, place[1] - y) < THERE:
            self._at, self._goal = self._goal, None
            self._waits_until = t + float(self._random.uniform(*self.config.waits))
            return 0.0, 0.0
        left = self._routes.left(self._ways[self._goal], x, y)
        if left < self._best - ADVANCE:
            self._best, self._since = left, t
        elif t - self._since > PATIENCE_S:
            self._turn_round(t, x, y, chair)
        head = self._head(x, y, chair)
        far = 0.0 if head is None else hypot(head[0] - x, head[1] - y)
        if far < 1e-6:
            return 0.0, 0.0
        speed = self.speed * min(far / BEFORE, 1.0)
        return speed * (head[0] - x) / far, speed * (head[1] - y) / far

    def _head(self, x, y, chair):
        """Where they head: on the way, or for a corner of the chair that they walk round; None without a way."""
        way = self._ways[self._goal]
        head = self._routes.ahead(way, x, y, LOOKAHEAD)
        if head is None or not self._notices(x, y, chair):
            return head
        beyond = self._routes.ahead(way, x, y, ROUND)
        shape = chair.shape
        room = self.radius + CLOSE
        if not _crosses((x, y), beyond, _grown(shape, room - LEEWAY)):
            return head
        best, least = head, inf
        for corner in _corners(_grown(shape, room + LEEWAY)):
            length = hypot(corner[0] - x, corner[1] - y)
            if length < PASSED or self._walled(*corner) or social_force.hidden(self._floor, x, y, *corner):
                continue
            length += hypot(beyond[0] - corner[0], beyond[1] - corner[1])
            if length < least and not _crosses((x, y), corner, _grown(shape, room - LEEWAY)):
                best, least = corner, length
        return best

    def _walled(self, x, y):
        """Whether a wall is too near for somebody to stand there."""
        wall_x, wall_y = social_force.nearest_wall(self._floor, x, y)
        return hypot(wall_x - x, wall_y - y) < min(SHOULDER, self.radius)

    def _choose(self, t, among):
        self._goal = int(self._random.choice(among))
        self._best, self._since = inf, t

    def _turn_round(self, t, x, y, chair):
        """Go to another place: one of those whose way leads off the chair, if there is one."""
        px, py = social_force.nearest_point(x, y, chair.shape)
        others = [k for k in range(len(self._ways)) if k != self._goal]
        away = []
        for k in others:
            head = self._routes.ahead(self._ways[k], x, y, LOOKAHEAD)
            if head is not None and (head[0] - x) * (x - px) + (head[1] - y) * (y - py) > 0.0:
                away.append(k)
        self._choose(t, away or others)

    def _seen(self, chair, things):
        """(n, 9): whom and what they give way to, as social_force.acceleration has it."""
        t, (x, y, _) = things.time, self._track[-1]
        rows = [
            (*shape, *thing.velocity(t), 0.0)
            for thing in things.all
            if thing is not self and (shape := thing.shape(t)) is not None
        ]
        if self._notices(x, y, chair):
            rows.append((*chair.shape, *chair.velocity, chair.turn))
        return np.array(rows) if rows else np.empty((0, 9))

    def _notices(self, x, y, chair):
        px, py = social_force.nearest_point(x, y, chair.shape)
        return hypot(px - x, py - y) < self.config.notices

    def _moved(self, seconds, pose, seen):
        """(x, y, yaw) after so many seconds. Who would walk into a wall, or into what they see, slides along it."""
        x, y, yaw = pose
        vx, vy = self._velocity
        ax, ay = social_force.acceleration((x, y, float(vx), float(vy)), self._wish, seen, self._floor)
        vx, vy = vx + ax * seconds, vy + ay * seconds
        size, fastest = hypot(vx, vy), social_force.FASTEST * self.speed
        if size > fastest:
            vx, vy = vx * fastest / size, vy * fastest / size
        near = [_Close(*_velocity_at(row, x, y), self.radius + CLOSE) for row in seen]
        near.append(_Close(*social_force.nearest_wall(self._floor, x, y), 0.0, 0.0, min(SHOULDER, self.radius)))
        for close in near:
            vx, vy = close.kept_off(x, y, vx, vy)
        if near[-1].into(x, y, vx, vy) > 1e-6:  # between a wall and something else
            vx, vy = 0.0, 0.0
        self._velocity = vx, vy
        if hypot(vx, vy) > TURNS:
            yaw = atan2(vy, vx)
        return x + vx * seconds, y + vy * seconds, yaw


def _grown(shape, room):
    """A box with so much more (m) on each side."""
    return shape + np.array((0.0, 0.0, 0.0, 0.0, room, room))


def _corners(shape):
    x, y, c, s, half, side = shape.tolist()
    return [(x + i * c * half - j * s * side, y + i * s * half + j * c * side) for i in (1, -1) for j in (1, -1)]


def _crosses(start, end, shape):
    """Whether the straight line between two places leads through a box."""
    far = hypot(end[0] - start[0], end[1] - start[1])
    if far == 0.0:
        return False
    return hit_shape(*start, (end[0] - start[0]) / far, (end[1] - start[1]) / far, shape)[0] < far


class _Close(NamedTuple):
    """The nearest place (m) of something that is kept `apart` (m) off, and how it moves, m/s."""

    x: float
    y: float
    vx: float
    vy: float
    apart: float

    def into(self, x, y, vx, vy):
        """m/s at which somebody at (x, y) with that velocity gets nearer to it where they are too near, 0 elsewhere."""
        dx, dy = self.x - x, self.y - y
        far = hypot(dx, dy)
        return max(((vx - self.vx) * dx + (vy - self.vy) * dy) / far, 0.0) if 0.0 < far < self.apart else 0.0

    def kept_off(self, x, y, vx, vy):
        """That velocity without the part that leads nearer."""
        into = self.into(x, y, vx, vy)
        if into == 0.0:
            return vx, vy
        dx, dy = self.x - x, self.y - y
        far = hypot(dx, dy)
        return vx - into * dx / far, vy - into * dy / far


def _velocity_at(row, x, y):
    """(x, y, velocity x, y) of the point of something seen that is nearest to (x, y), m, m/s."""
    px, py = social_force.nearest_point(x, y, row[:6])
    middle_x, middle_y, vx, vy, turn = row[[0, 1, 6, 7, 8]].tolist()
    return px, py, vx - turn * (py - middle_y), vy + turn * (px - middle_x)
