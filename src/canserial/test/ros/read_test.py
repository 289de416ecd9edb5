#!/usr/bin/env python3
"""read.py and calibrate_gain over ROS: the services, the file between them, and what is published. Frames come on
canrx.
"""

import math
import os
import subprocess
import sys
import threading
import time
import unittest

# This test is installed beside canserial.py, which must not be taken for the package.
HERE = {os.path.dirname(os.path.realpath(path)) for path in (sys.argv[0], __file__)}
sys.path[:] = [path for path in sys.path if os.path.realpath(path or '.') not in HERE]
sys.path.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), 'support'))

import rospy  # noqa: E402
import rostest  # noqa: E402
import tf2_ros  # noqa: E402
import yaml  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import (  # noqa: E402
    Pose,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3Stamped,
)
from pty_adapter import wait_until  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import BatteryState, Imu  # noqa: E402
from std_msgs.msg import Bool  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from canserial.dbc.bus import BusDescription  # noqa: E402
from canserial.msg import CAN  # noqa: E402
from canserial.ros.conversions import frame_to_msg  # noqa: E402

BUS = BusDescription.default()
OFFSET = (-0.49, -0.91, -0.65)
TOPICS = (
    ('imu/data', Imu),
    ('impact', Bool),
    ('battery', BatteryState),
    ('orientation/complementary', Vector3Stamped),
    ('orientation/madgwick', Vector3Stamped),
    ('saved/imu/data', Imu),
)


class Bus:
    """Plays the chair: turns of 0.2 s of its frames and of the clock. Each turn waits until the reader has said it."""

    def __init__(self):
        self.clock = rospy.Publisher('/clock', Clock, queue_size=10)
        self.set_pose = rospy.Publisher('/set_pose', PoseWithCovarianceStamped, queue_size=10)
        self.canrx = rospy.Publisher('/canrx', CAN, queue_size=1000)
        self.got = {topic: [] for topic, _ in TOPICS}
        for topic, kind in TOPICS:
            rospy.Subscriber(topic, kind, self.got[topic].append, tcp_nodelay=True)
        self.statuses = {}
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.note, tcp_nodelay=True)
        self.time, self.steps, self.count = 1000.0, 0, 0
        self.frozen = False
        rospy.wait_for_service('/reader/calibrate', 30.0)
        assert wait_until(lambda: all(topic.get_num_connections() for topic in (self.canrx, self.clock, self.set_pose)))
        assert wait_until(self.impact_arrives), 'no frame comes through'

    def note(self, message):
        self.statuses.update({status.name: status for status in message.status})

    def send(self, name, **signals):
        self.canrx.publish(frame_to_msg(BUS.encode(name, self.time, **signals)))

    def impact_arrives(self):
        self.tick()
        time.sleep(0.1)
        return bool(self.got['impact'])

    def tick(self, rate=0.0, steps=0):
        """rate: deg/s about z, as the chip measures it. steps: of the left wheel."""
        self.time += 0.2
        self.count += 1
        self.steps += steps
        alive = 0.0 if self.frozen else 0.01 * (self.count % 2)
        self.clock.publish(Clock(rospy.Time.from_sec(self.time)))
        self.send('ENCODER_LEFT', steps=self.steps, time=round(self.time * 1e4))
        self.send('BATTERY', voltage=24.5)
        self.send('RANGE_ACCEL', **dict.fromkeys(BUS.ranges['RANGE_ACCEL'], 1.0), ax=alive, ay=0.0, az=9.81)
        self.send('COMPLEMENTARY', rx=1.0, ry=-2.0, rz=alive)
        self.send('MADGWICK', roll=2.0, pitch=-1.0, yaw=alive)
        self.send('IMPACT_GYRO', alarma=0, gx=OFFSET[0] + alive, gy=OFFSET[1], gz=OFFSET[2] + rate)

    def turn(self, count=1, rate=0.0, steps=0):
        for _ in range(count):
            before = len(self.got['impact'])
            self.tick(rate, steps)
            assert wait_until(lambda before=before: len(self.got['impact']) > before), 'read.py does not answer'

    def turn_until(self, condition, turns=400, **motion):
        """Turns, until the condition holds; whether it does. They go slowly, for others than the reader listen too."""
        for _ in range(turns):
            if condition():
                return True
            self.turn(**motion)
            time.sleep(0.02)
        return condition()

    def call(self, service, **motion):
        """Call a Trigger while the bus goes on."""
        answers = []
        thread = threading.Thread(target=lambda: answers.append(rospy.ServiceProxy(service, Trigger)()))
        thread.start()
        self.turn_until(lambda: not thread.is_alive(), **motion)
        thread.join(20.0)
        return answers[0]


class ReadTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.bus = Bus()
        cls.file = rospy.get_param('~file')

    @classmethod
    def tearDownClass(cls):
        if os.path.exists(cls.file):
            os.unlink(cls.file)

    def setUp(self):
        self.assertTrue(self.bus.turn_until(lambda: self.bus.got['imu/data']), 'not calibrated at start')
        self.bus.turn(7)

    def rosrun(self, *arguments, **pipes):
        process = subprocess.Popen(
            ['rosrun', 'canserial', *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **pipes
        )
        self.addCleanup(lambda: process.stdin and process.stdin.close())
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        return process

    def calibrate(self):
        answer = self.bus.call('/reader/calibrate')
        self.assertTrue(answer.success, answer.message)
        return answer

    def test_what_is_published(self):
        bus = self.bus
        self.assertTrue(bus.turn_until(lambda: all(bus.got[topic] for topic, _ in TOPICS[:5])))
        vector = bus.got['orientation/complementary'][-1].vector
        self.assertAlmostEqual(vector.x, math.radians(1.0))
        self.assertAlmostEqual(vector.y, math.radians(-2.0))
        self.assertAlmostEqual(bus.got['orientation/madgwick'][-1].vector.x, math.radians(2.0))
        battery = bus.got['battery'][-1]
        self.assertAlmostEqual(battery.voltage, 24.5, 5)
        self.assertAlmostEqual(battery.percentage, 0.75, 5)
        self.assertEqual(battery.power_supply_status, BatteryState.POWER_SUPPLY_STATUS_DISCHARGING)
        self.assertTrue(math.isnan(battery.current))

    def test_a_frozen_imu_gives_no_estimate_and_then_a_less_certain_yaw(self):
        bus, imu = self.bus, self.bus.got['imu/data']
        certain = imu[-1].orientation_covariance[8]
        bus.frozen = True
        self.assertTrue(bus.turn_until(lambda: imu[-1].orientation_covariance[0] == -1.0, turns=10))
        self.assertEqual(imu[-1].angular_velocity_covariance[0], -1.0)
        self.assertEqual(imu[-1].linear_acceleration_covariance[0], -1.0)
        bus.frozen = False
        self.assertTrue(bus.turn_until(lambda: imu[-1].orientation_covariance[8] > certain + 0.5, turns=10))
        bus.set_pose.publish(
            PoseWithCovarianceStamped(pose=PoseWithCovariance(pose=Pose(orientation=Quaternion(w=1.0))))
        )
        self.assertTrue(bus.turn_until(lambda: imu[-1].orientation_covariance[8] == certain, turns=50))

    def test_calibrate_saves_while_the_imu_goes_on(self):
        imu = self.bus.got['imu/data']
        count = len(imu)
        answer = self.calibrate()
        self.assertIn(f'saved in {self.file}', answer.message)
        self.assertTrue(wait_until(lambda: len(imu) - count >= 5), 'nothing was published meanwhile')
        with open(self.file, encoding='utf-8') as file:
            content = yaml.safe_load(file)
        for value, right in zip(content['gyro_offset'], OFFSET):
            self.assertAlmostEqual(value, right, delta=0.011)
        self.assertGreaterEqual(content['gyro_frames'], 5)

    def test_calibrate_is_refused_while_the_chair_moves_and_given_up_when_it_sets_off(self):
        bus = self.bus
        for motion, reason in (({'steps': 100}, 'a wheel turns'), ({'rate': 20.0}, 'the gyroscope moves')):
            bus.turn(1, **motion)
            answer = rospy.ServiceProxy('/reader/calibrate', Trigger)()
            self.assertFalse(answer.success)
            self.assertIn(f'the chair moves: {reason}', answer.message)
            bus.turn(7)
        answers = []
        thread = threading.Thread(target=lambda: answers.append(rospy.ServiceProxy('/reader/calibrate', Trigger)()))
        thread.start()
        self.assertTrue(bus.turn_until(lambda: not thread.is_alive(), steps=100))
        self.assertFalse(answers[0].success)
        self.assertIn('wheel', answers[0].message)

    def test_a_saved_calibration_is_there_at_once(self):
        self.calibrate()
        bus = self.bus
        listeners = bus.canrx.get_num_connections()
        process = self.rosrun(
            'read.py', '__ns:=saved', 'canrx:=/canrx', '_calibration:=saved', f'_calibration_file:={self.file}'
        )
        self.assertTrue(wait_until(lambda: bus.canrx.get_num_connections() > listeners))
        self.assertTrue(bus.turn_until(lambda: bus.got['saved/imu/data'], turns=1000))
        self.assertAlmostEqual(bus.got['saved/imu/data'][-1].angular_velocity.z, 0.0, delta=math.radians(0.02))
        self.assertIsNone(process.poll())

    def test_a_bad_file_ends_the_node_with_one_sentence(self):
        bad = self.file + '.bad'
        self.addCleanup(lambda: os.path.exists(bad) and os.unlink(bad))
        for number, (content, arguments, sentence) in enumerate(
            (
                (None, ['_calibration:=saved'], 'there is no calibration file'),
                ('gyro_offset: [0, 0', ['_calibration:=saved'], 'is damaged'),
                ('gyro_offset: [0, 0, 99]', ['_calibration:=saved'], 'is implausible: gyro_offset is (0, 0, 99)'),
                ('gain: 1.1', ['_calibration:=saved'], 'holds no gyro_offset'),
                ('gain: [', [], 'is damaged'),
            )
        ):
            if content is not None:
                with open(bad, 'w', encoding='utf-8') as file:
                    file.write(content)
            process = self.rosrun('read.py', f'__name:=bad_{number}', f'_calibration_file:={bad}', *arguments)
            output, _ = process.communicate(timeout=30.0)
            self.assertIn(sentence, output)
            self.assertEqual(process.returncode, 1)

    def test_the_gain_by_turns_of_known_angle(self):
        bus = self.bus
        listeners = bus.canrx.get_num_connections()
        process = self.rosrun(
            'calibrate_gain',
            '--angles',
            '90',
            '360',
            '--calibration-time',
            '1.0',
            '--node',
            '/reader',
            stdin=subprocess.PIPE,
        )
        said = []

        def listen():
            for character in iter(lambda: process.stdout.read(1), ''):
                said.append(character)

        listener = threading.Thread(target=listen, daemon=True)
        listener.start()
        self.addCleanup(listener.join)
        self.assertTrue(wait_until(lambda: bus.canrx.get_num_connections() > listeners))

        def answer_when(prompt, count=1):
            self.assertTrue(bus.turn_until(lambda: ''.join(said).count(prompt) >= count), ''.join(said))
            process.stdin.write('\n')
            process.stdin.flush()

        for sign in (1.0, -1.0):
            way = 'left' if sign > 0.0 else 'right'
            answer_when(f'from which you will turn {way}, and press Enter: ')
            turned = 0.0
            for angle in (90.0, 360.0):
                self.assertTrue(
                    bus.turn_until(
                        lambda way=way, angle=angle: f'Turn {way} until the chair stands {angle:g} deg' in ''.join(said)
                    )
                )
                rate = sign * (angle - turned) / 1.1 / 4.0
                bus.turn(20, rate=round(rate, 2))
                bus.turn_until(lambda: False, turns=25)  # calibrate_gain, for which no turn waits, hears it meanwhile
                turned = angle
                answer_when(f'Turn {way} until the chair stands {angle:g} deg from zero, and press Enter: ')
        self.assertTrue(bus.turn_until(lambda: process.poll() is not None, turns=1000), ''.join(said))
        listener.join(5.0)
        output = ''.join(said)
        self.assertEqual(process.returncode, 0, output)
        self.assertIn('k = 1.10', output)
        self.assertIn('/reader/reload_gain: the gain is 1.10', output)
        with open(self.file, encoding='utf-8') as file:
            self.assertAlmostEqual(yaml.safe_load(file)['gain'], 1.1, delta=0.002)
        imu = bus.got['imu/data']
        bus.turn(2, rate=10.0)
        self.assertTrue(wait_until(lambda: imu[-1].angular_velocity.z > math.radians(1.0)))
        self.assertAlmostEqual(imu[-1].angular_velocity.z, math.radians(11.0), delta=math.radians(0.1))

    def test_set_pose_of_any_stamp(self):
        """Of now, of no time, of the past and of the future, which is now: the yaw is the pose's; the IMU goes on."""
        bus = self.bus

        def yaw():
            q = bus.got['imu/data'][-1].orientation
            return math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y**2 + q.z**2))

        for number, ago in enumerate((0.0, None, 0.3, -100.0), 1):
            pose = PoseWithCovarianceStamped()
            pose.header.stamp = rospy.Time.from_sec(0.0 if ago is None else bus.time - ago)
            pose.pose.pose.orientation.z, pose.pose.pose.orientation.w = math.sin(0.3 * number), math.cos(0.3 * number)
            bus.set_pose.publish(pose)
            self.assertTrue(
                bus.turn_until(
                    lambda number=number: abs(math.remainder(yaw() - 0.6 * number, math.tau)) < 0.01, turns=50
                ),
                (ago, yaw()),
            )
        nothing = PoseWithCovarianceStamped()
        bus.set_pose.publish(nothing)
        bus.turn(5)
        self.assertAlmostEqual(math.remainder(yaw() - 2.4, math.tau), 0.0, delta=0.01)

    def test_set_pose_in_another_frame_is_turned_into_the_map_or_ignored(self):
        """As the filter does, which hears it too."""
        bus, reader = self.bus, 'reader: frames to readings'

        def pose(frame, yaw, variance=0.1):
            made = PoseWithCovarianceStamped()
            made.header.frame_id = frame
            made.pose.pose.orientation.z, made.pose.pose.orientation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
            made.pose.covariance[0] = variance
            return made

        def off(yaw):
            q = bus.got['imu/data'][-1].orientation
            return abs(math.remainder(2.0 * math.atan2(q.z, q.w) - yaw, math.tau))

        def ignored():
            found = {value.key: value.value for value in bus.statuses[reader].values} if reader in bus.statuses else {}
            return int(found.get('set_pose_implausible', 0))

        tf = tf2_ros.StaticTransformBroadcaster()
        odom = TransformStamped(child_frame_id='odom')
        odom.header.frame_id = 'map'
        odom.transform.rotation = pose('', 0.5).pose.pose.orientation
        tf.sendTransform(odom)
        refused = ignored()
        bus.set_pose.publish(pose('odom', 0.4))

        def turned():
            nonlocal refused
            if ignored() > refused:  # tf may take longer on a busy machine than the second that the reader gives it
                refused = ignored()
                bus.set_pose.publish(pose('odom', 0.4))
            return off(0.9) < 0.01

        self.assertTrue(bus.turn_until(turned, turns=1000))
        bus.turn_until(lambda: False, turns=10)
        before = ignored()
        bus.set_pose.publish(pose('world', 2.0))
        bus.set_pose.publish(pose('map', 2.0, math.nan))
        self.assertTrue(bus.turn_until(lambda: ignored() == before + 2))
        self.assertLess(off(0.9), 0.01)
        bus.set_pose.publish(pose('/map', 0.2))
        self.assertTrue(bus.turn_until(lambda: off(0.2) < 0.01, turns=50))

    def test_the_calibration_at_start_is_saved_if_asked_for_whatever_was_in_the_file(self):
        bus = self.bus
        path = self.file + '.start'
        self.addCleanup(lambda: os.path.exists(path) and os.unlink(path))
        with open(path, 'w', encoding='utf-8') as file:
            file.write('gain: 1.07')
        self.rosrun(
            'read.py',
            '__ns:=starting',
            'canrx:=/canrx',
            '_calibration_time:=1.0',
            '_save_calibration:=true',
            f'_calibration_file:={path}',
        )

        def saved():
            with open(path, encoding='utf-8') as file:
                return yaml.safe_load(file)

        self.assertTrue(bus.turn_until(lambda: 'gyro_offset' in saved(), turns=1000))
        self.assertEqual(saved()['gain'], 1.07, 'the gain was lost')

    def test_who_calibrates_at_once_when_it_has_begun_does_not_end_it(self):
        bus, heard = self.bus, threading.Event()
        reader = self.rosrun('read.py', '__ns:=hasty', 'canrx:=/canrx', '_calibration_time:=1.0')
        begun = rospy.Subscriber('/hasty/imu/data', Imu, lambda _: heard.set())
        self.addCleanup(begun.unregister)
        rospy.wait_for_service('/hasty/read/reload_gain', 30.0)  # calibrated before that, it could not be asked
        self.assertTrue(bus.turn_until(heard.is_set, turns=1000))
        answer = bus.call('/hasty/read/calibrate')
        self.assertTrue(answer.success, answer.message)
        self.assertTrue(any('the gyroscope is calibrated' in line for line in reader.stdout), 'it has ended')

    def test_a_wrong_mode_and_a_silent_frame_are_named_in_the_diagnostics(self):
        bus = self.bus
        bus.send('MODO_PC', modoPC=9)

        def status():
            return bus.statuses.get('reader: frames to readings')

        self.assertTrue(bus.turn_until(lambda: status() and any(v.key == 'mode_implausible' for v in status().values)))
        self.assertTrue(
            bus.turn_until(lambda: f'0x{BUS.id_of("RANGES_1"):X} RANGES_1' in status().message, turns=200), status()
        )


if __name__ == '__main__':
    rospy.init_node('read_test', disable_rostime=True)
    rostest.rosrun('canserial', 'read', ReadTest)
