"""The heading of a lost robot by its odometry: a gyro goes on measuring while the robot is lifted and carried away.

While the pose is probably right, the yaw of the odometry's frame in the map is remembered; that yaw and the odometry
tell the heading once the pose is wrong, however the place has changed. Of two places that look alike under a turn it
tells which is meant. Odometry from wheels alone knows nothing of a carry.
"""

from __future__ import annotations

import math

import numpy as np

from sara_common.planar import wrap

SURE = 0.05
"""The probability of being lost up to which a pose is remembered."""
SPREAD = math.radians(10.0)
"""rad, standard deviation: the error of that heading, with what a gyro misjudges in a few turns."""


class KeptHeading:
    """`offset`: the yaw of the odometry's frame in the map when the pose was last sure, rad; None before."""

    def __init__(self) -> None:
        self.offset: float | None = None

    def remember(self, offset: float, lost_probability: float) -> None:
        """The odometry's frame now has the yaw `offset` (rad) in the map, if the robot is not lost."""
        if lost_probability <= SURE:
            self.offset = offset

    def forget(self) -> None:
        """The odometry began anew, or the robot may have any heading."""
        self.offset = None

    def turned(self, poses: np.ndarray, odometry_yaw: float, share: float, rng: np.random.Generator) -> np.ndarray:
        """The poses (n, 3), in place: a share of them, 0 to 1, gets the kept heading. odometry_yaw: rad, now."""
        if self.offset is not None and share > 0.0:
            kept = rng.random(len(poses)) < share
            errors = SPREAD * rng.standard_normal(np.count_nonzero(kept))
            poses[kept, 2] = wrap(self.offset + odometry_yaw + errors)
        return poses
