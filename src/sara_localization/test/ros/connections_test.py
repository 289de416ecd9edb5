#!/usr/bin/env python3
"""Mailbox and Outbox: what they carry is what rospy would, in order and whole, whatever the other end does."""

import contextlib
import io
import random
import socket
import struct
import sys
import time
import unittest

import numpy as np
import rospy
import rostest
from nav_msgs.msg import Odometry
from rospy.msg import serialize_message
from rospy.topics import _SubscriberImpl
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.stamps import Stamp
from sara_localization.inputs.data import FilterOutput, StampedTransform, Turning
from sara_localization.ros import conversions, wire
from sara_localization.ros.mailbox import Mailbox
from sara_localization.ros.outbox import Outbox


def wait_until(condition, what, timeout=15.0):
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.01)
    raise AssertionError(what)


def text(data):
    """The text of a std_msgs/String in bytes."""
    return String().deserialize(data).data


def written(publisher):
    """How many messages rospy's thread has written to the only listener of a publisher."""
    ((_, _, count, _),) = publisher.impl.get_stats()[2]
    return count


class Listener:
    """One end of a connection as rospy holds it; the other end reads when it likes."""

    def __init__(self):
        self.socket, self.far_end = socket.socketpair()
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        self.stat_bytes = self.stat_num_msg = 0
        self.closed = False

    def close(self):
        self.closed = True


