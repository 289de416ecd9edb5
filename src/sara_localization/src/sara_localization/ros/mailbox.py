"""What has come in on topics, read from the sockets when it is asked for.

rospy has a thread per connection that wakes up for every message. A filter wants what has come when its cycle begins,
and all of it
at once: reading it then costs two calls of the system, and nobody is woken. rospy still makes the connections and ends
them; its thread waits for the end of each.
"""

from __future__ import annotations

import select
import threading
from collections import deque
from collections.abc import Callable
from socket import MSG_DONTWAIT
from struct import Struct

import rospy
from rospy.exceptions import TransportTerminated

_LENGTH = Struct('<I')
_CHUNK = 1 << 16
# What ends a connection without being asked for, and what must be asked for.
_ENDED = select.POLLHUP | select.POLLERR | select.POLLNVAL | select.POLLRDHUP
_LOOK_UP = 1000  # ms: how often the end of the node is looked for


class _Line:
    """One connection: its socket and what has come of a message that is not whole yet."""

    def __init__(self, connection, topic):
        self.connection, self.topic, self.socket = connection, topic, connection.socket
        begun = connection.read_buff  # what came along with the handshake
        self.rest = begun.getvalue()[: begun.tell()]
        begun.seek(0)
        begun.truncate()

    def read(self):
        """The messages that are whole, as bytes, oldest first."""
        data = self.rest
        while True:
            try:
                more = self.socket.recv(_CHUNK, MSG_DONTWAIT)
            except OSError:  # nothing there, or the connection is gone: the thread that waits for that sees to it
                break
            data = data + more if data else more
            self.connection.stat_bytes += len(more)
            if len(more) < _CHUNK:
                break
        messages, at, end = [], 0, len(data)
        while at + 4 <= end:
            after = at + 4 + _LENGTH.unpack_from(data, at)[0]
            if after > end:
                break
            messages.append(data[at + 4 : after])
            at = after
        self.rest = data[at:]
        self.connection.stat_num_msg += len(messages)
        return messages


class _Topic:
    """Who takes a topic's messages, each with how many may wait: [(take, queue_size)]. `known`: to rospy."""

    def __init__(self):
        self.takers: list[tuple[Callable, int | None]] = []
        self.known = False


class Mailbox:
    """Topics that are read when it is asked for.

    mailbox.subscribe('imu', Imu, take, queue_size=10); ...; mailbox.deliver()      # calls take(bytes of a message),
    ...
    """

    def __init__(self, most: int):
        self._topics, self._lines, self._left = {}, [], deque(maxlen=most)
        self._lock = threading.RLock()

    def subscribe(self, topic: str, message: type, take: Callable, queue_size: int | None = None) -> rospy.Subscriber:
        """take(data) is called by `deliver` for each message; of more than queue_size at once the oldest are lost."""
        with self._lock:
            known = self._topics.setdefault(rospy.resolve_name(topic), _Topic())
            known.takers.append((take, queue_size))
        subscriber = rospy.Subscriber(topic, self._receiving(message, known), queue_size=queue_size, tcp_nodelay=True)
        with self._lock:
            if not (known.known or subscriber.impl.statistics_logger):
                known.known = True
                self._take_over(subscriber.impl, known)
        return subscriber

    def _receiving(self, message, topic):
        """The message for what rospy itself reads: a topic whose statistics are kept, and what comes until the
        connection is taken over. rospy adds a callback only after it has registered the topic, and drops what comes
        between the two; the message is made for whatever comes.
        """

        def receive(data):
            with self._lock:
                self._left.extend((take, data) for take, _ in topic.takers)

        class Receiving(message):
            def __init__(self):  # pylint: disable=super-init-not-called
                pass

            def deserialize(self, str):
                receive(str)
                return self

        return Receiving

    def _take_over(self, impl, topic):
        """From here on the topic's connections are not read by their threads."""
        add = impl.add_connection

        def add_connection(connection):
            connection.receive_once = lambda: self._hold(connection, topic)
            return add(connection)

        impl.add_connection = add_connection
        for connection in impl.connections:
            connection.receive_once = lambda connection=connection: self._hold(connection, topic)

    def _hold(self, connection, topic):
        """In the connection's own thread: wait for its end. Raises TransportTerminated then."""
        line, poll = _Line(connection, topic), select.poll()
        poll.register(line.socket, select.POLLRDHUP)
        with self._lock:
            self._lines = self._lines + [line]
        try:
            while not connection.done and not rospy.is_shutdown():
                if any(event & _ENDED for _, event in poll.poll(_LOOK_UP)):
                    break
        finally:
            with self._lock:
                self._collect(line)
                self._lines = [other for other in self._lines if other is not line]
        raise TransportTerminated('the publisher has closed the connection')

    def _collect(self, line):
        messages = line.read()
        for take, most in line.topic.takers:
            self._left.extend((take, data) for data in (messages[-most:] if most else messages))

    def deliver(self) -> None:
        """Give what has come to those who take it."""
        with self._lock:
            for line in self._lines:
                self._collect(line)
            left = self._left
            while left:
                take, data = left.popleft()
                take(data)

    def forget(self) -> None:
        """Throw away what has come."""
        with self._lock:
            for line in self._lines:
                self._collect(line)
            self._left.clear()
