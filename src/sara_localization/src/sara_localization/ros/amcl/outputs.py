"""What amcl publishes: map -> odom, amcl_pose, particlecloud; and the pose it leaves on the parameter server."""

from __future__ import annotations

from struct import Struct

import numpy as np
import rospy
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage

from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.stamps import later
from sara_localization.inputs.data import StampedTransform
from sara_localization.particles.amcl_config import AmclConfig
from sara_localization.particles.belief import Belief
from sara_localization.ros import conversions
from sara_localization.ros.shell import publish

PLANAR = np.ix_((0, 1, 5), (0, 1, 5))
"""x, y, yaw in a (6, 6) covariance."""
_COUNT = Struct('<I')
SAVED = ('initial_pose_x', 'initial_pose_y', 'initial_pose_a', 'initial_cov_xx', 'initial_cov_yy', 'initial_cov_aa')


class Cloud(PoseArray):
    """A PoseArray of planar poses (n, 3) that is written at once: thousands of Pose objects would cost more than the
    filter.
    """

    def __init__(self, poses: np.ndarray):
        super().__init__()
        self._numbers = np.zeros((len(poses), 7))
        self._numbers[:, :2] = poses[:, :2]
        self._numbers[:, 5], self._numbers[:, 6] = np.sin(0.5 * poses[:, 2]), np.cos(0.5 * poses[:, 2])

    def serialize(self, buff):
        """Into a stream, as genpy lays a PoseArray out."""
        self.header.serialize(buff)
        buff.write(_COUNT.pack(len(self._numbers)) + self._numbers.tobytes())


class Outputs:
    """The publishers. `config` may be replaced."""

    def __init__(self, config: AmclConfig):
        self.config = config
        self._transform = rospy.Publisher('/tf', TFMessage, queue_size=100, tcp_nodelay=True)
        self._pose = rospy.Publisher('amcl_pose', PoseWithCovarianceStamped, queue_size=2, latch=True)
        self._cloud = rospy.Publisher('particlecloud', PoseArray, queue_size=2, latch=True)
        self._lost = rospy.Publisher('lost_probability', Float32, queue_size=2, latch=True)
        self._last_cloud = self._last_saved = None

    def transform(self, stamp: float, map_from_odom: Transform) -> None:
        """Broadcast map -> odom, dated ahead of a scan's stamp (s) by the tolerance."""
        c = self.config
        if c.tf_broadcast:
            dated = later(stamp, c.transform_tolerance)
            stamped = StampedTransform(dated, c.global_frame_id, c.odom_frame_id, map_from_odom)
            publish(self._transform, TFMessage([conversions.transform_message(stamped)]))

    def pose(self, stamp: float, belief: Belief) -> None:
        """Publish amcl_pose of a scan's stamp (s)."""
        msg = PoseWithCovarianceStamped()
        msg.header.stamp, msg.header.frame_id = conversions.ros_time(stamp), self.config.global_frame_id
        x, y, yaw = belief.pose
        conversions.fill_pose(msg.pose.pose, Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, yaw))
        covariance = np.zeros((6, 6))
        covariance[PLANAR] = belief.covariance
        msg.pose.covariance = covariance.ravel().tolist()
        publish(self._pose, msg)

    def lost(self, probability: float) -> None:
        """Publish lost_probability."""
        publish(self._lost, Float32(probability))

    def cloud(self, stamp: float, poses: np.ndarray) -> None:
        """Publish the particles (n, 3), at most gui_publish_rate times a second where that is above 0."""
        rate, last = self.config.gui_publish_rate, self._last_cloud
        if rate > 0.0 and last is not None and 0.0 <= stamp - last < 1.0 / rate:
            return
        self._last_cloud = stamp
        msg = Cloud(poses)
        msg.header.stamp, msg.header.frame_id = conversions.ros_time(stamp), self.config.global_frame_id
        publish(self._cloud, msg)

    def save_is_due(self, stamp: float) -> bool:
        """Whether it is time to save the pose, at save_pose_rate."""
        rate, last = self.config.save_pose_rate, self._last_saved
        if rate <= 0.0 or (last is not None and 0.0 <= stamp - last < 1.0 / rate):
            return False
        self._last_saved = stamp
        return True


def save(pose: Transform, belief: Belief) -> None:
    """Write map_from_base and its variances to the parameter server."""
    variances = belief.covariance.diagonal().tolist()
    for name, value in zip(SAVED, (*pose.translation[:2], pose.yaw, *variances)):
        rospy.set_param('~' + name, value)


def saved() -> dict[str, object]:
    """What the parameter server holds of these."""
    known = rospy.get_param('~', {})
    return {name: known[name] for name in SAVED if name in known}
