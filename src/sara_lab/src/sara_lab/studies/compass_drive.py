"""Simulated chairs with a magnetometer: calibrated by two turns on the spot, then driven from door to door, parked now
and then, while heading and gyroscope are held against the truth.

The chair's programs, bus and reader are the real ones; the pilot knows the truth and has no walls to heed. A door is a
pair of steel posts that the chair passes between.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from canserial.calibration.turns import Turned, Turns
from canserial.dbc.bus import BusDescription
from canserial.dbc.modes import DRIVE
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from canserial.reader.readings import FieldReading, HeadingReading, ImuReading
from sara_common.planar import wrap_exact
from sara_common.repeatable import cos_sin
from sara_lowlevel.config import FAST_IMU, SensorConfig
from sara_sim.chair import SimulatedChair
from sara_sim.chips.gps_config import GpsConfig
from sara_sim.chips.magnetic_config import MagneticConfig
from sara_sim.world import luck
from sara_sim.world.world import World

BUS = '+compass'
READY_S = 25.0
"""s of rest at the start: the gyroscope is calibrated by then."""
COMMAND_STEPS = 2
SPEED, TURN = 0.6, 0.6
"""m/s, rad/s."""
RAMP = 1.0, 1.5
"""m/s2, rad/s2."""
DOORS, FIELD_M, DOOR_M, BEFORE_M = 10, 24.0, 0.90, 1.2
"""How many, on a square of this size; their width; how far off the chair lines up for them."""
REACHED, STRAIGHT = 0.15, 0.35
"""m from a target, and rad off the way to it at which the chair drives on."""
PARKS, LONGEST_PARK_S = 0.3, 60.0
"""Share of the doors behind which it does, and s."""
FACED_SIGMA = math.radians(0.5)
"""rad by which a person misjudges the heading at the start."""


class Row(NamedTuple):
    """s; rad that the heading is off and that the gyroscope alone is, from the same start; rad2; whether the last field
    was the earth's.
    """

    time: float
    heading: float
    gyro: float
    variance: float
    clear: bool


class CompassChair:
    """`chair`: SimulatedChair; `reader`: Reader; `north`: rad, the yaw that faces magnetic north."""

    def __init__(
        self,
        seed: int,
        magnetic: MagneticConfig,
        world: World | None = None,
        start: tuple[float, float, float] = (0.0, 0.0, 0.0),
        gps: GpsConfig | None = None,
    ) -> None:
        self.bus = BusDescription.named(BUS)
        sensors = SensorConfig.of(imu_period=FAST_IMU)
        self.chair = SimulatedChair(
            world or World.empty(), seed, start, self.bus, sensors=sensors, magnetic=magnetic, gps=gps
        )
        earth = self.chair.magnetism.earth
        self.north = math.atan2(earth[1], earth[0])
        self.reader = Reader(ReaderConfig.of(), self.bus)
        self.reader.compass.config = replace(self.reader.compass.config, compass_north=self.north)
        self._slip = self.chair.platform.parameters('safety_gate')['turn_slip']  # what the wheels turn more
        self._v = self._w = 0.0
        self._tick = 0

    def step(self, v: float, w: float) -> list[NamedTuple]:
        """10 ms towards this speed (m/s, rad/s); what the reader says."""
        self._tick += 1
        if self._tick % COMMAND_STEPS == 0:
            dt = 0.01 * COMMAND_STEPS
            self._v += min(max(v - self._v, -RAMP[0] * dt), RAMP[0] * dt)
            self._w += min(max(w - self._w, -RAMP[1] * dt), RAMP[1] * dt)
            self._command()
        return [reading for frame in self.chair.step() for reading in self.reader.on_frame(frame)]

    def _command(self):
        config, time = self.chair.config, self.chair.time
        side = 0.5 * config.track * self._slip * self._w
        right, left = ((self._v + sign * side) / config.wheel_radius for sign in (1, -1))
        if time > READY_S:
            self.chair.receive(self.bus.encode('WHEEL_COMMAND', time, right=right, left=left, mode=DRIVE))
        else:
            self.chair.receive(self.bus.encode('WHEEL_COMMAND', time, right=0.0, left=0.0, mode=ord('A')))

    def calibrate(self, facing: float | None) -> Turned:
        """Two turns on the spot. facing: rad, the yaw at the start as somebody judges it."""
        reader, turns, rates = self.reader, Turns(), (0.0, 0.0, 0.0)
        while any(turns.missing) or self.chair.time < READY_S:
            left, right = turns.missing
            w = 0.0 if self.chair.time < READY_S else TURN if left else -TURN if right else 0.0
            for reading in self.step(0.0, w):
                if isinstance(reading, ImuReading):
                    rates = reading.angular_velocity
                elif isinstance(reading, FieldReading) and reader.ready:
                    turns.add(reading.field, reader.gain * reader.turned, rates, reader.compass.efforts)
        earth = self.chair.magnetism.earth
        turned = turns.result(math.hypot(earth[0], earth[1]), -earth[2], reader.gain, facing, self.north)
        reader.compass.iron = turned.iron
        while not reader.compass.clear or self._w:
            self.step(0.0, 0.0)
        return turned


def doors(seed: int) -> np.ndarray:
    """(DOORS, 3): the middle (x, y) and the direction of the way through each, m, rad."""
    random = luck.stream(seed, 'doors')
    places = random.uniform(-0.5 * FIELD_M, 0.5 * FIELD_M, (DOORS, 2))
    places += 3.0 * np.sign(places)  # the chair is calibrated in the middle
    return np.column_stack((places, random.uniform(-math.pi, math.pi, DOORS)))


def posts(of: np.ndarray) -> tuple[tuple[float, float], ...]:
    """The two posts of each door."""
    c, s = cos_sin(of[:, 2])
    across = 0.5 * DOOR_M * np.column_stack((-s, c))
    return tuple((float(x), float(y)) for x, y in np.concatenate((of[:, :2] + across, of[:, :2] - across)))


class Tour:
    """Drives from door to door, in any order."""

    def __init__(self, seed: int, of: np.ndarray) -> None:
        self._random, self._doors = luck.stream(seed, 'tour'), of
        self._targets: list[tuple[float, float]] = []
        self._parked_until = 0.0

    def command(self, time: float, pose: tuple[float, float, float]) -> tuple[float, float]:
        """(v, w) at a time (s) and true pose."""
        if time < self._parked_until:
            return 0.0, 0.0
        if not self._targets:
            self._next()
        x, y = self._targets[0]
        if math.hypot(x - pose[0], y - pose[1]) < REACHED:
            self._targets.pop(0)
            if not self._targets and self._random.random() < PARKS:
                self._parked_until = time + float(self._random.uniform(2.0, LONGEST_PARK_S))
            return 0.0, 0.0
        off = wrap_exact(math.atan2(y - pose[1], x - pose[0]) - pose[2])
        turn = min(max(2.0 * off, -TURN), TURN)
        return (SPEED if abs(off) < STRAIGHT else 0.0), turn

    def _next(self):
        x, y, along = self._doors[self._random.integers(len(self._doors))]
        way = (1.0 if self._random.random() < 0.5 else -1.0) * np.array((math.cos(along), math.sin(along)))
        self._targets = [(float(x + s * way[0]), float(y + s * way[1])) for s in (-BEFORE_M, 0.3 * BEFORE_M)]


def drive(seed: int, minutes: float, magnetic: MagneticConfig, steel: bool, faced: bool = True) -> tuple[Turned, list]:
    """A chair's calibration and its Rows, 20 a second. steel: whether the doors have steel posts. faced: whether its
    heading was known when it was calibrated.
    """
    of = doors(seed)
    vehicle = CompassChair(seed, replace(magnetic, steel=posts(of)) if steel else magnetic)
    facing = float(luck.stream(seed, 'faced').normal(0.0, FACED_SIGMA)) if faced else None
    turned = vehicle.calibrate(facing)
    tour, rows, start = Tour(seed, of), [], None
    compass, end = vehicle.reader.compass, vehicle.chair.time + 60.0 * minutes
    while vehicle.chair.time < end:
        time, yaw = vehicle.chair.time, vehicle.chair.pose[2]
        for reading in vehicle.step(*tour.command(time, vehicle.chair.pose)):
            if isinstance(reading, HeadingReading):
                share = (reading.stamp - time) / (vehicle.chair.time - time)
                true = yaw + share * wrap_exact(vehicle.chair.pose[2] - yaw)
                if start is None:
                    start = reading.yaw - vehicle.reader.yaw
                heading, gyro = wrap_exact(reading.yaw - true), wrap_exact(vehicle.reader.yaw + start - true)
                rows.append(Row(reading.stamp, heading, gyro, reading.yaw_variance, compass.clear))
    return turned, rows
