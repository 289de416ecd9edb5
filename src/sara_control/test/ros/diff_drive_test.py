#!/usr/bin/env python3
"""The wiring of diff_drive_controller: made-up encoders and commands in; odometry, TF, joints and command frames out.

The test is the clock (twice real time) and the chair: its wheels turn as the command frames say.
"""

import math
import threading
import time
import unittest
import warnings

import rosnode
import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import UInt8
from tf2_msgs.msg import TFMessage

from canserial.dbc.bus import BusDescription
from canserial.msg import CAN, Encoder
from canserial.ros.conversions import msg_to_frame
from sara_common.platforms import chosen

STEP = 0.01
LATE = 0.035  # s since the last frame, which come at 50 Hz
WHEELS = chosen().wheels
START = 2**32 - 500  # encoder counters about to wrap


class Chair(threading.Thread):
    """10 ms of simulated time every 5 ms. While `frames_come` its clock waits for a frame that is late, a second at
    most, for the machine may hold the node up. `command`: (v, w) for the node, None for none; `measured`: when the
    encoders spoke last.
    """

    def __init__(self):
        super().__init__(daemon=True)
        self.now = 0.0
        self.running = self.encoders_on = self.frames_come = True
        self.command, self.measured = None, 0.0
        self.mode = 1
        self.wheels = [0.0, 0.0]  # left, right, rad
        self.speeds = (0.0, 0.0)
        self.frames = []
        self.bus = BusDescription.default()
        # Without queues, whose threads a busy machine may let wait: what was said is on its way before the clock goes
        # on.
        with warnings.catch_warnings():
            warnings.simplefilter('ignore', SyntaxWarning)
            self.clock = rospy.Publisher('/clock', Clock)
            self.encoders = rospy.Publisher('encoders', Encoder)
            self.mode_topic = rospy.Publisher('mode', UInt8)
            self.cmd_vel = rospy.Publisher('/diff_drive_controller/cmd_vel', Twist)
        rospy.Subscriber('cantx', CAN, self.on_frame, tcp_nodelay=True)

    def on_frame(self, message):
        name, values = self.bus.decode(msg_to_frame(message))
        self.frames.append((self.now, name, values))
        if values['mode'] == ord('A') and self.mode == 1:
            self.mode = 3  # consent
        self.speeds = (values['left'], values['right'])

    def run(self):
        tick = 0
        due = time.monotonic()
        while self.running:
            tick += 1
            self.now = 50.0 + STEP * tick
            stamp = rospy.Time.from_sec(self.now)
            self.clock.publish(Clock(stamp))
            self.wheels = [angle + speed * STEP for angle, speed in zip(self.wheels, self.speeds)]
            if tick % 10 == 0:
                self.mode_topic.publish(self.mode)
                if self.command is not None:
                    self.cmd_vel.publish(twist(*self.command))
                speaks = self.encoders_on
                self.measured = self.now if speaks else self.measured
                for wheel, angle in ((Encoder.RIGHT, self.wheels[1]), (Encoder.LEFT, self.wheels[0])):
                    message = Encoder(
                        wheel=wheel,
                        steps=(START + round(angle * WHEELS.steps_per_turn / math.tau)) % 2**32,
                        time_100us=tick * 100,
                    )
                    message.header.stamp = stamp
                    if speaks:
                        self.encoders.publish(message)
            due = max(due + STEP / 2, time.monotonic())  # what was late is not made up for: the clock never runs faster
            time.sleep(max(0.0, due - time.monotonic()))
            late = time.monotonic() + 1.0
            while self.frames_come and self.frames and self.now - self.frames[-1][0] > LATE:
                if time.monotonic() > late:
                    break
                time.sleep(0.001)


