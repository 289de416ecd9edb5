"""The filter of the map (config/outdoors.yaml) and navsat_transform_node over a recorded drive along the street.

Both are the nodes' own objects, each feeding the other; the filter runs at half its rate, for half the time.
"""

from __future__ import annotations

import datetime
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from sara_common.planar import wrap_exact
from sara_common.platforms import chosen, parameters
from sara_lab.studies.street_drive import HOME, StreetDrive
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.filters.state import YAW, X, Y
from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.gps.fixes import FixData
from sara_localization.gps.navsat import NavSat
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.velocity_heading import VelocityData, VelocityHeading
from sara_localization.inputs.data import ImuData, OdometryData
from sara_sim.world import luck

CONFIG = 'outdoors.yaml'
MAP, NAVSAT = 'ekf_se_map', 'navsat_transform_node'
PLANE = [X, Y, YAW]
FREQUENCY, KEPT, REPORTED = 25.0, 5, 25
"""Hz of the filter's cycles; each how many of them is judged; and after how many of them /diagnostics comes."""
PLACED_SIGMA, FACED_SIGMA = 0.3, math.radians(2.0)
"""m, along x and y, and rad by which somebody misjudges where the chair starts; so the parameters say."""


class Estimate(NamedTuple):
    """Of one tick: t (s); error (3,) of x, y (m), yaw (rad), estimate less truth; covariance (3, 3)."""

    time: float
    error: np.ndarray
    covariance: np.ndarray


class Replay(NamedTuple):
    """`estimates`, five a second; `fates`: (n, 2) of each fix that came to the filter, its t (s) and whether it was
    used; `said`: (t, sentence) of the filter's log; `reports`: (t, line) of what /diagnostics says of odom1, the
    receiver's places, one a second.
    """

    estimates: list[Estimate]
    fates: np.ndarray
    said: list[tuple[float, str]]
    reports: list[tuple[float, str]]


class StreetFilter:
    """Map filter and navsat_transform_node. changed: parameters of the filter that differ from the file's; start: the
    pose (x, y, yaw; m, rad) that it is told, at the time `began` (s).
    """

    def __init__(self, start: tuple[float, float, float], changed: Mapping[str, Any] | None = None):
        tree = parameters('sara_bringup', CONFIG)
        x, y, yaw = start
        initial = [x, y, 0.0, 0.0, 0.0, yaw, *[0.0] * 9]
        self.now, self.said, self.fates, self._given = 0.0, [], [], []
        self.transforms, mount = TransformBuffer(), chosen().gps
        antenna = Transform.from_xyz_rpy(mount.x, mount.y, 0.0, 0.0, 0.0, mount.yaw)
        self.transforms.set_transform('base_link', 'gps', antenna)
        config = FilterConfig.from_params(
            {**tree[MAP], 'frequency': FREQUENCY, 'initial_state': initial, **(changed or {})}, 'ekf'
        )
        self.engine = FilterEngine(config, self.transforms, self._hear)
        self.navsat = NavSat(NavSatConfig.from_params(tree[NAVSAT]), self.transforms, self._hear, today=_no_date)
        self.heading = VelocityHeading(self.navsat, self.transforms, self._hear)
        self.period = 1.0 / config.frequency
        self._navsat_every = 1.0 / self.navsat.config.frequency
        self._navsat_at = 0.0

    def _hear(self, sentence):
        self.said.append((self.now, sentence))

    def on_heading(self, row: np.ndarray) -> None:
        """A row of StreetDrive.headings."""
        stamp, roll, pitch, yaw, variance, rate = row.tolist()
        angles, rates = np.diag((0.01, 0.01, variance)), np.diag((2.6e-6, 2.8e-6, 1.6e-6))
        still = (0.0, 0.0, 0.0), np.eye(3)
        turned = quaternion_from_rpy(roll, pitch, yaw)
        self.engine.add_imu('imu0', ImuData(stamp, 'base_link', turned, angles, (0.0, 0.0, rate), rates, *still))

    def on_wheels(self, row: np.ndarray) -> None:
        """A row of StreetDrive.wheels."""
        stamp, speed, variance = row.tolist()
        unturned, unknown = (0.0, 0.0, 0.0, 1.0), np.eye(6)
        twist = (speed, 0.0, 0.0), (0.0, 0.0, 0.0), np.diag((variance, variance, 1e6, 1e6, 1e6, 1e6))
        self.engine.add_odometry(
            'odom0', OdometryData(stamp, 'odom', 'base_link', (0.0, 0.0, 0.0), unturned, unknown, *twist)
        )

    def on_fix(self, row: np.ndarray) -> None:
        """A row of StreetDrive.fixes."""
        stamp, status, latitude, longitude, east, north = row[:6].tolist()
        covariance = np.diag((east, north, 4.0 * east))
        fix = FixData(stamp, 'gps', int(status), latitude, longitude, math.nan, covariance, 2 if status >= 0 else 0)
        self.navsat.on_fix(fix, stamp)

    def on_velocity(self, row: np.ndarray) -> None:
        """A row of StreetDrive.velocities."""
        stamp, east, north = row.tolist()
        heading = self.heading.on_velocity(VelocityData(stamp, 'gps', east, north))
        if heading is not None:
            self.engine.add_imu('imu1', heading)

    def tick(self, now: float) -> Any:
        """A cycle of both at a time (s): FilterOutput or None."""
        self.now = now
        gps = self.engine.inputs['odom1']
        used, rejected = gps.used, gps.rejected
        output = self.engine.tick(now)
        for fate in [1.0] * (gps.used - used) + [0.0] * (gps.rejected - rejected):  # one at most, of each tick
            self.fates.append((self._given.pop(0), fate))
        if output is not None and output.published:
            self.navsat.on_odometry(output.odometry)
        if now >= self._navsat_at:
            self._navsat_at = now + self._navsat_every - 0.5 * self.period
            for data in self.navsat.tick(now).gps:
                self.engine.add_odometry('odom1', data)
                self._given.append(data.stamp)
        return output


