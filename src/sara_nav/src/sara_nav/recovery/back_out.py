"""Recovery by backing out: slowly back along the way the robot came by, where it fitted before, to plan anew from
there.

It follows the poses it remembers by pure pursuit (Coulter, 1992), backwards, and forwards where it had come backwards.
In each cycle the footprint is tried on the local costmap along the arc that it is about to drive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sara_common.config import range_faults
from sara_common.planar import wrap
from sara_nav.grids.free_motions import arc
from sara_nav.grids.grid import LETHAL, UNKNOWN
from sara_nav.pursuit.smooth_speed import Caps, Motion, SpeedLimits, approach, next_speed
from sara_nav.recovery.behaviours import (
    RECOVERIES,
    ClearCostmapConfig,
    ClearCostmapRecovery,
    Recovery,
    RecoveryStep,
    Situation,
)

LOOKAHEAD = 0.3
"""Distance (m) of the remembered pose that is aimed at."""
LEAST_WAY = 0.02
"""Ways shorter than this (m) are none."""
SLOWEST = 0.01
"""Speed (m/s) below which it stands, and at which the last of a way is driven."""
TURNED = 0.1
"""A turn in place ends so near (rad) to the track."""
REVERSED = 0.75 * math.pi
"""Where the track bends away by more (rad) the robot had changed between ahead and astern, and does so again."""
NOWHERE = 0.05
"""One that has driven less than this (m) has got nowhere."""
ALONG, STRAIGHT, AWAY = range(3)
MANNERS = 'backing out along the way it came', 'backing out straight', 'drawing away from what is behind'
SPACING = 0.03
"""The footprint is tried every so many metres."""


@dataclass(frozen=True)
class BackOutConfig:
    """distance: m to go back. farthest: m it goes back at most, where it cannot turn about after ``distance``. speed
    m/s, acc_lim m/s2, jerk_lim m/s3, max_vel_theta rad/s. corner_angle: rad, a track that bends away by more is turned
    to in place.
    room: m about the circle of its corners that must be free to turn about. clearance: m that stay free behind.
    held_timeout: s of standing, told to move, until it tries otherwise: straight back, then ``ahead`` (m) the other
    way; 0: never that. forget: whether it forgets what sensors marked once it has gone back at least half of
    ``distance``, from where they hear what is before the robot.
    """

    distance: float = 0.6
    farthest: float = 1.5
    speed: float = 0.12
    acc_lim: float = 0.2
    jerk_lim: float = 0.6
    max_vel_theta: float = 0.3
    corner_angle: float = 0.6
    room: float = 0.15
    clearance: float = 0.05
    ahead: float = 0.3
    held_timeout: float = 3.0
    forget: bool = False

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = range_faults(
            self,
            {
                'distance': (0.05, 10.0),
                'farthest': (0.05, 10.0),
                'speed': (0.01, 2.0),
                'acc_lim': (0.01, 10.0),
                'jerk_lim': (0.01, 100.0),
                'max_vel_theta': (0.01, 5.0),
                'corner_angle': (0.1, math.pi),
                'room': (0.0, 5.0),
                'clearance': (0.0, 1.0),
                'ahead': (0.0, 10.0),
                'held_timeout': (0.5, 60.0),
            },
        )
        if not result and self.farthest < self.distance:
            result.append(f'farthest is {self.farthest:g}, allowed is at least distance ({self.distance:g})')
        return result


@RECOVERIES.register('sara_nav/BackOutRecovery')
class BackOutRecovery(Recovery):
    """Drives back; see the module."""

    config_class = BackOutConfig

    def __init__(self, name: str, config: BackOutConfig | None = None) -> None:
        super().__init__(name, config)
        self._forget = ClearCostmapRecovery(name, ClearCostmapConfig(reset_distance=0.0, force_updating=True))
        self._limits = SpeedLimits(self.config.acc_lim, self.config.acc_lim, self.config.jerk_lim)
        self._begin(None)

    def _begin(self, pose):
        self._from, self._still_at, self._still_since = pose, pose, None
        self._driven = self._speed = self._acceleration = self._curvature = 0.0
        self._sign, self._turning, self._manner, self._since = 0, False, ALONG, 0.0
        self._end = ''

    def start(self, situation: Situation) -> None:
        """Begin."""
        self._begin(situation.local_pose)

    def excuse_standing(self) -> None:
        """See Recovery."""
        self._still_since = None

    def update(self, situation: Situation) -> RecoveryStep:
        """Return what to drive in this cycle."""
        c, here = self.config, situation.local_pose
        self._driven += here.distance(self._from)
        self._from = here
        if not self._end and not self._sign and abs(situation.velocity[0]) > 2.0 * LEAST_WAY:
            return RecoveryStep(done=False, text=f'{self.name}: coming to rest')
        turn, curvature, left = (0.0, 0.0, 0.0) if self._end else self._wanted(situation, here)
        if self._held(situation.t, here, turn, left):
            self._hindered('something holds it')
            turn = left = 0.0
        if self._end:
            self._speed, self._acceleration = approach(
                self._speed, self._acceleration, 0.0, c.acc_lim, c.jerk_lim, situation.dt
            )
            if self._speed < SLOWEST:
                return RecoveryStep(
                    text=f'{self.name}: went back {self._driven:.2f} m; {self._end}{self._forgot(situation)}'
                )
        elif not turn:
            highest = min(c.speed, c.max_vel_theta / max(abs(curvature), 1e-6))
            now, end = Motion(self._speed, self._acceleration), Caps([left], [0.0])
            self._speed, self._acceleration, _ = next_speed(now, highest, end, self._limits, situation.dt)
            self._speed = max(self._speed, SLOWEST if left else 0.0)
            self._curvature = curvature
        return RecoveryStep(
            (self._sign * self._speed, turn or self._speed * self._curvature),
            False,
            f'{self.name}: {MANNERS[self._manner]}, {self._driven:.2f} m of '
            f'{c.ahead if self._manner == AWAY else c.distance:.2f}',
        )

    def _forgot(self, situation):
        """Forget what sensors marked, where that is wanted; returns what is to be said of it."""
        if not self.config.forget or self._manner == AWAY or self._driven < 0.5 * self.config.distance:
            return ''
        self._forget.update(situation)
        return '; what sensors saw is forgotten'

    def _wanted(self, situation, here):
        """Return (rate of a turn in place rad/s or 0, curvature 1/m, way m that is left); sets ``_end`` where it is
        over.
        """
        c = self.config
        left = (c.ahead if self._manner == AWAY else c.distance) - self._driven
        if left <= LEAST_WAY:
            if self._turns_about(situation):
                self._end = 'there is room to turn'
            left = (c.ahead if self._manner == AWAY else c.farthest) - self._driven
            if left <= LEAST_WAY and not self._end:
                self._end = 'there is no room to turn'
        bearing = situation.track.bearing(here, LOOKAHEAD)
        if not self._sign:
            self._sign = 1 if bearing is not None and abs(bearing) < math.pi - REVERSED else -1
        if bearing is None or self._manner != ALONG:
            curvature = 0.0
        else:
            bearing = bearing if self._sign > 0 else wrap(bearing + math.pi)
            if abs(bearing) > REVERSED:
                if self._speed > SLOWEST:
                    return 0.0, self._curvature, 0.0
                self._sign, self._speed, self._acceleration = -self._sign, 0.0, 0.0
                bearing = wrap(bearing + math.pi)
            around = abs(bearing) > (TURNED if self._turning else c.corner_angle)
            self._turning = around and self._turn_is_free(situation, bearing)
            if self._turning and self._speed > SLOWEST:
                return 0.0, self._curvature, 0.0  # come to rest first
            if self._turning:
                self._speed = self._acceleration = 0.0
                return math.copysign(min(c.max_vel_theta, max(0.5 * abs(bearing), 0.1)), bearing), 0.0, left
            curvature = 0.0 if around else 2.0 * math.sin(bearing) / LOOKAHEAD
        free = self._free(situation, curvature, left)
        if free < LEAST_WAY and not self._end:
            self._hindered('something stands %s' % ('behind' if self._sign < 0 else 'ahead'))
        return 0.0, curvature, max(free, 0.0)

    def _hindered(self, why):
        """It cannot go on like that: one that has got nowhere tries another manner, one that has got somewhere ends
        there.
        """
        if (
            self._driven - self._since > NOWHERE
            or self._manner == AWAY
            or (self._manner == STRAIGHT and not self.config.ahead)
        ):
            self._end = why
            return
        self._manner += 1
        self._turning, self._since, self._still_since = False, self._driven, None
        self._speed = self._acceleration = 0.0
        if self._manner == AWAY:
            self._sign, self._driven, self._since = -self._sign, 0.0, 0.0

    def _free(self, situation, curvature, left):
        """Return how far (m) the footprint is free along the arc, less the clearance; at most ``left``."""
        c = self.config
        way = min(left, 0.5) + c.clearance
        steps = max(2, math.ceil(way / SPACING))
        touched = situation.world.touched(
            arc(situation.pose, self._sign * c.speed, c.speed * curvature, way / c.speed, steps)
        )
        worse = np.flatnonzero(touched > touched[0])
        return (way if not len(worse) else (worse[0] - 1) * way / steps) - c.clearance

    def _turn_is_free(self, situation, angle):
        pose = situation.pose
        angles = pose.yaw + np.linspace(0.0, angle, max(2, math.ceil(abs(angle) / 0.05)))
        return not situation.world.worsens(
            np.column_stack([np.full_like(angles, pose.x), np.full_like(angles, pose.y), angles])
        )

    def _turns_about(self, situation):
        """True when nothing is within ``room`` of the circle that the footprint's corners turn on."""
        world, g = situation.world, situation.world.geometry
        radius = float(np.hypot(*world.footprint.T).max()) + self.config.room
        x, y, _ = world.to_local([[situation.pose.x, situation.pose.y, situation.pose.yaw]])[0]
        low, high = g.to_cell(x - radius, y - radius), g.to_cell(x + radius, y + radius)
        if low is None or high is None:
            return False
        costs = world.costmap.costs[low[1] : high[1] + 1, low[0] : high[0] + 1]
        rows, columns = np.nonzero((costs == LETHAL) | (world.unknown_blocks & (costs == UNKNOWN)))
        cx, cy = g.to_world(columns + low[0], rows + low[1])
        return not (np.hypot(cx - x, cy - y) <= radius).any()

    def _held(self, t, here, turn, left):
        """True when it was told to move and has stood for held_timeout."""
        moved = self._still_at.distance(here) > LEAST_WAY or abs(wrap(here.yaw - self._still_at.yaw)) > LEAST_WAY
        if self._still_since is None or moved or not (turn or left):
            self._still_at, self._still_since = here, t
        return t - self._still_since > self.config.held_timeout
