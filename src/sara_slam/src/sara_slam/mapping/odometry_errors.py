"""The scale and the delay of the odometry's ways, learned where scans tell how far the robot came.

Wheels that are a little larger or smaller than they are said to be make a long bare corridor too short or too long. So
does a speed that is measured over an interval and counts at its end, as encoders' is: the odometry is behind by the
speed times the delay, which a stop makes good again; but where only one of start and stop is in sight of something,
the scans make good for one of the two. A Kalman filter of two constants: the way of a stretch in which the matches are
certain is scale x way of the odometry + delay x change of speed, and what the matches at both its ends are off.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_localization.particles.scan_input import ScanInput

Pose = tuple[float, float, float]
CERTAIN = 0.03
"""m; the greatest standard deviation along the way of a match that tells of the way."""
STRAIGHT = 0.2
"""rad; a motion that turns more tells nothing."""
ENDS = 0.01
"""m; standard deviation of the way between two matches."""
LONGEST = 3.0
"""m; a stretch ends there, and another one begins."""
LEAST = 0.2
"""m; shorter stretches are not heeded."""
FASTEST = 20.0
"""m/s; what the odometry is faster by is no speed."""
OUTLIER = 3.0
"""Standard deviations from which on a stretch is not heeded: somebody walked along with the robot."""


class Motion(NamedTuple):
    """From one scan to a later one, by the odometry: the later pose in the frame of the earlier one (x, y, yaw), and
    by how much faster (m/s) the robot goes ahead then.
    """

    pose: Pose
    faster: float


def speed_of(scan: ScanInput) -> float:
    """m/s ahead at a scan, by the odometry; 0 where all its rays are of one time."""
    motion, duration = scan.motion, scan.sweep.duration
    speed = motion[0] / duration if motion is not None and duration > 0.0 else 0.0
    return speed if abs(speed) <= FASTEST else 0.0


def along(covariance: np.ndarray, yaw: float) -> float:
    """m; the standard deviation of a place along a yaw (rad) in the frame of its covariance (3, 3)."""
    ahead = np.array((math.cos(yaw), math.sin(yaw)))
    return math.sqrt(max(float(ahead @ covariance[:2, :2] @ ahead), 0.0))


class OdometryErrors:
    """sigmas: standard deviations of scale and delay (s) at first; both 0: the odometry is taken as it is."""

    def __init__(self, sigmas: tuple[float, float]) -> None:
        self._state, self._covariance = np.array((1.0, 0.0)), np.diag(np.square(sigmas))
        self._sums = np.zeros(3)  # way by the odometry, change of speed, way by the matches

    @property
    def scale(self) -> float:
        """m driven for each m of the odometry."""
        return float(self._state[0])

    @property
    def delay(self) -> float:
        """s that the odometry's speed is late."""
        return float(self._state[1])

    def without(self, motion: Motion) -> Pose:
        """The pose of a Motion without these errors."""
        x, y, yaw = motion.pose
        return self.scale * x + self.delay * motion.faster, self.scale * y, yaw

    def heard(self, motion: Motion, matched: Pose, sigma: float) -> None:
        """A Motion, and its pose as a match tells it, whose standard deviation along the way is sigma (m)."""
        if sigma > CERTAIN or abs(motion.pose[2]) > STRAIGHT:
            self.end_stretch()
            return
        self._sums += motion.pose[0], motion.faster, matched[0]
        if abs(self._sums[0]) >= LONGEST:
            self.end_stretch()

    def end_stretch(self) -> None:
        """Learn of the stretch so far: it is long, or nothing tells any more how far the robot came."""
        (*h, way), self._sums = self._sums, np.zeros(3)
        h = np.array(h)
        if abs(h[0]) < LEAST:
            return
        shared, off = self._covariance @ h, way - h @ self._state
        variance = h @ shared + ENDS**2
        if off * off > OUTLIER**2 * variance:
            return
        gain = shared / variance
        self._state = self._state + gain * off
        self._covariance = self._covariance - np.outer(gain, shared)
