"""The sensor node's box: one MPU6050 and nine SRF02s on an I2C bus, fed with the chair's true motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sara_sim.chips.i2c_bus import SONAR_ADDRESSES, SimulatedI2c
from sara_sim.chips.imu import Imu
from sara_sim.chips.mpu6050 import ADDRESS as IMU_ADDRESS
from sara_sim.chips.mpu6050 import Mpu6050
from sara_sim.chips.sonars import Sonars
from sara_sim.chips.srf02 import Srf02
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.motion.body_motion import Motion
from sara_sim.world.world import World


class SensorBox:
    """`i2c`: the bus. `imu`: the MPU6050. `sonars`: {name: Srf02}. `time`: s, of the last step. `noise`: [(Generator,
    sigma in m/s2, in deg/s)] that faults add.
    """

    def __init__(
        self,
        world: World,
        config: ChairConfig,
        chair: DrawnChair,
        luck: tuple[np.random.Generator, np.random.Generator],
        pose: Callable[[], tuple[float, float, float]],
        dt: float,
    ):
        """`luck`: of the IMU and of the sonars. `pose`: gives the true (x, y, yaw) of the chair now. `dt`: s a step."""
        self.dt, self.time = dt, 0.0
        self.noise: list[tuple] = []
        self._gravity = config.gravity
        self.physics = Imu(config, chair, luck[0], dt)
        self.acoustics = Sonars(world, config, luck[1], pose)
        self.imu = Mpu6050()
        self.sonars = {name: Srf02(self._echo_of(name), lambda: self.time) for name in SONAR_ADDRESSES}
        self.i2c = SimulatedI2c(
            {IMU_ADDRESS: self.imu, **{SONAR_ADDRESSES[name]: chip for name, chip in self.sonars.items()}}
        )

    def _echo_of(self, name: str) -> Callable[[], float]:
        return lambda: self.acoustics.echo(name)

    def rest(self, now: float) -> None:
        """One step of a chair at rest on a level floor. `now`: s."""
        self._feel(now, self.physics.sample())

    def step(self, now: float, motion: Motion) -> None:
        """One step in motion. `now`: s."""
        self._feel(now, self.physics.moving(motion))

    def _feel(self, now: float, value: list[float]) -> None:
        self.time = now
        self.imu.step(self.dt, tuple(self._noisy(value) if self.noise else value))

    def _noisy(self, value: list[float]) -> list[float]:
        for random, accel, gyro in self.noise:
            extra = random.standard_normal(6).tolist()
            value = [
                v + n * (accel / self._gravity if axis < 3 else gyro) for axis, (v, n) in enumerate(zip(value, extra))
            ]
        return value
