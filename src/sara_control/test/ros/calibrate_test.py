#!/usr/bin/env python3
"""The way of a calibration: the launch file drives and records, the command reads the bag and tells what the robot
really is.

The robot turns less than its wheels say and one wheel is larger; the test is its floor, its gyroscope and its clock.
"""

import math
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import rospy
import rostest
import yaml
from actionlib_msgs.msg import GoalID
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from sara_common.platforms import chosen
from sara_common.ros.node import start_node

STEP = 0.01
WHEELS = chosen().wheels
SEPARATION = WHEELS.separation * 1.28
LEFT, RIGHT = WHEELS.radius * 0.9925, WHEELS.radius * 1.0075
BIAS = 0.002  # rad/s


class Floor(threading.Thread):
    """10 ms of simulated time every 5 ms, as long as the controller keeps up; a gyroscope at 20 Hz."""

    def __init__(self):
        super().__init__(daemon=True)
        self.now, self.running, self.heard, self.angles, self.yaw = 10.0, True, 0.0, None, 0.0
        self.clock = rospy.Publisher('/clock', Clock, queue_size=10)
        self.imu = rospy.Publisher('/imu/data', Imu, queue_size=10)
        self.sampled = 0.0, 0.0
        rospy.Subscriber('/joint_states', JointState, self.on_joints, tcp_nodelay=True)

    def on_joints(self, message):
        before, self.angles = self.angles, message.position
        if before is not None:
            self.yaw += (RIGHT * (self.angles[1] - before[1]) - LEFT * (self.angles[0] - before[0])) / SEPARATION
        self.heard = message.header.stamp.to_sec()

    def run(self):
        tick = 0
        while self.running:
            tick += 1
            self.now += STEP
            self.clock.publish(Clock(rospy.Time.from_sec(self.now)))
            time.sleep(STEP / 2)
            late = time.monotonic() + 2.0
            while self.running and self.heard < self.now - 0.05 and time.monotonic() < late:
                time.sleep(0.001)
            stamp, yaw = self.heard, self.yaw
            # One from before the clock was set back, by the test before, would silence the gyroscope until then.
            if tick % 5 == 0 and self.sampled[0] < stamp < self.now + STEP:
                message = Imu()
                message.header.stamp = rospy.Time.from_sec(stamp)
                message.header.frame_id = 'base_link'
                message.angular_velocity.z = (yaw - self.sampled[1]) / (stamp - self.sampled[0]) + BIAS
                self.sampled = stamp, yaw
                self.imu.publish(message)


class CalibrateTest(unittest.TestCase):
    def test_drive_record_and_calibrate(self):
        folder = Path(tempfile.mkdtemp())
        bag, result = folder / 'drive.bag', folder / 'result.yaml'
        for name, value in {'speed': 0.8, 'turn_rate': 1.5, 'acceleration': 1.0, 'turn_acceleration': 2.0}.items():
            rospy.set_param(f'/calibration_drive/{name}', value)
        floor = Floor()
        floor.start()
        drive = subprocess.run(
            [
                'roslaunch',
                'sara_control',
                'calibration_drive.launch',
                'cmd_vel:=/diff_drive_controller/cmd_vel',
                f'bag:={bag}',
                'side:=0.8',
                'turns:=1',
            ],
            capture_output=True,
            text=True,
            timeout=200,
        )
        floor.running = False
        self.assertIn('the drive is over', drive.stdout + drive.stderr)
        self.assertTrue(bag.exists(), drive.stdout + drive.stderr)
        run = subprocess.run(
            [
                'rosrun',
                'sara_control',
                'calibrate_odometry',
                str(bag),
                '--output',
                str(result),
                '--params',
                self.params(folder),
            ],
            capture_output=True,
            text=True,
        )
        self.assertEqual(run.returncode, 0, run.stderr)
        values = yaml.safe_load(result.read_text())
        for name, true in (
            ('wheel_separation_multiplier', 1.28),
            ('left_wheel_radius_multiplier', 0.9925),
            ('right_wheel_radius_multiplier', 1.0075),
        ):
            self.assertTrue(math.isclose(values[name], true, rel_tol=0.01), f'{name}: {values[name]}\n{run.stdout}')
            self.assertIn(f'{name}: {values[name]:.6f}  # +- ', run.stdout)
        squares = [line for line in run.stdout.splitlines() if ' m, ' in line and float(line.split()[2]) > 2.0]
        self.assertEqual(len(squares), 2, run.stdout)
        for line in squares:
            before, after = (float(part.split(' m, ')[0].split()[-1]) for part in line.split(' -> '))
            self.assertGreater(before, 10.0 * after, line)

    def test_a_drive_that_somebody_interrupts_does_not_go_on(self):
        floor, cancel = Floor(), rospy.Publisher('/move_base/cancel', GoalID, queue_size=1, latch=True)
        self.addCleanup(cancel.unregister)
        floor.start()
        drive = subprocess.Popen(
            ['roslaunch', 'sara_control', 'calibration_drive.launch', 'cmd_vel:=/diff_drive_controller/cmd_vel']
            + [f'bag:={Path(tempfile.mkdtemp()) / "drive.bag"}'],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        said = []
        for line in drive.stdout:
            said.append(line)
            if 'move 2 of' in line:
                cancel.publish(GoalID())
        drive.wait(timeout=60)
        floor.running = False
        self.assertIn('was interrupted (somebody else drives)', ''.join(said))
        self.assertNotIn('the drive is over', ''.join(said))

    def params(self, folder):
        """The controller's own, as somebody would save them."""
        path = folder / 'params.yaml'
        path.write_text(yaml.safe_dump(rospy.get_param('/diff_drive_controller')))
        return str(path)

    def test_what_cannot_be_calibrated_is_said(self):
        folder = Path(tempfile.mkdtemp())
        (folder / 'nothing.bag').write_text('this is no bag')
        for words, sentence in (
            (['no_such.bag'], 'cannot be read'),
            ([str(folder / 'nothing.bag')], 'cannot be read'),
            (['x.bag', '--params', 'no_such.yaml'], 'no_such.yaml'),
        ):
            run = subprocess.run(
                ['rosrun', 'sara_control', 'calibrate_odometry', *words], capture_output=True, text=True
            )
            self.assertEqual(run.returncode, 1)
            self.assertRegex(run.stderr, sentence)
            self.assertNotIn('Traceback', run.stderr)


if __name__ == '__main__':
    start_node('calibrate_test', disable_rostime=True)
    rostest.rosrun('sara_control', 'calibrate', CalibrateTest)
