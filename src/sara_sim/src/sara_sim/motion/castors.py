"""Castors that swing round when the chair changes its direction of travel, and turn it a little with them.

The pair in front is one castor at (castor_x, 0), a wheel trailing its pivot by d. Its direction c (straight ahead: 0)
follows the direction b of the pivot's velocity u, as a trailer follows its hitch, in the turning chair:
    dc/dt = |u| / d (sin(b - c) + e (1 - cos(b - c)) / 2) - w,
where e, the play of the swivel, tips castors to one side that stand exactly the wrong way round. The friction of its
swivel drags the chair with it: dw = k dc/dt, k = castor_swing. Reversing turns the castors by half a turn and the chair
by k pi; it comes without warning and the wheels do not see it.
"""

from __future__ import annotations

from math import atan2, cos, exp, hypot, sin

from sara_sim.options import ChairOptions

PLAY = 0.02


class Castors:
    """`angle`: rad, 0 when they trail as in driving forward; not wrapped."""

    def __init__(self, options: ChairOptions):
        self.options = options
        self.angle = 0.0

    def turn_rate(self, speed: float, yaw_rate: float, dt: float) -> float:
        """Let them follow for `dt` s; returns the yaw rate (rad/s) that they add. `speed`: m/s, `yaw_rate`: rad/s."""
        options = self.options
        across = yaw_rate * options.castor_x
        u = hypot(speed, across)
        if u < 1e-4:
            return 0.0
        # Exact for small angles at any speed: a fast castor must not overshoot within a step.
        lag = atan2(across, speed) - self.angle
        followed = (1.0 - exp(-u / options.castor_trail * dt)) * (sin(lag) + PLAY * 0.5 * (1.0 - cos(lag)))
        swivelled = followed - yaw_rate * dt
        self.angle += swivelled
        return options.castor_swing * swivelled / dt
