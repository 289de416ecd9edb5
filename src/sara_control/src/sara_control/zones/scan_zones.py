"""What an optional laser scanner tells the distance zones, beside the sonars.

Its hits are places like those on the arcs of the sonars' echoes, but exact ones, and of a quicker sensor. What moves
may come on towards the chair while it brakes.

A hit may explain an echo: where the scanner hit something in the sensor's cone at the echo's distance, the echo came
from there, and the arc has no place where the scanner saw it free. An echo that no hit explains keeps all its places:
what is too high or too low for the scanner, or came since it looked there, is where the sonar hears it.

A scan that is late, the same as the last one, or without sense ends all that at once; then the sonars' limits hold.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ahead_of_time import kernel
from sara_common.planar import compose, quaternion_from_yaw
from sara_common.scans import Sweep, shares_of, swept
from sara_control.zones import zone_places
from sara_control.zones.lost_echoes import NEAREST
from sara_control.zones.reckoning import Reckoning
from sara_control.zones.scan_config import ScanConfig
from sara_control.zones.scan_memory import ScanMemory
from sara_control.zones.zone_config import CRAWL, RangeSensor
from sara_control.zones.zone_places import Body, Places, Stopping

AHEAD = 0.1  # s: a stamp may be this far in the future
FARTHEST = 2.9  # m from the scanner: from there on a chair of 0.8 m/s brakes gently before who comes
NEAR = 3.4  # m from base_link within which hits count
WITHIN = 0.02  # m inside the body's margin where a hit may seem to be
SAME = 10  # ranges that are equal to those before: noise does not repeat itself
TOO_NEAR = 0.05  # m: so much farther may a hit be that explains an echo nearer than a sensor measures
EDGE = math.radians(4.0)  # beyond a sonar's cone, where a hit still explains its echo
LATE = 0.0, 0.2, 0.4, 0.6, 0.8  # s that an accepted echo may be old: median of three, and three readings to release it


class Echo(NamedTuple):
    """An accepted echo: its sensor, and the range (m) that it was accepted with."""

    sensor: RangeSensor
    range: float


class ScanZones:
    """config: ScanConfig. half: of a sonar's cone, rad. body: Body. `hits`: Places of what the scanner hit, in the base
    frame; `movers`: of those that move; `passed`: the same, of a body that is wider by `passing_distance` on each
    side. `live`: whether a scan is fresh. `dropped`: why the last scan was not taken, or ''.
    """

    def __init__(self, config: ScanConfig, half: float, body: Body) -> None:
        self.config, self._half, self._body = config, half, body
        self._wide = Body(body.half_length, body.half_width + config.passing_distance)
        self.reckoning = Reckoning()
        warm()
        self._memory = ScanMemory(config.walk, config.memory, config.still_memory)
        self._before, self._stamp, self._breaks = None, -math.inf, 0
        self._points, self._moves = np.empty((0, 2)), np.zeros(0, bool)
        self._seen_at, self._explained = -math.inf, {}
        self._begun = False  # before the first wheels and turn rates no way is known, and that is no fault
        self.hits = self.movers = self.passed = _places_of(np.empty((0, 2)), body)
        self.live = False

    @property
    def stamp(self) -> float:
        """When the newest scan ended, s; -inf where it was not taken."""
        return self._stamp

    def on_scan(self, sweep: Sweep, now: float) -> str:
        """Take a scan that came at now (s). Returns why it is not taken, or ''."""
        fault = self._fault(sweep, now)
        if fault:
            self._forget()
            return fault
        end = sweep.stamp + sweep.duration
        later = max(now, end)  # the clock may come after the scan
        ends = [self.reckoning.at(t, later) for t in (sweep.stamp, end)]
        if self.reckoning.breaks != self._breaks:
            self._breaks = self.reckoning.breaks
            self._forget()
        if None in ends:
            return 'scan on an unknown way' if self._begun else ''
        self._begun = True
        self._stamp = end
        self._remember(sweep, ends)
        return ''

    def _fault(self, sweep, now):
        """Why a scan is not to be believed, or ''."""
        if sweep.fault:
            return sweep.fault
        ranges = np.asarray(sweep.ranges, float)
        if self._before is not None and sweep.stamp <= self._before.stamp:
            self._before = None
            return 'scan older than the one before'
        before, self._before = self._before, sweep
        if not -AHEAD <= now - (sweep.stamp + sweep.duration) <= self.config.timeout:
            return 'scan late'
        if not (ranges > sweep.range_min).any():
            return 'scan without a reading'
        if before is not None and len(before.ranges) == len(ranges):
            finite = np.isfinite(ranges)
            if finite.sum() >= SAME and np.array_equal(ranges[finite], np.asarray(before.ranges, float)[finite]):
                return 'scan the same as before'
        return ''

    def _forget(self):
        self._memory.clear()
        self._stamp, self._points, self._moves = -math.inf, np.empty((0, 2)), np.zeros(0, bool)

    def _remember(self, sweep, ends):
        """Put a scan into the memory, each ray from where the scanner was at its time."""
        config, ranges = self.config, np.asarray(sweep.ranges, float)
        angles = sweep.angle_min + sweep.angle_increment * np.arange(len(ranges))
        angles = np.where(angles > math.pi, angles - math.tau, angles)  # some scanners count from 0 to 2 pi
        seen = (ranges >= sweep.range_min) & (np.abs(angles) <= config.view)  # not NaN
        rays, hit = np.flatnonzero(seen), ranges[seen] < min(sweep.range_max, FARTHEST)
        reach, angles = np.minimum(ranges[seen], FARTHEST), angles[seen]
        own = np.column_stack([reach * np.cos(angles), reach * np.sin(angles), np.zeros(len(reach))])
        mount = config.x, config.y, config.yaw
        places = [compose(pose, mount) for pose in ends]
        first, last = (((x, y, 0.0), quaternion_from_yaw(yaw)) for x, y, yaw in places)
        points = np.ascontiguousarray(swept(own, shares_of(rays, len(ranges)), first, last)[:, :2])
        middle = tuple(0.5 * (a + b) for a, b in zip(places[0][:2], places[1][:2]))
        self._memory.add(sweep.stamp, middle, points, hit)
        places, moves = self._memory.places()
        near = np.hypot(*(places - ends[1][:2]).T) <= NEAR
        self._points, self._moves = places[near], moves[near]

    def see(self, t: float) -> tuple[float, float, float] | None:
        """Bring `live` and `hits` to t (s). Returns the pose in the reckoned frame, None while no scan is fresh."""
        self._seen_at = t
        pose = self.reckoning.at(t, t) if -AHEAD <= t - self._stamp <= self.config.timeout else None
        self.live = pose is not None and self.reckoning.breaks == self._breaks
        if not self.live:
            self.hits = self.movers = self.passed = _places_of(np.empty((0, 2)), self._body)
            return None
        x, y, yaw = pose
        c, s = math.cos(yaw), math.sin(yaw)
        off = self._points - (x, y)
        points = np.column_stack([c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0]])
        self.hits = _places_of(points, self._body)
        self.movers = _places_of(points[self._moves], self._body)
        self.passed = _places_of(points[self._moves], self._wide)
        return pose

    def carved(
        self, places: Places, rays_of: Mapping[str, slice], echoes: Mapping[str, Echo], pose: tuple
    ) -> np.ndarray:
        """(n,) `outside` of the sonars' places without those that the scanner saw free, of the echoes it explains.

        rays_of: which places are a sensor's. pose: of base_link, from `see`.
        """
        outside = places.outside.copy()
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x, y = pose[0] + c * places.x - s * places.y, pose[1] + s * places.x + c * places.y
        known = self._memory.known(np.column_stack([x, y]))
        lately = [past for late in LATE if (past := self.reckoning.at(self._seen_at - late, self._seen_at)) is not None]
        for name, echo in echoes.items():
            rays = rays_of[name]
            if echo.range < math.inf and known[rays].any() and self._explains(echo, lately):
                outside[rays] = np.where(known[rays], math.inf, outside[rays])
        return outside

    def _explains(self, echo, lately):
        """Whether something was hit where an echo came from, at one of the chair's poses of late."""
        known, key = self._explained.get(echo.sensor.name, (None, None))
        if key != (echo.range, self._stamp):
            sensor = echo.sensor
            places = np.array([compose(pose, (sensor.x, sensor.y, sensor.yaw)) for pose in lately])
            distance, tolerance = float(echo.range), float(self.config.tolerance)
            if distance == -math.inf:  # anywhere nearer than a sensor measures
                distance = tolerance = 0.5 * (NEAREST + TOO_NEAR)
            known = in_cone(self._points, places, distance, self._half + EDGE, tolerance)
            self._explained[sensor.name] = known, (echo.range, self._stamp)
        return known

    def limit(self, v: float, w: float, stopping: Stopping, gentle_ease: float) -> tuple[float, str]:
        """(factor that the hits allow on a command (v m/s, w rad/s), +Inf if none limits it; side of the chair).
        stopping: the sonars'; gentle_ease: s that the gentle brake is given more.
        """
        config = self.config
        creep = min(stopping.creep, float(config.creep_speed)) if not stopping.creeps_everywhere else stopping.creep
        own = stopping._replace(
            stop_distance=float(config.stop_distance), reaction=float(config.reaction_time + gentle_ease), creep=creep
        )
        # While the chair reacts and brakes from u, what moves comes nearer by approach (reaction + u / braking).
        of_movers = Stopping(
            own.stop_distance + config.approach * own.reaction,
            own.reaction + config.approach / own.braking,
            own.braking,
            min(own.creep, CRAWL),
            True,
        )
        of_passed = of_movers._replace(creep=float(config.passing_speed))
        return min(
            self._limit_of(self.hits, v, w, self._body, own),
            self._limit_of(self.movers, v, w, self._body, of_movers),
            self._limit_of(self.passed, v, w, self._wide, of_passed),
        )

    def _limit_of(self, places, v, w, body, stopping):
        """As `limit`, of some places about a body."""
        if not len(places.x):
            return math.inf, ''
        factor, at = zone_places.limit(places, v, w, body, stopping)
        return (factor, self._side(places, at)) if at >= 0 else (math.inf, '')

    def _side(self, places, at):
        x, y = places.x[at] / self._body.half_length, places.y[at] / self._body.half_width
        if abs(x) >= abs(y):
            return 'front' if x > 0.0 else 'rear'
        return 'left' if y > 0.0 else 'right'


