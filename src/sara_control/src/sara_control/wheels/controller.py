"""Commands to wheel speeds and wheel positions to odometry: the pure part of a diff_drive_controller.

The inverse kinematics are the usual ones, wheel = (v -+ w separation / 2) / radius. A cycle does what the C++
controller does, in its order: a command older than cmd_vel_timeout counts as zero, then the limits of jerk,
acceleration and speed. Without wheel positions for encoder_timeout, or when an encoder stands still although its wheel
must turn, the wheels stop, and start again only on a command given after that.
"""

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

from sara_control.wheels.config import ControllerConfig
from sara_control.wheels.limiter import Motion, SpeedLimiter
from sara_control.wheels.odometry import Odometry, OdometryState
from sara_control.wheels.uncertainty import LossUncertainty
from sara_control.wheels.wheel_watch import WheelWatch

LONGEST_PERIODS = 5.0  # a cycle that comes later than so many periods may not make up for it with a leap of the command
SHORTEST_CYCLE = 1e-6  # s: the time of a shorter cycle is counted in the next one, it is too short to divide by


class DiffDriveController:
    """config: ControllerConfig. All times in s on one clock. `counters` counts what was dropped, by kind.

    `stopped_by`: why the wheels are stopped without a command, in words, else None.
    `command`: (v, w) of the last cycle, limited. `state`: the newest OdometryState, or None.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self.config = config
        self.counters = Counter()
        self.odometry = Odometry(config.separation, *config.radii, config.velocity_rolling_window_size)
        self.command = (0.0, 0.0)
        self.stopped_by = None
        self.state = None
        self._motions = (Motion(), Motion())  # linear and angular, of the last cycle
        self._limiters = SpeedLimiter(config.linear_limits), SpeedLimiter(config.angular_limits)
        self._uncertainty = LossUncertainty(
            config.separation, config.wheel_acceleration, config.velocity_rolling_window_size
        )
        self._watch = WheelWatch(config.frozen_distance, config.radii, LONGEST_PERIODS / config.command_rate)
        self._wanted = None
        self._updated_at = None
        self._clock = 0.0
        self._positions_at = None
        self._release = None  # after a frozen encoder: 'rest' until a command of zero or none, then 'command'

    def set_geometry(self, **multipliers: float) -> None:
        """New values of wheel_separation_multiplier, left_ and right_wheel_radius_multiplier. Raises ConfigError."""
        config = self.config = replace(self.config, **multipliers)
        odometry = self.odometry
        odometry.wheel_separation, (odometry.left_radius, odometry.right_radius) = config.separation, config.radii
        self._uncertainty.separation = config.separation
        self._watch.radii = config.radii

    def on_command(self, v: float, w: float, t: float, publishers: int = 1) -> None:
        """Drive with v (m/s) and w (rad/s) from time t on; a command that is not finite is dropped and counted.

        publishers: how many there are that command; more than one stop the wheels unless that is allowed.
        """
        if not (math.isfinite(v) and math.isfinite(w)):
            self.counters['command_not_finite'] += 1
            return
        if publishers > 1 and not self.config.allow_multiple_cmd_vel_publishers:
            self.counters['several_publishers'] += 1
            v = w = 0.0
        self._wanted = (v, w, t)

    def on_wheels(
        self,
        left: float | Iterable[float],
        right: float | Iterable[float],
        stamp: float,
        interval: float | None = None,
        missed: float = 0.0,
        unmeasured: float = 0.0,
    ) -> OdometryState | None:
        """Wheel positions (rad; a sequence for several joints a side) at `stamp`, see base.WheelPositions.

        Returns an OdometryState, or None for what is not newer than the last, not finite, or not used (open_loop). By
        the wheels' own clock what came after an `interval` is newer, though ROS's clock was set back meanwhile.
        """
        left, right = _mean(left), _mean(right)
        if not all(map(math.isfinite, (left, right, stamp))):
            self.counters['wheels_not_finite'] += 1
            return None
        last = self._positions_at
        if last is not None and last - self.config.encoder_timeout <= stamp <= last and not interval:
            self.counters['wheels_not_newer'] += 1
            return None
        self._positions_at = stamp
        if self.config.open_loop:
            return None
        if interval is None:
            interval = stamp - last if last is not None else 0.0
        interval = max(0.0, interval) if last is not None else 0.0
        odometry, lost = self.odometry, self._uncertainty
        if unmeasured > 0.0:
            half = 0.5 * odometry.angular * self.config.separation
            lost.on_unmeasured(odometry.heading, odometry.linear - half, odometry.linear + half, unmeasured)
        self._clock += interval
        x, y = odometry.x, odometry.y
        if odometry.update(left, right, self._clock):
            lost.on_interval(odometry.heading, math.hypot(odometry.x - x, odometry.y - y), interval, missed)
        self._watch_wheels(left, right, stamp)
        return None if stamp == last else self._renew(stamp)

    def _watch_wheels(self, left, right, stamp):
        """Stops the robot if an encoder stands still, and makes the covariance grow by what it hides."""
        missed_before = self._watch.missed
        if self._watch.on_wheels(left, right, stamp):
            self.counters['encoder_frozen'] += 1
            self._release = 'rest'
        if self._watch.missed != missed_before:
            # It adds up as one error, not as many independent ones: the variance goes from the old sum's to the new
            # one's.
            self._uncertainty.on_lost_way(
                self.odometry.heading,
                *(math.sqrt(now * now - then * then) for now, then in zip(self._watch.missed, missed_before)),
            )

    def update(self, t: float, driving: bool = True) -> tuple[float, float]:
        """(left, right) wheel speeds in rad/s to command at time t.

        driving: whether the wheels obey. While they do not, commands are dropped, and a new one is needed afterwards.
        """
        dt = self._cycle(t)
        if self.config.open_loop and self.odometry.update_open_loop(*self.command, t):
            self._renew(t)
        if not driving:
            return self._idle()
        wanted = self._target(t)
        if wanted is None and self.config.stop_deceleration is not None:
            command = self._brake(dt)
        else:
            command = tuple(
                limiter.limit(speed, motion, dt)
                for limiter, speed, motion in zip(self._limiters, wanted or (0.0, 0.0), self._motions)
            )
        self._motions = tuple(motion.after(speed, dt) for motion, speed in zip(self._motions, command))
        self.command = command
        wheels = self._wheel_speeds(*command)
        if not self.config.open_loop:
            self._watch.on_command(*wheels, t)
        return wheels

    def wheels_known(self, t: float) -> bool:
        """Whether wheel positions came within encoder_timeout before t. In open loop a robot need not have any."""
        if self._positions_at is None:
            return self.config.open_loop
        return abs(t - self._positions_at) <= self.config.encoder_timeout

    def _cycle(self, t):
        """The length of the cycle that begins at t, s; 0 in the first, and where time stood still or went back."""
        dt = 0.0 if self._updated_at is None else t - self._updated_at
        if 0.0 < dt < SHORTEST_CYCLE:
            return 0.0
        self._updated_at = t
        return min(max(dt, 0.0), LONGEST_PERIODS / self.config.command_rate)

    def _target(self, t):
        """(v, w) that is asked for now, or None for a stop; the reason is in `stopped_by`."""
        self.stopped_by = None
        wanted = self._wanted
        # A command from the future means that the clock was set back: it must be given again.
        if wanted is not None and not -self.config.cmd_vel_timeout <= t - wanted[2] <= self.config.cmd_vel_timeout:
            wanted = self._wanted = None
        resting = wanted is None or wanted[:2] == (0.0, 0.0)
        if self._release == 'rest' and resting:
            self._release = 'command'
        if not self.wheels_known(t):
            if wanted is not None:
                self.counters['command_without_wheels'] += 1
                self._wanted = None
            self.stopped_by = 'no wheel positions'
        elif self._release == 'rest' or self._release == 'command' and resting:
            self.stopped_by = f'the encoder of the {" and the ".join(self._watch.frozen)} wheel stands still'
        elif wanted is not None:
            if self._release:
                self._release = None
                self._watch.reset()
            return wanted[:2]
        return None

    def _idle(self):
        self.stopped_by = self._wanted = self._release = None
        self.command = (0.0, 0.0)
        self._motions = tuple(Motion(dt=motion.dt) for motion in self._motions)
        self._watch.reset()
        return 0.0, 0.0

    def _brake(self, dt):
        """The last command, slowed down along its arc so that the faster wheel's rim loses stop_deceleration."""
        v, w = self.command
        fastest = abs(v) + 0.5 * abs(w) * self.config.separation
        if fastest == 0.0:
            return 0.0, 0.0
        share = max(0.0, 1.0 - self.config.stop_deceleration * dt / fastest)
        return v * share, w * share

    def _wheel_speeds(self, v, w):
        half = 0.5 * w * self.config.separation
        left_radius, right_radius = self.config.radii
        return (v - half) / left_radius, (v + half) / right_radius

    def _renew(self, stamp):
        odometry, config, lost = self.odometry, self.config, self._uncertainty
        pose, twist = list(config.pose_covariance_diagonal), list(config.twist_covariance_diagonal)
        for index, variance in zip((0, 1, 5), lost.pose):
            pose[index] += variance
        for index, variance in zip((0, 5), lost.twist):
            twist[index] += variance
        self.state = OdometryState(
            stamp,
            odometry.x,
            odometry.y,
            odometry.heading,
            odometry.linear,
            odometry.angular,
            tuple(pose),
            tuple(twist),
        )
        return self.state


def _mean(positions):
    """Of the joints of a side."""
    if not hasattr(positions, '__iter__'):
        return float(positions)
    positions = tuple(positions)
    return sum(positions) / len(positions) if positions else math.nan
