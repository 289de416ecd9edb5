"""What reaches the MPU6050's sensing elements: the chair's motion in the chip's axes, with the errors of the individual
chip.

    force = R (a + alpha x p - w^2 p + gravity) / g + offset + noise,    rate = scale R w + bias + drift + noise,
with p the sensor's place and R its mounting tilt. The offsets of table 4.1 were measured on the chair, tilt included:
what a resting chair on a level floor measures is (0, 0, g) + offset, whatever the tilt.
"""

from __future__ import annotations

from math import cos, degrees, radians, sin, sqrt

import numpy as np

from sara_common.planar import Pose2D
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.motion.body_motion import Motion

_BLOCK = 512


class Imu:
    """Analogue samples for the chip. The gyro's sigma of a 10 ms sample is that of a 200 ms mean times sqrt(20); the
    accelerometer's is that of tables 4.1 and 4.2 as it stands, since the node sends single samples of it.
    """

    def __init__(self, config: ChairConfig, chair: DrawnChair, mount: Pose2D, random: np.random.Generator, dt: float):
        self._random, self._mount = random, mount
        gravity = self._gravity = config.gravity
        root = sqrt(config.samples_per_frame)
        step = config.gyro_drift * sqrt(dt / 60.0)
        self._sigma = np.array(
            [*(s / gravity for s in chair.accel_sigma), *(s * root for s in config.gyro_frame_sigma), step, step, step]
        )
        rest = [offset / gravity for offset in config.accel_offset]
        self._rest = np.array([rest[0], rest[1], rest[2] + 1.0])
        self._bias = np.array(chair.gyro_bias)
        self._scale = chair.gyro_scale
        self._rotation = _tilt(radians(chair.roll), radians(chair.pitch))
        # Flat, newest last: a list a sample would keep the garbage collector busy.
        self._block: list = []
        self._biases = np.empty((0, 3))
        self._next = 0

    @property
    def gyro_bias(self) -> tuple[float, float, float]:
        """The gyro's bias in the newest sample, drift included, deg/s: for tests and experiments only."""
        return tuple((self._biases[self._next // 6 - 1] if self._next else self._bias).tolist())

    def sample(self) -> list[float]:
        """[ax, ay, az (g), gx, gy, gz (deg/s)] of a chair that rests on a level floor."""
        if self._next == len(self._block):
            self._draw()
        begin, self._next = self._next, self._next + 6
        return self._block[begin : self._next]

    def moving(self, motion: Motion) -> list[float]:
        """The same in motion."""
        ax, ay, yaw_rate, yaw_acceleration, roll, pitch, roll_rate, pitch_rate, az = motion
        value = self.sample()
        place, g = self._mount, self._gravity
        square = yaw_rate * yaw_rate
        fx = (ax - yaw_acceleration * place.y - square * place.x) / g
        fy = (ay + yaw_acceleration * place.x - square * place.y) / g
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = self._rotation
        wz = degrees(yaw_rate)
        if not (roll or pitch or roll_rate or pitch_rate or az):  # on a level floor
            value[0] += xx * fx + xy * fy
            value[1] += yx * fx + yy * fy
            value[2] += zx * fx + zy * fy
            value[3] += xz * wz
            value[4] += yz * wz
            value[5] += self._scale * (zz * wz)
            return value
        fx -= sin(pitch)
        fy += cos(pitch) * sin(roll)
        fz = az / g + (cos(pitch) * cos(roll) - 1.0)
        wx, wy = degrees(roll_rate), degrees(pitch_rate)
        value[0] += xx * fx + xy * fy + xz * fz
        value[1] += yx * fx + yy * fy + yz * fz
        value[2] += zx * fx + zy * fy + zz * fz
        value[3] += xx * wx + xy * wy + xz * wz
        value[4] += yx * wx + yy * wy + yz * wz
        value[5] += self._scale * (zx * wx + zy * wy + zz * wz)
        return value

    def _draw(self) -> None:
        noise = self._random.standard_normal((_BLOCK, 9)) * self._sigma
        bias = self._bias + np.cumsum(noise[:, 6:], axis=0)
        self._bias = bias[-1]
        block = np.empty((_BLOCK, 6))
        block[:, :3] = self._rest + noise[:, :3]
        block[:, 3:] = bias + noise[:, 3:6]
        self._block, self._biases, self._next = block.ravel().tolist(), bias, 0


def _tilt(roll: float, pitch: float) -> list[list[float]]:
    """Rows that take a vector of `base_link` into the IMU's axes, mounted with this roll and pitch."""
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    return [[cp, 0.0, -sp], [sr * sp, cr, sr * cp], [cr * sp, -sr, cr * cp]]
