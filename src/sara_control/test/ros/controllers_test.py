#!/usr/bin/env python3
"""What users of the C++ diff_drive_controller rely on, on robots that are not SARA: each controller a process of its
own.

The test is the clock. It waits for the controllers: how fast the machine is does not matter.
"""

import math
import os
import socketserver
import subprocess
import threading
import time
import unittest
from pathlib import Path
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

import rosgraph
import rospkg
import rospy
import rostest
from dynamic_reconfigure.msg import Config, DoubleParameter
from dynamic_reconfigure.srv import Reconfigure
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage

from sara_common.ros.node import start_node
from sara_control.msg import JointTrajectoryControllerState

PACKAGE = Path(rospkg.RosPack().get_path('sara_control'))
STEP = 0.01
# s by which a controller may be behind the clock. `limited` makes up for no more than 5 / 150 s between two cycles.
BEHIND = {**dict.fromkeys(('plain', 'options', 'readme'), 0.05), 'limited': 2.5 * STEP}
URDF = (
    '<robot name="bot"><link name="base"/>'
    + ''.join(
        f'<link name="{side}"><collision><geometry>{{shape}}</geometry></collision></link>'
        f'<joint name="{side}_wheel" type="continuous">'
        f'<parent link="base"/><child link="{side}"/><origin xyz="0 {y} 0"/></joint>'
        for side, y in (('left', 0.2), ('right', -0.2))
    )
    + '</robot>'
)
SPHERE = URDF.format(shape='<sphere radius="0.11"/>')
BOX = URDF.format(shape='<box size="0.2 0.2 0.2"/>')
DIAGONALS = {
    'pose_covariance_diagonal': [0.001, 0.001, 1e6, 1e6, 1e6, 0.03],
    'twist_covariance_diagonal': [0.001, 0.001, 1e6, 1e6, 1e6, 0.03],
}
ONE_EACH = {'left_wheel': 'left_wheel', 'right_wheel': 'right_wheel'}
THREE_EACH = {
    f'{side}_wheel': [f'{place}{side}_wheel' for place in ('', 'front_', 'rear_')] for side in ('left', 'right')
}
SIZE = {'wheel_separation': 0.4, 'wheel_radius': 0.11}
BOT = {'base': 'diffbot:Diffbot', **DIAGONALS}
HAS_LIMITS = {f'has_{kind}_limits': True for kind in ('velocity', 'acceleration', 'jerk')}
CONTROLLERS = {
    'plain': ({**BOT, **ONE_EACH, 'first_position': 1000.0}, SPHERE),
    'options': (
        {
            **BOT,
            **THREE_EACH,
            **SIZE,
            'publish_cmd': True,
            'publish_wheel_joint_controller_state': True,
            'odom_frame_id': 'new_odom',
            'base_frame_id': 'bot',
            'allow_multiple_cmd_vel_publishers': False,
            'publish_rate': 20.0,
            'linear': {
                'x': {
                    'has_acceleration_limits': True,
                    'max_acceleration': 0.5,
                    'has_velocity_limits': True,
                    'max_velocity': 0.6,
                }
            },
        },
        None,
    ),
    # 150 cycles a second of a clock that goes on 100 times a second: every third cycle comes at the time of the second.
    'limited': (
        {
            **BOT,
            **ONE_EACH,
            **SIZE,
            'command_rate': 150.0,
            'velocity_rolling_window_size': 1,
            'odom_frame_id': 'limited_odom',
            'base_frame_id': 'limited_base',
            'linear': {'x': {'max_velocity': 1.0, 'max_acceleration': 1.0, 'max_jerk': 5.0, **HAS_LIMITS}},
            'angular': {'z': {'max_velocity': 2.0, 'max_acceleration': 2.0, 'max_jerk': 1e3, **HAS_LIMITS}},
        },
        None,
    ),
    'readme': (
        {
            **DIAGONALS,
            **ONE_EACH,
            **SIZE,
            'base': 'my_robot:MyRobot',
            'enable_odom_tf': False,
            'wheel_radius_multiplier': 1.6,
            'odom_frame_id': 'quiet_odom',
            'base_frame_id': 'quiet_base',
            'ticks_per_turn': 10000,
        },
        None,
    ),
}
REFUSED = {
    'wrong_joint': ({**BOT, **SIZE, 'left_wheel': 'this_wheel', 'right_wheel': 'right_wheel'}, None, 'this_wheel'),
    'bad_urdf': ({**BOT, **ONE_EACH}, '<robot', 'robot_description is not XML'),
    'no_radius_in_urdf': ({**BOT, **ONE_EACH}, BOX, 'wheel_radius is missing.*neither cylinder nor sphere'),
    'bad_radius': ({**BOT, **ONE_EACH, **SIZE, 'wheel_radius': -0.1}, None, 'wheel_radius is -0.1'),
    'no_wheels': ({**BOT, **SIZE, 'left_wheel': [], 'right_wheel': []}, None, r'left_wheel is \[\]'),
    'no_such_base': (
        {**BOT, **ONE_EACH, **SIZE, 'base': 'nobody:Nothing'},
        None,
        "base is 'nobody:Nothing'.*cannot be loaded",
    ),
}


