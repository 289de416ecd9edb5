"""Castors that swing round when the chair changes its direction of travel, and push it aside while they stand across.

The pair in front is one castor at (castor_x, 0), a wheel trailing its pivot by d. Its angle c (where the wheel trails to, against straight
back) follows the pivot's velocity u, of direction b in the chair:
    dc/dt = |u| / d sin(b - c) - w.
A castor wheel only rolls along itself: while it is at an angle to the pivot's motion it drags the axle sideways with a share of the
speed, which turns the chair about its drive axle by
    dw = k |u| sin(c - b) cos(c - b) / castor_x,    k = castor_swing.
"""

from __future__ import annotations

from math import atan2, cos, exp, hypot, sin

from sara_sim.options import ChairOptions

PLAY = 0.02  # rad: no castor stands exactly straight, so that reversing tips it to one side


class Castors:
    """`angle`: rad, 0 when they trail as in driving forward."""

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
        lag = atan2(across, speed) - self.angle - PLAY
        # The follower is stiff when fast: 1 - exp keeps a step from overshooting.
        self.angle += (1.0 - exp(-u / options.castor_trail * dt)) * sin(lag) - yaw_rate * dt * exp(-u / options.castor_trail * dt)
        return -options.castor_swing * u * sin(lag) * cos(lag) / options.castor_x
