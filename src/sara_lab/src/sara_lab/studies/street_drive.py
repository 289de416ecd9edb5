"""A simulated chair that drives 1 km along pavements: what its compass, wheels and GPS receiver say, beside the truth.

Its programs, bus and readers are the real ones, and the receiver is read by the driver's parser. It is guided by its
true pose: fixes that are metres off cannot keep it on a pavement, and where it goes must not depend on what is judged.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from canserial.reader.readings import EncoderReading, HeadingReading
from nmea_navsat_driver.config import DriverConfig
from nmea_navsat_driver.receiver import Fix, Receiver, Velocity
from nmea_navsat_driver.sentences import Lines
from sara_bringup.paths import share
from sara_common.planar import Pose2D, between, wrap_exact
from sara_common.platforms import parameters
from sara_control.wheels.can_base import CanBase
from sara_control.wheels.config import ControllerConfig
from sara_control.wheels.controller import DiffDriveController
from sara_lab.judge.runs import runs
from sara_lab.studies.compass_drive import FACED_SIGMA, STRAIGHT, TURN, CompassChair
from sara_lab.studies.kept_arrays import kept_arrays
from sara_sim.chips.gps_config import GpsConfig
from sara_sim.chips.magnetic_config import MagneticConfig
from sara_sim.riders.way import Way
from sara_sim.world import luck
from sara_sim.world.world import World

WORLD = 'street_world.yaml'
HOME = Pose2D(10.0, 15.0, 0.0)
ROUND = (
    (10.0, 15.0),
    (140.0, 15.0),
    (105.0, 15.0),
    (105.0, 45.0),
    (140.0, 45.0),
    (10.0, 45.0),
    (45.0, 45.0),
    (45.0, 15.0),
)
"""Corners of a way along pavements and over crossings, m, from home and back: 460 m, with turns on the spot."""
LENGTH, SPEED, LOOKAHEAD = 1000.0, 0.8, 0.8
"""m, m/s, m."""
LAMPS_X, LAMPS_Y = np.arange(12.5, 150.0, 25.0), (16.5, 23.5, 36.5, 43.5)
"""m: where the street's lamp posts, which are of steel, stand at the kerbs."""
GPS = GpsConfig(outage_interval=120.0)
TRUTH_STEPS = 5


class StreetDrive(NamedTuple):
    """What was recorded of a drive; rows by time (s, from the chair's start), m, rad, deg.

    `truth`: t, x, y, yaw, 20 a second. `headings`: t, roll, pitch, yaw, yaw variance, turn rate. `wheels`: t, speed and
    its variance. `fixes`: t, status, latitude, longitude, variances east and north, whether multipath throws it off,
    error east and north. `velocities`: t, east, north of the antenna (m/s). `declination`: rad by which magnetic north
    lies east of true north.
    """

    truth: np.ndarray
    headings: np.ndarray
    wheels: np.ndarray
    fixes: np.ndarray
    velocities: np.ndarray
    declination: np.ndarray

    @property
    def outages(self) -> list[tuple[float, float]]:
        """(begin, end) of each time without fixes, s."""
        return _runs(self.fixes[:, 0], self.fixes[:, 1] < 0)

    @property
    def jumps(self) -> list[tuple[float, float]]:
        """(begin, end) of each time that multipath throws the fixes, s."""
        fixes = self.fixes[self.fixes[:, 1] >= 0]
        return _runs(fixes[:, 0], fixes[:, 6] > 0)

    def pose(self, time: float) -> tuple[float, float, float]:
        """The true (x, y, yaw) at a time (s)."""
        k = int(np.clip(np.searchsorted(self.truth[:, 0], time), 1, len(self.truth) - 1))
        (t0, *before), (t1, *after) = self.truth[k - 1 : k + 1].tolist()
        x, y, yaw = between(before, after, (time - t0) / (t1 - t0))
        return x, y, wrap_exact(yaw)


def _runs(times, inside):
    """(begin, end) of the times at which something is so, s; the end is the first at which it is no longer."""
    return [(float(times[first]), float(times[min(end, len(times) - 1)])) for first, end in runs(inside)]


class _Recorder:
    """A chair, calibrated at home, and the rows of what it says."""

    def __init__(self, seed: int, gps: GpsConfig):
        steel = tuple((float(x), y) for x in LAMPS_X for y in LAMPS_Y)
        world = World.from_yaml(str(share() / 'maps' / WORLD))
        self.vehicle = CompassChair(seed, replace(MagneticConfig(), steel=steel), world, HOME, gps)
        self.chair = self.vehicle.chair
        self.vehicle.calibrate(float(luck.stream(seed, 'faced').normal(0.0, FACED_SIGMA)))
        control = ControllerConfig.from_params(
            parameters('sara_control', 'diff_drive_controller.yaml', self.chair.platform)
        )
        self._base = CanBase.from_config(self.vehicle.bus, control, True)
        self._controller = DiffDriveController(control)
        self._lines, self._receiver, self._steps = Lines(), Receiver(DriverConfig()), 0
        self.truth, self.headings, self.wheels, self.fixes, self.velocities = [], [], [], [], []

    def step(self, v: float, w: float) -> None:
        """10 ms towards this speed (m/s, rad/s)."""
        chair = self.chair
        for reading in self.vehicle.step(v, w):
            if isinstance(reading, HeadingReading):
                angles = reading.roll, reading.pitch, reading.yaw
                self.headings.append((reading.stamp, *angles, reading.yaw_variance, *reading.angular_velocity[2:]))
            elif isinstance(reading, EncoderReading):
                self._encoder(reading)
        for line in self._lines.feed(chair.gps.sent):
            for message in self._receiver.on_line(line, chair.time):
                if isinstance(message, Fix):
                    error = chair.gps.error
                    place = message.status, message.latitude, message.longitude, *message.variances[:2]
                    self.fixes.append((message.stamp, *place, error.jumped, error.east, error.north))
                elif isinstance(message, Velocity):
                    self.velocities.append(tuple(message))
        if self._steps % TRUTH_STEPS == 0:
            self.truth.append((chair.time, *chair.pose))
        self._steps += 1

    def _encoder(self, reading):
        wheels = self._base.on_encoder(reading)
        state = self._controller.on_wheels(*wheels) if wheels is not None else None
        if state is not None:
            self.wheels.append((state.stamp, state.linear, state.twist_covariance[0]))


def record(seed: int, gps: GpsConfig = GPS, length: float = LENGTH) -> StreetDrive:
    """Drive so many m with the chair of that number."""
    recorder = _Recorder(seed, gps)
    rounds = math.ceil(length / 460.0)
    way = Way([*ROUND * rounds, (HOME.x, HOME.y)])
    while way.reached < length and way.left > 0.1:
        x, y, yaw = recorder.chair.pose
        way.go_on(x, y)
        to_x, to_y = way.at(LOOKAHEAD)
        off = wrap_exact(math.atan2(to_y - y, to_x - x) - yaw)
        recorder.step(SPEED if abs(off) < STRAIGHT else 0.0, min(max(2.0 * off, -TURN), TURN))
    east, north, _ = recorder.chair.magnetism.earth
    told = recorder.truth, recorder.headings, recorder.wheels, recorder.fixes, recorder.velocities
    rows = (np.array(rows, dtype=float) for rows in told)
    return StreetDrive(*rows, np.array(math.atan2(east, north)))


def kept(seed: int, folder: Path) -> StreetDrive:
    """`record` with what it is asked by default, kept in a folder."""
    return StreetDrive(**kept_arrays(folder / f'street_{seed}.npz', lambda: record(seed)._asdict()))