class DiffDriveTest(unittest.TestCase):
    def wait(self, seconds):
        """Simulated seconds."""
        end = self.chair.now + seconds
        while self.chair.now < end:
            time.sleep(0.005)

    def until(self, condition, what, seconds=20.0):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.01)

    def moving(self, since):
        return [t for t, _, values in self.chair.frames if t >= since and (values['left'] or values['right'])]

    def test_the_way_of_a_command(self):
        got = {}
        for topic, kind in (
            ('/diff_drive_controller/odom', Odometry),
            ('/tf', TFMessage),
            ('/joint_states', JointState),
            ('/joint_commands', JointState),
        ):
            rospy.Subscriber(topic, kind, lambda m, t=topic: got.setdefault(t, []).append(m), tcp_nodelay=True)
        self.chair = chair = Chair()
        self.until(chair.cmd_vel.get_num_connections, 'nobody takes cmd_vel')
        time.sleep(1.0)
        self.assertEqual(chair.frames, [], 'commands before there was a time')
        chair.start()

        self.until(lambda: '/diff_drive_controller/odom' in got and '/tf' in got, 'no odometry')
        self.until(lambda: chair.mode == 3, 'nobody asked for control')
        self.assertEqual(self.moving(0.0), [])
        self.wait(0.3)

        chair.command = 0.3, 0.2
        self.wait(4.0)
        odometry = got['/diff_drive_controller/odom'][-1]
        chair.command = None
        self.assertAlmostEqual(odometry.twist.twist.linear.x, 0.3, delta=0.012)
        self.assertAlmostEqual(odometry.twist.twist.angular.z, 0.2, delta=0.05)
        self.assertEqual((odometry.header.frame_id, odometry.child_frame_id), ('odom', 'base_link'))
        self.assertGreater(odometry.pose.pose.position.x, 0.7)
        self.assertLess(odometry.pose.pose.position.x, 1.3)
        self.assertEqual(len(got['/joint_states'][-1].name), 2)

        self.wait(0.1)
        stopped_asking = chair.now
        self.wait(2.0)
        late = max(self.moving(stopped_asking), default=stopped_asking) - stopped_asking
        self.assertLess(late, 0.65, 'the wheels turned after the timeout')
        now = chair.now
        rate = sum(now - 1.0 < t <= now for t, *_ in chair.frames)
        self.assertAlmostEqual(rate, 50, delta=5)

        last = got['/diff_drive_controller/odom'][-1]
        turned = (chair.wheels[1] - chair.wheels[0]) * WHEELS.radius / WHEELS.separation
        yaw = 2.0 * math.atan2(last.pose.pose.orientation.z, last.pose.pose.orientation.w)
        self.assertAlmostEqual(yaw, turned, delta=0.002)

        def of_last():  # /tf comes by a connection of its own
            return [t for m in list(got['/tf']) for t in m.transforms if t.header.stamp == last.header.stamp]

        self.until(of_last, 'the newest odometry has no transform')
        transform = of_last()[0]
        self.assertEqual((transform.header.frame_id, transform.child_frame_id), ('odom', 'base_link'))
        self.assertEqual(transform.transform.translation.x, last.pose.pose.position.x)

        chair.command = 0.2, 0.0
        self.wait(1.0)
        chair.cmd_vel.publish(twist(math.nan, 0.0))
        chair.encoders_on = False
        self.wait(2.0)
        chair.command, silent = None, chair.measured
        self.assertGreater(max(self.moving(silent)), silent)
        self.assertLess(max(self.moving(silent)), silent + 0.7, 'the wheels turned without encoders')
        chair.encoders_on = True
        self.wait(0.5)
        again, chair.command = chair.now, (0.2, 0.0)
        self.wait(0.5)
        chair.command = None
        self.assertTrue(self.moving(again), 'the wheels stay still although all is well again')

        chair.frames_come = False
        rosnode.kill_nodes(['/diff_drive_controller'])
        stop = (0.0, 0.0, ord('A'))

        def word(frame):
            return tuple(frame[2][name] for name in ('left', 'right', 'mode'))

        self.until(lambda: word(chair.frames[-1]) == stop, 'no stop on the bus when the node is killed')
        self.wait(1.0)
        self.assertEqual(word(chair.frames[-1]), stop, 'something came after the stop')
        self.assertGreater(chair.now - chair.frames[-1][0], 0.5, 'the node still sends')
        chair.running = False
        chair.join()


def twist(v, w):
    message = Twist()
    message.linear.x, message.angular.z = v, w
    return message


if __name__ == '__main__':
    rospy.init_node('diff_drive_test', disable_rostime=True)
    rostest.rosrun('sara_control', 'diff_drive', DiffDriveTest)
