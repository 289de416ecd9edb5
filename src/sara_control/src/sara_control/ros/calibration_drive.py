"""calibration_drive: drives the manoeuvres that calibrate_odometry wants, by the odometry that is to be calibrated."""

import contextlib
import math

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from canserial.ros.node import stop
from sara_common.config import ConfigError
from sara_common.ros.node import start_node
from sara_control.calibration.manoeuvres import ManoeuvreConfig, Manoeuvres

RATE = 20.0  # Hz
SILENT = 0.5  # s without odometry after which it stands still


class CalibrationDrive:
    """`cmd_vel` out; `odom` in, and what ends the drive: `cancel` (somebody else drives), `give_up` (the safety gate).
    Parameters are those of ManoeuvreConfig.
    """

    def __init__(self) -> None:
        try:
            self.manoeuvres = Manoeuvres(ManoeuvreConfig.from_params(rospy.get_param('~', {})))
        except ConfigError as error:
            stop(f'wrong configuration of {rospy.get_name()}: {error}')
        self.odometry = None
        self.heading, self.given_up = None, ''
        self.cmd_vel = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber('odom', Odometry, self.on_odometry, queue_size=10, tcp_nodelay=True)
        rospy.Subscriber('cancel', GoalID, lambda _: self.give_up('somebody else drives'), queue_size=10)
        rospy.Subscriber('give_up', String, lambda message: self.give_up(message.data), queue_size=10)

    def give_up(self, why: str) -> None:
        """What was interrupted does not go on by itself."""
        self.given_up = self.given_up or why

    def on_odometry(self, message: Odometry) -> None:
        """Where it is, the heading unwrapped."""
        pose = message.pose.pose
        if not all(map(math.isfinite, (pose.position.x, pose.position.y, pose.orientation.z, pose.orientation.w))):
            return  # as if none had come
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        before = yaw if self.heading is None else self.heading
        self.heading = before + math.remainder(yaw - before, math.tau)
        self.odometry = message.header.stamp.to_sec(), pose.position.x, pose.position.y, self.heading

    def run(self) -> None:
        """Until the manoeuvres are over, or something ends them."""
        rate = rospy.Rate(RATE, reset=True)
        shown = None
        while not (rospy.is_shutdown() or self.manoeuvres.done or self.given_up):
            now, command = rospy.get_time(), Twist()
            if self.odometry is None or now - self.odometry[0] > SILENT:
                rospy.logwarn_throttle(5.0, f'waiting for odometry on {rospy.resolve_name("odom")}')
            else:
                command.linear.x, command.angular.z = self.manoeuvres.step(now, *self.odometry[1:])
                if self.manoeuvres.number != shown and not self.manoeuvres.done:
                    shown = self.manoeuvres.number
                    kind, amount = self.manoeuvres.moves[shown]
                    rospy.loginfo('move %d of %d: %s %.2f', shown + 1, len(self.manoeuvres.moves), kind, amount)
            self.cmd_vel.publish(command)
            rate.sleep()
        if self.manoeuvres.done:
            self.cmd_vel.publish(Twist())
            rospy.loginfo('the drive is over')
        elif self.given_up:
            self.cmd_vel.publish(Twist())
            stop(f'the drive was interrupted ({self.given_up}): start it anew')


def main() -> None:
    """Run the node."""
    start_node('calibration_drive')
    with contextlib.suppress(rospy.ROSInterruptException):  # stopped half-way: its commands end, which stops the robot
        CalibrationDrive().run()
