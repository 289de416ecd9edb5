"""What slam_gmapping publishes: map, map_metadata, ~entropy, map -> odom."""

from __future__ import annotations

import rospy
from nav_msgs.msg import MapMetaData, OccupancyGrid
from std_msgs.msg import Float64
from tf2_msgs.msg import TFMessage

from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.stamps import later
from sara_localization.inputs.data import StampedTransform
from sara_localization.ros import conversions
from sara_localization.ros.shell import publish
from sara_nav.maps.map_io import GridMap
from sara_nav.ros.conversions import grid_to_msg
from sara_slam.mapping.slam import Pose
from sara_slam.mapping.slam_config import SlamConfig


class Outputs:
    """The publishers. `message`: the OccupancyGrid that was published last, None before the first."""

    def __init__(self, config: SlamConfig):
        self._config, self.message = config, None
        self._sent = None
        self._transform = rospy.Publisher('/tf', TFMessage, queue_size=100, tcp_nodelay=True)
        self._map = rospy.Publisher('map', OccupancyGrid, queue_size=1, latch=True)
        self._metadata = rospy.Publisher('map_metadata', MapMetaData, queue_size=1, latch=True)
        self._entropy = rospy.Publisher('~entropy', Float64, queue_size=1, latch=True)

    def transform(self, now: float, map_from_odom: Pose | None) -> None:
        """Broadcast map -> odom (x, y, yaw), dated ahead of a time (s) by tf_delay; nothing twice for one time, and
        nothing while it is not known.
        """
        c = self._config
        if now == self._sent or map_from_odom is None:
            return
        self._sent = now
        x, y, yaw = map_from_odom
        placed = Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, yaw)
        stamped = StampedTransform(later(now, c.delay), c.map_frame, c.odom_frame, placed)
        publish(self._transform, TFMessage([conversions.transform_message(stamped)]))

    def map(self, stamp: rospy.Time, grid_map: GridMap) -> None:
        """Publish a map, made at a time."""
        frame = self._config.map_frame
        self.message = grid_to_msg(grid_map.data, grid_map.geometry, grid_map.origin_yaw, frame, stamp)
        publish(self._metadata, self.message.info)
        publish(self._map, self.message)

    def entropy(self, value: float) -> None:
        """Publish the entropy of the pose, nat."""
        publish(self._entropy, Float64(value))
