"""What the chair's sensors say of its true motion: the MPU6050 as int16 counts, the SRF02 sonars in whole centimetres."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import cos, degrees, inf, radians, sin, sqrt

import numpy as np

from sara_sim import mounting
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.world import World

ACCEL_COUNTS_PER_G = 16384.0
GYRO_COUNTS_PER_DPS = 131.0
_INT16 = 32767
_BLOCK = 512


class Imu:
    """An MPU6050 at its power-up ranges: offsets, scale error, slow drift, noise, mounting tilt.

    Measured rate = scale * true rate + bias + drift + noise. Specific force includes gravity, the chair's acceleration and the sensor's
    place beside the centre. The noise of a sample is that of a 200 ms mean times the square root of the samples in it.
    """

    def __init__(self, config: ChairConfig, chair: DrawnChair, random: np.random.Generator, dt: float):
        self.config, self.chair = config, chair
        self._random = random
        root = sqrt(config.samples_per_frame)
        step = config.gyro_drift * sqrt(dt / 60.0)
        self._sigma = np.array([*(s * root for s in chair.accel_sigma), *(s * root for s in config.gyro_frame_sigma), step, step, step])
        self._bias = list(chair.gyro_bias)
        self._rotation = _tilt(radians(chair.roll), radians(chair.pitch))
        self._noise: list = []

    def sample(self, acceleration: float, speed: float, yaw_rate: float, yaw_acceleration: float) -> tuple[tuple, tuple]:
        """Counts ((ax, ay, az), (gx, gy, gz)) for a motion in the plane: m/s2, m/s, rad/s, rad/s2 of `base_link`."""
        if not self._noise:
            self._noise = (self._random.standard_normal((_BLOCK, 9)) * self._sigma).tolist()
        noise = self._noise.pop()
        place, config = mounting.IMU, self.config
        square = yaw_rate * yaw_rate
        fx = acceleration - yaw_acceleration * place.y - square * place.x
        fy = speed * yaw_rate + yaw_acceleration * place.x - square * place.y
        fz = config.gravity
        rate = degrees(yaw_rate)
        accel, gyro = [], []
        for axis in range(3):
            to_x, to_y, to_z = self._rotation[axis]
            force = to_x * fx + to_y * fy + to_z * fz + config.accel_offset[axis] + noise[axis]
            accel.append(_counts(force * ACCEL_COUNTS_PER_G / config.gravity))
            self._bias[axis] += noise[6 + axis]
            scale = self.chair.gyro_scale if axis == 2 else 1.0
            gyro.append(_counts((scale * to_z * rate + self._bias[axis] + noise[3 + axis]) * GYRO_COUNTS_PER_DPS))
        return tuple(accel), tuple(gyro)


class Sonars:
    """The nine SRF02s. A reading is the distance at the moment of the trigger; 0 means no echo."""

    def __init__(self, world: World, config: ChairConfig, random: np.random.Generator, pose: Callable[[], tuple[float, float, float]]):
        """`pose`: gives the true (x, y, yaw) of the chair now."""
        self._world, self._config, self._random, self._pose = world, config, random, pose
        self._readings: dict[str, int] = {}

    def trigger(self, names: Iterable[str]) -> None:
        """Send a burst from each of the named sensors."""
        config = self._config
        x, y, yaw = self._pose()
        c, s = cos(yaw), sin(yaw)
        for name in names:
            mount = mounting.SONARS[name]
            distance = self._world.sonar(
                x + c * mount.x - s * mount.y, y + s * mount.x + c * mount.y, yaw + mount.yaw, radians(config.sonar_cone / 2),
                config.sonar_rays, radians(config.sonar_steepest), config.sonar_limit)
            # Drawn whether there is an echo or not, so that a wall does not change the luck of what follows.
            error, luck = self._random.normal(0.0, config.sonar_sigma), self._random.random()
            lost = distance == inf or luck < config.sonar_lost
            self._readings[name] = 0 if lost else max(round(100.0 * (distance + error)), 0)

    def read(self, name: str) -> int:
        """The last reading in cm, 0 without an echo or before the first trigger."""
        return self._readings.get(name, 0)


def _tilt(roll: float, pitch: float) -> list[list[float]]:
    """Rows that take a vector of `base_link` into the IMU's axes, mounted with this roll and pitch."""
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    return [[cp, 0.0, -sp], [sr * sp, cr, sr * cp], [cr * sp, -sr, cr * cp]]


def _counts(value: float) -> int:
    return min(max(round(value), -_INT16 - 1), _INT16)
