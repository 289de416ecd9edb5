"""canserial.py: frames of a CAN adapter to `canrx`, frames of `cantx` to the adapter; the shell around
canserial.adapter.link.Link.
"""

from __future__ import annotations

import threading

import rospy

from canserial.adapter.adapter import Adapter, AdapterConfig
from canserial.adapter.busload import load
from canserial.adapter.link import Link
from canserial.msg import CAN
from canserial.ros.conversions import frame_to_msg, msg_to_frame
from canserial.ros.node import config_from_params, stop, warn_of_unknown_params
from sara_common.diagnostics import ERROR, OK, WARN
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import on_shutdown, start_node, until_shutdown

QUEUE = 1000  # frames that a slow subscriber of canrx may be behind
# What spoils the good state for as long as it goes on, and what it means.
TROUBLE = {
    'bad_lines': 'lines that are no frames',
    'error_frames': 'error frames',
    'overruns': 'frames lost in the adapter',
    'adapter_receive_full': 'the adapter is full',
    'adapter_transmit_full': 'the adapter cannot send',
    'bus_errors': 'bus errors',
    'error_passive': 'the adapter is error passive',
    'error_warning': 'many errors on the bus',
    'refused': 'commands that the adapter refused',
    'transmit_queue_full': 'frames dropped from a full transmit queue',
    'transmit_queue_too_old': 'frames that waited too long to be sent',
    'not_sent_failed': 'frames that the adapter did not take',
    'not_sent_invalid': 'frames on cantx that CAN cannot carry',
    'not_sent_listen_only': 'frames on cantx, but the adapter listens only',
    'canrx_lost': 'frames lost to a slow subscriber of canrx',
    'threads_restarted': 'a thread that died',
}
HIGH_LOAD = 0.8


class FramePublisher:
    """Publishes on canrx, and counts what rospy drops without a word when a subscriber is QUEUE frames behind."""

    def __init__(self) -> None:
        self._publisher = rospy.Publisher('canrx', CAN, queue_size=QUEUE, tcp_nodelay=True)
        self.lost = 0

    def __call__(self, frame):
        for connection in self._publisher.impl.connections:
            if len(getattr(connection, '_queue', ())) >= QUEUE:
                self.lost += 1
        with until_shutdown():
            self._publisher.publish(frame_to_msg(frame))


class AdapterNode:
    """The shell around one Link."""

    def __init__(self) -> None:
        self.config = config_from_params(AdapterConfig)
        warn_of_unknown_params(AdapterConfig.__dataclass_fields__)
        for remark in self.config.remarks:
            rospy.loginfo(remark)
        self.canrx = FramePublisher()
        self.link = Link(Adapter(self.config), self.canrx, rospy.get_time, self.report)
        self.stopping = threading.Event()
        self.diagnostics = Diagnostics('CAN adapter', self.config.port)
        self.fatal = None
        self.before, self.bits, self.time = {}, 0, rospy.get_time()
        rospy.Subscriber(
            'cantx', CAN, lambda message: self.link.send(msg_to_frame(message)), queue_size=QUEUE, tcp_nodelay=True
        )
        on_shutdown(self.stopping.set)

    def report(self, level: str, sentence: str) -> None:
        """What the link has to say."""
        if level == 'fatal':
            self.fatal = sentence
            self.stopping.set()
            return
        {'info': rospy.loginfo, 'warn': rospy.logwarn, 'error': rospy.logerr}[level](sentence)

    def run(self) -> None:
        """Until ROS shuts down."""
        self.link.start()
        while not self.stopping.wait(1.0):
            self.link.supervise()
            self.diagnostics.publish(*self.status())
        self.link.stop()
        if self.fatal:
            stop(self.fatal)

    def status(self) -> tuple[int, str, dict]:
        """(level, message, values) for /diagnostics, since the last call."""
        counters = self.link.all_counters
        counters['canrx_lost'] = self.canrx.lost
        now = rospy.get_time()
        busy = load(counters.get('bits', 0) - self.bits, now - self.time, self.config.bitrate)
        self.bits, self.time = counters.get('bits', 0), now
        news = [text for name, text in TROUBLE.items() if counters.get(name, 0) > self.before.get(name, 0)]
        if busy > HIGH_LOAD:
            news.append('the bus is nearly full')
        self.before = counters
        values = {
            'received': 0,
            'sent': 0,
            'error_frames': 0,
            'overruns': 0,
            **counters,
            'bus_load_percent': f'{100.0 * busy:.1f}',
        }
        if self.link.error:
            return ERROR, self.link.error, values
        if not values['received']:
            news.insert(0, 'no frame has come yet')
        return (WARN, 'open, but: ' + '; '.join(news), values) if news else (OK, 'open', values)


def main() -> None:
    """Run the node."""
    start_node('canserial')
    AdapterNode().run()
    rospy.spin()  # until rospy has ended its own shutdown, so that the master forgets the node
