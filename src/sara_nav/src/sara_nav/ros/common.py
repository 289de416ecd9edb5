"""What the nodes of this package share: a listener to TF without delay, parameters that are moved."""

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from sara_common.ros.clock import Clock
from sara_nav.config.parameters import Parameters

END_OF_TIME = 2**31
"""s, from where on a stamp ends the process within tf2's Python module."""


def move_parameters(parameters: Parameters) -> None:
    """Move on the parameter server what was read at another path of the node's, as costmap_2d does: a node that is
    started anew then finds what was tuned, unless somebody has set the old path again.
    """
    for old, new in parameters.moved.items():
        rospy.set_param(f'~{new}', rospy.get_param(f'~{old}'))
        rospy.delete_param(f'~{old}')


class TransformListener:
    """Fills a tf2 buffer from /tf and /tf_static, with tcp_nodelay, which tf2_ros's own listener cannot ask for."""

    def __init__(self):
        self.buffer = tf2_ros.Buffer(debug=False)
        self._parents, self._clock = {}, Clock()
        self._subscribers = [
            rospy.Subscriber('/tf', TFMessage, self._add, False, queue_size=100, tcp_nodelay=True),
            rospy.Subscriber('/tf_static', TFMessage, self._add, True, queue_size=100, tcp_nodelay=True),
        ]

    def _add(self, msg, static):
        if self._clock.went_back():
            self.buffer.clear()
        put = self.buffer.set_transform_static if static else self.buffer.set_transform
        for transform in msg.transforms:
            if transform.header.stamp.secs >= END_OF_TIME:
                rospy.logwarn_throttle(
                    10.0, 'a transform with a stamp of %d s was dropped', transform.header.stamp.secs
                )
                continue
            try:
                put(transform, 'default_authority')
                self._parents[transform.child_frame_id.lstrip('/')] = transform.header.frame_id.lstrip('/')
            except tf2_ros.TransformException as error:
                rospy.logwarn_throttle(10.0, 'a transform was dropped: %s', error)

    def latest(self, target: str, source: str) -> TransformStamped:
        """Return the newest geometry_msgs/TransformStamped of ``source`` in ``target``.

        Raises tf2_ros.TransformException, whose text says what is missing.
        """
        return self.buffer.lookup_transform(target, source, rospy.Time(0))

    def child_towards(self, frame: str, source: str) -> str:
        """Return the child of ``frame`` through which ``source`` hangs below it: odom for map and base_link. ``source``
        itself where it is that child, or where it is not known to be below.
        """
        child = source
        for _ in range(len(self._parents)):
            parent = self._parents.get(child)
            if parent is None:
                break
            if parent == frame:
                return child
            child = parent
        return source