class ConnectionsTest(unittest.TestCase):
    def written(self, message, seq=7):
        buffer = io.BytesIO()
        serialize_message(buffer, seq, message)
        return buffer.getvalue()

    def test_1_what_is_written_is_what_the_message_class_writes(self):
        numbers = np.random.default_rng(1)
        for frame, child in (('map', 'odom'), ('', ''), ('Räder/links', 'base_link')):
            pose = Transform(tuple(numbers.random(3).tolist()), tuple(numbers.random(4).tolist()))
            stamped = StampedTransform(Stamp(1700000000, 123456789), frame, child, pose)
            output = FilterOutput(
                stamped.stamp,
                frame,
                child,
                numbers.random(15),
                numbers.random((15, 15)),
                stamped,
                True,
                Turning(numbers.random(15), numbers.random((15, 15)), np.zeros(3), 0.02),
            )
            self.assertEqual(wire.write_odometry(7, output), self.written(conversions.odometry_message(output)))
            self.assertEqual(
                wire.write_transform(7, stamped), self.written(TFMessage([conversions.transform_message(stamped)]))
            )

    def test_2_a_slow_listener_loses_whole_messages_and_delays_nobody(self):
        outbox = Outbox('slow', String, most=5)
        slow, quick = Listener(), Listener()
        outbox._impl.connections = [slow, quick]  # pylint: disable=protected-access
        quick.far_end.setblocking(False)
        received, numbers = b'', random.Random(2)
        for k in range(200):
            body = struct.pack('<I', k) + bytes(numbers.randrange(3000))
            began = time.monotonic()
            outbox.send(lambda seq, body=body: struct.pack('<I', len(body)) + body)
            self.assertLess(time.monotonic() - began, 1.0)
            with contextlib.suppress(BlockingIOError):
                received += quick.far_end.recv(1 << 20)
        self.assertEqual(self.numbered(received)[-1], 199)
        self.assertEqual(len(self.numbered(received)), 200)
        late = b''
        slow.far_end.setblocking(False)
        for _ in range(50):  # what waits goes with what comes
            outbox.send(lambda seq: struct.pack('<II', 4, 1000))
            with contextlib.suppress(BlockingIOError):
                late += slow.far_end.recv(1 << 20)
        heard = self.numbered(late)
        self.assertEqual(sorted(heard), heard)
        self.assertEqual(heard[-1], 1000)
        self.assertLess(len([k for k in heard if k < 1000]), 200)
        slow.far_end.close()
        outbox.send(lambda seq: struct.pack('<II', 4, 1001))
        self.assertTrue(slow.closed)
        self.assertFalse(quick.closed)
        outbox._impl.connections = []  # pylint: disable=protected-access

    def numbered(self, data):
        """The numbers of the messages in a stream, all of them whole."""
        found = []
        while data:
            length, number = struct.unpack_from('<II', data)
            self.assertLessEqual(4 + length, len(data))
            found.append(number)
            data = data[4 + length :]
        return found

    def test_3_rospy_hears_what_an_outbox_sends(self):
        heard = []
        outbox = Outbox('heard', Odometry)
        subscriber = rospy.Subscriber('heard', Odometry, heard.append)
        wait_until(lambda: outbox.heard, 'nobody listens')
        for k in range(20):
            message = Odometry()
            message.header.stamp, message.pose.pose.position.x = rospy.Time(100, k), float(k)
            outbox.send(lambda seq, message=message: self.written(message, seq))
        wait_until(lambda: len(heard) == 20, 'not all came')
        self.assertEqual([m.pose.pose.position.x for m in heard], list(map(float, range(20))))
        self.assertEqual(np.diff([m.header.seq for m in heard]).tolist(), [1] * 19)
        subscriber.unregister()
        wait_until(
            lambda: outbox.send(lambda seq: b'\0\0\0\0') or not outbox.heard, 'the listener that went is still sent to'
        )

    def test_4_a_mailbox_gives_all_that_came_in_order_and_only_when_asked(self):
        mailbox, first, second = Mailbox(10000), [], []
        mailbox.subscribe('letters', String, lambda data: first.append(text(data)))
        mailbox.subscribe('letters', String, lambda data: second.append(text(data)))
        publisher = rospy.Publisher('letters', String, queue_size=1000)
        wait_until(publisher.get_num_connections, 'the mailbox does not listen')
        numbers, sent = random.Random(4), []
        for k in range(300):
            sent.append(f'{k} {"x" * numbers.choice([0, 10, 1000, 200000 if k % 50 == 0 else 5])}')
            publisher.publish(sent[-1])
        wait_until(lambda: mailbox.deliver() or len(first) == len(sent), 'not all came')
        self.assertEqual(first, sent)
        self.assertEqual(second, sent)
        publisher.publish('later')
        wait_until(lambda: written(publisher) == len(sent) + 1, 'it is not sent')
        time.sleep(0.2)
        self.assertEqual(len(first), len(sent))
        mailbox.forget()
        mailbox.deliver()
        self.assertEqual(len(first), len(sent))

    def test_5_what_a_publisher_said_before_it_went_is_not_lost_and_its_successor_is_heard(self):
        mailbox, heard = Mailbox(100), []
        subscriber = mailbox.subscribe('brief', String, lambda data: heard.append(text(data)), queue_size=10)
        for word in ('one', 'two'):
            publisher = rospy.Publisher('brief', String, queue_size=10)
            wait_until(publisher.get_num_connections, 'the mailbox does not listen')
            publisher.publish(word)
            wait_until(lambda publisher=publisher: written(publisher) == 1, 'it is not sent')
            publisher.unregister()
            wait_until(lambda: not subscriber.get_num_connections(), 'a connection stays')
        mailbox.deliver()
        self.assertEqual(heard, ['one', 'two'])

    def test_6_of_more_than_the_queue_holds_the_newest_stay(self):
        mailbox, heard = Mailbox(100), []
        mailbox.subscribe('many', String, lambda data: heard.append(text(data)), queue_size=3)
        publisher = rospy.Publisher('many', String, queue_size=10)
        wait_until(publisher.get_num_connections, 'the mailbox does not listen')
        publisher.publish('begin')
        wait_until(lambda: mailbox.deliver() or heard, 'nothing comes')
        for k in range(8):
            publisher.publish(str(k))
        wait_until(lambda: written(publisher) == 9, 'not all are sent')
        time.sleep(0.5)
        mailbox.deliver()
        self.assertEqual(heard, ['begin', '5', '6', '7'])

    def test_7_what_comes_before_rospy_knows_whom_to_call_is_not_lost(self):
        mailbox, heard = Mailbox(100), []
        publisher = rospy.Publisher('early', String, queue_size=10)
        set_queue_size = _SubscriberImpl.set_queue_size

        def late(impl, size):  # a busy computer: the connection is there before rospy.Subscriber is made
            wait_until(publisher.get_num_connections, 'the mailbox does not listen')
            publisher.publish('first')
            time.sleep(0.3)
            set_queue_size(impl, size)

        _SubscriberImpl.set_queue_size = late
        try:
            mailbox.subscribe('early', String, lambda data: heard.append(text(data)), queue_size=10)
        finally:
            _SubscriberImpl.set_queue_size = set_queue_size
        publisher.publish('second')
        wait_until(lambda: mailbox.deliver() or len(heard) == 2, f'only {heard} came')
        self.assertEqual(heard, ['first', 'second'])


if __name__ == '__main__':
    rospy.init_node('connections_test_node')
    rostest.rosrun('sara_localization', 'connections', ConnectionsTest, sys.argv)
