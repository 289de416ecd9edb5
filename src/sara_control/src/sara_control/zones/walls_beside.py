"""Walls that come nearer beside the chair while it drives, and go on before its corner, where no sensor hears them.

A smooth wall sends an echo back only to a sensor that looks at it squarely, within 60 degrees: one along which the
chair drives, and which closes in by some degrees, is heard by the sensors that look to that side, and not by those that
look ahead. The ranges that such a sensor measured on the way are circles about the places where it was; a wall touches
them all. So a line n x = d is fitted to them (n towards the wall, r = d - n p for a range r at a place p), and the wall
is taken to go on for REACH beyond the edge of the chair that leads. Of the sensors of a side the one that leads is
asked, since it hears the wall's end first. A chair that turns towards the wall soon looks at it squarely, or into an
opening: then the wall is none of this module's.

That the circle of one reading and the tangent of several tell a wall is from J. Leonard, H. Durrant-Whyte, Directed
sonar sensing for mobile robot navigation, 1992.
"""

import math
from collections import deque
from collections.abc import Iterable
from typing import NamedTuple

from sara_common.planar import advanced, compose, wrap
from sara_control.zones.lost_echoes import DISORDER, LONGEST_GAP, MOVING, NEAREST
from sara_control.zones.tangents import Line, tangent
from sara_control.zones.zone_config import RangeSensor
from sara_control.zones.zone_places import Body

FARTHEST = 1.2  # m: an echo from farther away is not searched for a wall
APART = 0.03  # m that are driven between two readings of a wall
LEAST, SPAN, LONGEST = 3, 0.4, 0.8  # readings of a wall; m of way that they span at least, and at most
STRAIGHT = 0.015  # m, r.m.s., by which they may differ from a line: those of an edge that is passed differ by more
ENDED, MISSES = 0.1, 3  # m off the wall, and so many times in a row: it has ended, or something stands before it
DELAY = 0.1  # s from a burst to the stamp of its raw range
BORDER = 0.05  # rad beyond the border of the cone at which a wall may still be heard
CLOSING, STEEP = 0.07, 0.44  # rad by which it closes in, at least; one that does so by more is heard ahead
REACH, STEP = 0.7, 0.1  # m beyond the edge that leads; between two places of a wall
MARGIN = 0.03  # m by which a wall may be nearer than the line found
PLACES = round(REACH / STEP)  # of a wall
TURNING = 0.5  # 1/m: a curve towards the wall that is tighter than this turns towards it


class Reading(NamedTuple):
    """x, y, axis of the sensor in the frame of the way (m, rad). range, m. driven: m until then. along: m ahead, less
    those astern.
    """

    x: float
    y: float
    axis: float
    range: float
    driven: float
    along: float


def fitted(readings: list[Reading], half_angle: float, spare: bool = True) -> Line | None:
    """The wall that readings of one sensor tell of; None where they do not: too few, or not of one flat thing in the
    cone (half_angle, rad). spare: whether one of them may be of something else.
    """
    along = [q.along for q in readings]
    if len(readings) < LEAST or max(along) - min(along) < SPAN:
        return None
    found = tangent([(q.x, q.y, q.range) for q in readings], readings[-1].axis)
    if found is None:
        return None
    if math.sqrt(sum(e * e for e in found.off) / len(readings)) > STRAIGHT:
        if not spare or len(readings) <= LEAST + 1:
            return None
        worst = max(range(len(readings)), key=lambda k: abs(found.off[k]))
        return fitted(readings[:worst] + readings[worst + 1 :], half_angle, False)
    wall = found.line
    if any(abs(wrap(wall.normal - q.axis)) > half_angle + BORDER for q in (readings[0], readings[-1])):
        return None
    return wall


