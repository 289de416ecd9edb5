"""tf2 behind the filter's small interface."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from rospy.impl.transport import INBOUND, Transport
from tf2_msgs.msg import TFMessage

from sara_common.ros.clock import Clock
from sara_common.ros.members import current
from sara_localization.geometry.rigid import IDENTITY, Transform
from sara_localization.inputs.data import StampedTransform
from sara_localization.ros import conversions, wire

# After a wait in vain for a transform it is not waited for again for so long (s): messages would pile up behind each
# other.
PATIENCE = 1.0
# Transforms of the node's own that are kept until somebody asks for any: what tf2 remembers of ten seconds.
MOST_OWN = 1000


class Tf2Transforms:
    """lookup(target, source, stamp) from tf2's buffer; waits `timeout` s for a transform that is not there yet.

    What this node broadcasts it enters itself (`enter`), at once; it does not listen to itself on /tf, but to other
    nodes of its process (sara_common.ros.members). on_news: called when transforms have come.
    """

    def __init__(self, timeout: float = 0.0, on_news: Callable[[], None] = lambda: None):
        self.buffer, self._on_news = tf2_ros.Buffer(), on_news
        self.timeout = rospy.Duration.from_sec(timeout)
        self._in_vain, self._clock, self._name = {}, Clock(), rospy.get_name()
        self._own, self._message = deque(maxlen=MOST_OWN), TransformStamped()
        self._subscribers = [
            rospy.Subscriber(topic, wire.unread(TFMessage), self._hear, enter, tcp_nodelay=True)
            for topic, enter in (('/tf', self.buffer.set_transform), ('/tf_static', self.buffer.set_transform_static))
        ]
        if current() is None:
            self._subscribers[0].impl.add_connection(_Itself(self._subscribers[0].resolved_name))

    def enter(self, stamped: StampedTransform) -> None:
        """A StampedTransform of this node's own; tf2 is told when somebody asks."""
        self._own.append(stamped)

    def _hear(self, msg, enter):
        who = msg._connection_header.get('callerid', 'default_authority')  # pylint: disable=protected-access
        if who == self._name:
            return
        back = self._clock.went_back()
        if back:
            rospy.logwarn('time went back by %.3f s: what was known of moving frames is forgotten', back)
            self.buffer.clear()
        for transform in TFMessage().deserialize(msg.bytes).transforms:
            enter(transform, who)
        self._on_news()

    def lookup(self, target: str, source: str, stamp: float | None) -> Transform | None:
        """target_from_source at the stamp (s), the latest one where that fails, or None."""
        if target == source:
            return IDENTITY
        while self._own:
            self.buffer.set_transform(conversions.transform_message(self._own.popleft(), self._message), self._name)
        found = self._at(target, source, conversions.ros_time(stamp))
        if found is None:
            found = self._at(target, source, rospy.Time(0), wait=False)
        return found

    def lookup_at(self, target: str, source: str, stamp: float) -> Transform | None:
        """target_from_source at that very time (s), None where it is not known or not known yet."""
        return IDENTITY if target == source else self._at(target, source, conversions.ros_time(stamp), wait=False)

    def latest(self, target: str, source: str) -> Transform | None:
        """The newest target_from_source, or None."""
        return IDENTITY if target == source else self._at(target, source, rospy.Time(0), wait=False)

    def is_past(self, target: str, source: str, stamp: float) -> bool:
        """Whether newer transforms than of that time (s) are known: what `lookup_at` lacks will not come any more."""
        try:
            return self.buffer.get_latest_common_time(target, source) > conversions.ros_time(stamp)
        except tf2_ros.TransformException:
            return False

    def _at(self, target, source, stamp, wait=True):
        wait = wait and self.timeout and time.monotonic() - self._in_vain.get((target, source), -PATIENCE) >= PATIENCE
        try:
            if wait:
                found = self.buffer.lookup_transform(target, source, stamp, self.timeout)
            else:
                found = self.buffer.lookup_transform_core(target, source, stamp)
        except tf2_ros.TransformException:
            if wait:
                self._in_vain[target, source] = time.monotonic()
            return None
        return conversions.transform(found).transform

    def age(self, target: str, source: str, stamp: float) -> float:
        """By how much (s) what `lookup` gives is older than the stamp; 0.0 where that time is covered, or nothing
        moves.
        """
        try:
            newest = self.buffer.get_latest_common_time(target, source)
        except tf2_ros.TransformException:
            return 0.0
        return 0.0 if newest.is_zero() else max(0.0, (conversions.ros_time(stamp) - newest).to_sec())

    def clear(self) -> None:
        """Forget all that moved, as after a jump of the clock."""
        self._own.clear()
        self.buffer.clear()


class _Itself(Transport):
    """What stands in rospy's list for a connection of the node to itself, so that it makes none: over it a message of
    the node's own costs more than a cycle of the filter.
    """

    def __init__(self, topic):
        super().__init__(INBOUND, topic)
        self.endpoint_id = rospy.get_node_uri()

    def close(self):
        """rospy's list closes what it drops, and what is closed drops out of the list: once is enough."""
        if not self.done:
            super().close()

    def get_transport_info(self):
        """For rosnode info."""
        return 'none: what the node sends it does not hear'
