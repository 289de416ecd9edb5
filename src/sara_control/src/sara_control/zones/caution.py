"""Limits the speed for a while after a pedestrian was detected, where a hidden one could appear.

A sonar measures only the nearest echo in its cone. Behind a door jamb or the end of a wall a pedestrian is invisible
until they are nearer than it, and between the cones nothing is measured at all. So for a while after a detection no
part of the body moves in the direction of a sensor faster than it could stop for a pedestrian who comes out from behind
the nearest echo that this sensor has measured lately. Where that leaves no speed the chair creeps, so slowly that it is
the pedestrian who walks into it.

Who gives way is soon gone; who does not hits the chair, and is remembered for longer.

Two things count as a detection: approach_detector.py confirms an approach twice; or a standing chair, which measures
better than a driving one, measures an echo at another distance than before, nearer or farther.

Speeds that allow for pedestrians who are hidden: R. Alami, T. Simeon, K. M. Krishna, On the influence of sensor
capacities and environment dynamics onto collision-free motion plans, IROS 2002.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sara_common.config import ConfigError, number_faults
from sara_control.zones.zone_config import RangeSensor

STANDS = 1e-3, 0.04  # m/s commanded, rad/s measured: slower is standing
SETTLED = 0.8  # s of rest until echoes are compared
LONGEST_GAP = 0.65  # s between two echoes that are compared
MOVED = 0.10  # m: the echo of a static obstacle changes by less than this,
CERTAIN = 5.0  # or by less than so many standard deviations of the difference of two readings
TOUCHING = 0.10  # m that a reading of -Inf counts as
TWICE = 1.0  # s within which two approaches must be confirmed: a wall is mistaken for a pedestrian at times, but once
BETWEEN = math.radians(20.0)  # a sensor's sector goes this far beyond both edges of its cone: gaps belong to both sides
DIRECTIONS = 11  # in that sector
LATELY = 1.0  # s that every echo counts for
NOISY_FOR = 3.0  # s of noise after which a sensor's detections are void, and those of so many s before
PACE = 0.08  # m of path after which an echo counts as passed


@dataclass(frozen=True)
class CautionConfig:
    """memory: s that the limit holds after a detection, 0: no caution at all. after_contact: s that it holds after the
    chair was hit: somebody about does not give way. near: m; after a detection within it the whole body creeps for
    near_memory (s). way: m of path for which the nearest echo is remembered: jambs leave the
    cones before the body's corners have passed them. walk: m/s, of a pedestrian who comes out. reaction: s from their
    first echo to the wheels' answer. braking: m/s2. creep: m/s, of any part of the body. patience: s of standing for
    pedestrians until goals are given up, 0: never. expected: whether the limit holds from the start, without a
    detection.
    """

    memory: float = 0.0
    after_contact: float = 0.0
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
            from_0=('memory', 'after_contact', 'near_memory', 'way', 'patience'),
        )
        if not isinstance(self.expected, bool):
            faults.append(f'expected is {self.expected!r}, allowed are true and false')
        elif self.expected and not faults and not self.memory:
            faults.append('expected is True, allowed is false where memory is 0: nothing is kept in mind then')
        if faults:
            raise ConfigError(faults)

    def allowed(self, distance: float) -> float:
        """The speed u (m/s) in the direction of the nearest echo at `distance` (m), at which the chair stands before a
        pedestrian who comes out from behind the echo reaches it; creep at least.

        Both approach each other for `reaction`, at walk + u; then the chair brakes and the pedestrian walks on:
        (walk + u) reaction + u walk / braking + u^2 / (2 braking) = distance.
        """
        if distance == math.inf:
            return math.inf
        b = self.reaction + self.walk / self.braking
        room = max(distance - self.walk * self.reaction, 0.0)
        return max(self.braking * (math.sqrt(b * b + 2.0 * room / self.braking) - b), self.creep)


class Motion(NamedTuple):
    """The chair's motion at a reading: v (m/s) as commanded, w (rad/s) as measured; commanded: whether the wheels are
    told to turn at all (a turn is commanded before it is measured).
    """

    v: float = 0.0
    w: float = 0.0
    commanded: bool = False

    @property
    def standing(self) -> bool:
        """Whether the chair stands, and is to stand."""
        return not self.commanded and abs(self.v) <= STANDS[0] and abs(self.w) <= STANDS[1]


class Heard(NamedTuple):
    """A raw reading: s, m of path until then, m."""

    stamp: float
    path: float
    range: float


class Caution:
    """config: CautionConfig. sensors: RangeSensors, with half_angle (rad) of their cones. half: half the body's length
    and width, m.

    `expected`: whether the limit holds without a detection.
    """

    def __init__(
        self, config: CautionConfig, sensors: Sequence[RangeSensor], half_angle: float, half: tuple[float, float]
    ) -> None:
        self.config = config
        self._half = half
        # {name: (parts of v, of w that move its corner of the body in each direction of its sector)}
        self._sectors = {}
        for sensor in sensors:
            if sensor.stops:  # one inside the outline measures the jambs beside the chair
                self._sectors[sensor.name] = self._sector(sensor, half_angle)
        self._radius = math.hypot(*half)
        self._history = {name: deque() for name in self._sectors}  # Heard
        self._nearest = {}  # {name: m}, cached until the next reading
        self._path, self._last = 0.0, -math.inf
        self.expected = config.expected
        self._forget()

    def expect(self, expected: bool) -> bool:
        """Hold the limit whether or not a pedestrian is detected, or no more. False where there is no caution."""
        self.expected = bool(expected and self.config.memory)
        return self.expected or not expected

    def _sector(self, sensor, half_angle):
        """The parts of v and w (see __init__) of the sensor's nearest corner of the body, for each direction of the
        sector that points outward there.
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
        self._detected = {}  # {name: stamp} of a sensor's last detection,
        self._detected_near = {}  # and of its last one nearby
        self._noisy = {}  # {name: (stamp, stamp)} since when and until when it has been too noisy
        self._moved_at = self._approach_at = self._until = self._near_until = self._hit_until = -math.inf
        for history in self._history.values():
            history.clear()
        self._nearest.clear()

    def on_range(self, name: str, distance: float, stamp: float, motion: Motion, sigma: float) -> None:
        """Takes a raw reading (m, +-Inf as in REP-117) at stamp (s).

        sigma: standard deviation of its noise, m, +Inf where it is too noisy for a detection.
        """
        if not self.config.memory:
            return
        self._drive(stamp, motion)
        if distance == -math.inf and self.pedestrians_nearby(stamp):
            self._detected_near[name] = stamp
            self._renew()
        if distance < TOUCHING:
            distance = TOUCHING
        if name in self._history:
            self._remember(self._history[name], Heard(stamp, self._path, distance))
            self._nearest.pop(name, None)
        if not motion.standing:
            self._moved_at = stamp
            self._stood.clear()
        elif stamp - self._moved_at >= SETTLED and distance < math.inf:
            before = self._stood.get(name)
            self._stood[name] = stamp, distance
            if (
                before is not None
                and stamp - before[0] <= LONGEST_GAP
                and abs(distance - before[1]) > max(MOVED, CERTAIN * math.sqrt(2.0) * sigma)
            ):
                self._detect(name, stamp, min(distance, before[1]))

    def _remember(self, history, heard):
        """All of `way`; where the chair stands, what was heard there LATELY."""
        here = []
        while history and history[-1].path == heard.path:
            here.append(history.pop())
        history.extend(before for before in reversed(here) if before.stamp >= heard.stamp - LATELY)
        history.append(heard)
        while history[0].path < heard.path - self.config.way:
            history.popleft()

    def _drive(self, stamp, motion):
        """The chair has moved so until stamp (s)."""
        if stamp < self._last - LATELY:  # the clock was set back
            self._forget()
            self._last = -math.inf
        if self._last > -math.inf and not motion.standing:
            seconds = min(max(stamp - self._last, 0.0), LONGEST_GAP)
            self._path += (abs(motion.v) + abs(motion.w) * self._radius) * seconds
        self._last = stamp

    def on_approach(self, name: str, distance: float, stamp: float) -> None:
        """A sensor has confirmed at stamp (s) that an obstacle at `distance` (m) approaches. The second one counts, and
        every one while pedestrians are nearby.
        """
        if not self.config.memory:
            return
        if self.pedestrians_nearby(stamp) or 0.0 <= stamp - self._approach_at <= TWICE:
            self._detect(name, stamp, distance)
        self._approach_at = stamp

    def on_contact(self, stamp: float) -> None:
        """The chair was hit at stamp (s)."""
        if self.config.memory:
            self._hit_until = stamp + self.config.after_contact

    def on_noise(self, name: str, stamp: float) -> None:
        """A sensor's readings at stamp (s) are too noisy for a detection. If that goes on, its detections in the
        seconds before are void: the noise was not known yet.
        """
        since, until = self._noisy.get(name, (stamp, -math.inf))
        if not 0.0 <= stamp - until <= LONGEST_GAP:  # a pedestrian who walks to and fro looks like noise for a while
            since = stamp
        self._noisy[name] = since, stamp
        if stamp - since >= NOISY_FOR and since - self._detected.get(name, -math.inf) <= NOISY_FOR:
            del self._detected[name]
            self._detected_near.pop(name, None)
            self._renew()

    def _detect(self, name, stamp, distance):
        self._detected[name] = stamp
        if distance <= self.config.near:
            self._detected_near[name] = stamp
        self._renew()

    def _renew(self):
        self._until = max(self._detected.values(), default=-math.inf) + self.config.memory
        self._near_until = max(self._detected_near.values(), default=-math.inf) + self.config.near_memory

    def pedestrians_nearby(self, now: float) -> bool:
        """Whether one was detected within `memory`, or hit the chair within `after_contact`, before now (s)."""
        return now < max(self._until, self._hit_until)

    def scale(self, v: float, w: float, now: float) -> float:
        """The factor 0..1 on the command (v m/s, w rad/s) at now (s)."""
        if not (self.expected or self.pedestrians_nearby(now)):
            return 1.0
        if now < self._near_until:
            return min(1.0, self.config.creep / max(self._fastest(v, w), 1e-9))
        factor = 1.0
        for name, (ahead, across) in self._sectors.items():
            u = float((v * ahead + w * across).max())
            if u > self.config.creep:
                factor = min(factor, self.config.allowed(self._nearest_echo(name)) / u)
        return factor

    def _nearest_echo(self, name):
        """m: the nearest echo of a sensor now and on the last bit of the path: in each PACE of it the nearest of the
        last second there.

        An echo that ends while the chair stands has moved away, and is forgotten with its second; one that ends while
        it drives may have left the cone.
        """
        if name not in self._nearest:
            history, nearest, pace = self._history[name], math.inf, math.inf  # from the newest to the oldest
            for stamp, path, distance in reversed(history):
                if path < self._path - self.config.way:
                    break
                if path <= pace - PACE or pace == math.inf:  # the last reading of a pace
                    pace, last = path, stamp
                if stamp >= last - LATELY:
                    nearest = min(nearest, distance)
            self._nearest[name] = nearest
        return self._nearest[name]

    def _fastest(self, v, w):
        """m/s of the fastest corner of the body."""
        x, y = self._half
        return math.hypot(abs(v) + abs(w) * y, w * x)
