"""The optional laser scanner: one sweep every 0.1 s, its rays cast one after the other while the chair moves.

It has an interface of its own (USB or Ethernet) and never speaks on the CAN bus. What it sends is what a driver puts
into a sensor_msgs/LaserScan. Ranges follow REP 117: +Inf where nothing is within RANGE_MAX, -Inf where something is
nearer than RANGE_MIN. Its bracket sits 0.04 m behind the chair's front edge. The chair's own frame hides whatever is
more than VIEW to either side: those rays read -Inf, for the frame is nearer than RANGE_MIN.
"""

from __future__ import annotations

from math import floor, inf, radians
from typing import NamedTuple

import numpy as np

from sara_common.planar import between
from sara_sim.chips import mounting
from sara_sim.world.world import World

RAYS = 541
ANGLE_MIN, ANGLE_INCREMENT = radians(-135.0), radians(0.5)  # rad, in the frame `scan`, whose x is the chair's
PERIOD_STEPS = 10  # of 10 ms from one sweep's first ray to the next one's
TIME_INCREMENT = 0.1 / 720  # s from ray to ray: the mirror turns steadily through its 360 deg
RANGE_MIN, RANGE_MAX = 0.05, 10.0  # m
SIGMA = 0.01  # m
VIEW = radians(100.0)
ANGLES = ANGLE_MIN + ANGLE_INCREMENT * np.arange(RAYS)


class Scan(NamedTuple):
    """A sweep. stamp: s, of its first ray. ranges: (RAYS,), m."""

    stamp: float
    ranges: np.ndarray


class Scanner:
    """`silent`: it sends nothing. `frozen`: it repeats its last ranges. `scan`: the Scan that ended in the last step,
    None if none did.
    """

    def __init__(self, world: World, random: np.random.Generator, pose: tuple[float, float, float], step_s: float):
        """`pose`: true (x, y, yaw) of the chair at the start, m, rad. `step_s`: s between two calls of `step`."""
        self._world, self._random, self._step_s = world, random, step_s
        self._pose, self._tick = pose, 0
        self._ranges, self._done = np.full(RAYS, inf), 0  # of the present sweep, and how many rays of it were cast
        self._sent: np.ndarray | None = None
        self.silent = self.frozen = False
        self.scan: Scan | None = None

    def step(self, pose: tuple[float, float, float]) -> None:
        """One step on, at whose end the chair is at `pose`: cast the rays whose time has come."""
        before, self._pose, self.scan = self._pose, pose, None
        self._tick += 1
        phase = self._tick % PERIOD_STEPS
        if phase == 0:
            self._done = 0
        since = phase * self._step_s
        due = min(floor(since / TIME_INCREMENT + 1e-9) + 1, RAYS)
        if due > self._done:
            rays = np.arange(self._done, due)
            self._cast(rays, (rays * TIME_INCREMENT - since) / self._step_s + 1.0, before)
            self._done = due
            if due == RAYS:
                self._send((self._tick - phase) * self._step_s)

    def _cast(self, rays, shares, before):
        """Cast some rays, each from where the chair was after its share of the step."""
        x, y, yaw = between(before, self._pose, shares)
        mount = mounting.SCANNER
        c, s = np.cos(yaw), np.sin(yaw)
        places = np.column_stack(
            [x + c * mount.x - s * mount.y, y + s * mount.x + c * mount.y, yaw + mount.yaw + ANGLES[rays]]
        )
        self._ranges[rays] = self._world.laser(places, RANGE_MAX)

    def _send(self, stamp):
        ranges = self._ranges + self._random.normal(0.0, SIGMA, RAYS)
        ranges[(ranges < RANGE_MIN) | (np.abs(ANGLES) > VIEW)] = -inf
        ranges[ranges > RANGE_MAX] = inf
        if self.frozen and self._sent is not None:
            ranges = self._sent
        self._sent = ranges
        self.scan = None if self.silent else Scan(stamp, ranges)