def _places_of(points, body):
    """Places at points (n, 2; base frame, m); a hit within the body itself is none."""
    x, y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
    outside = zone_places.outside_of(x, y, body)
    kept = outside > -WITHIN
    x, y, outside = x[kept], y[kept], np.maximum(outside[kept], 1e-3)
    none = np.zeros(len(x))
    return Places(x, y, outside, np.hypot(x, y), none, none, np.ones(len(x), bool), np.zeros((2, len(x))), none)


@kernel
def in_cone(points: np.ndarray, sensors: np.ndarray, distance: float, half: float, tolerance: float) -> bool:
    """Whether one of `points` (n, 2) is at a distance (m), give or take the tolerance, and within `half` (rad) of the
    axis of one of `sensors` (m, 3: x, y, yaw).
    """
    for i in range(len(sensors)):
        for j in range(len(points)):
            dx, dy = points[j, 0] - sensors[i, 0], points[j, 1] - sensors[i, 1]
            if abs(math.hypot(dx, dy) - distance) <= tolerance:
                off = (math.atan2(dy, dx) - sensors[i, 2] + math.pi) % (2.0 * math.pi) - math.pi
                if abs(off) <= half:
                    return True
    return False


def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    in_cone(np.ones((1, 2)), np.ones((1, 3)), 1.0, 0.5, 0.1)
