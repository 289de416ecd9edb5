"""Messages go out on the thread that publishes them, as long as the socket takes them at once.

rospy hands every message of a publisher with a queue to a thread of its own per subscriber, which must be woken for it:
a simulator that tells its clock to a dozen nodes wakes a dozen threads every 10 ms, and each message is late by that.
"""

from __future__ import annotations

import socket

import rospy.topics
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_pubsub import QueuedConnection


class DirectConnection(QueuedConnection):
    """rospy's queued connection, whose queue and thread are only for what the socket does not take at once.

    Publishing never waits, as before. `connection`: to one subscriber; `queue_size`: messages kept for one that does
    not read, the oldest go; 0 is without end.
    """

    def __init__(self, connection: TCPROSTransport, queue_size: int) -> None:
        self._rest = b''  # of a message that went half: never dropped, or the stream could not be read
        self._writing = False  # by the thread: what is sent now would overtake it
        connection.socket.settimeout(None)  # Python waits for a socket with a timeout, MSG_DONTWAIT or not
        super().__init__(connection, queue_size)

    def write_data(self, data: bytes) -> bool:
        """Send or queue one serialised message; raise what the last one met in the thread."""
        with self._lock:
            if self._error:
                error, self._error = self._error, None
                raise error
            if not (self._writing or self._rest or self._queue):
                self._rest = data[self._send(data) :]
                if not self._rest:
                    return True
            else:
                if self._queue_size > 0 and len(self._queue) == self._queue_size:
                    del self._queue[0]
                self._queue.append(data)
            self._cond_data_available.notify()
        return True

    def _send(self, data: bytes) -> int:
        """How many bytes went. The thread meets an error again, and ends the connection as rospy does."""
        try:
            sent = self._connection.socket.send(data, socket.MSG_DONTWAIT)
        except (OSError, AttributeError):  # it is full, broken or closed already
            return 0
        self._connection.stat_bytes += sent
        self._connection.stat_num_msg += sent == len(data)
        return sent

    def _run(self) -> None:
        while not self._connection.done:
            with self._lock:
                while not (self._rest or self._queue or self._connection.done):
                    self._cond_data_available.wait()
                batch = [self._rest] * bool(self._rest) + self._queue
                self._rest, self._queue, self._writing = b'', [], True
            for data in batch:
                try:
                    self._connection.write_data(data)
                except Exception as error:  # told to who publishes next, as rospy does
                    with self._lock:
                        self._error = error
            with self._lock:
                self._writing = False


def send_directly() -> None:
    """Make every publisher of this process that has a queue send so; called before it connects to anybody."""
    rospy.topics.QueuedConnection = DirectConnection
