"""The chips of a chair at rest, in real time, behind the methods of `smbus2.SMBus`."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from sara_common.platforms import chosen
from sara_lowlevel.config import SensorConfig
from sara_sim.chips.i2c_bus import SimulatedI2c
from sara_sim.chips.imu import Imu
from sara_sim.chips.sensor_box import SensorBox
from sara_sim.chips.sonars import Sonars
from sara_sim.config import ChairConfig, DrawnChair
from sara_sim.world.world import World

STEP_S = 0.01
LONGEST_CATCH_UP_S = 5.0  # a program that looked away for longer has missed it
ROOM_CELLS = 80


class RestingChips:
    """A `SensorBox` at rest in the middle of a room of 4 x 4 m."""

    def __init__(self, seed: int, now: float):
        """`now`: s, the clock's reading at power-up."""
        walls = np.zeros((ROOM_CELLS, ROOM_CELLS), bool)
        walls[[0, -1], :] = walls[:, [0, -1]] = True
        world, platform = World(walls), chosen()
        config = ChairConfig.of(platform)
        drawn, imu, sonar, _ = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(4))
        middle = 0.5 * ROOM_CELLS * world.resolution
        physics = Imu(config, DrawnChair.draw(config, drawn), platform.imu, imu, STEP_S)
        acoustics = Sonars(world, config, platform.sonars, sonar, lambda: (middle, middle, 0.0))
        self.box = SensorBox(physics, acoustics, SensorConfig.of(platform), STEP_S)
        self._start, self._steps = now, 0

    def advance(self, now: float) -> None:
        """Bring the chips up to `now` (s)."""
        due = int((now - self._start) / STEP_S)
        if due - self._steps > LONGEST_CATCH_UP_S / STEP_S:
            self._steps = due - int(LONGEST_CATCH_UP_S / STEP_S)
        while self._steps < due:
            self._steps += 1
            self.box.rest(self._steps * STEP_S)


class _RealTimeI2c(SimulatedI2c):
    """A bus whose chips live by a clock of their own: they are brought up to now before every transfer."""

    def __init__(self, chips: dict, advance: Callable[[], None]):
        super().__init__(chips)
        self._advance = advance

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int, force=None) -> list[int]:
        """As a bus whose chips need no clock."""
        self._advance()
        return super().read_i2c_block_data(i2c_addr, register, length, force)

    def read_byte_data(self, i2c_addr: int, register: int, force=None) -> int:
        """As a bus whose chips need no clock."""
        self._advance()
        return super().read_byte_data(i2c_addr, register, force)

    def write_byte_data(self, i2c_addr: int, register: int, value: int, force=None) -> None:
        """As a bus whose chips need no clock."""
        self._advance()
        super().write_byte_data(i2c_addr, register, value, force)

    def write_i2c_block_data(self, i2c_addr: int, register: int, data: list[int], force=None) -> None:
        """As a bus whose chips need no clock."""
        self._advance()
        super().write_i2c_block_data(i2c_addr, register, data, force)


def demo(seed: int = 0, clock: Callable[[], float] = time.monotonic) -> SimulatedI2c:
    """The chips of chair number `seed`, at rest in the middle of a room of 4 x 4 m, in real time.

    For trying a program of the sensor node without a chair: it needs nothing else. `clock`: s, any steady clock.
    """
    chips = RestingChips(seed, clock())
    return _RealTimeI2c(chips.box.i2c.chips, lambda: chips.advance(clock()))
