"""Caution with a memory: once somebody has been heard who moves by themselves, people are about, though nobody hears
them now.

A sonar tells of the nearest echo in its cone alone: behind a jamb, or round the end of a wall, somebody walks unheard
until they are nearer than it, and between the cones nobody is heard at all. So for a while after somebody was heard no
part of the body moves towards where a sensor looks faster than it could stop for who comes out from behind what that
sensor has heard nearest lately. Where that leaves nothing the chair creeps: so slowly that it is they who walk into it.
People are told by movers.py, heard twice; and by a chair that stands, which hears better than one that drives: what is
heard at another distance than before has moved by itself, to or fro. (Speeds that reckon with who may come out of what
is hidden: R. Alami, T. Simeon, K. M. Krishna, On the influence of sensor capacities and environment dynamics onto
collision-free motion plans, IROS 2002.)
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from sara_common.config import ConfigError, number_faults

STANDS = 1e-3, 0.04  # m/s commanded, rad/s measured: no more is rest
SETTLED = 0.8  # s of rest until echoes are compared
LONGEST_GAP = 0.65  # s between two echoes that are compared
MOVED = 0.10  # m by which the echo of what stands does not change,
SURE = 5.0  # nor by so many standard deviations of two readings, as this sensor scatters
TOUCHING = 0.10  # m that a reading of -Inf counts as
TWICE = 1.0  # s within which a mover must be heard twice: walls are taken for people at times, but once
BETWEEN = math.radians(
    20.0
)  # so far beyond both edges of its cone a sensor answers for who comes: between two cones that is for either
DIRECTIONS = 11  # looked at in that sector
LATELY = 1.0  # s that every echo counts for
DOUBT = 3.0  # s for which a sensor must scatter to be doubted, and before that in which it is not believed either
HISTORY = 100  # readings of each sensor that are kept
PACE = 0.08  # m of way after which what is heard counts as passed by


@dataclass(frozen=True)
class CautionConfig:
    """memory: s for which people are about after one was heard, 0: there is no caution. near: m; after one was heard
    within it the whole body creeps for near_memory (s). way: m for which the chair keeps in mind what was heard near:
    jambs leave the cones before the corners have passed them. walk: m/s, of who comes out from behind something.
    reaction: s from their first echo to the wheels' answer. braking: m/s2. creep: m/s, of any part of the body.
    patience: s of standing for people until goals are given up, 0: never. expected: whether people are reckoned with
    from the start, heard or not.
    """

    memory: float = 0.0
    near: float = 1.2
    near_memory: float = 3.0
    way: float = 0.6
    walk: float = 1.0
    reaction: float = 0.55
    braking: float = 1.5
    creep: float = 0.045
    patience: float = 0.0
    expected: bool = False

    def __post_init__(self):
        faults = number_faults(
            self,
            above_0=('near', 'walk', 'reaction', 'braking', 'creep'),
            from_0=('memory', 'near_memory', 'way', 'patience'),
        )
        if not isinstance(self.expected, bool):
            faults.append(f'expected is {self.expected!r}, allowed are true and false')
        elif self.expected and not faults and not self.memory:
            faults.append('expected is True, allowed is false where memory is 0: nothing is kept in mind then')
        if faults:
            raise ConfigError(faults)

    def allowed(self, heard):
        """m/s towards what is heard so far away (m), from which the chair stands before who comes out from behind it is
        there; creep at least.

        Both near each other for `reaction`, at walk + u; then it brakes, and they go on: (walk + u) reaction + u walk /
        braking + u^2 / (2 braking) = heard.
        """
        if heard == math.inf:
            return math.inf
        b = self.reaction + self.walk / self.braking
        return max(
            self.braking * (math.sqrt(b * b + 2.0 * max(heard - self.walk * self.reaction, 0.0) / self.braking) - b),
            self.creep,
        )


class Caution:
    """config: CautionConfig. sensors: RangeSensors, with half_angle (rad) of their cones. half: half the body's length
    and width, m.
    """

    def __init__(self, config, sensors, half_angle, half):
        self.config = config
        self._half = half
        # {name: (parts of v, of w that bring its corner of the body towards each of the directions it answers for)}
        self._sectors = {}
        for sensor in sensors:
            if sensor.stops:  # one inside the outline hears the jambs beside the chair
                self._sectors[sensor.name] = self._sector(sensor, half_angle)
        self._radius = math.hypot(*half)
        self._history = {name: deque(maxlen=HISTORY) for name in self._sectors}  # (stamp, m of way, m): raw readings
        self._nearest = {}  # {name: m} of what is known to be nearest, until the next reading
        self._way, self._last = 0.0, -math.inf
        self.expected = config.expected
        self._forget()

    def expect(self, expected):
        """Reckon with people whether or not one is heard, or no more. False where there is no caution."""
        self.expected = bool(expected and self.config.memory)
        return self.expected or not expected

    def _sector(self, sensor, half_angle):
        """Whom it answers for walks into the nearest corner of the body, or the sides next to it: from directions that
        look outward there.
        """
        angles = sensor.yaw + np.linspace(-half_angle - BETWEEN, half_angle + BETWEEN, DIRECTIONS)
        corner = np.copysign(self._half, (sensor.x, sensor.y))
        cos, sin = np.cos(angles), np.sin(angles)
        outward = (cos * corner[0] > -1e-9) & (sin * corner[1] > -1e-9)
        if not outward.any():
            outward[:] = True
        return cos[outward], (corner[0] * sin - corner[1] * cos)[outward]

    def _forget(self):
        self._stood = {}  # {name: (stamp, m)} of the last echo at rest
        self._witnesses = {}  # {name: stamp} of the last that a sensor told of somebody,
        self._close = {}  # and of somebody near
        self._coarse = {}  # {name: (stamp, stamp)} since when and until when it has scattered too much
        self._moved = self._mover = self._until = self._near_until = -math.inf
        for history in self._history.values():
            history.clear()
        self._nearest.clear()

    def add(self, name, distance, stamp, v, w, sigma, told=False):
        """A raw reading (m, +-Inf as in REP-117) at stamp (s), while the chair was told to drive at v (m/s) and turned
        by w (rad/s); sigma (m): of its scatter, +Inf where it tells of nobody; told: whether it is told to move at all.
        """
        if not self.config.memory:
            return
        if stamp < self._last - LATELY:  # the clock was set back
            self._forget()
            self._last = -math.inf
        if self._last > -math.inf:
            self._way += (abs(v) + abs(w) * self._radius) * min(max(stamp - self._last, 0.0), LONGEST_GAP)
        self._last = stamp
        if distance == -math.inf and stamp < self._until:
            self._close[name] = stamp
            self._remember()
        if distance < TOUCHING:
            distance = TOUCHING
        if name in self._history:
            self._history[name].append((stamp, self._way, distance))
            self._nearest.pop(name, None)
        if told or abs(v) > STANDS[0] or abs(w) > STANDS[1]:
            self._moved = stamp
            self._stood.clear()
        elif stamp - self._moved >= SETTLED and distance < math.inf:
            before = self._stood.get(name)
            self._stood[name] = stamp, distance
            if (
                before is not None
                and stamp - before[0] <= LONGEST_GAP
                and abs(distance - before[1]) > max(MOVED, SURE * math.sqrt(2.0) * sigma)
            ):
                self._heard(name, stamp, min(distance, before[1]))

    def mover(self, name, distance, stamp):
        """A sensor is sure at stamp (s) that somebody comes, at distance (m). While people are about once is enough."""
        if not self.config.memory:
            return
        if stamp < self._until or 0.0 <= stamp - self._mover <= TWICE:
            self._heard(name, stamp, distance)
        self._mover = stamp

    def doubted(self, name, stamp):
        """What a sensor says at stamp (s) scatters so that it tells of nobody. If it goes on so, nor did it in the
        seconds before, when that was not known yet.
        """
        since, until = self._coarse.get(name, (stamp, -math.inf))
        if (
            not 0.0 <= stamp - until <= LONGEST_GAP
        ):  # whoever walks to and fro before a sensor makes it scatter for a while, too
            since = stamp
        self._coarse[name] = since, stamp
        if stamp - since >= DOUBT and since - self._witnesses.get(name, -math.inf) <= DOUBT:
            del self._witnesses[name]
            self._close.pop(name, None)
            self._remember()

    def _heard(self, name, stamp, distance):
        self._witnesses[name] = stamp
        if distance <= self.config.near:
            self._close[name] = stamp
        self._remember()

    def _remember(self):
        self._until = max(self._witnesses.values(), default=-math.inf) + self.config.memory
        self._near_until = max(self._close.values(), default=-math.inf) + self.config.near_memory

    def about(self, now):
        """Whether people are about: one was heard lately."""
        return now < self._until

    def scale(self, v, w, now):
        """The factor 0..1 on the command (v m/s, w rad/s)."""
        if not (self.expected or self.about(now)):
            return 1.0
        if now < self._near_until:
            return min(1.0, self.config.creep / max(self._fastest(v, w), 1e-9))
        factor = 1.0
        for name, (ahead, across) in self._sectors.items():
            u = float((v * ahead + w * across).max())
            if u > self.config.creep:
                factor = min(factor, self.config.allowed(self._heard_nearest(name)) / u)
        return factor

    def _heard_nearest(self, name):
        """m: the nearest that a sensor hears, or has heard on the last bit of the way: on each PACE of it the nearest
        of the last second there.

        What ends while the chair stands has gone by itself, and is forgotten with the second; what was heard a pace
        before may have left the cone.
        """
        if name not in self._nearest:
            history, nearest, pace = self._history[name], math.inf, math.inf  # from the newest to the oldest
            for stamp, way, distance in reversed(history):
                if way < self._way - self.config.way:
                    break
                if way <= pace - PACE or pace == math.inf:  # the last reading of a pace
                    pace, last = way, stamp
                if stamp >= last - LATELY:
                    nearest = min(nearest, distance)
            self._nearest[name] = nearest
        return self._nearest[name]

    def _fastest(self, v, w):
        """m/s of the fastest corner of the body."""
        x, y = self._half
        return math.hypot(abs(v) + abs(w) * y, w * x)
