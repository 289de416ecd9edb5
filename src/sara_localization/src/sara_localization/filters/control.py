"""What a command does to the robot before the wheels have measured it: robot_localization's control input.

For each controlled velocity the robot is taken to accelerate towards the command: gain times what is missing, up to a
limit; slowing down has limits and gains of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sara_localization.filters.state import AX, RATES, VELOCITY

Six = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class ControlConfig:
    """mask: which of vx vy vz vroll vpitch vyaw are controlled; timeout in s; limits in m/s2 and rad/s2, gains in
    1/s.
    """

    mask: tuple[bool, ...]
    timeout: float
    acceleration_limits: Six = (1.0,) * 6
    deceleration_limits: Six = (1.0,) * 6
    acceleration_gains: Six = (1.0,) * 6
    deceleration_gains: Six = (1.0,) * 6
    stamped: bool = False


class Control:
    """The newest command and the accelerations that follow from it. refused: how many were no commands."""

    def __init__(self, config: ControlConfig):
        self.config, self.refused = config, 0
        self.command, self.stamp = (0.0,) * 6, 0.0

    def set(self, command: np.ndarray, stamp: float) -> None:
        """command: (6,) vx vy vz vroll vpitch vyaw in the robot's frame, at a time (s)."""
        self.command, self.stamp = tuple(float(c) for c in command), stamp

    def accelerations(self, velocities: np.ndarray, time: float) -> Six:
        """The six accelerations at the velocities (6,); a command as old as the timeout counts as zero."""
        c, timed_out = self.config, abs(time - self.stamp) >= self.config.timeout
        return tuple(
            _acceleration(float(v), 0.0 if timed_out else u, al, ag, dl, dg) if on else 0.0
            for on, v, u, al, ag, dl, dg in zip(
                c.mask,
                velocities,
                self.command,
                c.acceleration_limits,
                c.acceleration_gains,
                c.deceleration_limits,
                c.deceleration_gains,
            )
        )

    def apply(self, x: np.ndarray, time: float, dt: float) -> None:
        """Put the command into the state before a prediction over dt seconds that ends at `time`, in place.

        A linear one replaces the acceleration, an angular one changes the rate.
        """
        accelerations = self.accelerations(x[VELOCITY.start : RATES.stop], time)
        for i in range(3):
            if self.config.mask[i]:
                x[AX + i] = accelerations[i]
            x[RATES.start + i] += accelerations[3 + i] * dt


def _acceleration(velocity, command, limit, gain, braking_limit, braking_gain) -> float:
    missing = command - velocity
    # A command that points away from the motion is first a command to stop.
    target = 0.0 if abs(missing) > abs(command) + 0.01 else command
    if abs(target) < abs(velocity):
        limit, gain = braking_limit, braking_gain
    return math.copysign(min(abs(gain * missing), limit), gain * missing)
