"""How the body moves at a time, as an IMU on it feels it."""

from __future__ import annotations

from typing import NamedTuple


class Motion(NamedTuple):
    """Acceleration of `base_link` forward, to the left and up (m/s2), rates (rad/s, rad/s2), roll and pitch (rad; a
    nose that points up is a negative pitch).
    """

    ax: float
    ay: float
    yaw_rate: float
    yaw_acceleration: float
    roll: float = 0.0
    pitch: float = 0.0
    roll_rate: float = 0.0
    pitch_rate: float = 0.0
    az: float = 0.0
