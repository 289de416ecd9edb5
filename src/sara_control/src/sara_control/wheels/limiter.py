"""Limits of speed, acceleration and jerk of one axis, as the C++ diff_drive_controller's SpeedLimiter applies them.

A cycle of dt seconds takes the speed from v0 to v, a mean acceleration of (v - v0) / dt. First the jerk is limited: the
acceleration may differ from that of the last cycle by [min_jerk, max_jerk] times the time between the cycles' middles.
Then the acceleration is limited, then the speed. In cycles of equal length this is the C++ controller's rule, with one
correction: it has 2 dt^2 in the place of dt^2 and so lets through twice the jerk that was asked for. It remembers
differences of speed; this one remembers accelerations, so cycles may be of any length.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

KINDS = ('velocity', 'acceleration', 'jerk')


@dataclass(frozen=True)
class Limits:
    """(lowest, highest) velocity, acceleration and jerk in m or rad and s; None: no such limit."""

    velocity: tuple = None
    acceleration: tuple = None
    jerk: tuple = None

    @classmethod
    def from_params(cls, flat: dict, axis: str, faults: list[str]) -> 'Limits':
        """From the parameters `AXIS/has_KIND_limits`, `AXIS/max_KIND`, `AXIS/min_KIND` (default: -max); faults are
        added to the list.
        """
        return cls(**{kind: _pair(flat, axis, kind, faults) for kind in KINDS})


class Motion(NamedTuple):
    """The last cycle: its speed (m/s or rad/s), its mean acceleration (per s) and its length dt (s)."""

    speed: float = 0.0
    acceleration: float = 0.0
    dt: float = 0.0

    def after(self, speed: float, dt: float) -> 'Motion':
        """The cycle of dt seconds that leads to `speed`. One that takes no time keeps the acceleration."""
        if dt <= 0.0:
            return self._replace(speed=speed)
        return Motion(speed, (speed - self.speed) / dt, dt)


class SpeedLimiter:
    """limits: Limits. Stateless: the caller keeps the Motion of the last cycle."""

    def __init__(self, limits: Limits = Limits()) -> None:
        self.limits = limits

    def limit(self, v: float, last: Motion, dt: float) -> float:
        """The allowed speed nearest to v after a cycle of dt seconds that follows `last`.

        Where dt is not above 0, a limit of acceleration or jerk keeps the speed as it is.
        """
        limits, dt = self.limits, max(dt, 0.0)
        if limits.jerk is not None:
            change = last.acceleration * dt
            between_middles = 0.5 * (last.dt + dt)
            v = last.speed + change + _clamp(v - last.speed - change, limits.jerk, between_middles * dt)
        if limits.acceleration is not None:
            v = last.speed + _clamp(v - last.speed, limits.acceleration, dt)
        if limits.velocity is not None:
            v = _clamp(v, limits.velocity, 1.0)
        return v


def _clamp(value, pair, scale):
    return min(max(value, pair[0] * scale), pair[1] * scale)


def _pair(flat, axis, kind, faults):
    has_name, max_name, min_name = f'{axis}/has_{kind}_limits', f'{axis}/max_{kind}', f'{axis}/min_{kind}'
    has = flat.get(has_name, False)
    if not isinstance(has, bool):
        faults.append(f'{has_name} is {has!r}, allowed are true and false')
        return None
    values = {name: flat[name] for name in (max_name, min_name) if name in flat}
    wrong = [
        name
        for name, value in values.items()
        if not isinstance(value, (int, float)) or isinstance(value, bool) or not math.isfinite(value)
    ]
    faults.extend(f'{name} is {values[name]!r}, allowed are numbers' for name in wrong)
    if wrong or not has:
        return None
    if max_name not in values:
        faults.append(f'{max_name} is missing though {has_name} is true')
        return None
    highest = float(values[max_name])
    lowest = float(values.get(min_name, -highest))
    if not lowest <= 0.0 <= highest:
        faults.append(f'{min_name} to {max_name} is {lowest:g} to {highest:g}, allowed is a range with 0 in it')
        return None
    return lowest, highest
