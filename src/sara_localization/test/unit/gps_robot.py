"""A robot with a GPS receiver, an IMU and odometry, all exact, on a flat piece of the earth."""

import datetime
import math

import numpy as np

from sara_localization.geometry.rigid import Transform, quaternion_from_rpy
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.gps.fixes import FixData
from sara_localization.gps.navsat import NavSat
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.utm import Utm, Zone
from sara_localization.inputs.data import ImuData, OdometryData

ORIGIN = (48.1, 11.6, 500.0)
START = 1.7e9
"""s: in November 2023."""
VARIANCE = np.diag([1.0, 1.0, 4.0])
TODAY = datetime.date(2026, 11, 25)
TRUE = {'magnetic_declination_radians': 0.0}
"""Parameters of a robot whose IMU knows true east."""


class GpsRobot:
    """The node, and what is said to it. x, y, yaw: the robot on the grid, from ORIGIN, 0 along the grid's x.

    world: the same place and heading in the odometry's frame at the start; arm: the antenna on the robot, m.
    """

    def __init__(self, arm=(0.0, 0.0, 0.0), world=(0.0, 0.0, 0.0), transforms=True, restarts=False, **params):
        self.said, self.informed = [], []
        self.buffer = TransformBuffer()
        if transforms:
            self.buffer.set_transform('base_link', 'gps', Transform(arm))
        config = NavSatConfig.from_params({'frequency': 10.0, **params})
        self.node = NavSat(
            config, self.buffer, self.said.append, self.informed.append, lambda: TODAY, restarts=restarts
        )
        self.arm, self.world = arm, Transform.from_xyz_rpy(world[0], world[1], yaw=world[2])
        self.now, self.x, self.y, self.yaw = START, 0.0, 0.0, 0.0
        self.grid = Utm(Zone.of(*ORIGIN[:2]))
        self.east, self.north = self.grid.forward(*ORIGIN[:2])
        self.convergence = self.grid.convergence(*ORIGIN[:2])
        self.filtered, self.transforms = [], []

    @property
    def pose(self):
        """The robot in the odometry's frame."""
        return self.world @ Transform.from_xyz_rpy(self.x, self.y, yaw=self.yaw)

    def fix(self, stamp=None, **changes):
        """A fix of where the antenna is now."""
        turned = Transform.from_xyz_rpy(self.x, self.y, yaw=self.yaw).apply(self.arm)
        latitude, longitude = self.grid.inverse(self.east + turned[0], self.north + turned[1])
        data = FixData(
            self.now if stamp is None else stamp, '/gps', 0, latitude, longitude, ORIGIN[2] + turned[2], VARIANCE
        )
        return data._replace(**changes)

    def odometry(self, stamp=None, linear=(0.0, 0.0, 0.0), turn=0.0, **changes):
        pose = self.pose
        data = OdometryData(
            self.now if stamp is None else stamp,
            'odom',
            'base_link',
            pose.translation,
            pose.rotation,
            linear=linear,
            angular=(0, 0, turn),
        )
        return data._replace(**changes)

    def imu(self, stamp=None, offset=0.0, **changes):
        """The heading from true east, less an offset (rad) that the node must add."""
        yaw = self.yaw - self.convergence - offset
        return ImuData(self.now if stamp is None else stamp, 'base_link', quaternion_from_rpy(0.0, 0.0, yaw))._replace(
            **changes
        )

    def tell(self, fix=True, imu=True):
        """All that is known now."""
        self.node.on_odometry(self.odometry())
        if imu:
            self.node.on_imu(self.imu())
        if fix:
            self.node.on_fix(self.fix(), self.now)

    def tick(self, seconds=0.1):
        """A cycle after a time; returns odometry/gps."""
        self.now += seconds
        output = self.node.tick(self.now)
        self.filtered += [output.filtered] if output.filtered else []
        self.transforms += [output.transform] if output.transform else []
        return output.gps

    def laid(self):
        """The robot, once the world frame is known."""
        self.tell()
        assert self.tick(), (self.said, self.node.waiting_for())
        return self

    def off(self, answer):
        """m from odometry/gps to the robot's true place."""
        return math.dist(answer.position[:2], self.pose.translation[:2])
