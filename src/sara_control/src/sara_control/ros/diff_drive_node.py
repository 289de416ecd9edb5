"""diff_drive_controller for a chair on a CAN bus: `encoders`, `mode` and `~cmd_vel` in, odometry, TF, joints and `cantx` out."""

import math
import threading

import rospy
import tf2_ros
from canserial.bus import BusDescription
from canserial.msg import CAN, Encoder
from canserial.readings import EncoderReading
from canserial.ros.conversions import frame_to_msg
from canserial.ros.node import ERROR, OK, WARN, Diagnostics, stop
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_msgs.msg import UInt8

from sara_control.can_base import CanBase
from sara_control.config import ConfigError, ControllerConfig, not_available
from sara_control.controller import DiffDriveController

COMMAND_RATE = 50.0  # Hz


class DiffDriveNode:
    """The shell around DiffDriveController and CanBase."""

    def __init__(self):
        params = rospy.get_param('~', {})
        try:
            config = ControllerConfig.from_params(params)
        except ConfigError as error:
            stop(f'wrong configuration of {rospy.get_name()}: {error}')
        for sentence in not_available(params):
            rospy.logwarn(sentence)
        self.config = config
        self.base = CanBase.from_config(BusDescription.default(), config)
        self.controller = DiffDriveController(config)
        self.lock = threading.Lock()
        self.stopping = threading.Event()
        self.published_at = -math.inf
        self.wheels = None
        self.diagnostics = Diagnostics('wheels', 'CAN bus')
        self.odom = rospy.Publisher('~odom', Odometry, queue_size=10, tcp_nodelay=True)
        self.joint_states = rospy.Publisher('joint_states', JointState, queue_size=10, tcp_nodelay=True)
        self.joint_commands = rospy.Publisher('joint_commands', JointState, queue_size=10, tcp_nodelay=True)
        self.cantx = rospy.Publisher('cantx', CAN, queue_size=10, tcp_nodelay=True)
        self.broadcaster = tf2_ros.TransformBroadcaster()
        rospy.Subscriber('mode', UInt8, self.on_mode, queue_size=10, tcp_nodelay=True)
        rospy.Subscriber('encoders', Encoder, self.on_encoder, queue_size=20, tcp_nodelay=True)
        rospy.Subscriber('~cmd_vel', Twist, self.on_command, queue_size=1, tcp_nodelay=True)
        # reset: a simulation that is started anew sets the clock back, which would kill the timer.
        self.timer = rospy.Timer(rospy.Duration(1.0 / COMMAND_RATE), self.on_timer, reset=True)
        rospy.on_shutdown(self.on_shutdown)

    def on_mode(self, message):
        """Who drives."""
        with self.lock:
            before, self.base.mode = self.base.mode, message.data
            may_drive = self.base.may_drive
        if before != message.data:
            rospy.loginfo('modoPC is %d: %s', message.data, 'the PC drives' if may_drive else 'the joystick drives')

    def on_command(self, message):
        """A new command for the chair."""
        with self.lock:
            self.controller.on_command(message.linear.x, message.angular.z, rospy.get_time())

    def on_encoder(self, message):
        """One wheel's counters; a pair moves the odometry on."""
        reading = EncoderReading(message.header.stamp.to_sec(), message.wheel, message.steps, message.time_100us)
        with self.lock:
            wheels = self.base.on_encoder(reading)
            state = None if wheels is None else self.controller.on_wheels(*wheels)
        if state is None:
            return
        self.publish_joints(wheels, message.header.stamp)
        since = state.stamp - self.published_at
        # A little early is on time: stamps jitter. A stamp far back is a clock that was started anew.
        if 0.0 <= since < 0.9 / self.config.publish_rate:
            return
        self.published_at = state.stamp
        self.publish_odometry(state)

    def publish_joints(self, wheels, stamp):
        """Measured wheel positions and speeds."""
        message = JointState(name=[self.config.left_wheel, self.config.right_wheel], position=[wheels.left, wheels.right])
        message.header.stamp = stamp
        if self.wheels is not None and wheels.interval > 0.0:
            message.velocity = [(wheels.left - self.wheels.left) / wheels.interval,
                                (wheels.right - self.wheels.right) / wheels.interval]
        else:
            message.velocity = [0.0, 0.0]
        self.wheels = wheels
        self.joint_states.publish(message)

    def publish_odometry(self, state):
        """Odometry and its transform."""
        config, message = self.config, Odometry()
        message.header.stamp = rospy.Time.from_sec(state.stamp)
        message.header.frame_id, message.child_frame_id = config.odom_frame_id, config.base_frame_id
        pose, twist = message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y = state.x, state.y
        pose.orientation.z, pose.orientation.w = math.sin(0.5 * state.heading), math.cos(0.5 * state.heading)
        twist.linear.x, twist.angular.z = state.linear, state.angular
        message.pose.covariance = _diagonal(config.pose_covariance_diagonal)
        message.twist.covariance = _diagonal(config.twist_covariance_diagonal)
        if config.enable_odom_tf:
            transform = TransformStamped(header=message.header, child_frame_id=config.base_frame_id)
            transform.transform.translation.x, transform.transform.translation.y = state.x, state.y
            transform.transform.rotation = pose.orientation
            self.broadcaster.sendTransform(transform)
        self.odom.publish(message)

    def on_timer(self, _event):
        """The wheel command, 50 times a second."""
        with self.lock:
            if self.stopping.is_set():  # asked and published under one lock: nothing follows the last stop
                return
            left, right = self.controller.update(rospy.get_time())
            self.cantx.publish(frame_to_msg(self.base.command(left, right)))
        message = JointState(name=[self.config.left_wheel, self.config.right_wheel], velocity=[left, right])
        message.header.stamp = rospy.Time.now()
        self.joint_commands.publish(message)

    def on_shutdown(self):
        """The last word to the wheels is stop; the process may end only when it is on its way."""
        with self.lock:
            self.stopping.set()
            self.cantx.publish(frame_to_msg(self.base.stop()))
        rospy.rostime.wallsleep(0.1)

    def run(self):
        """Diagnostics once a second of wall time until ROS shuts down."""
        warned = set()
        while not self.stopping.wait(1.0):
            with self.lock:
                counters = {**self.base.counters, **self.controller.counters}
                known, may_drive, mode = self.controller.wheels_known(rospy.get_time()), self.base.may_drive, self.base.mode
            for kind in sorted(counters.keys() - warned):
                rospy.logwarn('dropped: %s; counted in /diagnostics', kind.replace('_', ' '))
                warned.add(kind)
            if not known:
                level, text = ERROR, f'waiting for {rospy.resolve_name("encoders")}: the wheels are stopped'
                rospy.logwarn_throttle(10.0, text)
            elif not may_drive:
                level, text = WARN, f'the joystick drives (modoPC is {"unknown" if mode is None else mode})'
            else:
                level, text = OK, 'the PC drives'
            self.diagnostics.publish(level, text, counters)


def _diagonal(values):
    """Six values as the diagonal of a row-major 6 x 6 matrix."""
    matrix = [0.0] * 36
    matrix[::7] = values
    return matrix


def main():
    """Run the node."""
    rospy.init_node('diff_drive_controller')
    DiffDriveNode().run()
    rospy.spin()  # until rospy has ended its own shutdown: leaving earlier would cut off the last stop
