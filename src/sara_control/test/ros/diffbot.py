"""A robot for the tests: wheels that obey at once, three on each side if so asked, encoders that can break."""

import math

import rospy
from std_srvs.srv import SetBool, SetBoolResponse

from sara_control.wheels.base import WheelBase, WheelPositions


class Diffbot(WheelBase):
    """Counts from `~first_position` (rad), `~broken` makes its positions NaN, the first of them None."""

    joints = tuple(f'{place}{side}_wheel' for side in ('left', 'right') for place in ('', 'front_', 'rear_'))

    def __init__(self, config, params):
        super().__init__(config, params)
        self._angles = [params.get('first_position', 0.0)] * 2
        self._speeds = (0.0, 0.0)
        self._at = None
        self._broken, self._forgets = False, True
        rospy.Service('~broken', SetBool, self._break)

    def _break(self, request):
        self._broken = request.data
        return SetBoolResponse(success=True)

    def read(self, t):
        """The wheels went on turning since the last time."""
        dt = 0.0 if self._at is None else max(0.0, t - self._at)
        self._at = t
        self._angles = [angle + speed * dt for angle, speed in zip(self._angles, self._speeds)]
        count = len(self.config.left_joints)
        if self._broken and self._forgets:
            self._forgets = False
            return None  # as code does that forgets to return something
        left, right = (math.nan, math.nan) if self._broken else self._angles
        return [WheelPositions((left,) * count, (right,) * count, t)]

    def write(self, left, right, t):
        """They turn so at once."""
        self._speeds = (left, right)
