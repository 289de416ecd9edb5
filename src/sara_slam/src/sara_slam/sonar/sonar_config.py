"""What a map builder by range sensors is told of the sensors and of the odometry."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from sara_common.platforms import OfPlatform, Platform


@dataclass(frozen=True)
class SonarConfig(OfPlatform):
    """Of the sensors, of the odometry, and of the walls that are believed. Names are those of range_localization's
    parameters where it has them.
    """

    range_delay: float = 0.3  # s by which a reading is older than its stamp
    range_min_range: float = 0.2  # m: what is used
    range_max_range: float = 2.4  # m
    range_sigma_hit: float = 0.04  # m: of a reading about the distance of a wall
    field_of_view: float = math.radians(60.0)  # rad: full cone
    steepest: float = math.radians(60.0)  # rad between axis and a wall's normal, from which on the wall is silent
    gate: float = 3.0  # standard deviations
    max_innovation: float = 0.25  # m
    update_min_d: float = 0.05  # m, rad between two readings of a sensor that move the estimate
    update_min_a: float = 0.05
    odom_alpha1: float = 5.0e-5  # rad2 per rad
    odom_alpha2: float = 2.0e-5  # rad2 per m
    odom_alpha3: float = 1.0e-4  # m2 per m
    odom_alpha4: float = 5.0e-5  # m2 per rad
    turn_scale_sigma: float = 0.01  # of the odometry's turns and ways
    way_scale_sigma: float = 0.01
    square_gate: float = math.radians(8.0)  # rad off the building's directions that a wall may be and be one of them
    square_sigma: float = math.radians(0.2)
    body_length: float = 0.0  # m: nothing stands where the body was, a box centred on the robot's frame; 0: not known
    body_width: float = 0.0
    resolution: float = 0.05  # m per cell

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """Its body."""
        return dict(zip(('body_length', 'body_width'), platform.size))
