"""What navsat_transform_node publishes, made of a world frame that has been laid on the earth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sara_localization.geometry.rigid import Transform, rotate
from sara_localization.gps import fixes
from sara_localization.gps.fixes import FixData
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.waiting import PlacedFix
from sara_localization.gps.world_frame import WorldFrame
from sara_localization.inputs.data import OdometryData, StampedTransform

UNMEASURED = 1e9
"""Variance (rad2) of what a fix does not tell: roll, pitch, yaw."""


class Frames(NamedTuple):
    """Those of the odometry: the world's and the robot's."""

    world: str
    base: str


def gps_odometry(world: WorldFrame, placed: PlacedFix, frames: Frames, zero_altitude: bool) -> OdometryData:
    """odometry/gps: where the robot's origin is by a fix. Raises NoPlace where the fix cannot be converted."""
    fix = placed.fix
    antenna = world.from_earth(fix.latitude, fix.longitude, fix.altitude)
    x, y, z = (a - b for a, b in zip(antenna, rotate(placed.pose.rotation, placed.arm)))
    covariance = np.diag([0.0] * 3 + [UNMEASURED] * 3)
    covariance[:3, :3] = world.covariance_from_earth(fix.covariance)
    position = (x, y, 0.0 if zero_altitude else z)
    return OdometryData(fix.stamp, *frames, position, pose_covariance=covariance)


def filtered_fix(world: WorldFrame, data: OdometryData, pose: Transform, base_frame: str, status: int) -> FixData:
    """gps/filtered: where on the earth the robot's pose by the odometry is; status: of the fix. Raises NoPlace."""
    place = world.to_earth(pose.translation)
    covariance = np.array(data.pose_covariance, dtype=float)[:3, :3]
    if not np.isfinite(covariance).all():
        return FixData(data.stamp, base_frame, status, *place, np.zeros((3, 3)), fixes.UNKNOWN)
    return FixData(data.stamp, base_frame, status, *place, world.covariance_to_earth(covariance))


def grid_transform(world: WorldFrame, config: NavSatConfig, world_frame: str, now: float) -> StampedTransform:
    """The transform between grid and world frame, whichever is asked for as the parent."""
    names, found = (config.cartesian_frame_id, world_frame), world.grid_from_world
    if not config.broadcast_cartesian_transform_as_parent_frame:
        names, found = names[::-1], found.inverse()
    if config.zero_altitude:
        found = found._replace(translation=(*found.translation[:2], 0.0))
    return StampedTransform(now, *names, found)
