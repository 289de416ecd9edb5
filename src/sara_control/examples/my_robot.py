"""A robot's wheels for `diff_drive_controller`, which takes them by the parameter `base: my_robot:MyRobot` when this
file is on the Python path. Replace Motor by your driver.
"""

import math

from sara_control.wheels.base import WheelBase, WheelPositions


class Motor:
    """Stands for a motor's driver: turns exactly as it is told."""

    def __init__(self):
        self.ticks, self.speed, self.time = 0.0, 0.0, None

    def run(self, ticks_per_second, t):
        self.count(t)
        self.speed = ticks_per_second

    def count(self, t):
        self.ticks += 0.0 if self.time is None else self.speed * (t - self.time)
        self.time = t
        return int(self.ticks)


class MyRobot(WheelBase):
    """Two motors with encoders."""

    joints = ('left_wheel', 'right_wheel')  # names it knows; None takes any

    def __init__(self, config, params):  # the controller's configuration and all its private parameters
        super().__init__(config, params)
        self.radians = math.tau / params.get('ticks_per_turn', 4096)
        self.left, self.right = Motor(), Motor()

    def read(self, t):
        """Positions not read before: a list, here always one."""
        return [WheelPositions(self.left.count(t) * self.radians, self.right.count(t) * self.radians, t)]

    def write(self, left, right, t):
        """Wheel speeds, rad/s."""
        self.left.run(left / self.radians, t)
        self.right.run(right / self.radians, t)
