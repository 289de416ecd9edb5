#!/usr/bin/env python3
"""Faults over ROS: the services, the command, /diagnostics, and an adapter that really goes away and comes back."""

import math
import os
import subprocess
import time
import unittest

import can
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray

from canserial.dbc.bus import BusDescription
from sara_sim.srv import Fault

ENCODER, RATES = (BusDescription.default().id_of(name) for name in ('ENCODER_RIGHT', 'IMPACT_GYRO'))


class FaultsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('faults_test')
        cls.port = rospy.get_param('/simulator/port')
        cls.status, cls.truth = [], []
        rospy.Subscriber(
            '/diagnostics', DiagnosticArray, lambda message: cls.status.extend(message.status), tcp_nodelay=True
        )
        rospy.Subscriber('/ground_truth', Odometry, cls.truth.append, tcp_nodelay=True)
        rospy.wait_for_service('/simulator/fault', 30.0)
        cls.fault = rospy.ServiceProxy('/simulator/fault', Fault)
        cls.clear = rospy.ServiceProxy('/simulator/clear_faults', Trigger)

    def setUp(self):
        self.clear()
        self.assertTrue(self.until(lambda: os.path.islink(self.port)), 'no adapter')

    def until(self, condition, timeout=15.0):
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            if condition():
                return True
            time.sleep(0.01)
        return False

    def told(self):
        """The last status, as {key: value}."""
        return {value.key: value.value for value in self.status[-1].values} if self.status else {}

    def was_told(self, key, value, since):
        """Whether a status said so after the first `since`: what lasts for a moment only may be over by now."""
        return any((key, value) in [(v.key, v.value) for v in status.values] for status in self.status[since:])

    def open(self, bitrate=500000):
        return can.Bus(interface='slcan', channel=self.port, bitrate=bitrate, sleep_after_open=0)

    def hears(self, bus, seconds):
        deadline, heard = time.monotonic() + seconds, []
        while time.monotonic() < deadline:
            message = bus.recv(0.05)
            if message:
                heard.append(message.arbitration_id)
        return heard

    def test_what_is_wrong_is_refused_by_name(self):
        # What the test before this one asked for has ended, but the last status may be older than that.
        self.assertTrue(self.until(lambda: self.told().get('faults on command') == 'none'), 'a fault is left')
        answer = self.fault('frames_droped', '')
        self.assertFalse(answer.success)
        self.assertIn('frames_dropped', answer.message)
        for arguments in ('{probability: 3}', '[1, 2]', '{probability: ', '{1: 2}'):
            self.assertFalse(self.fault('frames_dropped', arguments).success)
        self.status.clear()
        self.assertTrue(self.until(lambda: self.status), 'no status')
        self.assertEqual(self.told()['faults on command'], 'none')

    def test_a_fault_is_shown_and_cleared(self):
        self.assertTrue(self.fault('node_silent', '{node: sensor}').success)
        self.assertTrue(self.until(lambda: 'node_silent' in self.told().get('faults on command', '')))
        with self.open() as bus:
            self.hears(bus, 0.3)
            heard = []
            self.assertTrue(self.until(lambda: heard.extend(self.hears(bus, 1.5)) or ENCODER in heard))
            self.assertNotIn(RATES, heard)
            self.assertEqual(self.clear().message, '1 faults ended')
            self.assertTrue(self.until(lambda: RATES in self.hears(bus, 0.3)))
        self.assertTrue(self.until(lambda: self.told().get('faults on command') == 'none'))

    def test_the_command(self):
        run = lambda *words: subprocess.run(
            ['rosrun', 'sara_sim', 'fault', *words], capture_output=True, text=True, timeout=60
        )
        self.assertTrue(self.until(lambda: self.truth), 'no truth')
        before = self.truth[-1].pose.pose.position.x
        done = run('push', 'forward:=0.5', 'duration:=0.5')
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(self.until(lambda: self.truth[-1].pose.pose.position.x > before + 0.1), 'it did not move')
        self.assertNotEqual(run('push', 'forwards:=0.5').returncode, 0)
        self.assertIn('wheel_slip', run('--list').stdout)
        self.assertEqual(run('--clear').returncode, 0)

    def test_unplugged_it_is_gone_and_comes_back(self):
        bus = self.open()
        self.assertTrue(self.until(lambda: self.hears(bus, 1.0)))
        since = len(self.status)
        self.assertTrue(self.fault('adapter_unplugged', '{duration: 6.0}').success)
        self.assertTrue(self.until(lambda: not os.path.lexists(self.port)), 'the link is still there')

        def fails():
            try:
                bus.recv(0.05)
            except (can.CanError, OSError, TypeError):
                return True
            return False

        self.assertTrue(self.until(fails), 'the port still reads')
        try:
            bus.shutdown()
        except (can.CanError, OSError, TypeError):
            bus.serialPortOrig.close()
        self.assertTrue(self.until(lambda: self.was_told('adapter plugged in', 'False', since)))
        self.assertTrue(self.until(lambda: os.path.islink(self.port), 30.0), 'it did not come back')
        with self.open() as again:
            self.assertTrue(self.until(lambda: {ENCODER, RATES} <= set(self.hears(again, 0.5))))

    def test_obstacles_are_shown_where_they_are(self):
        message = rospy.wait_for_message('/simulator/obstacles', MarkerArray, 15.0)
        kinds = [(marker.ns, marker.type) for marker in message.markers]
        self.assertEqual(kinds[0], ('obstacles', Marker.CUBE))
        self.assertIn(('obstacles', Marker.CYLINDER), kinds)
        self.assertEqual(kinds[-1], ('ramps', Marker.CUBE))
        table = message.markers[0]
        self.assertAlmostEqual(table.pose.position.x, 3.0)
        self.assertAlmostEqual(2 * math.degrees(math.atan2(table.pose.orientation.z, table.pose.orientation.w)), 20.0)
        self.assertAlmostEqual(table.scale.x, 1.2)

    def test_the_log_is_written(self):
        log = rospy.get_param('/simulator/log')
        self.assertTrue(self.until(lambda: os.path.exists(log) and os.path.getsize(log) > 0, 30.0))
        with open(log, encoding='ascii') as lines:
            self.assertRegex(lines.readline(), r'^\(\d+\.\d{6}\) can0 [0-9A-F]{3}#[0-9A-F]{16}$')

    def test_a_wrong_bit_rate_hears_nothing_and_is_told(self):
        # What the simulator sends until it has read that the test before this one has closed the channel is heard, too.
        self.assertTrue(self.until(lambda: self.told().get('channel') == 'closed'), 'the channel is open')
        with self.open(250000) as bus:
            self.assertEqual(self.hears(bus, 1.0), [])
            self.assertTrue(self.until(lambda: self.told().get('bit rate agrees') == 'False'))


if __name__ == '__main__':
    import rostest

    rostest.rosrun('sara_sim', 'faults_test', FaultsTest)
