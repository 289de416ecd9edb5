"""Limits of speed, acceleration and jerk of one axis, as the C++ diff_drive_controller's SpeedLimiter applies them.

A command v is limited against the two commands before it, v0 (the last) and v1, one period dt apart: first the jerk,
    v - v0 within (v0 - v1) + [min_jerk, max_jerk] dt^2,
then the acceleration, v - v0 within [min_acceleration, max_acceleration] dt, then the speed itself. The C++ controller
has 2 dt^2 in the place of dt^2 and so lets through twice the jerk that was asked for; here the limit is what it says.
"""

import math
from dataclasses import dataclass

KINDS = ('velocity', 'acceleration', 'jerk')


@dataclass(frozen=True)
class Limits:
    """(lowest, highest) velocity, acceleration and jerk in m or rad and s; None: no such limit."""

    velocity: tuple = None
    acceleration: tuple = None
    jerk: tuple = None

    @classmethod
    def from_params(cls, flat, axis, faults):
        """From the parameters `AXIS/has_KIND_limits`, `AXIS/max_KIND`, `AXIS/min_KIND` (default: -max); faults are
        added to the list.
        """
        return cls(**{kind: _pair(flat, axis, kind, faults) for kind in KINDS})


class SpeedLimiter:
    """limits: Limits. Stateless: who asks remembers the commands before."""

    def __init__(self, limits=Limits()):
        self.limits = limits

    def limit(self, v, v0, v1, dt):
        """The allowed command nearest to v after v0 and v1, each dt (s) apart."""
        limits = self.limits
        if limits.jerk is not None:
            before = v0 - v1
            v = v0 + before + _clamp(v - v0 - before, limits.jerk, dt * dt)
        if limits.acceleration is not None:
            v = v0 + _clamp(v - v0, limits.acceleration, dt)
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
