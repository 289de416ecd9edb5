"""Settings of the compass, checked as a whole."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sara_common.config import ConfigError, is_number, number_faults

ABOVE_0 = (
    'compass_place_sigma',
    'compass_place_roll',
    'compass_place_turn',
    'compass_gate_sigma',
    'compass_norm_tolerance',
    'compass_dip_tolerance',
    'compass_steady_tolerance',
    'compass_steady_roll',
    'compass_drift',
    'compass_restart_roll',
)


@dataclass(frozen=True)
class CompassConfig:
    """config/read.yaml describes each line for users.

    compass_north: rad, the yaw that faces magnetic north: pi/2 where x points to magnetic east (REP-103).
    compass_place_sigma: uT that the field of an undisturbed place differs from the earth's; compass_place_roll,
    compass_place_turn: rad that the wheels roll, or the robot turns, until it is another place. compass_gate_sigma: uT
    by which an undisturbed field misses what is expected. compass_norm_tolerance (uT), compass_dip_tolerance (rad):
    a field further from the earth's is disturbed; so is one further than compass_steady_tolerance (uT) from the mean of
    the last compass_steady_roll (rad of the wheels). compass_drift: rad/s per root of a second, how the gyroscope's
    offset wanders. compass_restart_roll: rad that the wheels roll while undisturbed fields contradict the gyroscope,
    until it is given up.
    """

    compass_north: float = 0.5 * math.pi
    compass_place_sigma: float = 0.5
    compass_place_roll: float = 3.2
    compass_place_turn: float = 0.35
    compass_gate_sigma: float = 0.5
    compass_norm_tolerance: float = 2.0
    compass_dip_tolerance: float = 0.045
    compass_steady_tolerance: float = 1.0
    compass_steady_roll: float = 13.0
    compass_drift: float = 7.0e-6
    compass_restart_roll: float = 65.0

    def __post_init__(self):
        faults = number_faults(self, above_0=ABOVE_0)
        if not is_number(self.compass_north):
            faults.append(f'compass_north is {self.compass_north!r}, allowed are finite numbers')
        if faults:
            raise ConfigError(faults)
