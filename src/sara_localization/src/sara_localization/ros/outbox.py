"""Messages that are bytes already, sent without a thread per listener and without ever waiting for one.

rospy's queues hand every message to another thread, which costs more than the message. Here the socket takes it at
once, as a rule; what it does not take waits for the next message. A listener who is too slow loses the oldest, as with
rospy's queue_size.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from socket import MSG_DONTWAIT

import rospy


class Outbox:
    """A publisher of `message` on a topic. most: messages that may wait for a listener."""

    def __init__(self, topic: str, message: type, most: int = 20):
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')  # no queue_size: rospy's queue is not wanted
            self._publisher = rospy.Publisher(topic, message, queue_size=None, tcp_nodelay=True)
        self._impl, self._most, self._waiting = self._publisher.impl, most, {}

    @property
    def heard(self) -> bool:
        """Whether anybody listens."""
        return bool(self._impl.connections)

    def send(self, write: Callable, *values) -> None:
        """Send what write(sequence number, *values) returns, with the length before it; it is only called if anybody
        listens.
        """
        impl = self._impl
        impl.seq += 1
        connections = impl.connections
        if not connections:
            self._waiting.clear()
            return
        data = write(impl.seq, *values)
        impl.message_data_sent += len(data)
        for connection in connections:
            try:
                self._relay(connection, data)
            except (OSError, AttributeError):  # the listener has gone; the latter while rospy takes the socket away
                self._waiting.pop(connection, None)
                connection.close()

    def _relay(self, connection, data):
        queue = self._waiting.pop(connection, None)
        if queue is None:
            queue = [data]
        else:
            queue.append(data)
            del queue[1 : 1 + len(queue) - self._most]  # not the first: half of it may be on its way
        while queue:
            try:
                sent = connection.socket.send(queue[0], MSG_DONTWAIT)
            except BlockingIOError:
                sent = 0
            connection.stat_bytes += sent
            if sent < len(queue[0]):
                queue[0] = queue[0][sent:]
                self._waiting[connection] = queue
                return
            connection.stat_num_msg += 1
            del queue[0]