class Clockwork(threading.Thread):
    """10 ms of simulated time every 5 ms, as long as the controllers keep up; `commands`: {topic: Twist} go out 20
    times a second.
    """

    def __init__(self, controllers):
        super().__init__(daemon=True)
        self.now, self.running = 10.0, True
        self.heard = dict.fromkeys(controllers, 0.0)
        self.commands, self.asked = {}, {}
        self.clock = rospy.Publisher('/clock', Clock, queue_size=10)
        self.publishers = {name: rospy.Publisher(f'/{name}/cmd_vel', Twist, queue_size=10) for name in controllers}
        for name in controllers:
            rospy.Subscriber(f'/{name}/joint_commands', JointState, self.on_cycle, name, tcp_nodelay=True)

    def on_cycle(self, message, name):
        self.heard[name] = message.header.stamp.to_sec()
        self.asked[name] = dict(zip(message.name, message.velocity))

    def run(self):
        tick = 0
        while self.running:
            tick += 1
            self.now += STEP
            self.clock.publish(Clock(rospy.Time.from_sec(self.now)))
            if tick % 5 == 0:
                for name, command in list(self.commands.items()):
                    self.publishers[name].publish(command)
            time.sleep(STEP / 2)
            late = time.monotonic() + 2.0
            while self.running and self.is_ahead() and time.monotonic() < late:
                time.sleep(0.001)

    def is_ahead(self):
        return any(stamp < self.now - BEHIND[name] for name, stamp in self.heard.items())


class RecordingMaster(socketserver.ThreadingMixIn, SimpleXMLRPCServer):
    """Passes every call on to the ROS master; `published`: topics in the order in which they were advertised."""

    daemon_threads = True

    def __init__(self, uri):
        super().__init__(('localhost', 0), logRequests=False, allow_none=True)
        self.master, self.published = uri, []
        self.uri = f'http://localhost:{self.server_address[1]}'
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def _dispatch(self, method, params):
        if method == 'system.multicall':
            return [[self._dispatch(call['methodName'], call['params'])] for call in params[0]]
        if method == 'registerPublisher':
            self.published.append(params[1])
        return getattr(ServerProxy(self.master), method)(*params)


def twist(v, w=0.0):
    message = Twist()
    message.linear.x, message.angular.z = v, w
    return message


def yaw(odometry):
    q = odometry.pose.pose.orientation
    return 2.0 * math.atan2(q.z, q.w)


class ControllersTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.environment = {
            **os.environ,
            'PYTHONPATH': f'{PACKAGE / "examples"}:{PACKAGE / "test" / "ros"}:{os.environ.get("PYTHONPATH", "")}',
        }
        cls.odometry, cls.frames, cls.limited, cls.states, cls.joints = (
            {name: [] for name in CONTROLLERS},
            {},
            [],
            [],
            [],
        )
        for name in CONTROLLERS:
            rospy.Subscriber(f'/{name}/odom', Odometry, cls.odometry[name].append, tcp_nodelay=True)
        rospy.Subscriber('/tf', TFMessage, cls.on_tf, tcp_nodelay=True)
        rospy.Subscriber('/options/cmd_vel_out', TwistStamped, cls.limited.append, tcp_nodelay=True)
        rospy.Subscriber(
            '/options/wheel_joint_controller_state', JointTrajectoryControllerState, cls.states.append, tcp_nodelay=True
        )
        rospy.Subscriber('/options/joint_states', JointState, cls.joints.append, tcp_nodelay=True)
        cls.clock = Clockwork(CONTROLLERS)
        cls.master = RecordingMaster(os.environ['ROS_MASTER_URI'])
        cls.processes = [cls.start(name, params, urdf) for name, (params, urdf) in CONTROLLERS.items()]
        cls.refused = {name: cls.start(name, params, urdf) for name, (params, urdf, _) in REFUSED.items()}
        cls.clock.start()
        end = time.monotonic() + 60.0
        while not cls.are_there() and time.monotonic() < end:
            time.sleep(0.05)

    @classmethod
    def are_there(cls):
        """Whether each controller speaks, and hears."""
        hear = [publisher.get_num_connections() for publisher in cls.clock.publishers.values()]
        return all(cls.odometry.values()) and all(hear)

    @classmethod
    def tearDownClass(cls):
        for process in [*cls.processes, *cls.refused.values()]:
            process.terminate()
        for process in [*cls.processes, *cls.refused.values()]:
            process.wait(20.0)
        cls.clock.running = False

    @classmethod
    def start(cls, name, params, urdf):
        rospy.set_param(f'/{name}', params)
        if urdf is not None:
            rospy.set_param(f'/{name}_ns/robot_description', urdf)
        words = [
            'rosrun',
            'sara_control',
            'diff_drive_controller',
            f'__name:={name}',
            f'robot_description:=/{name}_ns/robot_description',
            f'joint_commands:=/{name}/joint_commands',
            f'joint_states:=/{name}/joint_states',
        ]
        environment = {**cls.environment, 'ROS_MASTER_URI': cls.master.uri} if name == 'options' else cls.environment
        return subprocess.Popen(words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    @classmethod
    def on_tf(cls, message):
        for transform in message.transforms:
            cls.frames.setdefault(transform.header.frame_id, []).append(transform)

    def setUp(self):
        self.assertTrue(
            all(self.odometry.values()), f'no odometry: {[name for name, got in self.odometry.items() if not got]}'
        )
        self.rest()

    def wait(self, seconds):
        end = self.clock.now + seconds
        while self.clock.now < end:
            time.sleep(0.002)

    def rest(self):
        """Until every one has stood for a while."""
        self.clock.commands.clear()
        for name in CONTROLLERS:
            self.clock.commands[name] = twist(0.0)
        stood, end = self.clock.now, self.clock.now + 10.0
        while self.clock.now < stood + 0.5:
            if any(max(map(abs, self.speeds(name))) > 1e-9 for name in CONTROLLERS):
                stood = self.clock.now
            self.assertLess(stood, end, 'in vain: all stand')
            time.sleep(0.002)
        self.clock.commands.clear()
        self.wait(0.2)

    def drive(self, names, v, w, seconds):
        """Odometry before and after so many seconds of this command, of each."""
        for name in names:
            self.clock.commands[name] = twist(v, w)
        self.wait(0.5)
        before = [self.odometry[name][-1] for name in names]
        self.wait(seconds)
        return list(zip(before, (self.odometry[name][-1] for name in names)))

    def published(self, topic):
        return any(name == topic for name, _ in rosgraph.Master('/controllers_test').getSystemState()[0])

    def test_forward_and_turning(self):
        """Two of them at once."""
        names = ('plain', 'readme')
        for before, after in self.drive(names, 0.2, 0.0, 4.0):
            seconds = (after.header.stamp - before.header.stamp).to_sec()
            way = math.hypot(
                after.pose.pose.position.x - before.pose.pose.position.x,
                after.pose.pose.position.y - before.pose.pose.position.y,
            )
            self.assertGreater(seconds, 3.5)
            self.assertAlmostEqual(way, 0.2 * seconds, delta=0.01)
            self.assertAlmostEqual(yaw(after), yaw(before), delta=0.01)
            self.assertAlmostEqual(after.twist.twist.linear.x, 0.2, delta=0.01)
        self.rest()
        for before, after in self.drive(names, 0.0, math.pi / 10.0, 4.0):
            seconds = (after.header.stamp - before.header.stamp).to_sec()
            self.assertAlmostEqual(
                math.remainder(yaw(after) - yaw(before), math.tau), math.pi / 10.0 * seconds, delta=0.03
            )
            self.assertAlmostEqual(after.twist.twist.angular.z, math.pi / 10.0, delta=0.01)

    def test_encoders_that_do_not_start_at_zero_do_not_throw_the_pose(self):
        first = self.odometry['plain'][0].pose.pose.position
        self.assertEqual((first.x, first.y), (0.0, 0.0))

    def test_frames(self):
        for name, odom, base in (('plain', 'odom', 'base_link'), ('options', 'new_odom', 'bot')):
            last = self.odometry[name][-1]
            self.assertEqual((last.header.frame_id, last.child_frame_id), (odom, base))
            self.assertEqual(self.frames[odom][-1].child_frame_id, base)
            self.assertAlmostEqual(last.pose.covariance[35], 0.03)
            others = [
                transform for frame, transforms in self.frames.items() if frame != odom for transform in transforms
            ]
            self.assertFalse([transform for transform in others if transform.child_frame_id == base], 'a second parent')

    def test_what_was_not_asked_for_is_not_published(self):
        for name in ('plain', 'readme'):
            for topic in ('cmd_vel_out', 'wheel_joint_controller_state'):
                self.assertFalse(self.published(f'/{name}/{topic}'), f'{name}/{topic}')
        self.assertTrue(self.published('/options/cmd_vel_out'))
        self.assertTrue(self.published('/options/wheel_joint_controller_state'))

    def test_odometry_is_advertised_last(self):
        """Whoever waits for it may then look for the other topics."""
        order = self.master.published
        topics = ('cmd_vel_out', 'wheel_joint_controller_state', 'joint_states', 'joint_commands')
        for topic in topics:
            self.assertLess(order.index(f'/options/{topic}'), order.index('/options/odom'), topic)

    def test_limited_commands_and_wheel_states(self):
        self.limited.clear()
        self.drive(('options',), 5.0, 0.0, 2.0)
        speeds = [message.twist.linear.x for message in self.limited]
        self.assertAlmostEqual(speeds[-1], 0.6, delta=1e-9)
        for a, b in zip(self.limited, self.limited[1:]):
            self.assertLessEqual(
                b.twist.linear.x - a.twist.linear.x, 0.5 * (b.header.stamp - a.header.stamp).to_sec() + 1e-6
            )
        self.assertAlmostEqual(self.odometry['options'][-1].twist.twist.linear.x, 0.6, delta=0.02)
        self.assertEqual(list(self.joints[-1].name), THREE_EACH['left_wheel'] + THREE_EACH['right_wheel'])
        self.assertEqual(
            self.clock.asked['options'], dict.fromkeys(self.joints[-1].name, self.clock.asked['options']['left_wheel'])
        )
        state = self.states[-1]
        self.assertEqual(list(state.joint_names), THREE_EACH['left_wheel'] + THREE_EACH['right_wheel'])
        for k in range(6):
            self.assertAlmostEqual(state.desired.velocities[k], 0.6 / 0.11, delta=1e-6)
            self.assertAlmostEqual(state.actual.velocities[k], 0.6 / 0.11, delta=0.1)
            self.assertAlmostEqual(state.error.velocities[k], state.desired.velocities[k] - state.actual.velocities[k])

    def test_from_rest_a_step_is_limited_in_jerk_then_acceleration_then_speed(self):
        """0.45 s after it began to move for a command of 10 m/s the robot drives at 0.35 m/s (5 m/s3 for 0.2 s, then 1
        m/s2); after three seconds at the limit. The same holds for the turn, at 2 rad/s2.
        """
        for axis, command, after, limit in ((1, twist(0.0, 10.0), 0.9, 2.0), (0, twist(10.0), 0.35, 1.0)):
            self.assertEqual(self.speeds('limited'), (0.0, 0.0))
            before = len(self.odometry['limited'])
            self.clock.commands['limited'] = command
            self.wait(3.0)
            stamps = [message.header.stamp.to_sec() for message in self.odometry['limited'][before:]]
            speeds = [self.speed_of(message)[axis] for message in self.odometry['limited'][before:]]
            began = next(stamp for stamp, speed in zip(stamps, speeds) if speed > 0.0)
            then = next(speed for stamp, speed in zip(stamps, speeds) if stamp > began + 0.45 - 1e-6)
            self.assertAlmostEqual(then, after, delta=0.07)
            self.assertAlmostEqual(speeds[-1], limit, delta=0.02)
            self.assertAlmostEqual(self.speeds('limited')[1 - axis], 0.0, delta=1e-6)
            self.rest()

    @staticmethod
    def speed_of(message):
        return message.twist.twist.linear.x, message.twist.twist.angular.z

    def speeds(self, name):
        return self.speed_of(self.odometry[name][-1])

    def test_odometry_comes_at_its_rate(self):
        start = self.odometry['options'][-1].header.stamp
        self.wait(3.0)
        inside = [message for message in self.odometry['options'] if message.header.stamp > start]
        rate = (len(inside) - 1) / (inside[-1].header.stamp - inside[0].header.stamp).to_sec()
        self.assertAlmostEqual(rate, 20.0, delta=1.5)

    def test_a_command_given_once_is_obeyed_for_its_timeout(self):
        before = self.odometry['plain'][-1].pose.pose.position
        self.clock.publishers['plain'].publish(twist(1.0))
        self.wait(3.0)
        after = self.odometry['plain'][-1].pose.pose.position
        way = math.hypot(after.x - before.x, after.y - before.y)
        self.assertGreater(way, 0.3)
        self.assertLess(way, 0.8)

    def test_two_publishers_stop_it_where_one_is_allowed(self):
        # A second publisher in this process would share its connection: it must be somebody else.
        other = subprocess.Popen(
            ['rostopic', 'pub', '-r', '10', '/options/cmd_vel', 'geometry_msgs/Twist', '{linear: {x: 0.5}}'],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            end = time.monotonic() + 20.0
            while self.commanders() < 2:
                self.assertLess(time.monotonic(), end, 'the second publisher never came')
                time.sleep(0.05)
            self.wait(1.0)
            [(before, after)] = self.drive(('options',), 0.5, 0.3, 2.0)
            self.assertLess(
                math.hypot(
                    after.pose.pose.position.x - before.pose.pose.position.x,
                    after.pose.pose.position.y - before.pose.pose.position.y,
                ),
                0.01,
            )
            self.assertAlmostEqual(yaw(after), yaw(before), delta=0.01)
        finally:
            other.terminate()
            other.wait(10.0)

    def commanders(self):
        """How many publishers the controller is connected to; the master knows of one before that."""
        controller = ServerProxy(rosgraph.Master('/controllers_test').lookupNode('/options'))
        connections = controller.getBusInfo('/controllers_test')[2]
        return sum(direction == 'i' and topic == '/options/cmd_vel' for _, _, direction, _, topic, *_ in connections)

    def test_what_is_not_a_number_moves_nothing(self):
        before = self.odometry['plain'][-1]
        for bad in (twist(math.nan), twist(0.0, math.nan), twist(math.inf, -math.inf)):
            self.clock.commands['plain'] = bad
            self.wait(0.3)
        after = self.odometry['plain'][-1]
        self.assertEqual(before.pose.pose, after.pose.pose)
        self.assertEqual((after.twist.twist.linear.x, after.twist.twist.angular.z), (0.0, 0.0))
        self.drive(('plain',), 0.2, 0.1, 1.0)
        broken = rospy.ServiceProxy('/plain/broken', SetBool)
        broken(True)
        self.wait(1.0)
        broken(False)
        self.wait(0.5)
        last = self.odometry['plain'][-1]
        self.assertGreater(last.header.stamp, after.header.stamp)
        values = (
            last.pose.pose.position.x,
            last.pose.pose.position.y,
            yaw(last),
            last.twist.twist.linear.x,
            last.twist.twist.angular.z,
        )
        self.assertTrue(all(map(math.isfinite, values)), values)

    def test_reconfiguring(self):
        configure = rospy.ServiceProxy('/readme/set_parameters', Reconfigure)
        answer = configure(Config()).config
        names = [
            'left_wheel_radius_multiplier',
            'right_wheel_radius_multiplier',
            'wheel_separation_multiplier',
            'publish_rate',
        ]
        self.assertEqual([(p.name, p.value) for p in answer.bools], [('enable_odom_tf', False)])
        self.assertEqual(
            [(p.name, p.value) for p in answer.doubles],
            list(zip(names, (1.6, 1.6, 1.0, 50.0))),
            'what was configured beyond the range of the fields must stay',
        )
        self.assertFalse(answer.ints or answer.strs)
        self.assertNotIn('quiet_odom', self.frames)
        change = Config()
        for name, value in zip(names, (0.8, 0.9, 1.1, 100.0)):
            change.doubles.append(DoubleParameter(name, value))
        change.bools.append(answer.bools[0])
        change.bools[0].value = True
        answer = configure(change).config
        self.assertEqual([p.value for p in answer.doubles], [0.8, 0.9, 1.1, 100.0])
        self.assertTrue(answer.bools[0].value)
        self.wait(1.0)
        self.assertIn('quiet_odom', self.frames)
        self.assertAlmostEqual(rospy.get_param('/readme/wheel_separation_multiplier'), 1.1)
        back = Config(doubles=[DoubleParameter(name, value) for name, value in zip(names, (1.0, 1.0, 1.0, math.nan))])
        self.assertEqual([p.value for p in configure(back).config.doubles], [0.8, 0.9, 1.1, 100.0], 'a NaN was taken')
        back.doubles[3].value = 50.0
        self.assertEqual([p.value for p in configure(back).config.doubles], [1.0, 1.0, 1.0, 50.0])

    def test_a_controller_that_cannot_be_right_does_not_come_up(self):
        for name, (_, _, sentence) in REFUSED.items():
            text = self.refused[name].communicate(timeout=60.0)[0]
            self.assertEqual(self.refused[name].returncode, 1, f'{name}: {text}')
            self.assertRegex(text, sentence)
            self.assertFalse(self.published(f'/{name}/odom'), name)


if __name__ == '__main__':
    start_node('controllers_test', disable_rostime=True)
    rostest.rosrun('sara_control', 'controllers', ControllersTest)
