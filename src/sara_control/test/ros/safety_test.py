#!/usr/bin/env python3
"""The wiring of cmd_vel_mux and safety_gate: made-up readings and commands in, commands for the wheels out.

The test is the clock (twice real time, slower where one of the two is late) and the chair: its wheels turn as they are
told.
"""

import math
import threading
import time
import unittest
import warnings

import rosnode
import rospy
import rostest
from actionlib_msgs.msg import GoalID
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, Joy, LaserScan, Range
from std_msgs.msg import Bool, String, UInt8
from std_srvs.srv import Trigger

from canserial.msg import Encoder
from sara_common.platforms import chosen

STEP = 0.01
# Simulated: the clock waits for a gate that was not heard, and for a multiplexer that did not pass a command on, for so
# long; PATIENCE_S of real time at most.
LATE_S = 0.03
PATIENCE_S = 2.0
WHEELS, SONARS = chosen().wheels, chosen().sonars
RANGES = tuple(SONARS)
FRONT_LEFT = max(RANGES, key=lambda name: (SONARS[name].x, SONARS[name].y))
LEFT = max(RANGES, key=lambda name: (SONARS[name].y, SONARS[name].x))
REAR_RIGHT = min(RANGES, key=lambda name: (SONARS[name].x, SONARS[name].y))


class Chair(threading.Thread):
    """10 ms of simulated time every 5 ms. `silent`: what does not speak; `distances`: what the sonars say; `raw`: what
    some of them say before any filter; `walk`: what FRONT_LEFT still has to say so, one every 0.2 s.
    """

    def __init__(self):
        super().__init__(daemon=True)
        self.now = 0.0
        self.running = True
        self.silent = set()
        self.distances = dict.fromkeys(RANGES, math.inf)
        self.raw, self.walk = {}, []
        self.mode = 3
        self.navigation = None
        self.axes = None
        self.angles = [0.0, 0.0]
        self.command = (0.0, 0.0)
        self.out = []
        self.answered = None  # when the gate spoke last
        self.asked = None  # since when a command of the navigation waits for the multiplexer
        publish = {
            'clock': ('/clock', Clock),
            'encoders': ('encoders', Encoder),
            'imu': ('imu/data', Imu),
            'mode': ('mode', UInt8),
            'localization': ('odometry/filtered', Odometry),
            'navigation': ('/cmd_vel/navigation', Twist),
            'impact': ('impact', Bool),
            'joystick': ('joystick', Joy),
        }
        publish['raw'] = 'raw_ranges', Range
        publish.update({name: (f'{name}_range', Range) for name in RANGES})
        # Without queues, whose threads a busy machine may let wait: what was said is on its way before the clock goes
        # on.
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', SyntaxWarning)
            self.topics = {name: rospy.Publisher(topic, kind) for name, (topic, kind) in publish.items()}
        rospy.Subscriber('/diff_drive_controller/cmd_vel', Twist, self.on_command, tcp_nodelay=True)
        rospy.Subscriber('/cmd_vel/mux', Twist, self.on_passed_on, tcp_nodelay=True)

    def on_command(self, message):
        self.out.append((self.now, message.linear.x, message.angular.z))
        self.command = (message.linear.x, message.angular.z)  # who sees it finds it in `out`
        self.answered = self.now

    def on_passed_on(self, _message):
        self.asked = None

    def say(self, name, message):
        if name not in self.silent:
            self.topics[name].publish(message)

    def run(self):
        tick = 0
        due = time.monotonic()
        while self.running:
            tick += 1
            self.now = 50.0 + STEP * tick
            stamp = rospy.Time.from_sec(self.now)
            self.topics['clock'].publish(Clock(stamp))
            v, w = self.command
            turn = 0.5 * WHEELS.separation * w
            for wheel, speed in enumerate((v + turn, v - turn)):
                self.angles[wheel] += speed / WHEELS.radius * STEP
            if tick % 10 == 0:
                self.say('mode', UInt8(self.mode))
                for wheel, angle in enumerate(self.angles):
                    steps = round(angle * WHEELS.steps_per_turn / math.tau) % 2**32
                    message = Encoder(wheel=wheel, steps=steps, time_100us=tick * 100)
                    message.header.stamp = stamp
                    self.say('encoders', message)
                if self.axes is not None:
                    self.say('joystick', Joy(axes=self.axes, buttons=[3]))
            if tick % 20 == 0:
                message = Imu()
                message.header.stamp = stamp
                message.angular_velocity.z = w
                message.angular_velocity_covariance[0] = -1.0 if 'estimate' in self.silent else 0.0
                self.say('imu', message)
                self.say('impact', Bool(False))
                for name in RANGES:
                    message = Range(range=self.distances[name])
                    message.header.stamp = stamp
                    self.say(name, message)
                walk = {FRONT_LEFT: self.walk.pop(0)} if self.walk else {}
                for name, distance in {**self.raw, **walk}.items():
                    message = Range(range=distance)
                    message.header.stamp, message.header.frame_id = stamp, f'{name}_frame'
                    self.say('raw', message)
            if tick % 5 == 0:
                message = Odometry()
                message.header.stamp = stamp
                message.pose.pose.orientation.w = 1.0
                self.say('localization', message)
                if self.navigation is not None:
                    message = Twist()
                    message.linear.x, message.angular.z = self.navigation
                    if self.asked is None and self.axes is None and 'navigation' not in self.silent:
                        self.asked = self.now
                    self.say('navigation', message)
            due = max(due + STEP / 2, time.monotonic())  # what was late is not made up for: the clock never runs faster
            time.sleep(max(0.0, due - time.monotonic()))
            began = time.monotonic()
            while self.is_late():
                time.sleep(0.001)
                if time.monotonic() - began > PATIENCE_S:  # dead, or told not to pass it on, and not late
                    self.give_up_waiting()
            due += time.monotonic() - began

    def is_late(self):
        return any(since is not None and self.now - since > LATE_S for since in (self.answered, self.asked))

    def give_up_waiting(self):
        if self.asked is not None and self.now - self.asked > LATE_S:
            self.asked = math.inf  # until it passes something on
        else:
            self.answered = None


class SafetyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.got = {}
        for topic, kind in (
            ('/safety_gate/status', String),
            ('/safety_gate/give_up', String),
            ('/cmd_vel_mux/active', String),
            ('/move_base/cancel', GoalID),
            ('/safety_gate/waits', Bool),
            ('/diagnostics', DiagnosticArray),
        ):
            rospy.Subscriber(topic, kind, lambda m, t=topic: cls.got.setdefault(t, []).append(m), tcp_nodelay=True)
        cls.stop_button = rospy.Publisher('/emergency_stop', Bool, queue_size=1)
        cls.touch = rospy.Publisher('/cmd_vel/touch', Twist, queue_size=1)
        cls.scan, cls.scans = rospy.Publisher('/scan', LaserScan, queue_size=1), 0
        cls.expected = rospy.Publisher('/safety_gate/expect_people', Bool, queue_size=1)
        cls.chair = Chair()
        rospy.wait_for_service('/emergency_stop/reset')
        cls.reset = rospy.ServiceProxy('/emergency_stop/reset', Trigger)
        end = time.monotonic() + 20.0
        topics = [cls.stop_button, cls.scan, cls.expected, cls.touch, *cls.chair.topics.values()]
        while not all(topic.get_num_connections() for topic in topics):
            assert time.monotonic() < end, 'nobody listens to ' + ', '.join(
                t.name for t in topics if not t.get_num_connections()
            )
            time.sleep(0.01)
        cls.chair.start()

    @classmethod
    def tearDownClass(cls):
        cls.chair.running = False
        cls.chair.join()

    def setUp(self):
        """All is well, nobody commands, the chair stands."""
        chair = self.chair
        chair.silent, chair.distances, chair.mode = set(), dict.fromkeys(RANGES, math.inf), 3
        chair.raw, chair.walk = {}, []
        chair.navigation = chair.axes = None
        self.expected.publish(Bool(False))
        self.until(
            lambda: self.status() == 'The chair is ready.' and chair.command == (0.0, 0.0), 'the chair is not ready'
        )
        self.wait(0.6)

    def wait(self, seconds):
        """Simulated seconds."""
        end = self.chair.now + seconds
        while self.chair.now < end:
            time.sleep(0.005)

    def until(self, condition, what, seconds=20.0):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, f'{what}; status: {self.status()}, command: {self.chair.command}')
            time.sleep(0.01)

    def says(self, words):
        """The status comes by a connection of its own, and may be later than the command."""
        self.until(lambda: words in self.status(), f'it does not say {words}')

    def status(self):
        return self.got['/safety_gate/status'][-1].data if '/safety_gate/status' in self.got else None

    def drivers(self):
        return [message.data for message in self.got.get('/cmd_vel_mux/active', [])]

    def driver(self):
        return self.drivers()[-1] if self.drivers() else None

    def drive(self):
        self.chair.navigation = (0.4, 0.1)
        self.until(lambda: abs(self.chair.command[0] - 0.4) < 1e-6, 'the command does not come through')
        self.assertAlmostEqual(self.chair.command[1], 0.1, delta=1e-6)
        self.until(lambda: self.driver() == 'navigation', 'it is not told who drives')

    def stands_although_commanded(self, seconds=2.0):
        since = self.chair.now
        self.wait(seconds)
        self.assertEqual([out for out in self.chair.out if out[0] > since and (out[1] or out[2])], [])

    def test_drives_gently(self):
        start = len(self.chair.out)
        self.drive()
        speeds = [out[1] for out in self.chair.out[start:]]
        self.assertLess(max(b - a for a, b in zip(speeds, speeds[1:])), 0.4 * 0.1 + 1e-9)
        self.assertGreater(len(speeds), 30, 'no ramp')

    def test_emergency_stop_is_latched(self):
        self.drive()
        given_up = len(self.got.get('/safety_gate/give_up', []))
        self.stop_button.publish(True)
        self.until(lambda: self.chair.command == (0.0, 0.0), 'it does not stop')
        self.says('emergency stop')
        self.until(lambda: len(self.got.get('/safety_gate/give_up', [])) > given_up, 'the goal is not given up')
        self.assertFalse(self.reset().success, 'released although the button is pressed')
        self.stop_button.publish(False)
        self.wait(0.3)
        self.assertFalse(self.reset().success, 'released although navigation commands')
        self.stands_although_commanded()
        self.chair.navigation = None
        self.until(lambda: self.reset().success, 'not released although nobody commands')
        self.until(lambda: self.status() == 'The chair is ready.', 'not ready after the release')
        self.drive()

    def test_silence_of_each_sensor_stops_the_chair(self):
        for name, word in (
            ('encoders', 'wheel sensors'),
            ('imu', 'turn sensor does not answer'),
            ('estimate', 'turn sensor always says the same'),
            (REAR_RIGHT, 'obstacle sensor'),
            ('localization', 'does not know where'),
        ):
            self.drive()
            self.chair.silent = {name}
            self.until(lambda: self.chair.command == (0.0, 0.0), f'it drives without {name}')
            self.says(word)
            self.chair.silent = set()
            self.stands_although_commanded()
            self.says('waits for a new command')
            self.chair.navigation = None
            self.until(lambda: self.status() == 'The chair is ready.', f'not ready after {name} came back')
            self.wait(0.6)

    def test_impact(self):
        self.drive()
        self.chair.topics['impact'].publish(Bool(True))
        self.until(lambda: self.chair.command == (0.0, 0.0), 'it does not stop')
        self.stands_although_commanded()

    def test_navigation_dies(self):
        self.drive()
        self.chair.silent = {'navigation'}
        self.until(lambda: self.chair.command == (0.0, 0.0), 'it goes on')
        self.until(lambda: self.driver() == 'nobody', 'navigation still drives')

    def test_obstacle_slows_and_blocks(self):
        self.drive()
        self.chair.distances[FRONT_LEFT] = 0.5
        self.until(lambda: 0.05 < self.chair.command[0] < 0.3, 'it does not slow down')
        self.says('in front')
        self.chair.distances[FRONT_LEFT] = -math.inf
        self.until(lambda: self.chair.command == (0.0, 0.0), 'it does not stop')
        self.until(lambda: 'does not go that way' in self.status(), 'no reason')
        self.chair.navigation = (-0.2, 0.0)
        self.until(lambda: self.chair.command[0] < -0.15, 'it may go back')

    def test_scanner_stops_it_where_the_sonars_hear_nothing_and_lets_it_go_when_silent(self):
        def scan(distance):
            message = LaserScan(angle_min=-1.0, angle_max=1.0, angle_increment=0.1, range_min=0.05, range_max=10.0)
            message.header.stamp = rospy.Time.from_sec(self.chair.now)
            self.scans += 1
            message.ranges = [math.inf] * 9 + [distance + 1e-4 * self.scans] * 3 + [math.inf] * 9
            self.scan.publish(message)
            time.sleep(0.02)

        self.chair.navigation = (0.4, 0.0)

        def stands():
            scan(0.12)
            return self.chair.command == (0.0, 0.0) and 'in front' in self.status()

        self.until(stands, 'what the scanner sees does not stop it')
        self.until(lambda: self.chair.command[0] > 0.3, 'without scans it stands')

    def test_people_who_are_expected_make_it_creep_until_they_are_not(self):
        self.chair.raw = {LEFT: 0.45}  # something that would hide them
        self.wait(0.5)
        self.drive()
        self.expected.publish(Bool(True))
        self.until(
            lambda: self.status() == 'The chair goes slowly because people are expected.',
            'it does not say why it is slow',
        )
        self.wait(3.0)
        self.assertGreater(self.chair.command[0], 0.02)
        self.assertLess(self.chair.command[0], 0.07)
        self.expected.publish(Bool(False))
        self.until(lambda: self.chair.command[0] > 0.35, 'it goes on slowly')

    def test_who_walks_up_is_heard_in_raw_readings_before_the_median_tells(self):
        self.drive()
        # 0.7 m/s and what the chair drives; the median hears nothing
        self.chair.walk = [2.0 - 0.22 * reading for reading in range(8)]
        self.until(lambda: not self.chair.walk, 'not all is said')
        self.until(lambda: self.chair.command[0] < 0.2, 'it drives on towards somebody')
        self.says('in front')
        self.until(lambda: self.got.get('/safety_gate/waits'), 'it does not say that it waits')
        # They have gone, and are remembered: beside something that would hide them it creeps, and says why.
        self.chair.raw = {FRONT_LEFT: math.inf, LEFT: 0.45}
        self.until(
            lambda: self.status() == 'The chair goes slowly because people are nearby.',
            'it does not say why it is slow',
        )
        self.wait(3.0)
        self.assertGreater(self.chair.command[0], 0.02)
        self.assertLess(self.chair.command[0], 0.07)
        self.chair.raw = {FRONT_LEFT: math.inf, LEFT: math.inf}  # past it, where all is heard
        self.until(lambda: self.chair.command[0] > 0.35, 'it goes on slowly')

    def test_the_user_wins(self):
        self.drive()
        self.chair.axes = [0.0, 0.0]
        cancels = len(self.got.get('/move_base/cancel', []))
        self.chair.axes = [0.0, -0.5]
        self.until(lambda: self.chair.command[0] < -0.1, 'the joystick is not obeyed')
        self.until(lambda: self.driver() == 'joystick', 'it is not told who drives')
        self.until(lambda: len(self.got.get('/move_base/cancel', [])) > cancels, 'the goal is not given up')
        self.chair.axes = [0.0, 0.0]
        self.until(lambda: self.chair.command == (0.0, 0.0) and self.driver() == 'nobody', 'it goes on')
        self.stands_although_commanded()

    def test_a_joystick_that_does_not_fit_is_told(self):
        self.chair.axes = [0.5]
        self.until(
            lambda: any(
                pair.key.startswith('joystick without its axes')
                for array in self.got.get('/diagnostics', [])
                for status in array.status
                for pair in status.values
            ),
            'not in /diagnostics',
        )
        self.chair.axes = [0.0, 0.0]

    def test_the_chairs_own_joystick(self):
        self.drive()
        self.chair.mode = 1
        self.until(
            lambda: self.chair.command == (0.0, 0.0) and self.driver() == 'the joystick of the chair', 'it goes on'
        )
        self.chair.mode = 3
        self.stands_although_commanded()

    def test_touch_before_navigation_and_nan(self):
        self.drive()
        message = Twist()
        message.linear.x = math.nan
        self.touch.publish(message)
        self.wait(0.5)
        self.assertEqual(self.driver(), 'navigation')
        self.until(
            lambda: any(
                pair.key == 'not finite from touch' and int(pair.value) >= 1
                for array in self.got.get('/diagnostics', [])
                for status in array.status
                for pair in status.values
            ),
            'not in /diagnostics',
        )
        message.linear.x, before = 0.1, len(self.drivers())
        self.touch.publish(message)  # once: it drives for 0.5 s
        self.until(lambda: 'touch' in self.drivers()[before:], 'the touch screen is not heard')

    def test_z_the_last_word_is_stop(self):
        self.drive()
        rosnode.kill_nodes(['/safety_gate'])
        self.until(lambda: self.chair.command == (0.0, 0.0), 'no stop when the gate is killed')
        last = len(self.chair.out)
        self.wait(0.5)
        self.assertEqual(len(self.chair.out), last, 'something came after the stop')


if __name__ == '__main__':
    rospy.init_node('safety_test', disable_rostime=True)
    rostest.rosrun('sara_control', 'safety', SafetyTest)
