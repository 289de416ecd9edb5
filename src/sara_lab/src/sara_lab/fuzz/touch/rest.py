"""Whether a chair came to rest as soon as the safety gate says that it does, once its driver is gone."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from sara_control.gate.comfort import AxisLimiter, Profile

REST = 0.05  # m/s, slower than this is rest, as in docs/safety.md
WHEELS_S = 0.25  # s on top for gate, bus and wheels, as in docs/safety.md
LATELY_S = 0.1  # s within which the gate's output must have grown to be growing,
GROWS = 0.005  # m/s by which
STEP_S = 0.02
LONGEST_S = 10.0

Series = Sequence[tuple[float, float]]


def gentle_stop_s(profile: Profile, speed: float, acceleration: float) -> float:
    """s until a gate that is told zero commands less than REST. speed (m/s), acceleration (m/s2): of its output now."""
    axis = AxisLimiter(profile.acceleration, profile.braking, profile.jerk)
    axis.set(speed)
    axis.acceleration = acceleration
    t = 0.0
    while abs(axis.speed) >= REST and t < LONGEST_S:
        axis.step(0.0, STEP_S)
        t += STEP_S
    return t


class Rest(NamedTuple):
    """speed: m/s of the true chair at the zero. took: s from the zero until it was at rest for good, infinite where it
    never was. allowed: s.
    """

    speed: float
    took: float
    allowed: float

    @property
    def wrong(self) -> str:
        """What is wrong, "" if nothing."""
        if self.took <= self.allowed:
            return ''
        return f'from {self.speed:.2f} m/s at rest after {self.took:.2f} s, allowed are {self.allowed:.2f} s'


def rest_after(zero: float, commanded: Series, true: Series, profile: Profile) -> Rest:
    """The Rest after a zero at that time (s). commanded: the gate's output, true: the chair's own motion, both
    [(s, m/s)]; the last reading of `true` must lie well behind the rest.
    """
    before = [(t, v) for t, v in commanded if t <= zero]
    now, speed = before[-1]
    earlier = next((v for t, v in reversed(before) if t <= now - LATELY_S), before[0][1])
    # How fast it grew cannot be told from when its outputs came: as fast as the profile lets it from rest, at most.
    most = min(profile.acceleration, math.sqrt(2.0 * profile.jerk * abs(speed)))
    growing = math.copysign(most, speed) if abs(speed) > abs(earlier) + GROWS else 0.0
    allowed = gentle_stop_s(profile, speed, growing) + WHEELS_S
    moving = [t for t, v in true if t > zero and abs(v) >= REST]
    if not any(t > zero for t, _ in true) or abs(true[-1][1]) >= REST:
        took = math.inf
    else:
        took = max(moving) - zero if moving else 0.0
    at_zero = max((t, v) for t, v in true if t <= zero)[1]
    return Rest(at_zero, took, allowed)
