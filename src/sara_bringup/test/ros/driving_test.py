#!/usr/bin/env python3
"""go, patrol, square.py and teleop as a person at a terminal uses them: what they say, what the chair does, how they
end.
"""

import math
import os
import pty
import signal
import subprocess
import termios
import threading
import time
import unittest

import rospy
import rostest
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from sara_common.planar import yaw_of

WRITTEN = (
    '# mine\nplaces:\n  near: [1.6, 1.0, 0.0]   # a short way off\n  '
    'cupboard: [3.0, 3.0, 0.0]\n  far: [5.0, 5.0, '
    '0.0]\n'
)
PATIENCE_S = 60.0  # of wall time, for anything


class DrivingTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.places = rospy.get_param('/places_file')
        with open(cls.places, 'w', encoding='utf-8') as file:
            file.write(WRITTEN)
        cls.truth, cls.drivers, cls.helped = None, [], []
        rospy.Subscriber(
            '/ground_truth', Odometry, lambda message: setattr(cls, 'truth', message), queue_size=1, tcp_nodelay=True
        )
        rospy.Subscriber('/cmd_vel_mux/active', String, lambda message: cls.drivers.append(message.data))
        rospy.Subscriber('/shared_control/status', String, lambda message: cls.helped.append(message.data))
        rospy.wait_for_message('/ground_truth', Odometry)

    def pose(self):
        pose = self.truth.pose.pose
        return pose.position.x, pose.position.y, yaw_of(pose.orientation)

    def speed(self):
        twist = self.truth.twist.twist
        return abs(twist.linear.x) + 0.5 * abs(twist.angular.z)

    def wait(self, condition, what):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            self.assertLess(time.monotonic(), end, f'in vain: {what}')
            time.sleep(0.01)

    def run_it(self, *words, status=0):
        done = subprocess.run(
            ['rosrun', 'sara_bringup', *words], capture_output=True, text=True, timeout=2 * PATIENCE_S, check=False
        )
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout + done.stderr

    def test_1_go_to_a_named_place(self):
        text = self.run_it('go', 'near')
        self.assertIn('reached near (1.60 m, 1.00 m, 0 deg)', text)
        self.assertIn('m away, at (', text)
        self.assertIn(
            'waiting. The chair stands still because the turn sensor does not answer.',
            text,
            'the gyro is being calibrated',
        )
        x, y, yaw = self.pose()
        self.assertLess(math.hypot(x - 1.6, y - 1.0), 0.15)
        self.assertLess(abs(yaw), math.radians(5.0))

    def test_2_lists_unknown_names_and_writing_where_it_is(self):
        self.assertIn('near', self.run_it('go', '--list'))
        self.assertIn('did you mean near?', self.run_it('go', 'neer', status=2))
        self.assertIn('three finite numbers', self.run_it('go', '1', '2', 'x', status=2))
        self.assertIn('added: stand', self.run_it('go', '--here', 'stand'))
        with open(self.places, encoding='utf-8') as file:
            kept, line = file.read().rsplit('\n', 2)[:2]
        self.assertEqual(kept + '\n', WRITTEN)
        x, y, yaw_deg = (float(number) for number in line.split('[')[1].rstrip(']').split(','))
        self.assertLess(math.dist((x, y), self.pose()[:2]), 0.1)
        self.assertLess(abs(yaw_deg - math.degrees(self.pose()[2])), 3.0)

    def test_3_a_patrol_says_what_it_cannot_reach_and_goes_on(self):
        text = self.run_it('patrol', 'cupboard', '1.6,1.0,30', '--pause', '0.5', status=1)
        self.assertIn('did NOT reach cupboard', text)
        self.assertIn('reached (1.60 m, 1.00 m, 30 deg)', text)
        self.assertIn('patrol finished: 1 of 2 stops reached', text)
        self.assertAlmostEqual(math.degrees(self.pose()[2]), 30.0, delta=5.0)
        self.assertIn(
            'patrol stopped: cupboard', self.run_it('patrol', 'cupboard', 'near', '--on-failure', 'stop', status=1)
        )

    def test_4_interrupting_go_stops_the_chair(self):
        process = subprocess.Popen(['rosrun', 'sara_bringup', 'go', 'far'], stdout=subprocess.PIPE, text=True)
        self.wait(lambda: self.speed() > 0.1, 'the chair moves')
        process.send_signal(signal.SIGINT)
        text, _ = process.communicate(timeout=PATIENCE_S)
        self.assertEqual(process.returncode, 130, text)
        self.assertIn('cancelled: the chair stops', text)
        self.wait(lambda: self.speed() < 0.01, 'the chair stands')

    def test_5_interrupting_the_square_stops_the_chair(self):
        process = subprocess.Popen(['rosrun', 'sara_bringup', 'square.py'], stdout=subprocess.PIPE, text=True)
        self.wait(lambda: self.speed() > 0.1, 'the chair moves')
        process.send_signal(signal.SIGINT)
        text, _ = process.communicate(timeout=PATIENCE_S)
        self.assertEqual(process.returncode, 130, text)
        self.assertNotIn('corner 2', text)
        self.wait(lambda: self.speed() < 0.01, 'the chair stands')

    def test_6_teleop(self):
        keyboard, terminal = pty.openpty()
        before = termios.tcgetattr(terminal)
        process = subprocess.Popen(
            ['rosrun', 'sara_bringup', 'teleop', '_turn:=0.5'], stdin=terminal, stdout=terminal, stderr=terminal
        )
        said = []

        def listen():
            while process.poll() is None:
                said.append(os.read(keyboard, 4096))

        threading.Thread(target=listen, daemon=True).start()
        self.wait(lambda: b'turning 0.50 rad/s' in b''.join(said), 'the help is shown')
        self.assertFalse(termios.tcgetattr(terminal)[3] & termios.ECHO, 'keys are not echoed')

        yaw, held = self.pose()[2], time.monotonic() + 2.0

        def hold():
            """A key that is held, as a terminal repeats it."""
            os.write(keyboard, b'j')
            time.sleep(0.03)
            return True

        self.wait(lambda: hold() and time.monotonic() > held and self.pose()[2] > yaw + 0.2, 'it turns')
        self.wait(lambda: self.speed() < 0.01, 'the chair stands when keys cease')
        self.assertGreater(self.pose()[2], yaw + 0.2)
        self.assertIn('keyboard', self.drivers)
        unhelped = [text for text in self.helped if 'does not know' in text]
        self.assertEqual(unhelped, [], 'shared control knows what is around the chair, at rest and while it turns, too')
        self.wait(lambda: self.drivers[-1] == 'nobody', 'the multiplexer is left to others')

        self.wait(lambda: hold() and self.speed() > 0.03, 'it turns again')
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(PATIENCE_S), 0)
        self.wait(lambda: self.speed() < 0.01, 'the end of teleop stops the chair')
        self.assertEqual(termios.tcgetattr(terminal), before, 'the terminal is as it was')
        without = subprocess.run(
            ['rosrun', 'sara_bringup', 'teleop'],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
        self.assertEqual(
            (without.returncode, without.stderr), (2, 'teleop needs a terminal: its standard input is none\n')
        )


if __name__ == '__main__':
    rospy.init_node('driving_test')
    rostest.rosrun('sara_bringup', 'driving', DrivingTest)
