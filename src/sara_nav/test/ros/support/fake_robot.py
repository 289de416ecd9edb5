"""A robot and a clock made up for rostests: it obeys cmd_vel, publishes TF and odom, and /clock at twice real time."""

import contextlib
import math
import threading
import time

import rospy
import tf2_ros
from actionlib import CommState
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock


class FakeRobot:
    """Integrates cmd_vel at 50 Hz; map -> odom is a fixed shift, odom -> base_link the drive; base_link -> SDI_frame is
    where a sensor looks ahead from the front.
    """

    SHIFT = 0.5
    HELD = 0.15
    """Seconds without a command, while driving, after which the clock waits for move_base, so that a busy machine is no
    fault.
    """

    def __init__(self):
        self.x, self.y, self.yaw = 1.0, 1.0, 0.0
        self.v = self.w = 0.0
        self.command = (0.0, 0.0)
        self.last_command = None
        self.turned = 0.0
        self.clock_back = 0  # s by which the clock is to be set back
        self.silent = self.stopped = False  # stopped: it does not obey
        self.waits = False  # the clock
        self.lock = threading.Lock()
        self.tf = tf2_ros.TransformBroadcaster()
        self.odom = rospy.Publisher('odom', Odometry, queue_size=1, tcp_nodelay=True)
        self.subscriber = rospy.Subscriber('cmd_vel', Twist, self.on_command, queue_size=1, tcp_nodelay=True)
        self.clock = rospy.Publisher('/clock', Clock, queue_size=1, tcp_nodelay=True)
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()
        while rospy.Time.now().is_zero() and not rospy.is_shutdown():
            time.sleep(0.01)

    def on_command(self, msg):
        with self.lock:
            self.command = msg.linear.x, msg.angular.z
            self.last_command = rospy.Time.now()

    def run(self):
        """Let 10 ms pass every 5 ms, the robot moving every 20."""
        due, ticks = time.monotonic(), 10000
        while not rospy.is_shutdown():
            self.wait_for_move_base(ticks / 100.0)
            while self.waits and not rospy.is_shutdown():
                time.sleep(0.002)
            if self.clock_back:
                ticks, self.clock_back = ticks - 100 * self.clock_back, 0
            now = rospy.Time(ticks // 100, ticks % 100 * 10**7)
            try:
                self.clock.publish(now)
                if ticks % 2 == 0:
                    self.tick(now)
            except rospy.ROSException:  # the topics close when ROS shuts down
                return
            ticks += 1
            due = max(due + 0.005, time.monotonic())  # what was missed is not made up for in a burst
            time.sleep(max(0.0, due - time.monotonic()))

    def wait_for_move_base(self, now):
        """Wait for a command that is due, but for a second at most."""
        end = time.monotonic() + 1.0
        while time.monotonic() < end and not rospy.is_shutdown():
            with self.lock:
                idle = self.command == (0.0, 0.0) or self.last_command is None
                if idle or now - self.last_command.to_sec() < self.HELD:
                    return
            time.sleep(0.002)

    def tick(self, now):
        with self.lock:
            command = (0.0, 0.0) if self.stopped else self.command
            self.v += (command[0] - self.v) * 0.18
            self.w += (command[1] - self.w) * 0.18
            self.x += self.v * 0.02 * math.cos(self.yaw)
            self.y += self.v * 0.02 * math.sin(self.yaw)
            self.yaw += self.w * 0.02 / 1.27
            self.turned += self.w * 0.02 / 1.27
            if self.silent:
                return
            self.tf.sendTransform(
                [
                    self.transform('map', 'odom', self.SHIFT, 0.0, 0.0, now),
                    self.transform('odom', 'base_link', self.x - self.SHIFT, self.y, self.yaw, now),
                    self.transform('base_link', 'SDI_frame', 0.54, 0.0, 0.0, now),
                ]
            )
            odom = Odometry(child_frame_id='base_link')
            odom.header.stamp, odom.header.frame_id = now, 'odom'
            odom.twist.twist.linear.x, odom.twist.twist.angular.z = self.v, self.w / 1.27
            self.odom.publish(odom)

    @staticmethod
    def transform(parent, child, x, y, yaw, stamp):
        msg = TransformStamped(child_frame_id=child)
        msg.header.frame_id, msg.header.stamp = parent, stamp
        msg.transform.translation.x, msg.transform.translation.y = x, y
        msg.transform.rotation.z, msg.transform.rotation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        return msg

    def put(self, x, y, yaw):
        with self.lock:
            self.x, self.y, self.yaw, self.v, self.w = x, y, yaw, 0.0, 0.0
            self.silent = self.stopped = False
            self.turned = 0.0

    @contextlib.contextmanager
    def clock_waits(self):
        """No time passes within: how long a busy machine takes for what is done here does not matter."""
        self.waits = True
        try:
            yield
        finally:
            self.waits = False

    def cancel(self, client):
        """Cancel the goal of a SimpleActionClient. The clock waits until move_base has heard of it."""
        end = time.monotonic() + 20.0
        with self.clock_waits():
            client.cancel_goal()
            while client.gh.get_comm_state() == CommState.WAITING_FOR_CANCEL_ACK and time.monotonic() < end:
                time.sleep(0.002)

    def stands_within(self, seconds):
        """Wait until it is told to stand; return whether that was within so many seconds of its clock."""
        begin = rospy.Time.now()
        while self.command != (0.0, 0.0) and (rospy.Time.now() - begin).to_sec() < 5.0:
            time.sleep(0.002)
        return self.command == (0.0, 0.0) and (rospy.Time.now() - begin).to_sec() < seconds


def is_connected(subscriber):
    """Whether its publisher has answered a Subscriber; get_num_connections() counts one that is not connected yet."""
    return any(connection.callerid_pub != 'unknown' for connection in subscriber.impl.connections)


def stamped(x, y, yaw, frame='map'):
    msg = PoseStamped()
    msg.header.frame_id, msg.header.stamp = frame, rospy.Time.now()
    msg.pose.position.x, msg.pose.position.y = x, y
    msg.pose.orientation.z, msg.pose.orientation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
    return msg
