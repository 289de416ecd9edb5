"""The command given last, how it may go on within acceleration and jerk, and what is sent for it."""

import math

from sara_nav.grids.free_motions import Ways
from sara_nav.planners.local_command import BLOCKED, DRIVING, LocalCommand
from sara_nav.pursuit.cycle import Cycle
from sara_nav.pursuit.messages import Words
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_speed import approach

SLOWEST, SLOWEST_TURN = 0.03, 0.005
"""Braking ends at a speed (m/s) and a turn rate (rad/s) below these."""
HARDER = (1.0, 0.5, 0.2)
"""Shares of a gentle stop's speed that are tried where something stands in its way."""


def ahead_of_smoother(now: float, last: float, dt: float, jerk: float, highest: float) -> float:
    """Return what to send (m/s or rad/s) so that a limiter of jerk behind drives ``now``, dt (s) after ``last``.

    While its speed grows by a, such a limiter stays a^2 / (2 jerk) behind what it is told, to be able to end the
    acceleration there (sara_control's comfort.py). jerk: its limit, 0: there is none. highest: sent at most.
    """
    more = abs(now) - abs(last)
    if jerk == 0.0 or dt <= 0.0 or more <= 0.0 or now * last < 0.0:
        return now
    grows = more / dt
    return math.copysign(max(min(abs(now) + grows * grows / (2.0 * jerk), highest), abs(now)), now)


class SmoothCommand:
    """``last``: (v m/s, w rad/s). ``acceleration`` (m/s2): of the size of v; ``turn_acceleration`` (rad/s2): of w."""

    def __init__(self, config: RotateThenPursueConfig, words: Words):
        self.config, self._words = config, words
        self.rest()

    def rest(self) -> None:
        """The robot is told to stand at once."""
        self.last, self.acceleration, self.turn_acceleration = (0.0, 0.0), 0.0, 0.0

    def come_to_rest(self, cycle: Cycle, text: str) -> LocalCommand:
        """Return the command that brakes as the limits allow, on the curve driven now, and harder where something is in
        the way; text: what for.
        """
        c, dt = self.config, cycle.dt
        v0, w0 = self.last
        size, self.acceleration = approach(abs(v0), self.acceleration, 0.0, c.dec_lim_x, c.jerk_lim_x, dt)
        if size < SLOWEST:
            size = self.acceleration = 0.0
        v = math.copysign(size, v0)
        target = w0 * v / v0 if v0 else 0.0
        w, self.turn_acceleration = approach(w0, self.turn_acceleration, target, c.acc_lim_theta, c.jerk_lim_theta, dt)
        if abs(w) < SLOWEST_TURN:
            w = self.turn_acceleration = 0.0
        share = self._free_share(cycle, v, w)
        if share == 0.0:
            return LocalCommand(0.0, 0.0, BLOCKED, 'something stands where it would come to rest')
        return LocalCommand(share * v, share * w, DRIVING, self._words.say(cycle.t, text, text))

    def _free_share(self, cycle, v, w):
        """The greatest of HARDER at which the robot comes to rest before it touches something new; 0.0: at none."""
        if v == 0.0:
            return 1.0
        c, ways = self.config, Ways(cycle.world)
        free = (
            share
            for share in HARDER
            if ways.stop_is_free(cycle.now, share * v, share * w, c.dec_lim_x, c.acc_lim_theta)
        )
        return next(free, 0.0)

    def sent(self, command: LocalCommand, dt: float) -> LocalCommand:
        """Return the LocalCommand to send for one that follows ``last`` after dt (s): where it speeds up, or begins to
        turn in place, as far ahead of it as what smooths commands behind stays behind.
        """
        c, (v0, w0) = self.config, self.last
        if command.v:
            highest = c.max_vel_x if command.v > 0.0 else -c.min_vel_x
            return command._replace(v=ahead_of_smoother(command.v, v0, dt, c.smoother_jerk_x, highest))
        if v0:
            return command
        return command._replace(w=ahead_of_smoother(command.w, w0, dt, c.smoother_jerk_theta, c.max_vel_theta))

    def turn_rate(self, wanted: float, dt: float) -> float:
        """Return the turn rate (rad/s) nearest to the one wanted that acceleration and jerk allow."""
        c, w = self.config, self.last[1]
        most = min(self.turn_acceleration + c.jerk_lim_theta * dt, c.acc_lim_theta)
        least = max(self.turn_acceleration - c.jerk_lim_theta * dt, -c.acc_lim_theta)
        self.turn_acceleration = min(max((wanted - w) / dt, least), most)
        return w + self.turn_acceleration * dt
