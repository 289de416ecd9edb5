"""The robot's heading by a GPS receiver's velocity: the antenna's course, less the way it goes on the robot.

A receiver measures its velocity by the Doppler shift of the carriers, to some cm/s, however far off its place is. While
the robot drives, the course is a heading that no iron disturbs and that does not drift: 3.6 deg by each velocity, with
0.05 m/s at 0.8 m/s, and less by many. The odometry says which way the antenna goes on the robot, so that it holds in
reverse and in curves, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sara_localization.geometry.rigid import quaternion_from_rpy
from sara_localization.geometry.transforms import Transforms
from sara_localization.gps.answers import UNMEASURED
from sara_localization.gps.navsat import NavSat
from sara_localization.inputs.data import ImuData, OdometryData
from sara_localization.inputs.raw_measurement import Problem
from sara_localization.inputs.status import InputStatus

VELOCITY = 'gps/vel'
"""The topic of the receiver's velocities."""
SLOWEST = 4.0
"""Standard deviations of the velocity at which an antenna is fast enough for its course to tell a heading."""
AGREED = 4.0
"""Standard deviations by which the speed may differ from the odometry's; by more it is multipath, or wheels slip."""
SMOOTHED = 0.2
"""s: receivers smooth their velocity over about so long, and in a curve the course is an older one."""
OLDEST = 0.5
"""s from the newest odometry."""
NOT_MEASURED = np.diag((-1.0, 0.0, 0.0))


class VelocityData(NamedTuple):
    """stamp: s; frame_id: the antenna's; east, north: m/s over the ground."""

    stamp: float
    frame_id: str
    east: float
    north: float


class VelocityHeading:
    """Velocities in, the robot's yaw in the world frame of a NavSat out.

    navsat: has the odometry, the world frame, and an account of velocities from now on. transforms: where the antenna
    is on the robot; report: called with a sentence when something is wrong; topic: how VELOCITY is really called.
    """

    def __init__(
        self,
        navsat: NavSat,
        transforms: Transforms,
        report: Callable[[str], None] = lambda sentence: None,
        topic: str = VELOCITY,
    ):
        self._navsat, self._transforms, self._report = navsat, transforms, report
        self._sigma = navsat.config.velocity_sigma
        self._account = navsat.accounts['velocity'] = InputStatus('velocity', topic)

    def on_velocity(self, velocity: VelocityData) -> ImuData | None:
        """gps/heading by a velocity: an orientation alone; None where it tells none. Never raises for its data."""
        self._account.received += 1
        world, odometry = self._navsat.world, self._navsat.odometry
        if world is None or odometry is None:
            return None
        moving = self._antenna(velocity, odometry)
        if isinstance(moving, Problem):
            said = self._account.has_problem(*moving)
            if said:
                self._report(said)
            return None
        speed = math.hypot(*moving)
        if not speed >= SLOWEST * self._sigma:
            return None
        deviation = math.hypot(self._sigma / speed, SMOOTHED * odometry.angular[2])
        if not deviation < math.pi:
            return None
        self._account.used += 1
        self._account.last_stamp = velocity.stamp
        yaw = math.atan2(velocity.north, velocity.east) - world.anchor.heading - math.atan2(moving[1], moving[0])
        return ImuData(
            velocity.stamp,
            self._navsat.frames.base,
            quaternion_from_rpy(0.0, 0.0, math.remainder(yaw, 2.0 * math.pi)),
            np.diag((UNMEASURED, UNMEASURED, deviation * deviation)),
            angular_velocity_covariance=NOT_MEASURED,
            linear_acceleration_covariance=NOT_MEASURED,
        )

    def _antenna(self, velocity: VelocityData, odometry: OdometryData) -> tuple[float, float] | Problem:
        """The antenna's velocity along the robot's axes by the odometry, m/s."""
        if not (math.isfinite(velocity.stamp) and velocity.stamp > 0.0):
            return Problem('no_stamp', 'a velocity has no time stamp: dropped')
        if not abs(velocity.stamp - odometry.stamp) <= OLDEST:
            return Problem(
                'other_time',
                f'a velocity is {velocity.stamp - odometry.stamp:.2f} s newer than the odometry: dropped. Are the '
                'clocks of receiver and odometry the same?',
            )
        base, frame = self._navsat.frames.base, velocity.frame_id.lstrip('/')
        mounting = self._transforms.lookup(base, frame or base, velocity.stamp)
        if mounting is None:
            return Problem('no_antenna', f'no transform {base} -> {frame}: velocities are dropped')
        x, y, _ = mounting.translation
        turn = odometry.angular[2]
        moving = odometry.linear[0] - turn * y, odometry.linear[1] + turn * x
        told, speed = math.hypot(velocity.east, velocity.north), math.hypot(*moving)
        if not abs(told - speed) <= AGREED * self._sigma:
            return Problem(
                'other_speed',
                f'a velocity of {told:.2f} m/s is left out: the odometry has {speed:.2f} m/s, more than {AGREED:g} '
                'times velocity_sigma off. Multipath, or wheels that slip',
            )
        return moving
