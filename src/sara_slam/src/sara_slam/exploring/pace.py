"""How long a robot takes to places at which it is to face some way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sara_common.planar import Pose2D, wrap


class Pace(NamedTuple):
    """m/s, rad/s, and s that a stop takes."""

    speed: float
    turn_rate: float
    stop: float

    def seconds_to(self, stands: np.ndarray, ways: np.ndarray, start: Pose2D, there: float) -> np.ndarray:
        """(n,) s from a pose to each of stands (n, 3), by ways (n,) m; up to `there`, m, it turns on the spot alone."""
        bearing = np.arctan2(stands[:, 1] - start.y, stands[:, 0] - start.x)
        about = np.abs(wrap(bearing - start.yaw)) + np.abs(wrap(stands[:, 2] - bearing))
        turns = np.where(ways > there, about, np.abs(wrap(stands[:, 2] - start.yaw)))
        return ways / self.speed + turns / self.turn_rate + self.stop
