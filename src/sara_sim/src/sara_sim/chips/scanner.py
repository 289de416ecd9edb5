"""A laser scanner that moves: the rays of a sweep are cast one after the other, or all at once.

What it sends is what a driver puts into a sensor_msgs/LaserScan. Ranges follow REP 117: +Inf where nothing is within
its reach, -Inf where something is nearer than it can see. The chair's scanner (the constants here) sweeps every 0.1 s;
it has an interface of its own (USB or Ethernet) and never speaks on the CAN bus. The chair's own frame hides whatever
is more than VIEW to either side: those rays read -Inf, for the frame is nearer than RANGE_MIN.
"""

from __future__ import annotations

from math import floor, inf, radians
from typing import NamedTuple

import numpy as np

from sara_common.planar import Pose2D, between
from sara_common.scans import Sweep
from sara_sim.world.world import World

RAYS = 541
ANGLE_MIN, ANGLE_INCREMENT = radians(-135.0), radians(0.5)  # rad, in the frame `scan`, whose x is the chair's
PERIOD_STEPS = 10  # of 10 ms from one sweep's first ray to the next one's
TIME_INCREMENT = 0.1 / 720  # s from ray to ray: the mirror turns steadily through its 360 deg
RANGE_MIN, RANGE_MAX = 0.05, 10.0  # m
SIGMA = 0.01  # m
VIEW = radians(100.0)
ANGLES = ANGLE_MIN + ANGLE_INCREMENT * np.arange(RAYS)


class Optics(NamedTuple):
    """What one scanner is like. mount: where it sits; rays: how many, from angle_min on, angle_increment apart (rad, in
    its own frame); period_steps: steps from one sweep's first ray to the next one's; time_increment: s from ray to ray,
    0 where all are cast at once; range_min, range_max, sigma: m; view: rad to either side, beyond which the vehicle
    itself is in the way.
    """

    mount: Pose2D
    rays: int
    angle_min: float
    angle_increment: float
    period_steps: int
    time_increment: float
    range_min: float
    range_max: float
    sigma: float
    view: float = inf

    @property
    def angles(self) -> np.ndarray:
        """(rays,) rad."""
        return self.angle_min + self.angle_increment * np.arange(self.rays)


def optics_at(mount: Pose2D) -> Optics:
    """The chair's scanner, sitting there."""
    return Optics(
        mount, RAYS, ANGLE_MIN, ANGLE_INCREMENT, PERIOD_STEPS, TIME_INCREMENT, RANGE_MIN, RANGE_MAX, SIGMA, VIEW
    )


class Scan(NamedTuple):
    """A sweep. stamp: s, of its first ray. ranges: (n,), m."""

    stamp: float
    ranges: np.ndarray


class Scanner:
    """`silent`: it sends nothing. `frozen`: it repeats its last ranges. `scan`: the Scan that ended in the last step,
    None if none did.
    """

    def __init__(
        self,
        world: World,
        random: np.random.Generator,
        pose: tuple[float, float, float],
        step_s: float,
        optics: Optics,
    ):
        """`pose`: true (x, y, yaw) of the vehicle at the start, m, rad. `step_s`: s between two calls of `step`."""
        self._world, self._random, self._step_s, self.optics = world, random, step_s, optics
        self._pose, self._tick = pose, 0
        self._rays, self._angles = optics.rays, optics.angles
        self._hidden = np.abs(self._angles) > optics.view
        self._ranges, self._done = np.full(self._rays, inf), 0  # of the present sweep, and how many rays were cast
        self._sent: np.ndarray | None = None
        self.silent = self.frozen = False
        self.scan: Scan | None = None

    def step(self, pose: tuple[float, float, float]) -> None:
        """One step on, at whose end the vehicle is at `pose`: cast the rays whose time has come."""
        before, self._pose, self.scan = self._pose, pose, None
        self._tick += 1
        phase = self._tick % self.optics.period_steps
        if phase == 0:
            self._done = 0
        if self._done == self._rays:
            return
        since, increment = phase * self._step_s, self.optics.time_increment
        due = min(floor(since / increment + 1e-9) + 1, self._rays) if increment else self._rays
        if due > self._done:
            rays = np.arange(self._done, due)
            self._cast(rays, (rays * increment - since) / self._step_s + 1.0, before)
            self._done = due
            if due == self._rays:
                self._send((self._tick - phase) * self._step_s)

    def _cast(self, rays, shares, before):
        """Cast some rays, each from where the vehicle was after its share of the step."""
        x, y, yaw = between(before, self._pose, shares)
        mount, angles = self.optics.mount, self._angles
        c, s = np.cos(yaw), np.sin(yaw)
        places = np.column_stack(
            [x + c * mount.x - s * mount.y, y + s * mount.x + c * mount.y, yaw + mount.yaw + angles[rays]]
        )
        self._ranges[rays] = self._world.laser(places, self.optics.range_max)

    def _send(self, stamp):
        optics = self.optics
        ranges = self._ranges + self._random.normal(0.0, optics.sigma, self._rays)
        ranges[(ranges < optics.range_min) | self._hidden] = -inf
        ranges[ranges > optics.range_max] = inf
        if self.frozen and self._sent is not None:
            ranges = self._sent
        self._sent = ranges
        self.scan = None if self.silent else Scan(stamp, ranges)


def sweep_of(scan: Scan, optics: Optics) -> Sweep:
    """A Scan with all that a sensor_msgs/LaserScan says besides."""
    return Sweep(
        scan.stamp,
        optics.angle_min,
        optics.angle_min + optics.angle_increment * (optics.rays - 1),
        optics.angle_increment,
        optics.time_increment,
        optics.range_min,
        optics.range_max,
        np.asarray(scan.ranges),
    )
