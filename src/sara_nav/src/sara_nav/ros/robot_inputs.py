"""What move_base hears of the robot: its pose in both frames from TF, its velocity from odometry, poses from
clients.
"""

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry

from sara_common.planar import Pose2D
from sara_nav.goals.goal_input import global_pose
from sara_nav.move_base.robot_state import FASTEST
from sara_nav.move_base.settings import Settings
from sara_nav.ros import conversions as conv
from sara_nav.ros.common import TransformListener

ODOM_TIMEOUT = 0.5
"""Seconds after which a measured velocity is no longer believed."""


class RobotInputs:
    """Looks the robot up. settings: Settings; tf: TransformListener. ``problem``: why there is no pose, or ''."""

    def __init__(self, settings: Settings, tf: TransformListener):
        self._global, self._local, self._base = settings.global_frame, settings.local_frame, settings.robot_base_frame
        self._tf = tf
        self._odom = None
        self.problem = ''
        self.counts = {'bad_odometry': 0, 'bad_lost': 0}
        topic = getattr(settings.local_planner.config, 'odom_topic', 'odom')
        self._subscriber = rospy.Subscriber(topic, Odometry, self._on_odom, queue_size=1, tcp_nodelay=True)

    @property
    def odom_topic(self) -> str:
        """Where odometry is listened to."""
        return self._subscriber.resolved_name

    @property
    def has_odometry(self) -> bool:
        """True once odometry came."""
        return self._odom is not None

    def _on_odom(self, msg):
        twist = msg.twist.twist
        velocity = twist.linear.x, twist.angular.z
        if not all(abs(v) <= FASTEST for v in velocity):  # true for NaN, too
            self.counts['bad_odometry'] += 1
            rospy.logwarn_once('odometry with velocity %s is dropped: not a sound speed', velocity)
            return
        self._odom = velocity, msg.header.stamp.to_sec()

    def velocity(self, t: float) -> tuple[float, float] | None:
        """Return the measured (v m/s, w rad/s), or None when it is too old at t (s)."""
        odom = self._odom
        if odom is None or not -ODOM_TIMEOUT < t - odom[1] < ODOM_TIMEOUT:
            return None
        return odom[0]

    def forget(self) -> None:
        """Time went back: what was heard before means nothing."""
        self._tf.buffer.clear()
        self._odom = None

    def poses(self) -> tuple[Pose2D | None, float | None, Pose2D | None]:
        """Return (pose, stamp s or None, local pose): Pose2D in the global frame, and in the local costmap's where that
        is another; all None when one of them is not known.
        """
        try:
            pose, stamp = self._newest(self._global)
            local = self._newest(self._local)[0] if self._local != self._global else None
        except (ValueError, tf2_ros.TransformException) as error:
            self.problem = str(error)
            return None, None, None
        self.problem = ''
        return pose, stamp, local

    def _newest(self, frame):
        """Return (Pose2D, stamp s or None) of the robot in a frame, put together of the newest odometry and of its
        newest place in that frame.

        tf's own answer is for the newest time of which it knows both. Who corrects odometry dates map -> odom ahead, so
        that others need not wait for the next one (robot_localization's transform_time_offset, amcl's
        transform_tolerance), and tf takes one that is older by so much.
        """
        between = self._tf.child_towards(frame, self._base)
        ways = [self._tf.latest(*way) for way in ((frame, between), (between, self._base)) if way[0] != way[1]]
        pose = None
        for way in ways:
            step = conv.pose_from_transform(way.transform)
            pose = step if pose is None else pose.compose(step)
        # what is fixed has none
        stamps = [way.header.stamp.to_sec() for way in ways if not way.header.stamp.is_zero()]
        return pose, min(stamps, default=None)

    def global_pose(self, stamped: PoseStamped) -> Pose2D:
        """Return the Pose2D of a geometry_msgs/PoseStamped in the global frame; raises GoalError."""
        p, q = stamped.pose.position, stamped.pose.orientation
        return global_pose(stamped.header.frame_id, (p.x, p.y, p.z), (q.x, q.y, q.z, q.w), self._global, self._find)

    def _find(self, frame):
        try:
            return conv.pose_from_transform(self._tf.latest(self._global, frame).transform)
        except tf2_ros.TransformException as error:
            raise LookupError(str(error)) from None
