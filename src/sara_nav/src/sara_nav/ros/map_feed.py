"""The map's way from its topic to the static layers."""
import rospy
from nav_msgs.msg import OccupancyGrid

from sara_nav import costmap as cm
from sara_nav.ros import conversions as conv


class MapFeed:
    """Takes maps as they come and gives them to the costmaps' static layers in the control loop."""

    def __init__(self, node):
        self._node = node
        self._waiting = None
        self.counts = {'bad_maps': 0}
        self._layers = [layer for costmap in (node.machine.global_costmap, node.machine.local_costmap)
                        for layer in costmap.layers.values() if hasattr(layer, 'set_map')]
        self.costmap = rospy.Publisher('~global_costmap/costmap', OccupancyGrid, queue_size=1, latch=True)
        self._subscribers = [rospy.Subscriber(topic, OccupancyGrid, self._on_map, topic, queue_size=1, tcp_nodelay=True)
                             for topic in sorted({layer.config.map_topic for layer in self._layers})]

    def _on_map(self, msg, topic):
        try:
            if msg.header.frame_id.lstrip('/') != self._node.settings.global_frame:
                raise ValueError('it is in frame %r but global_frame is %r' % (
                    msg.header.frame_id, self._node.settings.global_frame))
            self._waiting = topic, conv.grid_from_msg(msg)
        except ValueError as error:
            self.counts['bad_maps'] += 1
            rospy.logerr('a map was dropped: %s', error)

    def feed(self):
        """Give a waiting map to the layers."""
        waiting, self._waiting = self._waiting, None
        if waiting is None:
            return
        topic, grid_map = waiting
        try:
            taken = [layer.set_map(grid_map) for layer in self._layers if layer.config.map_topic == topic]
        except ValueError as error:
            self.counts['bad_maps'] += 1
            rospy.logerr('a map was dropped: %s', error)
            return
        machine = self._node.machine
        if any(taken):
            machine.replan()
            machine.global_costmap.update(rospy.get_time(), None)
            g = machine.global_costmap.geometry
            rospy.loginfo('global costmap of %d x %d cells of %.3g m', g.width, g.height, g.resolution)
            self.costmap.publish(conv.grid_to_msg(cm.to_occupancy(machine.global_costmap.costmap.costs), g, 0.0,
                                                  self._node.settings.global_frame, rospy.Time.now()))