class WallsBeside:
    """sensors: RangeSensors, of which those are used that look to a side. half_angle: of their cones, rad. body: a
    Body. `places`: (x, y, sensor's name, side) of walls that close in, beyond the edge that leads, in the base frame
    now, m; side: 1.0 left, -1.0 right.
    """

    def __init__(self, sensors: Iterable[RangeSensor], half_angle: float, body: Body) -> None:
        sensors = [sensor for sensor in sensors if abs(math.sin(sensor.yaw)) > 0.7]
        self._sensors = {sensor.name: sensor for sensor in sensors}
        self.most = 2 * PLACES  # places at most
        self._half, self._body = half_angle, body
        self._stamp, self._pose, self._driven, self._along, self._sense = None, (0.0, 0.0, 0.0), 0.0, 0.0, 1.0
        self.places: list[tuple[float, float, str, float]] = []
        sides = [[s for s in sensors if s.y * side > 0.0] for side in (1.0, -1.0)]
        self._leading = {
            sense: {max(of, key=lambda s: sense * s.x).name for of in sides if of} for sense in (1.0, -1.0)
        }
        self._forget()

    def _forget(self):
        self._readings: dict[str, deque[Reading]] = {name: deque() for name in self._sensors}
        self._walls: dict[str, Line] = {}
        self._misses = dict.fromkeys(self._sensors, 0)

    def on_range(self, name: str, distance: float, stamp: float, v: float, w: float) -> bool:
        """A raw range (m, REP-117) of a sensor at stamp (s), while the chair moves at v (m/s), w (rad/s). Returns
        whether `places` have changed.
        """
        self._advance(stamp, v, w)
        if name in self._sensors:
            self._hear(self._sensors[name], distance, advanced(*self._pose, v, w, -DELAY))
        before, self.places = self.places, list(self._closing())
        return self.places != before

    def _advance(self, stamp, v, w):
        if self._stamp is not None and -DISORDER <= stamp - self._stamp <= 0.0:
            return
        dt = math.inf if self._stamp is None else stamp - self._stamp
        self._stamp = stamp
        self._sense = self._sense if abs(v) <= MOVING else math.copysign(1.0, v)
        if not 0.0 < dt <= LONGEST_GAP:
            self._forget()
            return
        self._pose = advanced(*self._pose, v, w, dt)
        self._driven, self._along = self._driven + abs(v) * dt, self._along + v * dt

    def _hear(self, sensor, distance, pose):
        """A range that was measured when the chair was at a pose."""
        readings, name = self._readings[sensor.name], sensor.name
        x, y, axis = compose(pose, (sensor.x, sensor.y, sensor.yaw))
        known = self._walls.get(name)
        if distance < NEAREST:  # too near to be measured: the wall is where it was
            self._misses[name] = 0
            return
        farther = 0.0 if known is None else distance - known.distance(x, y)
        if distance > FARTHEST or abs(farther) > ENDED:
            self._misses[name] += 1
            if self._misses[name] >= MISSES:
                readings.clear()
                self._walls.pop(name, None)
            return
        self._misses[name] = 0
        if not readings or self._driven - readings[-1].driven >= APART:
            readings.append(Reading(x, y, axis, distance, self._driven, self._along))
            while readings[-1].driven - readings[0].driven > LONGEST:
                readings.popleft()
        found = fitted(list(readings), self._half) or known
        if found:
            self._walls[name] = found

    def turned_to(self, v: float, w: float) -> float:
        """The side of such places to which the chair turns at (v, w): 1.0 left, -1.0 right, 0.0 to none."""
        turns = bool(self.places) and abs(w) > TURNING * abs(v)
        return math.copysign(1.0, w) * math.copysign(1.0, v) if turns else 0.0

    def _closing(self):
        x, y, yaw = self._pose
        for name, wall in self._walls.items():
            if name not in self._leading[self._sense]:
                continue
            c, s = math.cos(wall.normal - yaw), math.sin(wall.normal - yaw)
            if not math.sin(CLOSING) <= self._sense * c <= math.sin(STEEP):
                continue
            away, side = wall.distance(x, y) - MARGIN, math.copysign(1.0, self._sensors[name].y)
            for k in range(PLACES):
                along = self._sense * (self._body.half_length + (k + 0.5) * STEP)
                across = (away - c * along) / s
                if side * across > -self._body.half_width:
                    yield along, across, name, side
