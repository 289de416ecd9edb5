#!/usr/bin/env python3
"""Both scripts start by roslaunch and by rosrun, although one is named like its package; wrong settings end them."""

import os
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path
from socketserver import ThreadingMixIn
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray

sys.path.append(str(Path(__file__).resolve().parent / 'support'))
from pty_adapter import wait_until  # noqa: E402


def publishers(topic):
    state = dict(rosgraph.Master('/start_test').getSystemState()[0])
    return state.get(topic, [])


def wait_for(node, topic):
    return wait_until(lambda: node in publishers(topic))


class SlowMaster(ThreadingMixIn, SimpleXMLRPCServer):
    """The test's own master, which takes a second to register a publisher; `busy` is set meanwhile."""

    daemon_threads = True

    def __init__(self):
        super().__init__(('localhost', 0), logRequests=False, allow_none=True)
        self.busy = threading.Event()
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def uri(self):
        return f'http://localhost:{self.server_address[1]}/'

    def _dispatch(self, method, parameters):
        if method == 'registerPublisher':
            self.busy.set()
            time.sleep(1.0)
        return getattr(ServerProxy(os.environ['ROS_MASTER_URI']), method)(*parameters)


class StartTest(unittest.TestCase):
    def rosrun(self, *arguments, **environment):
        process = subprocess.Popen(
            ['rosrun', 'canserial', *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, **environment},
        )
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        return process

    def test_by_roslaunch(self):
        self.assertTrue(wait_for('/launched_canserial', '/canrx'))
        self.assertTrue(wait_for('/launched_read', '/imu/data'))

    def test_by_rosrun(self):
        processes = [
            self.rosrun('canserial.py', '__name:=run_canserial', '_port:=/dev/no_such_adapter'),
            self.rosrun('read.py', '__name:=run_read', '_calibration_file:=/none/of/it.yaml'),
        ]
        self.assertTrue(wait_for('/run_canserial', '/canrx'))
        self.assertTrue(wait_for('/run_read', '/imu/data'))
        self.assertEqual([process.poll() for process in processes], [None, None])

    def test_a_node_ends_on_a_signal_while_it_registers_its_topics(self):
        master = SlowMaster()
        self.addCleanup(master.shutdown)
        process = self.rosrun('read.py', '__name:=ended_read', '_calibration_file:=/none', ROS_MASTER_URI=master.uri)
        self.addCleanup(process.kill)
        self.assertTrue(master.busy.wait(20.0))
        process.terminate()
        self.assertIsNotNone(process.wait(timeout=20.0))

    def test_a_missing_adapter_is_named_in_the_diagnostics(self):
        statuses = {}

        def note(message):
            statuses.update({status.name: status for status in message.status})

        def is_named():
            status = statuses.get('launched_canserial: CAN adapter')
            return status and status.level == 2 and '/dev/no_such_adapter is missing' in status.message

        rospy.Subscriber('/diagnostics', DiagnosticArray, note)
        self.assertTrue(wait_until(is_named), statuses)

    def test_silence_on_canrx_is_named_in_the_diagnostics(self):
        statuses = {}
        rospy.Subscriber(
            '/diagnostics',
            DiagnosticArray,
            lambda message: statuses.update({status.name: status for status in message.status}),
        )
        self.assertTrue(wait_until(lambda: 'launched_read: frames to readings' in statuses), statuses)
        status = statuses['launched_read: frames to readings']
        self.assertEqual((status.level, status.message), (2, 'waiting for frames on /canrx'))

    def test_wrong_settings_end_the_node_by_name(self):
        for number, (arguments, sentence) in enumerate(
            (
                (('read.py', '_calibration:=guessed'), "calibration is 'guessed', allowed are 'measure' and 'saved'"),
                (('read.py', '_dbc:=/none.dbc'), "dbc: bus description is '/none.dbc', allowed are "),
                (('canserial.py', '_bitrate:=123'), 'bitrate is 123, allowed with slcan are 10000'),
                (
                    ('canserial.py', '_interface:=socketcan', '_port:=can0', '_listen_only:=true'),
                    'listen_only is True, allowed with',
                ),
                (('canserial.py', '_interface:=gs_usb', '_port:=0'), 'cannot be used on this machine'),
            )
        ):
            process = self.rosrun(*arguments, f'__name:=wrong_{number}')
            output, _ = process.communicate(timeout=20.0)
            self.assertIn(sentence, output)
            self.assertEqual(process.returncode, 1)


if __name__ == '__main__':
    rospy.init_node('start_test')
    rostest.rosrun('canserial', 'start', StartTest)
