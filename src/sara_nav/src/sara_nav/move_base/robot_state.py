"""What is known of the robot between two control steps: how much time passed, how fast it is, how old its pose."""

import math
from typing import Any

from sara_common.planar import Pose2D
from sara_nav.goals.move_base_config import Counters

FARTHEST = 1e6
"""A position beyond this (m) is no place of a robot."""

FASTEST = 100.0
"""A speed beyond this (m/s, rad/s) is none of a robot."""

AHEAD = 1.0
"""A pose that is dated farther ahead than this (s) is of another clock, and stays what it was until that time comes."""

SHORTEST = 1e-3
"""What passes between two steps at least (s)."""


def sound(pose: Pose2D) -> bool:
    """True when a Pose2D is a place where a robot can be."""
    return pose.is_finite() and abs(pose.x) <= FARTHEST and abs(pose.y) <= FARTHEST


def within_limits(v: float, w: float, config: Any, slow: float = 1.0) -> tuple[float, float]:
    """Return a command (m/s, rad/s) slowed on its arc to what a local planner's parameters allow, where they have
    limits; slow: share of the greatest speed that is allowed here.

    A planner that brakes a robot from the speed that was measured may else command a speed nobody allowed, when that
    measurement is wrong.
    """
    fastest = max(
        abs(getattr(config, 'max_vel_x', 0.0)),
        abs(getattr(config, 'min_vel_x', 0.0)),
        abs(getattr(config, 'escape_vel', 0.0)),
    )
    fastest *= slow
    quickest = max(abs(getattr(config, 'max_vel_theta', 0.0)), abs(getattr(config, 'min_vel_theta', 0.0)))
    share = min(
        fastest / abs(v) if 0.0 < fastest < abs(v) else 1.0, quickest / abs(w) if 0.0 < quickest < abs(w) else 1.0
    )
    return share * v, share * w


class RobotState:
    """Judges what move_base is told of the robot; what is not sound is counted and not used.

    counters: a Counters, whose ``stale_poses``, ``bad_poses`` and ``bad_velocities`` it adds to.
    """

    LAG = 0.1
    """Seconds by which a robot follows its commands, for the velocity that is reckoned from them."""

    def __init__(self, counters: Counters):
        self._counters = counters
        self._last_t = None
        self._model = (0.0, 0.0)

    def elapsed(self, t: float, period: float) -> float | None:
        """Return the seconds since the last step, from a millisecond (a clock that stands) to three periods; None when
        time went back.
        """
        last, self._last_t = self._last_t, t
        if last is None:
            return period
        if t < last - 1e-6:
            return None
        return min(max(t - last, SHORTEST), 3.0 * period)

    def velocity(
        self, measured: tuple[float, float] | None, command: tuple[float, float], dt: float
    ) -> tuple[float, float]:
        """Return the measured velocity (v, w) when it is sound, else one reckoned from the commands with a lag."""
        share = 1.0 - math.exp(-dt / self.LAG)
        v, w = self._model
        self._model = v + share * (command[0] - v), w + share * (command[1] - w)
        if measured is None:
            return self._model
        if not (abs(measured[0]) <= FASTEST and abs(measured[1]) <= FASTEST):  # true for NaN, too
            self._counters.bad_velocities += 1
            return self._model
        return measured

    def pose_age(self, t: float, pose: Pose2D | None, pose_time: float | None, tolerance: float) -> float | None:
        """Return how old the pose is (s), or None when it cannot be driven on: none, unsound, older than tolerance
        (s), or of another clock.
        """
        if pose is None:
            return None
        if not sound(pose) or (pose_time is not None and not math.isfinite(pose_time)):
            self._counters.bad_poses += 1
            return None
        age = 0.0 if pose_time is None else t - pose_time
        if not -AHEAD <= age <= tolerance:
            self._counters.stale_poses += 1
            return None
        return max(age, 0.0)
