"""What reaches the magnetometer: the earth's field, steel in the world, the motors' currents, the chair's own iron.

    chip = S T (R^T (earth + sum of dipoles) + sum of motors) + hard iron + noise,
with R the chair's attitude, T the box's mounting, S the soft iron's matrix (Poisson's nine coefficients: it need not be
symmetric). A dipole of moment m at distance r along the unit vector u has the field (3 (m u) u - m) / r^3. A motor's
field is that of its current: friction, speed and acceleration of its wheel.
"""

from __future__ import annotations

import datetime
from collections.abc import Callable
from functools import lru_cache
from math import radians, tanh
from typing import NamedTuple

import numpy as np

from sara_common.earth_field import earth_field
from sara_common.planar import Pose2D
from sara_sim.chips.hmc5883l import ADDRESS as HMC_ADDRESS
from sara_sim.chips.hmc5883l import Hmc5883l
from sara_sim.chips.magnetic_config import MagneticConfig
from sara_sim.chips.qmc5883l import ADDRESS as QMC_ADDRESS
from sara_sim.chips.qmc5883l import Qmc5883l
from sara_sim.world import luck

MICROTESLA = 1e6
CHIPS = {'HMC5883L': (HMC_ADDRESS, Hmc5883l), 'QMC5883L': (QMC_ADDRESS, Qmc5883l)}
FRICTION_A, PER_SPEED_A, PER_ACCELERATION_A = 1.5, 0.7, 0.8
"""A of a motor: turning at all, for each rad/s and for each rad/s2 of its wheel [W]."""
STARTING = 0.1
"""rad/s of the wheel at which friction is felt in full, nearly."""
NEAREST = 0.15
"""m; a post's own radius keeps the chip further off than this."""


class Wheel(NamedTuple):
    """rad/s, rad/s2."""

    speed: float
    acceleration: float

    @property
    def current(self) -> float:
        """A of its motor."""
        friction = FRICTION_A * tanh(self.speed / STARTING)
        return friction + PER_SPEED_A * self.speed + PER_ACCELERATION_A * self.acceleration


class Placement(NamedTuple):
    """Where the chair is: x, y (m), roll, pitch, yaw (rad) in the map; its right and left wheel."""

    x: float
    y: float
    roll: float
    pitch: float
    yaw: float
    right: Wheel
    left: Wheel


class Magnetism:
    """The field at the chip of one chair, drawn from a seed. `earth`: (3,) uT in the map, x east, y north, z up.
    `chip`: the one that is configured, at `address`. `magnet`: uT along its axes that faults add.
    """

    def __init__(
        self,
        config: MagneticConfig,
        seed: int,
        box: tuple[tuple[float, float], Pose2D],
        placement: Callable[[], Placement],
        clock: Callable[[], float],
    ) -> None:
        """`box`: its roll and pitch, deg, and its place. `placement`: of the chair now. `clock`: s."""
        random, (tilt, self._mount) = luck.stream(seed, 'magnetism'), box
        self.config = config
        self.earth = np.array(_earth(config.latitude, config.longitude, config.date))
        self.hard_iron = random.normal(0.0, config.hard_iron_sigma, 3)
        soft = np.eye(3) + random.normal(0.0, config.soft_iron_sigma, (3, 3))
        turn = radians(random.normal(0.0, config.turn_sigma))
        self.iron = soft @ rotation(radians(tilt[0]), radians(tilt[1]), turn).T
        self._motors = random.normal(0.0, config.motor_sigma, (2, 3))
        posts = luck.stream(seed, 'steel').normal(size=(len(config.steel), 3))
        posts /= np.linalg.norm(posts, axis=1, keepdims=True)
        # On its axis a dipole's field is twice that beside it.
        self._moments = 0.5 * config.steel_field * config.steel_distance**3 * posts
        self._places = np.array(config.steel, dtype=float).reshape(-1, 2)
        self._noise, self._placement = random, placement
        self.magnet = (0.0, 0.0, 0.0)
        self.address, kind = CHIPS[config.chip]
        self.chip = kind(self.field, clock)

    def field(self) -> np.ndarray:
        """(3,) uT at the sensing elements now, along the chip's x, y, z, with the noise of one measurement."""
        body = self.body_field(self._placement())
        return self.iron @ body + self.hard_iron + self.magnet + self._noise.normal(0.0, self.config.noise, 3)

    def body_field(self, at: Placement) -> np.ndarray:
        """(3,) uT in `base_link` without the chair's own iron."""
        turned = rotation(at.roll, at.pitch, at.yaw)
        place = np.array((at.x, at.y)) + (turned @ (self._mount.x, self._mount.y, 0.0))[:2]
        motors = self._motors[0] * at.right.current + self._motors[1] * at.left.current
        return turned.T @ (self.earth + self._steel(place)) + motors

    def _steel(self, place):
        """(3,) uT of all posts at a place (2,), m."""
        if not len(self._places):
            return np.zeros(3)
        way = place - self._places
        distance = np.maximum(np.linalg.norm(way, axis=1), NEAREST)
        unit = np.column_stack((way / np.maximum(np.linalg.norm(way, axis=1), 1e-9)[:, None], np.zeros(len(way))))
        along = np.einsum('ij,ij->i', self._moments, unit)
        return ((3.0 * along[:, None] * unit - self._moments) / distance[:, None] ** 3).sum(axis=0)


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """(3, 3) Rz(yaw) Ry(pitch) Rx(roll): from the turned axes into the fixed ones; rad."""
    (sr, sp, sy), (cr, cp, cy) = np.sin((roll, pitch, yaw)), np.cos((roll, pitch, yaw))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


@lru_cache
def _earth(latitude, longitude, date):
    field = earth_field(latitude, longitude, 0.0, datetime.date(*date))
    return field.east * MICROTESLA, field.north * MICROTESLA, -field.down * MICROTESLA