def _no_date():
    return datetime.date.min


def told_start(seed: int) -> tuple[float, float, float]:
    """Where somebody says that the chair starts."""
    x, y, yaw = luck.stream(seed, 'placed').normal(0.0, (PLACED_SIGMA, PLACED_SIGMA, FACED_SIGMA))
    return HOME.x + float(x), HOME.y + float(y), HOME.yaw + float(yaw)


def replay(drive: StreetDrive, seed: int, changed: Mapping[str, Any] | None = None) -> Replay:
    """The filter over a drive; where it is told that the chair starts is drawn from the seed."""
    x, y, yaw = told_start(seed)
    x0, y0, yaw0 = drive.pose(drive.truth[0, 0])
    street = StreetFilter((x0 + x - HOME.x, y0 + y - HOME.y, yaw0 + yaw - HOME.yaw), changed)
    events = [(row[0], give, row) for give, rows in _inputs(street, drive) for row in rows]
    events.sort(key=lambda event: event[0])
    estimates, reports, at, end = [], [], 0, drive.truth[-1, 0]
    ticks = math.floor((end - drive.truth[0, 0]) / street.period)
    for k in range(1, ticks):
        now = drive.truth[0, 0] + k * street.period
        while at < len(events) and events[at][0] <= now:
            events[at][1](events[at][2])
            at += 1
        output = street.tick(now)
        if k % REPORTED == 0:
            reports.append((now, street.engine.inputs['odom1'].line(now)))
        if output is not None and k % KEPT == 0:
            true = drive.pose(now)
            error = output.state[PLANE] - true
            error[2] = wrap_exact(error[2])
            estimates.append(Estimate(now, error, output.covariance[np.ix_(PLANE, PLANE)].copy()))
    return Replay(estimates, np.array(street.fates), street.said, reports)


def _inputs(street, drive):
    return (
        (street.on_heading, drive.headings),
        (street.on_wheels, drive.wheels),
        (street.on_fix, drive.fixes),
        (street.on_velocity, drive.velocities),
    )
