"""Where SARA's sensors sit, in `base_link` (on the floor, midway between the drive wheels, x forward)."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians


@dataclass(frozen=True)
class Mount:
    """A sensor's place: x, y, z in m, yaw in rad."""

    x: float
    y: float
    z: float
    yaw: float


SONARS = {
    'SDI': Mount(0.54, 0.18, 0.45, radians(10)),
    'SDD': Mount(0.54, -0.18, 0.45, radians(-10)),
    'SLID': Mount(0.35, 0.29, 0.45, radians(90)),
    'SLIT': Mount(-0.35, 0.29, 0.45, radians(90)),
    'SLDD': Mount(0.35, -0.29, 0.45, radians(-90)),
    'SLDT': Mount(-0.35, -0.29, 0.45, radians(-90)),
    'STI': Mount(-0.54, 0.18, 0.45, radians(170)),
    'STD': Mount(-0.54, -0.18, 0.45, radians(-170)),
    'SJO': Mount(0.30, -0.25, 0.75, 0.0),
}
IMU = Mount(0.0, -0.25, 0.40, 0.0)
SCANNER = Mount(0.50, 0.0, 0.25, 0.0)
