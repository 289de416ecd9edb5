"""A costmap as RViz and others see it: the whole grid for those who come, then windows of what changed."""

from collections.abc import Callable
from typing import Any

import rospy
from geometry_msgs.msg import Point32, PolygonStamped
from map_msgs.msg import OccupancyGridUpdate
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import to_occupancy
from sara_nav.costmaps.layered_costmap import LayeredCostmap
from sara_nav.ros import conversions as conv


class _NewSubscribers(rospy.SubscribeListener):
    def __init__(self, publisher: 'CostmapPublisher'):
        super().__init__()
        self._publisher = publisher

    def peer_subscribe(self, _topic: str, _publish: Callable, peer_publish: Callable) -> None:
        """Send the whole grid to one who just came."""
        grid = self._publisher.grid()
        if grid is not None:
            peer_publish(grid)


class CostmapPublisher:
    """Publishes K/costmap, K/costmap_updates and the footprint; name: K. lock: held while the costmap is changed."""

    def __init__(self, name: str, costmap: LayeredCostmap, footprint_topic: str, lock: Any):
        self._costmap = costmap
        self._lock = lock
        self._changed = None
        self._sent = None
        self._sent_at = None
        self._full = rospy.Publisher(f'~{name}/costmap', numpy_msg(OccupancyGrid), _NewSubscribers(self), queue_size=1)
        self._updates = rospy.Publisher(f'~{name}/costmap_updates', numpy_msg(OccupancyGridUpdate), queue_size=1)
        self._footprint = rospy.Publisher(f'~{name}/{footprint_topic}', PolygonStamped, queue_size=1)

    def grid(self) -> OccupancyGrid | None:
        """Return the whole costmap as a message, or None before its first update."""
        with self._lock:
            if self._costmap.updated_at is None:
                return None
            costs, geometry = to_occupancy(self._costmap.costmap.costs), self._costmap.geometry
        msg = conv.grid_to_msg(costs[:0], geometry, 0.0, self._costmap.config.global_frame, rospy.Time.now())
        msg.data = costs.ravel()
        return numpy_like(OccupancyGrid, msg)

    def updated(self, window: tuple | None, pose: Pose2D | None, now: rospy.Time) -> None:
        """Note an update that changed ``window`` (or None), and publish what is due at ``now`` (rospy.Time).

        pose: Pose2D of the robot in the global frame, or None.
        """
        if window is not None:
            old = self._changed
            self._changed = (
                window
                if old is None
                else (min(old[0], window[0]), min(old[1], window[1]), max(old[2], window[2]), max(old[3], window[3]))
            )
        if pose is not None:
            self._publish_footprint(pose, now)
        frequency, t = self._costmap.config.publish_frequency, now.to_sec()
        if frequency <= 0.0:
            return
        if self._sent_at is None or not 0.0 <= t - self._sent_at < 1.0 / frequency - 1e-6:
            self._sent_at = t
            self._publish(now)

    def _publish(self, now):
        """Send the whole grid when it is asked for, moved or has another size, else what changed since the last
        time.
        """
        changed, self._changed = self._changed, None
        g = self._costmap.geometry
        moved, self._sent = g != self._sent, g
        if self._costmap.config.always_send_full_costmap or moved:
            if self._full.get_num_connections():
                self._full.publish(self.grid())
        elif changed is not None and self._updates.get_num_connections():
            x0, y0, xn, yn = (
                max(0, changed[0]),
                max(0, changed[1]),
                min(g.width, changed[2]),
                min(g.height, changed[3]),
            )
            msg = numpy_msg(OccupancyGridUpdate)(x=x0, y=y0, width=xn - x0, height=yn - y0)
            msg.header.frame_id, msg.header.stamp = self._costmap.config.global_frame, now
            msg.data = to_occupancy(self._costmap.costmap.costs[y0:yn, x0:xn]).ravel()
            self._updates.publish(msg)

    def _publish_footprint(self, pose, now):
        if self._footprint.get_num_connections():
            msg = PolygonStamped()
            msg.header.frame_id, msg.header.stamp = self._costmap.config.global_frame, now
            for x, y in self._costmap.footprint.tolist():
                corner = pose.compose(type(pose)(x, y, 0.0))
                msg.polygon.points.append(Point32(corner.x, corner.y, 0.0))
            self._footprint.publish(msg)


def numpy_like(kind: type, msg: Any) -> Any:
    """Return a message whose arrays are numpy's, to be written at once, with the fields of ``msg``."""
    result = numpy_msg(kind)()
    for field in msg.__slots__:
        setattr(result, field, getattr(msg, field))
    return result
