"""The sensor node's box: one MPU6050 and SRF02s on an I2C bus, fed with the chair's true motion."""

from __future__ import annotations

from collections.abc import Callable

from sara_lowlevel.config import SensorConfig
from sara_sim.chips.i2c_bus import SimulatedI2c
from sara_sim.chips.imu import Imu
from sara_sim.chips.mpu6050 import Mpu6050
from sara_sim.chips.sonars import Sonars
from sara_sim.chips.srf02 import Srf02
from sara_sim.motion.body_motion import Motion


class SensorBox:
    """`i2c`: the bus. `imu`: the MPU6050. `sonars`: {name: Srf02}. `time`: s, of the last step. `noise`: [(Generator,
    sigma in m/s2, in deg/s)] that faults add.
    """

    def __init__(self, physics: Imu, acoustics: Sonars, sensors: SensorConfig, dt: float):
        """`physics`, `acoustics`: what reaches the chips. `sensors`: their addresses. `dt`: s a step."""
        self.dt, self.time = dt, 0.0
        self.noise: list[tuple] = []
        self._gravity = sensors.gravity
        self.physics, self.acoustics = physics, acoustics
        self.imu = Mpu6050()
        addresses = sensors.sonar_addresses
        self.sonars = {name: Srf02(self._echo_of(name), lambda: self.time) for name in addresses}
        self.i2c = SimulatedI2c(
            {sensors.imu_address: self.imu, **{addresses[name]: chip for name, chip in self.sonars.items()}}
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
