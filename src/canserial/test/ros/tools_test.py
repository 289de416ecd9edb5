#!/usr/bin/env python3
"""The commands by rosrun: a log to a bag and back is the log; what is left out is named by line; documents and fuzz
tests run.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

# This test is installed beside canserial.py, which must not be taken for the package.
HERE = {os.path.dirname(os.path.realpath(path)) for path in (sys.argv[0], __file__)}
sys.path[:] = [path for path in sys.path if os.path.realpath(path or '.') not in HERE]

import genpy  # noqa: E402
import rosbag  # noqa: E402
import rospy  # noqa: E402
import rostest  # noqa: E402
from std_msgs.msg import UInt8  # noqa: E402

from canserial.dbc.bus import BusDescription  # noqa: E402
from canserial.dbc.busdoc import markdown  # noqa: E402
from canserial.frame import Frame  # noqa: E402
from canserial.msg import CAN  # noqa: E402
from canserial.ros.adapter_node import QUEUE, FramePublisher  # noqa: E402

LOG = """(1612345678.123456) can0 204#0011223344556677
(1612345678.123457) can0 101#
(1612345678.999999) can0 1ABCDEF0#01
(1612345679.000000) can0 001#FF
"""
NO_MASTER = {**os.environ, 'ROS_MASTER_URI': 'http://localhost:1'}


class ToolsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = lambda name: os.path.join(folder.name, name)

    def rosrun(self, *arguments):
        done = subprocess.run(
            ['rosrun', 'canserial', *arguments], capture_output=True, text=True, env=NO_MASTER, timeout=50
        )
        return done.returncode, done.stdout, done.stderr

    def write(self, text):
        with open(self.path('in.log'), 'w') as log:
            log.write(text)

    def read(self, name):
        with open(self.path(name)) as log:
            return log.read()

    def test_there_and_back(self):
        self.write(LOG)
        self.assertEqual(
            self.rosrun('candump2bag', self.path('in.log'), self.path('a.bag'), '--topic', 'bus/canrx')[0], 0
        )
        with rosbag.Bag(self.path('a.bag')) as bag:
            messages = list(bag.read_messages())
        self.assertEqual({m.topic for m in messages}, {'/bus/canrx'})
        self.assertEqual([m.message.timestamp for m in messages], [m.timestamp for m in messages])
        self.assertEqual(messages[0].timestamp, genpy.Time(1612345678, 123456000))
        self.assertEqual(
            [(m.message.stdId, m.message.extId) for m in messages], [(0x204, -1), (0x101, -1), (0, 0x1ABCDEF0), (1, -1)]
        )
        code, out, _ = self.rosrun('bag2candump', self.path('a.bag'), self.path('out.log'), '--topic', 'bus/canrx')
        self.assertEqual((code, out), (0, f'4 frames to {self.path("out.log")}\n'))
        self.assertEqual(self.read('out.log'), LOG)
        self.rosrun(
            'bag2candump', self.path('a.bag'), self.path('slcan.log'), '--topic', '/bus/canrx', '--interface', 'slcan0'
        )
        self.assertEqual(self.read('slcan.log'), LOG.replace('can0', 'slcan0'))

    def test_what_is_left_out_is_said(self):
        self.write(
            '(0.000000) can0 204#01\nrubbish\n\n(1.0) can0 204#R\n(1.0) can0 20000004#0001000000000000\n'
            '(1.0) can0 204##1AABB\n'
            '(2.0) can1 204#02\n(3.0) can0 800#\n(999999999999.0) can0 204#03\n'
        )
        code, out, error = self.rosrun('candump2bag', self.path('in.log'), self.path('a.bag'), '--interface', 'can0')
        self.assertEqual(code, 0)
        self.assertEqual(
            out, f'1 frames to {self.path("a.bag")}; left out: 3 bad, 1 error, 1 fd, 1 other interface, 1 remote\n'
        )
        self.assertIn('line 2: not', error)
        self.assertIn('line 8: no CAN identifier: 800', error)
        self.assertIn('line 9: a stamp after 2106', error)
        self.rosrun('bag2candump', self.path('a.bag'), self.path('out.log'))
        self.assertEqual(self.read('out.log'), '(0.000000) can0 204#01\n')
        code, _, error = self.rosrun('candump2bag', self.path('in.log'), self.path('b.bag'))
        self.assertIn('frames of can0, can1', error)

    def test_wrong_use_is_refused_in_a_sentence_and_leaves_nothing_behind(self):
        with rosbag.Bag(self.path('a.bag'), 'w') as bag:
            bag.write('/canrx', UInt8(1), genpy.Time(1))
            bag.write('/wide', CAN(stdId=1, extId=-1, data=bytes(9)), genpy.Time(1))
        for arguments, sentence in (
            (('candump2bag', '/none.log', self.path('x')), 'cannot read /none.log'),
            (('bag2candump', self.path('a.bag'), self.path('x')), 'is of type std_msgs/UInt8'),
            (('bag2candump', self.path('a.bag'), self.path('x'), '--topic', 'y'), 'has no topic y, but /canrx'),
            (('bag2candump', self.path('a.bag'), self.path('a.bag')), 'exists already'),
        ):
            code, _, error = self.rosrun(*arguments)
            self.assertEqual(code, 1)
            self.assertIn(sentence, error)
            self.assertEqual(os.listdir(os.path.dirname(self.path('x'))), ['a.bag'])
        code, out, _ = self.rosrun('bag2candump', self.path('a.bag'), self.path('x'), '--topic', 'wide')
        self.assertEqual((code, out), (1, f'0 frames to {self.path("x")}; left out: 1 bad\n'))

    def test_documents_by_command(self):
        self.assertEqual(self.rosrun('bus2md', 'sara_tenths')[1], markdown(BusDescription.named('sara_tenths')))

    def test_what_a_stopped_subscriber_loses_is_counted(self):
        rospy.init_node('tools_test')
        listener = subprocess.Popen(['rostopic', 'echo', '-p', '/canrx'], stdout=subprocess.DEVNULL)
        self.addCleanup(listener.wait)
        self.addCleanup(listener.kill)
        publish = FramePublisher()
        end = time.monotonic() + 20.0
        while not publish._publisher.get_num_connections() and time.monotonic() < end:
            time.sleep(0.02)
        for _ in range(QUEUE // 2):
            publish(Frame(1, bytes(8), 1.0))
        self.assertEqual(publish.lost, 0)
        listener.send_signal(signal.SIGSTOP)
        for _ in range(20000):  # the sockets take some megabytes
            publish(Frame(1, bytes(5000), 1.0))
            if publish.lost > 10:
                break
        self.assertGreater(publish.lost, 10)


if __name__ == '__main__':
    rostest.rosrun('canserial', 'tools', ToolsTest)
