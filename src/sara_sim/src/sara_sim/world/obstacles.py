"""What the map does not show: discs and boxes that stand, appear, or walk along paths, where these are a function of
time alone; and whatever else is a Thing, such as pedestrians who see the chair.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from math import atan2, cos, hypot, sin
from typing import NamedTuple

import numpy as np

from sara_common.config import is_number

LOOPS = ('once', 'around', 'back')
LATELY = 0.05  # s over which a velocity is taken


class ObstacleError(ValueError):
    """Obstacles that cannot be; one sentence for each fault."""


class Body(NamedTuple):
    """Where the chair is and how it moves: x, y (m), yaw (rad), map frame; half its length and width, m; v (m/s), turn
    (rad/s).
    """

    x: float
    y: float
    yaw: float
    half_length: float
    half_width: float
    v: float
    turn: float

    @property
    def shape(self) -> np.ndarray:
        """(6,) as a row of `Obstacles.shapes`."""
        return np.array((self.x, self.y, cos(self.yaw), sin(self.yaw), self.half_length, self.half_width))

    @property
    def velocity(self) -> tuple[float, float]:
        """(x, y) m/s of its middle."""
        return self.v * cos(self.yaw), self.v * sin(self.yaw)


class Thing:
    """Base of what stands or walks about. `radius` (m): it is a disc; else `size` (length, width; m): a box."""

    name: str
    radius: float | None = None
    size: tuple | None = None
    walks = False
    lasting = True  # whether it stands where it is from the beginning to the end

    def pose(self, t: float) -> tuple[float, float, float] | None:
        """(x, y, yaw) at `t` s: m, rad; None when it is not there."""
        raise NotImplementedError

    def step(self, t: float, chair: Body, others: Obstacles) -> None:
        """Go on to `t` s, in sight of the chair and of all `others` (this one too)."""

    def shape(self, t: float) -> tuple[float, ...] | None:
        """A row of `Obstacles.shapes` at `t` s, None when it is not there."""
        pose = self.pose(t)
        if pose is None:
            return None
        half = (self.size[0] / 2, self.size[1] / 2) if self.size else (self.radius, -1.0)
        return pose[0], pose[1], cos(pose[2]), sin(pose[2]), *half

    def velocity(self, t: float) -> tuple[float, float]:
        """(x, y) m/s at `t` s."""
        before, now = self.pose(t - LATELY), self.pose(t)
        if before is None or now is None:
            return 0.0, 0.0
        return (now[0] - before[0]) / LATELY, (now[1] - before[1]) / LATELY


@dataclass(frozen=True)
class Obstacle(Thing):
    """A disc (`radius`, m) or a box (`size`: length, width in m), in the map frame.

    It stands at `at` (x, y; m) turned by `yaw` (rad), or walks along `path` (two points or more) with `speed` (m/s)
    from the time `start` (s) on: `loop` 'once' stays at the last point, 'around' walks from it to the first and on,
    'back' walks the same way back. A walking box looks where it goes. It is there from `appears` to `disappears` (s).
    """

    name: str = 'obstacle'
    radius: float | None = None
    size: tuple | None = None
    at: tuple | None = None
    yaw: float = 0.0
    path: tuple = ()
    speed: float = 0.0
    start: float = 0.0
    loop: str = 'once'
    appears: float = -math.inf
    disappears: float = math.inf

    def __post_init__(self):
        for name in ('size', 'at'):
            if isinstance(getattr(self, name), list):
                object.__setattr__(self, name, tuple(getattr(self, name)))
        if isinstance(self.path, (list, tuple)):
            object.__setattr__(
                self, 'path', tuple(tuple(point) if isinstance(point, (list, tuple)) else point for point in self.path)
            )
        faults = self.validate()
        if faults:
            raise ObstacleError('; '.join(faults))
        if self.path:
            points = (
                list(self.path) + {'once': [], 'around': [self.path[0]], 'back': list(self.path[-2::-1])}[self.loop]
            )
            lengths = [0.0]
            for (ax, ay), (bx, by) in zip(points, points[1:]):
                lengths.append(lengths[-1] + hypot(bx - ax, by - ay))
            object.__setattr__(self, '_points', points)
            object.__setattr__(self, '_lengths', lengths)

    def validate(self) -> list[str]:
        """One sentence for every fault found."""
        faults, who = [], f'obstacle {self.name!r}: '
        if (self.radius is None) == (self.size is None):
            faults.append(who + 'give either radius (a disc) or size (a box)')
        if self.radius is not None and not (is_number(self.radius) and self.radius > 0):
            faults.append(who + f'radius is {self.radius!r}, allowed are lengths above 0 m')
        if self.size is not None and not (_point(self.size) and min(self.size) > 0):
            faults.append(who + f'size is {self.size!r}, allowed is [length, width], positive, in m')
        if (self.at is None) == (not self.path):
            faults.append(who + 'give either at (it stands) or path (it walks)')
        if self.at is not None and not _point(self.at):
            faults.append(who + f'at is {self.at!r}, allowed is [x, y] in m')
        if self.path and not (
            isinstance(self.path, tuple)
            and len(self.path) > 1
            and all(map(_point, self.path))
            and len(set(self.path)) > 1
        ):
            faults.append(who + f'path is {self.path!r}, allowed are two different points [x, y] or more')
        if self.path and not (is_number(self.speed) and self.speed > 0):
            faults.append(who + f'speed is {self.speed!r}, allowed are speeds above 0 m/s')
        if self.loop not in LOOPS:
            faults.append(who + f'loop is {self.loop!r}, allowed are {", ".join(LOOPS)}')
        faults += [
            who + f'{name} is {getattr(self, name)!r}, allowed is a finite number'
            for name in ('yaw', 'start')
            if not is_number(getattr(self, name))
        ]
        faults += [
            who + f'{name} is {getattr(self, name)!r}, allowed is a time in s'
            for name in ('appears', 'disappears')
            if not isinstance(getattr(self, name), (int, float)) or math.isnan(getattr(self, name))
        ]
        return faults

    @property
    def walks(self) -> bool:
        """Whether it has a path."""
        return bool(self.path)

    @property
    def lasting(self) -> bool:
        """Whether it stands where it is from the beginning to the end."""
        return not self.path and self.appears == -math.inf and self.disappears == math.inf

    def pose(self, t: float) -> tuple[float, float, float] | None:
        """(x, y, yaw) at `t` s: m, rad; None when it is not there."""
        if not self.appears <= t < self.disappears:
            return None
        if not self.path:
            return self.at[0], self.at[1], self.yaw
        lengths, points = self._lengths, self._points
        walked = max(t - self.start, 0.0) * self.speed
        walked = min(walked, lengths[-1]) if self.loop == 'once' else walked % lengths[-1]
        leg = min(bisect_right(lengths, walked), len(lengths) - 1) - 1
        while lengths[leg + 1] == lengths[leg]:  # a point given twice
            leg -= 1
        (ax, ay), (bx, by) = points[leg], points[leg + 1]
        share = (walked - lengths[leg]) / (lengths[leg + 1] - lengths[leg])
        return ax + share * (bx - ax), ay + share * (by - ay), atan2(by - ay, bx - ax) + self.yaw


class Obstacles:
    """A set of obstacles at one time. `shapes`: (n, 6) x, y, cos yaw, sin yaw, half length, half width (-1: a disc of
    that radius); m.
    """

    def __init__(self, obstacles: Iterable[Thing] = ()) -> None:
        self.all: list[Thing] = []
        self.time = 0.0
        self.shapes = np.empty((0, 6))
        self._still = True
        for obstacle in obstacles:
            self.add(obstacle)

    def __len__(self) -> int:
        return len(self.all)

    def add(self, obstacle: Thing) -> None:
        """One more. Raises ObstacleError where it is none."""
        if not isinstance(obstacle, Thing):
            raise ObstacleError(f'{obstacle!r} is no Obstacle.')
        self.all.append(obstacle)
        self._place()

    def remove(self, name: str) -> None:
        """Take away all of that name. Raises ObstacleError where there is none."""
        left = [obstacle for obstacle in self.all if obstacle.name != name]
        if len(left) == len(self.all):
            raise ObstacleError(f'there is no obstacle {name!r}.')
        self.all = left
        self._place()

    def step(self, t: float, chair: Body) -> None:
        """Let everybody go on to `t` (s), in sight of the chair."""
        for obstacle in self.all:
            obstacle.step(t, chair, self)
        self.move_to(t)

    def move_to(self, t: float) -> None:
        """Put every obstacle where it is, or was, at `t` (s)."""
        self.time = t
        if not self._still:
            self._place()

    def _place(self) -> None:
        self._still = all(obstacle.lasting for obstacle in self.all)
        rows = [row for obstacle in self.all if (row := obstacle.shape(self.time)) is not None]
        self.shapes = np.array(rows) if rows else np.empty((0, 6))


def _point(value) -> bool:
    return isinstance(value, tuple) and len(value) == 2 and all(map(is_number, value))
