#!/usr/bin/env python3
"""A publisher waits for no subscriber and cuts no message in two; a sleep in simulated time ends when it should."""

import socket
import struct
import subprocess
import sys
import threading
import time
import unittest

import rospy
import rostest
from rosgraph_msgs.msg import Clock
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_pubsub import TCPROSPub
from std_msgs.msg import String

from sara_common.ros.direct import DirectConnection
from sara_common.ros.node import start_node

PATIENCE_S = 20.0
PADDING = b'.' * 5000

LATE_HOOK = """
import threading, rospy
from sara_common.ros.node import on_shutdown
calls, ending = [], threading.Event()
rospy.core.add_preshutdown_hook(lambda reason: (ending.set(), rospy.rostime.wallsleep(0.3)))
on_shutdown(lambda: calls.append('early'))
end = threading.Thread(target=rospy.signal_shutdown, args=('a signal',))
end.start()
ending.wait()
on_shutdown(lambda: calls.append('meanwhile'))
end.join()
on_shutdown(lambda: calls.append('late'))
print(*calls)
"""


class DirectTest(unittest.TestCase):
    def setUp(self):
        listener = socket.create_server(('127.0.0.1', 0))
        self.reader = socket.create_connection(listener.getsockname())
        self.writer, _ = listener.accept()
        listener.close()
        transport = TCPROSTransport(TCPROSPub('/said', String), '/said')
        transport.set_socket(self.writer, 'reader')
        self.connection = DirectConnection(transport, 5)
        self.addCleanup(self.reader.close)
        self.addCleanup(self.connection.close)

    def test_what_fits_is_sent_before_publishing_returns(self):
        for number in range(100):
            self.connection.write_data(struct.pack('<II', number, 0))
        self.assertEqual(self.connection.stat_num_msg, 100)
        self.assertEqual(len(self.reader.makefile('rb').read(800)), 800)

    def test_one_that_does_not_read_delays_nobody_and_gets_whole_messages_the_newest_last(self):
        began, count = time.monotonic(), 5000
        for number in range(count):
            self.connection.write_data(struct.pack('<II', number, len(PADDING)) + PADDING)
        self.assertLess(time.monotonic() - began, PATIENCE_S)
        self.reader.settimeout(PATIENCE_S)
        numbers = []
        stream = self.reader.makefile('rb')
        while not numbers or numbers[-1] != count - 1:
            number, padding = struct.unpack('<II', stream.read(8))
            self.assertEqual(stream.read(padding), PADDING)
            numbers.append(number)
        self.assertEqual(numbers, sorted(set(numbers)))
        self.assertLess(len(numbers), count, 'the oldest are dropped')
        end = time.monotonic() + PATIENCE_S
        while self.connection._writing:
            self.assertLess(time.monotonic(), end, 'in vain: all is written')
            time.sleep(0.01)
        self.connection.write_data(struct.pack('<II', count, 0))
        self.assertEqual(struct.unpack('<II', stream.read(8)), (count, 0), 'then directly again')

    def test_who_publishes_is_told_that_the_reader_is_gone(self):
        self.reader.close()
        end = time.monotonic() + PATIENCE_S
        with self.assertRaises(Exception):  # noqa: B017 - whichever way the system says so
            while time.monotonic() < end:
                self.connection.write_data(struct.pack('<II', 0, 0))
                time.sleep(0.01)


class NodeTest(DirectTest):
    @classmethod
    def setUpClass(cls):
        cls.clock = rospy.Publisher('/clock', Clock, queue_size=10, latch=True)

    def at(self, seconds, milliseconds=0):
        """Tell the time, and wait until this node has heard it."""
        moment, end = rospy.Time(seconds, milliseconds * 1_000_000), time.monotonic() + PATIENCE_S
        self.clock.publish(moment)
        while rospy.get_rostime() != moment:
            self.assertLess(time.monotonic(), end, 'in vain: the clock is heard')
            time.sleep(0.001)

    def until_asleep(self, seconds, milliseconds=0, ended=()):
        """Wait until somebody sleeps until this time, or `ended` holds something."""
        moment, end = rospy.Time(seconds, milliseconds * 1_000_000), time.monotonic() + PATIENCE_S
        clock = rospy.rostime.get_rostime_cond()
        while not (ended or any(sleep.until == moment for sleep, _ in list(clock._sleepers))):
            self.assertLess(time.monotonic(), end, f'in vain: nobody sleeps until {moment.to_sec()}')
            time.sleep(0.001)

    def asleep(self, call, until):
        """What a call that sleeps until a time (s) returned or raised, and its thread."""
        ended = []

        def sleep():
            try:
                ended.append(call())
            except rospy.ROSException as error:
                ended.append(error)

        thread = threading.Thread(target=sleep)
        thread.start()
        self.until_asleep(until, ended=ended)  # what it sleeps counts from the time at which it begins
        return ended, thread

    def test_it_ends_when_its_time_has_come_and_not_before(self):
        self.at(100)
        ended, thread = self.asleep(lambda: rospy.sleep(1.0), 101)
        for milliseconds in (500, 999):
            self.at(100, milliseconds)
            time.sleep(0.05)
            self.assertEqual(ended, [], f'at {milliseconds} ms')
        self.at(101)
        thread.join(PATIENCE_S)
        self.assertEqual(ended, [None])

    def test_many_sleep_and_each_is_woken(self):
        self.at(200)
        sleeps = [self.asleep(lambda k=k: rospy.sleep(rospy.Duration(k)), 200 + k) for k in (3, 1, 2, 0)]
        for passed in range(4):
            self.at(200 + passed)
            sleeps[(3, 1, 2, 0)[passed]][1].join(PATIENCE_S)
            self.assertEqual([len(ended) for ended, _ in sleeps], [k <= passed for k in (3, 1, 2, 0)])

    def test_a_clock_that_goes_back_is_told(self):
        self.at(300)
        ended, thread = self.asleep(lambda: rospy.sleep(5.0), 305)
        self.at(290)
        thread.join(PATIENCE_S)
        self.assertIsInstance(ended[0], rospy.exceptions.ROSTimeMovedBackwardsException)

    def test_a_timer_fires_once_in_each_period(self):
        self.at(400)
        fired = []
        timer = rospy.Timer(
            rospy.Duration(0, 100_000_000), lambda event: fired.append(event.current_real.to_nsec() // 1_000_000)
        )
        for tenth in range(1, 10):
            self.until_asleep(400, 100 * tenth)
            self.at(400, 100 * tenth - 50)
            self.at(400, 100 * tenth)
            end = time.monotonic() + PATIENCE_S
            while len(fired) < tenth:
                self.assertLess(time.monotonic(), end, f'in vain: it fires at {tenth}')
                time.sleep(0.001)
        timer.shutdown()
        self.assertEqual(fired, [400_000 + 100 * tenth for tenth in range(1, 10)])

    def test_a_hook_is_called_once_whenever_it_is_registered(self):
        output = subprocess.check_output([sys.executable, '-c', LATE_HOOK], text=True, timeout=PATIENCE_S)
        self.assertEqual(output.split(), ['early', 'meanwhile', 'late'])


if __name__ == '__main__':
    start_node('node_test')
    rostest.rosrun('sara_common', 'node', NodeTest)
