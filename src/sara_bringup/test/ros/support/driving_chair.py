"""What the tests share that stop a driving chair."""

import unittest

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

MOVING = 0.4  # m/s: fast enough to be worth stopping
AT_REST = 0.05  # m/s
SILENT_S, BRAKE = 0.25, 1.5  # s until the loss is noticed below, m/s2


class DrivingChair(unittest.TestCase):
    """A test of a running sara.launch, which knows where the chair truly is."""

    @classmethod
    def setUpClass(cls):
        cls.truths = []
        rospy.Subscriber('/ground_truth', Odometry, cls.truths.append, tcp_nodelay=True)
        rospy.wait_for_message('/imu/data', Imu)
        rospy.wait_for_message('/odometry/filtered', Odometry)
        rospy.wait_for_message('/ground_truth', Odometry)

    @property
    def truth(self):
        """The newest one."""
        return self.truths[-1]

    def speed(self):
        """True speed, m/s."""
        return _speed(self.truth)

    def now(self):
        """Time of the newest truth, s: the call of a service must not blur when the chair stopped."""
        return _time(self.truth)

    def stood_at(self, since):
        """Time of the first truth from then on in which the chair stands, s; None before it comes."""
        stands = (_time(truth) for truth in self.truths if _time(truth) >= since and _speed(truth) < AT_REST)
        return next(stands, None)

    def wait(self, condition, seconds, what):
        """Until condition() holds; the test fails after so many seconds."""
        end = rospy.get_time() + seconds
        while not condition():
            self.assertLess(rospy.get_time(), end, f'not within {seconds} s: {what}')
            rospy.sleep(0.01)


def _time(truth):
    return truth.header.stamp.to_sec()


def _speed(truth):
    return abs(truth.twist.twist.linear.x)
