"""A script of motions for a simulated robot: paths, turns in place, plain velocities, pauses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, sqrt

from sara_common.planar import wrap
from sara_sim.riders.driving import Manner, WayDriver

TURN_GAIN, SLOWEST_TURN = 2.0, 0.1  # 1/s, rad/s
FACING = 0.005  # rad
ARRIVED = 0.05  # m
BRAKING, SLOWEST = 0.5, 0.1  # m/s2, m/s: towards the end of a path


@dataclass(frozen=True)
class Along:
    """Drive along points (x, y; m, map frame) from where the robot is. speed: m/s on straights; turn: rad/s at most."""

    points: tuple
    speed: float = 0.8
    turn: float = 1.0


@dataclass(frozen=True)
class Face:
    """Turn in place to a yaw (rad, map frame), the short way round, at up to `turn` (rad/s)."""

    yaw: float
    turn: float = 1.0


@dataclass(frozen=True)
class Go:
    """Velocities v (m/s) and w (rad/s) for so many s; both 0: a pause."""

    seconds: float
    v: float = 0.0
    w: float = 0.0


Motion = Along | Face | Go


@dataclass
class Script:
    """Motions one after the other, steered by the true pose; then the robot stands. `done`: whether that is so."""

    motions: Sequence[Motion]
    _next: int = 0
    _since: float | None = None
    _driver: WayDriver | None = None

    @property
    def done(self) -> bool:
        """Whether every motion is over."""
        return self._next == len(self.motions)

    def command(self, t: float, pose: tuple[float, float, float]) -> tuple[float, float]:
        """(m/s, rad/s) for a robot at a true pose (x, y, yaw; m, rad) at t (s)."""
        while not self.done:
            if self._since is None:
                self._begin(t, pose)
            found = self._motion(self.motions[self._next], t, pose)
            if found is not None:
                return found
            self._next, self._since = self._next + 1, None
        return 0.0, 0.0

    def _begin(self, t, pose):
        self._since, motion = t, self.motions[self._next]
        if isinstance(motion, Along):
            manner = Manner(
                cruise=1.0,
                turning=1.0,
                full_speed=motion.speed,
                full_turn=motion.turn,
                look=0.5,
                reaction=0.0,
                arrival=ARRIVED,
            )
            self._driver = WayDriver([pose[:2], *motion.points], manner=manner)

    def _motion(self, motion, t, pose):
        """What a motion asks for; None where it is over."""
        if isinstance(motion, Go):
            return (motion.v, motion.w) if t - self._since < motion.seconds - 1e-9 else None
        if isinstance(motion, Face):
            off = wrap(motion.yaw - pose[2])
            return None if abs(off) < FACING else (0.0, _turn(off, motion.turn))
        stick = self._driver.stick(t, pose)
        if self._driver.arrived:
            return None
        if not stick.forward:
            return 0.0, stick.left * motion.turn
        share = min(1.0, max(SLOWEST, sqrt(2.0 * BRAKING * self._driver.way.left)) / motion.speed)
        return share * stick.forward * motion.speed, share * stick.left * motion.turn


def _turn(off, most):
    return copysign(min(most, max(SLOWEST_TURN, TURN_GAIN * abs(off))), off)
