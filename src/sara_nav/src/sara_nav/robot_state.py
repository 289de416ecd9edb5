"""What is known of the robot between two control steps: how much time passed, how fast it is, how old its pose."""
import math


class RobotState:
    """Judges what move_base is told of the robot; what is not sound is counted and not used.

    counters: a Counters, whose ``stale_poses``, ``bad_poses`` and ``bad_velocities`` it adds to.
    """

    LAG = 0.1
    """Seconds by which a robot follows its commands, for the velocity that is reckoned from them."""

    def __init__(self, counters):
        self._counters = counters
        self._last_t = None
        self._model = (0.0, 0.0)

    def elapsed(self, t, period):
        """Return the seconds since the last step, at most three periods; None when time went back."""
        last, self._last_t = self._last_t, t
        if last is None:
            return period
        if t < last - 1e-6:
            return None
        return min(max(t - last, 0.0), 3.0 * period)

    def velocity(self, measured, command, dt):
        """Return the measured velocity (v, w) when it is sound, else one reckoned from the commands with a lag."""
        share = 1.0 - math.exp(-dt / self.LAG)
        self._model = tuple(m + share * (c - m) for m, c in zip(self._model, command))
        if measured is None:
            return self._model
        if not (math.isfinite(measured[0]) and math.isfinite(measured[1])):
            self._counters.bad_velocities += 1
            return self._model
        return measured

    def pose_age(self, t, pose, pose_time, tolerance):
        """Return how old the pose is (s), or None when it cannot be driven on: none, unsound or older than tolerance (s)."""
        if pose is None:
            return None
        if not pose.is_finite() or (pose_time is not None and not math.isfinite(pose_time)):
            self._counters.bad_poses += 1
            return None
        age = 0.0 if pose_time is None else t - pose_time
        if age > tolerance:
            self._counters.stale_poses += 1
            return None
        return max(age, 0.0)
