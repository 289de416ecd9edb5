"""Which way the world frame points on the earth: from an IMU's heading, or from the odometry's own."""

from __future__ import annotations

import datetime
import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from sara_localization.geometry.rigid import normalised, yaw_from_quaternion
from sara_localization.geometry.transforms import Transforms
from sara_localization.gps import declination
from sara_localization.gps.fixes import FixData
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.track import Track
from sara_localization.inputs.data import ImuData
from sara_localization.inputs.measurement import measures
from sara_localization.inputs.poses import without_mounting
from sara_localization.inputs.raw_measurement import Problem

REMEMBERED = 50
"""Headings of the IMU that are kept until odometry of their time has come."""


class Correction(NamedTuple):
    """What is added to a measured heading (rad), and how that came about."""

    angle: float
    sentence: str


def robot_heading(data: ImuData, base_frame: str, transforms: Transforms) -> float | Problem:
    """The robot's yaw (rad) by an IMU's message, before any correction; or why there is none."""
    if not (math.isfinite(data.stamp) and data.stamp > 0.0):
        return Problem('no_stamp', 'a message has no time stamp: dropped')
    if not measures(data.orientation_covariance):
        return Problem(
            'no_orientation',
            'its messages say (orientation_covariance -1) that it does not measure orientation: no heading comes from '
            'it. Give another imu/data, use_odometry_yaw or a datum',
        )
    try:
        rotation = normalised(data.orientation)
    except ValueError as error:
        return Problem('bad_orientation', f'a message is dropped: {error}')
    frame = data.frame_id.lstrip('/') or base_frame
    mounting = transforms.lookup(base_frame, frame, data.stamp)
    if mounting is None:
        return Problem('no_transform', f'there is no transform {base_frame} -> {frame}: its heading cannot be used')
    return yaw_from_quaternion(without_mounting(rotation, mounting))


class ImuHeading:
    """The newest headings of the robot that an IMU told: rad, 0 east, before any correction."""

    def __init__(self, transforms: Transforms):
        self._transforms = transforms
        self._headings: deque[tuple[float, float]] = deque(maxlen=REMEMBERED)

    def clear(self) -> None:
        self._headings.clear()

    def add(self, data: ImuData, base_frame: str) -> Problem | None:
        """Take a message; returns why it cannot be used."""
        yaw = robot_heading(data, base_frame, self._transforms)
        if isinstance(yaw, Problem):
            return yaw
        self._headings.append((data.stamp, yaw))
        return None

    def of_world(self, track: Track) -> float | None:
        """The heading of the world's x axis: by how much the IMU's heading exceeds the odometry's at the same time.
        None where there is no such time.
        """
        for stamp, yaw in sorted(self._headings, key=lambda told: (not track.covers(told[0]), -told[0])):
            pose = track.at(stamp)
            if pose is not None:
                return math.remainder(yaw - pose.yaw, 2.0 * math.pi)
        return None


def correction(config: NavSatConfig, fix: FixData, today: Callable[[], datetime.date], measured: bool) -> Correction:
    """What makes a true heading of one that an instrument measured, or (not `measured`) that the user gave.

    The declination is the parameter's, added as in the C++ node: positive where the needle points west of north. If
    there is none, a measured heading is corrected by the model's for the fix's place and date; dates that the model
    does not cover are taken for simulated, and today's is used.
    """
    given = config.magnetic_declination_radians
    if given is not None:
        angle, words = given, f'magnetic_declination_radians {given:.5f}'
    elif not measured:
        angle, words = 0.0, 'no declination'
    else:
        angle, words = _by_model(fix, today)
    return Correction(angle + config.yaw_offset, f'{words}, yaw_offset {config.yaw_offset:.5f}')


def _by_model(fix, today):
    date = _date(fix.stamp)
    if not declination.FIRST <= date <= declination.LAST:
        date = today()
    try:
        east = declination.declination(fix.latitude, fix.longitude, fix.altitude, date)
    except ValueError as error:
        return 0.0, f'magnetic declination not known, 0 is taken ({error})'
    degrees = math.degrees(east)
    return -east, (
        f'magnetic declination {abs(degrees):.2f} deg {"east" if east >= 0.0 else "west"} by the magnetic model of '
        f'{date.isoformat()}, as if magnetic_declination_radians were {-east:.5f}'
    )


def _date(stamp):
    try:
        return datetime.datetime.fromtimestamp(stamp, datetime.UTC).date()
    except (ValueError, OverflowError, OSError):
        return datetime.date.min
