#!/usr/bin/env python3
"""An adapter pulled out while frames flow both ways: one line says so, one its return; frames come again, old commands
never go out.
"""

import os
import sys
import time
import unittest

# This test is installed beside canserial.py, which must not be taken for the package.
HERE = {os.path.dirname(os.path.realpath(path)) for path in (sys.argv[0], __file__)}
sys.path[:] = [path for path in sys.path if os.path.realpath(path or '.') not in HERE]
sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))

import rospy  # noqa: E402
import rostest  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from pty_adapter import PtyAdapter, wait_until  # noqa: E402
from rosgraph_msgs.msg import Log  # noqa: E402

from canserial.msg import CAN  # noqa: E402

NODE = '/unplugged_canserial'


class Adapter(PtyAdapter):
    """Sends frame 0x101 with a count in it every 10 ms, and 0x201, which the filter drops; its status says that it was
    overrun.
    """

    WAIT = 0.01
    count = 0

    def say(self):
        if b'O' in self.commands:
            self.count += 1
            os.write(self.master, b't1018%016X\rt2018%016X\r' % (self.count, self.count))

    def answer(self, line):
        return b'F08\r' if line == b'F' else super().answer(line)


class UnplugTest(unittest.TestCase):
    def setUp(self):
        self.frames, self.log, self.status = [], [], None
        rospy.Subscriber('canrx', CAN, self.frames.append, queue_size=1000, tcp_nodelay=True)
        rospy.Subscriber('/rosout', Log, self.on_log, queue_size=1000)
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.on_diagnostics)
        self.cantx = rospy.Publisher('cantx', CAN, queue_size=1000, tcp_nodelay=True)
        self.assertTrue(wait_until(self.cantx.get_num_connections))

    def on_log(self, message):
        if message.name == NODE:
            self.log.append(message)

    def on_diagnostics(self, message):
        for status in message.status:
            if status.name == f'{NODE[1:]}: CAN adapter':
                self.status = {
                    'level': status.level,
                    'message': status.message,
                    **{v.key: v.value for v in status.values},
                }

    def command(self, first, count):
        for number in range(first, first + count):
            self.cantx.publish(CAN(stdId=0x120, extId=-1, data=bytes([number, 0, 0, 0, 67, 0, 0, 0])))
            time.sleep(0.005)

    def told(self, text):
        return [entry for entry in self.log if text in entry.msg]

    def test_pulled_out_and_plugged_in(self):
        path = rospy.get_param('~port')
        adapter = Adapter(path)
        self.addCleanup(lambda: os.path.lexists(path) and os.unlink(path))
        self.assertTrue(wait_until(lambda: len(self.frames) > 20), 'no frames')
        self.assertEqual({frame.stdId for frame in self.frames}, {0x101}, 'the filter')
        self.command(1, 10)
        self.assertTrue(wait_until(lambda: len(adapter.lines) == 10), adapter.lines)
        self.assertTrue(
            wait_until(lambda: self.status and int(self.status.get('overruns', 0)) > 0),
            "the adapter's status is not read",
        )
        self.assertTrue(wait_until(lambda: float(self.status['bus_load_percent']) > 0.0))

        adapter.unplug()
        self.command(100, 50)
        self.assertTrue(wait_until(lambda: self.status['level'] == 2))
        self.assertIn(f'{path} is ', self.status['message'])
        self.assertTrue(wait_until(lambda: self.told('is lost')), 'that it is lost is not said')
        time.sleep(2.0)  # several attempts
        self.assertLessEqual(len(self.told('is missing')), 1, 'that it is missing after it was lost is no news')
        self.assertEqual(len(self.told('is lost')), 1)
        self.frames.clear()

        adapter = Adapter(path)
        self.assertTrue(wait_until(lambda: len(self.frames) > 20), 'an adapter plugged in again is not found')
        self.command(200, 10)
        self.assertTrue(wait_until(lambda: len(adapter.lines) == 10))
        self.assertEqual(
            [int(line[5:7], 16) for line in adapter.lines], list(range(200, 210)), 'a command from before the loss'
        )
        self.assertTrue(wait_until(lambda: len(self.told('is open')) >= 2), 'that it is open again is not said')
        self.assertEqual(len(self.told('is open')), 2)
        self.assertTrue(wait_until(lambda: self.status['level'] != 2))
        counted = sum(
            int(self.status.get(name, 0)) for name in ('not_sent_closed', 'transmit_queue_discarded', 'not_sent_failed')
        )
        self.assertLessEqual(int(self.status['sent']) + counted, 70)
        self.assertGreater(counted, 0)
        adapter.unplug()


if __name__ == '__main__':
    rospy.init_node('unplug_test')
    rostest.rosrun('canserial', 'unplug', UnplugTest)
