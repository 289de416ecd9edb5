"""A rider who drives the flat by hand, by a joystick: from room to room through its doors.

The rider knows what the page shows, the chair's pose, and follows straight legs: aims at a point a little ahead on the
leg, turns in place where that lies aside, and backs up a little where the chair does not move any more, farther where
that has not helped; a chair that does not back up either is driven on a little, then back again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from sara_common.planar import wrap

Point = tuple[float, float]
CORRIDOR_Y = 4.9  # m, its middle
DOORS = {  # of each room of the flat: where its door's axis is (x, m), and a point of that axis inside the room (y, m)
    'kitchen': (1.95, 3.1),
    'living_room': (3.05, 6.7),
    'bathroom': (5.95, 3.1),
    'bedroom': (8.4, 6.7),
    'childs_room': (9.0, 3.1),
}
TOUR = (
    'kitchen',
    'living_room',
    'front_door',
    'bathroom',
    'corridor',
    'bedroom',
    'childs_room',
    'corridor',
    'bathroom',
    'front_door',
)
AHEAD = 0.7  # m along the leg, that the rider aims at
THERE = 0.3  # m from the place, where the rider lets go
SLOWS = 0.8  # m before a corner, where the rider begins to go slowly
TURNS, TURNED = 0.5, 0.1  # rad aside, from which on the joystick turns in place, and until when
STUCK_S, FREES_S = 4.0, 1.5  # without having moved, until the rider drives back or on, and for how long
FARTHER, AGAIN = 3, 0.5  # times as long at most, where the chair stands again within that (m)
MOVED = (0.03, 0.05)  # m, rad


def stop(number: int) -> str:
    """The place where journey `number` (1, 2, ...) ends and the next one begins; 0: where the first begins."""
    return TOUR[(number - 1) % len(TOUR)]


def legs(start: str, goal: str, places: Mapping[str, Sequence[float]]) -> list[Point]:
    """The corners of the way between two places of the flat, both included; without a door it is in the corridor."""
    way = [(places[start][0], places[start][1])]
    if start in DOORS:
        way += [(DOORS[start][0], DOORS[start][1]), (DOORS[start][0], CORRIDOR_Y)]
    if goal in DOORS:
        way += [(DOORS[goal][0], CORRIDOR_Y), (DOORS[goal][0], DOORS[goal][1])]
    return [*way, (places[goal][0], places[goal][1])]


class Legs:
    """Straight legs that somebody follows. way: their corners, first where the chair is. passed: m before a corner,
    where the next leg begins.
    """

    def __init__(self, way: Sequence[Point], passed: float) -> None:
        self._way, self._leg, self._passed = list(way), 1, passed

    def is_there(self, pose: Sequence[float]) -> bool:
        """Whether the chair, at (x, y, yaw), is at the end of the last leg."""
        return self._leg == len(self._way) - 1 and math.dist(pose[:2], self._way[-1]) < THERE

    def _along(self, pose):
        """m that are left of this leg, and where the leg ends and which way it leads (unit vector)."""
        (ax, ay), (bx, by) = self._way[self._leg - 1], self._way[self._leg]
        long = math.dist((ax, ay), (bx, by))
        ux, uy = (bx - ax) / long, (by - ay) / long
        return (bx - pose[0]) * ux + (by - pose[1]) * uy, (bx, by), (ux, uy)

    def look(self, pose: Sequence[float]) -> tuple[float, float]:
        """(m left of this leg; rad, + to the left: how far aside lies the point of it AHEAD of the chair)."""
        left, end, along = self._along(pose)
        while self._leg < len(self._way) - 1 and left < self._passed:
            self._leg += 1
            left, end, along = self._along(pose)
        short = max(left - AHEAD, 0.0)
        aim = end[0] - short * along[0], end[1] - short * along[1]
        return left, wrap(math.atan2(aim[1] - pose[1], aim[0] - pose[0]) - pose[2])


class Rider:
    """way: corners of the legs, first where the chair is."""

    def __init__(self, way: Sequence[Point]) -> None:
        self._legs = Legs(way, passed=0.08)
        self._still: tuple[float, tuple[float, ...]] | None = None
        self._frees_until, self._frees = -math.inf, 0
        self._stood, self._times = (math.inf, math.inf), 0
        self._turns = False

    def is_there(self, pose: Sequence[float]) -> bool:
        """Whether the chair, at (x, y, yaw), is where the rider wants to be."""
        return self._legs.is_there(pose)

    def frees(self, t: float, pose: Sequence[float]) -> int:
        """-1, 1: the chair has not moved for long, and the rider drives it back or on, in turn; 0: neither. t: s."""
        if t < self._frees_until:
            return self._frees
        since = self._still
        moved = since is None or math.dist(pose[:2], since[1][:2]) > MOVED[0]
        if moved or abs(wrap(pose[2] - since[1][2])) > MOVED[1]:
            self._still, self._frees = (t, tuple(pose)), 0
        elif t - since[0] > STUCK_S:
            if self._frees == 0:  # it has moved since
                again = math.dist(pose[:2], self._stood) < AGAIN
                self._times, self._stood = min(self._times + 1, FARTHER) if again else 1, tuple(pose[:2])
            self._still, self._frees_until = (t, tuple(pose)), t + FREES_S * self._times
            self._frees = 1 if self._frees < 0 else -1
            return self._frees
        return 0

    def stick(self, t: float, pose: Sequence[float]) -> tuple[float, float]:
        """(forward, left): the joystick's way in shares of its radius."""
        if frees := self.frees(t, pose):
            return 0.6 * frees, 0.0
        left, aside = self._legs.look(pose)
        self._turns = abs(aside) > (TURNED if self._turns else TURNS)
        if self._turns:
            return 0.0, math.copysign(min(1.0, 0.3 + 0.7 * abs(aside)), aside)
        return max(min(1.0 - abs(aside) / TURNS, left / SLOWS), 0.3), min(max(1.4 * aside, -0.7), 0.7)
