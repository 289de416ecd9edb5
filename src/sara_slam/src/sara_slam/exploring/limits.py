"""How long a robot may go on exploring until it has to turn home."""

from __future__ import annotations

import math

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_slam.exploring.explore_config import ExploreConfig
from sara_slam.exploring.viewpoints import Surroundings

PACE, SPARE_S, LOOK_S = 0.12, 60.0, 10.0
"""m/s at least that the way home goes on, s more that it may take, and s between two looks at how long it is."""


class Limits:
    """`time_limit` and `return_by` of an ExploreConfig. footprint: (k, 2) m, of the robot."""

    def __init__(self, config: ExploreConfig, footprint: np.ndarray) -> None:
        self._config, self._footprint = config, footprint
        self._looked, self._way = -math.inf, 0.0

    def left(self, gone: float, pose: Pose2D, home: Pose2D, ground: Costmap) -> tuple[float, str]:
        """(s until it has to turn home, inf without a limit; by which limit, a sentence), `gone` s after it began, at a
        pose on the map by which it goes.
        """
        config = self._config
        limits = [(math.inf, '')]
        if config.time_limit > 0.0:
            limits.append((config.time_limit - gone, f'The time_limit of {config.time_limit:.0f} s is over.'))
        if config.return_by > 0.0:
            left = config.return_by - gone - SPARE_S - self._way_home(gone, pose, home, ground) / PACE
            limits.append((left, f'The way back takes what is left of {config.return_by:.0f} s (return_by).'))
        return min(limits)

    def _way_home(self, gone, pose, home, ground):
        """m that are to be driven home, as far as is known."""
        if not 0.0 <= gone - self._looked < LOOK_S:
            known = Surroundings(ground, pose, self._footprint).way_to(home.x, home.y)
            self._way = known if math.isfinite(known) else max(self._way, pose.distance(home))
            self._looked = gone
        return self._way
