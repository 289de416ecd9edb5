#!/usr/bin/env python3
"""The simulator seen from outside: an adapter on a pseudo-terminal that python-can opens, /clock and /ground_truth."""

import math
import os
import threading
import time
import unittest

import can
import rospy
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

from canserial.dbc.bus import BusDescription
from sara_common.platforms import chosen

BUS = BusDescription.default()


class SimulatorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('simulator_test')
        cls.port = rospy.get_param('/simulator/port')
        cls.truth, cls.clock = [], []
        rospy.Subscriber('/ground_truth', Odometry, cls.truth.append, tcp_nodelay=True)
        told = lambda message: cls.clock.append((time.monotonic(), message.clock))
        rospy.Subscriber('/clock', Clock, told, tcp_nodelay=True)
        deadline = time.monotonic() + 20.0
        while not (os.path.islink(cls.port) and cls.truth):
            if time.monotonic() > deadline:
                raise RuntimeError('no simulator')
            time.sleep(0.05)

    def setUp(self):
        self.bus = self.open()
        self.heard = []
        self.command = None
        self.alive = True
        self.threads = [threading.Thread(target=self.listen), threading.Thread(target=self.talk)]
        for thread in self.threads:
            thread.start()

    def tearDown(self):
        self.alive = False
        for thread in self.threads:
            thread.join()
        self.bus.shutdown()

    def open(self):
        return can.Bus(interface='slcan', channel=self.port, bitrate=500000, sleep_after_open=0)

    def listen(self):
        while self.alive:
            message = self.bus.recv(0.05)
            if message:
                self.heard.append(message)

    def talk(self):
        while self.alive:
            if self.command is not None:
                frame = BUS.encode(
                    'WHEEL_COMMAND', right=self.command[0], left=self.command[1], mode=ord(self.command[2])
                )
                self.bus.send(can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=False))
            time.sleep(0.01)

    def until(self, condition, timeout=30.0):
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            if condition():
                return True
            time.sleep(0.005)
        return False

    def take_control(self):
        self.command = (0, 0, 'A')
        mode = BUS.encode('MODO_PC', modoPC=3)
        self.assertTrue(
            self.until(lambda: any(m.arbitration_id == mode.id and m.data[0] == 3 for m in self.heard)),
            'control not given',
        )

    def speed(self):
        return self.truth[-1].twist.twist.linear.x

    def test_1_starts_where_it_was_put(self):
        pose = self.truth[0].pose.pose
        self.assertEqual((self.truth[0].header.frame_id, self.truth[0].child_frame_id), ('map', 'base_link'))
        self.assertAlmostEqual(pose.position.x, 1.0, 6)
        self.assertAlmostEqual(pose.position.y, 2.0, 6)
        self.assertAlmostEqual(2 * math.atan2(pose.orientation.z, pose.orientation.w), 0.5, 6)

    def test_2_all_frames_come(self):
        expected = {BUS.id_of(name) for name in BUS.names if name != 'WHEEL_COMMAND'}
        self.assertTrue(self.until(lambda: expected <= {m.arbitration_id for m in self.heard}), 'frames are missing')

    def test_2_scans_come_ten_times_a_second(self):
        scans = []
        subscriber = rospy.Subscriber('/scan', LaserScan, scans.append)
        self.assertTrue(self.until(lambda: len(scans) >= 3), 'no scans')
        subscriber.unregister()
        before, scan = scans[-2:]
        self.assertEqual((len(scan.ranges), scan.header.frame_id), (541, 'scan'))
        self.assertAlmostEqual((scan.header.stamp - before.header.stamp).to_sec(), 0.1, 6)
        self.assertAlmostEqual(scan.angle_min + 540 * scan.angle_increment, scan.angle_max, 5)
        self.assertAlmostEqual(540 * scan.time_increment, 0.075, 5)

    def test_3_moves_on_command_and_stops_in_silence(self):
        self.take_control()
        self.command = (2.0, 2.0, 'C')
        self.assertTrue(self.until(lambda: self.speed() > 0.81 * 2.0 * chosen().wheels.radius), 'it does not move')
        self.command = None
        # How soon is a matter of the unit tests: here the machine may be slow.
        self.assertTrue(self.until(lambda: abs(self.speed()) < 1e-3), 'it does not stop')

    def test_4_clock_runs_at_the_asked_speed(self):
        count = len(self.clock)

        def ratio():
            """From what was heard soonest of the first half: what is heard late makes the rest look fast."""
            heard = [(wall, clock.to_sec()) for wall, clock in self.clock[count:]]
            wall, simulated = max(heard[: len(heard) // 2], key=lambda one: one[1] - 2.0 * one[0])
            return (heard[-1][1] - simulated) / (heard[-1][0] - wall)

        self.assertTrue(self.until(lambda: len(self.clock) >= count + 400), 'no clock')
        # A slow machine may fall behind, none may run ahead.
        self.assertTrue(self.until(lambda: ratio() < 2.2), 'it runs ahead')
        self.assertGreater(ratio(), 0.0)
        stamps = [clock.to_nsec() for _, clock in self.clock]
        steps = [b - a for a, b in zip(stamps, stamps[1:])]  # a busy machine may lose a message on the way
        self.assertGreater(min(steps), 0)
        self.assertEqual({step % 10_000_000 for step in steps}, {0})

    def test_5_garbage_and_reopening(self):
        self.alive = False
        for thread in self.threads:
            thread.join()
        self.bus.shutdown()
        with open(self.port, 'wb', buffering=0) as port:
            port.write(bytes(range(256)) + b'\xff\x00t12\r\r\r')
        time.sleep(0.5)
        self.setUp()
        self.assertTrue(self.until(lambda: len(self.heard) > 20), 'no frames after reopening')
        self.take_control()


if __name__ == '__main__':
    import rostest

    rostest.rosrun('sara_sim', 'simulator_test', SimulatorTest)
