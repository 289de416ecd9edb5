"""Commands to wheel speeds and wheel positions to odometry: the pure part of a diff_drive_controller.

The inverse kinematics are the usual ones, wheel = (v -+ w separation / 2) / radius. A command is obeyed for cmd_vel_timeout;
without wheel positions for encoder_timeout the wheels stop, and start again only on a command given after the positions
came back.
"""

import math
from collections import Counter

from sara_control.odometry import Odometry, OdometryState


class DiffDriveController:
    """config: ControllerConfig. All times in s on one clock. `counters` counts what was dropped, by kind."""

    def __init__(self, config):
        self.config = config
        self.counters = Counter()
        self.odometry = Odometry(config.separation, *config.radii, config.velocity_rolling_window_size)
        self._command = None
        self._wheels_at = None
        self._clock = 0.0
        self._positions_at = None

    def on_command(self, v, w, t):
        """Drive with v (m/s) and w (rad/s) from time t on; a command that is not finite is dropped and counted."""
        if not (math.isfinite(v) and math.isfinite(w)):
            self.counters['command_not_finite'] += 1
            return
        self._command = (v, w, t)

    def on_wheels(self, left, right, stamp, interval=None):
        """Wheel positions (rad) at `stamp`. Returns an OdometryState, or None for what is not newer than the last.

        interval: s since the last positions by the wheels' own clock, if there is one: it is free of the jitter of the way.
        """
        if not all(map(math.isfinite, (left, right, stamp))):
            self.counters['wheels_not_finite'] += 1
            return None
        last = self._positions_at
        if last is not None and last - self.config.encoder_timeout <= stamp <= last:
            self.counters['wheels_not_newer'] += 1
            return None
        self._clock += max(0.0, stamp - last if interval is None else interval) if last is not None else 0.0
        self._positions_at = self._wheels_at = stamp
        odometry = self.odometry
        odometry.update(left, right, self._clock)
        return OdometryState(stamp, odometry.x, odometry.y, odometry.heading, odometry.linear, odometry.angular)

    def update(self, t):
        """(left, right) wheel speeds in rad/s to command at time t."""
        if not self.wheels_known(t):
            if self._command is not None:
                self.counters['command_without_wheels'] += 1
                self._command = None
            return 0.0, 0.0
        if self._command is None:
            return 0.0, 0.0
        v, w, given = self._command
        # A command from the future means that the clock was set back: it must be given again.
        if not -self.config.cmd_vel_timeout <= t - given <= self.config.cmd_vel_timeout:
            self._command = None
            return 0.0, 0.0
        half = 0.5 * w * self.config.separation
        left_radius, right_radius = self.config.radii
        return (v - half) / left_radius, (v + half) / right_radius

    def wheels_known(self, t):
        """Whether wheel positions came within encoder_timeout before t."""
        return self._wheels_at is not None and abs(t - self._wheels_at) <= self.config.encoder_timeout
