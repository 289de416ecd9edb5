#!/usr/bin/env python3
"""The touch screen's server as pages and a robot see it: driving, held frames, a killed page, two drivers, stop, goals,
places, map.
"""

import asyncio
import contextlib
import io
import json
import math
import pathlib
import tempfile
import threading
import time
import unittest
from types import SimpleNamespace
from xmlrpc.client import ServerProxy

import actionlib
import aiohttp
import numpy as np
import rosgraph
import rosnode
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped, Twist
from move_base_msgs.msg import MoveBaseAction
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from PIL import Image
from sensor_msgs.msg import Range
from std_msgs.msg import Bool, Float32, String
from std_srvs.srv import Trigger, TriggerResponse
from tf2_msgs.msg import TFMessage

from sara_hmi.ros.robot import RosRobot
from sara_nav.maps import edits, places
from sara_nav.maps.edits import Edit

PATIENCE_S = 30.0


class Page:
    """A page: sends frames, keeps what comes."""

    def __init__(self, session, url):
        self._session, self._url = session, url
        self.got, self.seq, self.beat, self.images = [], 0, 0, []

    async def __aenter__(self):
        self.socket = await self._session.ws_connect(f'{self._url}/ws', max_msg_size=0)
        self._reader = asyncio.create_task(self._read())
        await self.send('hello', version=1)
        self.welcome = await self.until('welcome')
        return self

    async def __aexit__(self, *_):
        self._reader.cancel()
        await self.socket.close()

    async def _read(self):
        async for message in self.socket:
            if message.type == aiohttp.WSMsgType.BINARY:
                self.images.append(message.data)
                continue
            frame = json.loads(message.data)
            if frame['op'] == 'beat':
                self.beat = frame['n']
            self.got.append(frame)

    async def send(self, op, **fields):
        await self.socket.send_json({'op': op, **fields})

    async def drive(self, v, w=0.0, beat=None):
        self.seq += 1
        await self.send('drive', seq=self.seq, t=1, n=self.beat if beat is None else beat, v=v, w=w)
        return self.seq

    async def until(self, op, condition=lambda frame: True, since=0):
        """The first frame of that op for which the condition holds."""
        end = time.monotonic() + PATIENCE_S
        while True:
            found = [frame for frame in self.got[since:] if frame['op'] == op and condition(frame)]
            if found:
                return found[0]
            assert time.monotonic() < end, (
                f'no {op}; came: {[frame for frame in self.got if frame["op"] != "state"][-9:]}'
            )
            await asyncio.sleep(0.01)

    async def answer(self, v, w=0.0):
        """What the server says to a command."""
        seq = await self.drive(v, w)
        return await self.until('ack', lambda frame: frame['seq'] == seq)

    async def drive_in_time(self, v, w=0.0):
        """Drive, anew while a machine that pauses makes the command come late; returns what the server says to it."""
        end = time.monotonic() + PATIENCE_S
        while (ack := await self.answer(v, w)).get('why') == 'error.drive_late':
            assert time.monotonic() < end, 'every command comes late'
        return ack

    async def take(self):
        """Take the controls, and wait until the server knows that the robot listens."""
        await self.send('take')
        while not self.beat:
            await asyncio.sleep(0.01)
        end = time.monotonic() + PATIENCE_S
        while not (ack := await self.answer(0.0))['ok']:
            assert time.monotonic() < end, ack
            await asyncio.sleep(0.05)


class Robot:
    """The other side: gate, move_base, tf, odometry, map."""

    def __init__(self):
        self.touched, self.stops, self.poses, self.profiles = [], [], [], []
        self.helps, self.overrides = [], []
        self.goal = self.ending = None
        self.listen_to_touch()
        rospy.Subscriber('/emergency_stop', Bool, lambda m: self.stops.append(m.data), tcp_nodelay=True)
        self.listen_to_poses()
        rospy.Subscriber('/safety_gate/profile', String, lambda m: self.profiles.append(m.data), tcp_nodelay=True)
        rospy.Subscriber('/shared_control/profile', String, lambda m: self.helps.append(m.data), tcp_nodelay=True)
        rospy.Subscriber('/shared_control/override', Bool, lambda m: self.overrides.append(m.data), tcp_nodelay=True)
        self.status = rospy.Publisher('/safety_gate/status', String, queue_size=1, latch=True)
        self.map = rospy.Publisher('/map', OccupancyGrid, queue_size=1, latch=True)
        self.tf = rospy.Publisher('/tf', TFMessage, queue_size=10)
        self.odometry = rospy.Publisher('/odometry/filtered', Odometry, queue_size=1)
        self.asked, self.mux_is_gone = None, threading.Event()
        self.range = rospy.Publisher('/SDI_range', Range, queue_size=1)
        self.lost = rospy.Publisher('/lost_probability', Float32, queue_size=1)
        self.refusal = ''
        rospy.Service('/emergency_stop/reset', Trigger, self._on_reset)
        self.server = actionlib.SimpleActionServer('move_base', MoveBaseAction, self._go, auto_start=False)
        self.server.start()
        self.end = threading.Event()
        threading.Thread(target=self._speak, daemon=True).start()

    def listen_to_touch(self):
        self.touch = rospy.Subscriber('/cmd_vel/touch', Twist, self._on_touch, tcp_nodelay=True)

    def listen_to_poses(self):
        self.set_pose = rospy.Subscriber('/set_pose', PoseWithCovarianceStamped, self.poses.append, tcp_nodelay=True)

    def _on_touch(self, message):
        self.touched.append((time.monotonic(), message.linear.x, message.angular.z))

    def _on_reset(self, _request):
        return TriggerResponse(success=not self.refusal, message=self.refusal)

    def _go(self, goal):
        self.goal = goal.target_pose.pose
        while not self.server.is_preempt_requested() and self.ending is None and not rospy.is_shutdown():
            time.sleep(0.01)
        ending, self.ending = self.ending, None  # not before: the server tells of a goal before it is begun here
        if ending is None:
            self.server.set_preempted(text='Goal cancelled.')
        elif ending:
            self.server.set_aborted(text=ending)
        else:
            self.server.set_succeeded(text='Goal reached.')

    def _speak(self):
        while not self.end.wait(0.05):
            message = TransformStamped()
            message.header.frame_id, message.child_frame_id, message.header.stamp = 'map', 'base_link', rospy.Time.now()
            message.transform.translation.x, message.transform.rotation.w = 3.0, 1.0
            sensor = TransformStamped()
            sensor.header.frame_id, sensor.child_frame_id = 'base_link', 'SDI_frame'
            sensor.header.stamp, sensor.transform.translation.x = rospy.Time.now(), 0.5
            sensor.transform.rotation.w = 1.0
            self.tf.publish(TFMessage([message, sensor]))
            odometry = Odometry()
            odometry.twist.twist.linear.x = 0.25
            self.odometry.publish(odometry)
            asked = Twist()
            asked.linear.x, asked.angular.z = 0.5, 1.25
            self._ask(asked)
            reading = Range(min_range=0.16, max_range=6.0, field_of_view=1.0, range=1.5)
            reading.header.frame_id = 'SDI_frame'
            self.range.publish(reading)

    def _ask(self, asked):
        """As cmd_vel_mux, which may be gone for a while."""
        if self.mux_is_gone.is_set() and self.asked:
            self.asked.unregister()
            self.asked = None
        elif not self.mux_is_gone.is_set():
            self.asked = self.asked or rospy.Publisher('/cmd_vel/mux', Twist, queue_size=1)
            self.asked.publish(asked)


class HmiTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = Robot()
        cls.places = rospy.get_param('/places_file')
        cls.robot.status.publish('The chair is ready.')
        end = time.monotonic() + PATIENCE_S
        while not rospy.has_param('/hmi/url'):
            assert time.monotonic() < end, 'the server does not start'
            time.sleep(0.05)
        cls.url = rospy.get_param('/hmi/url')

    def run_it(self, test):
        """An async test with two pages; afterwards nobody drives."""

        async def whole():
            async with (
                aiohttp.ClientSession() as session,
                Page(session, self.url) as one,
                Page(session, self.url) as two,
            ):
                if one.welcome['profile'] != 'brisk':
                    await one.until('profile')  # the server has found the gate's
                await test(one, two)

        self.robot.touched.clear()
        asyncio.run(whole())

    def wait(self, condition, what):
        end = time.monotonic() + PATIENCE_S
        while not condition():
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.01)

    @staticmethod
    def is_sent(topic):
        """Whether the server has somebody to whom it sends a topic."""
        node = ServerProxy(rosgraph.Master('/hmi_test').lookupNode('/hmi'))
        links = node.getBusInfo('/hmi_test')[2]
        return any(direction == 'o' and name == topic for _, _, direction, _, name, *_ in links)

    def stands(self):
        """Whether the newest command is a zero."""
        return bool(self.robot.touched) and self.robot.touched[-1][1:] == (0.0, 0.0)

    def ends_with_one_zero(self):
        """After each motion one zero, and none after another; a machine that pauses may put one in between."""
        self.wait(lambda: self.stands() and time.monotonic() - self.robot.touched[-1][0] > 0.4, 'no zero at the end')
        still = [motion[1:] == (0.0, 0.0) for motion in self.robot.touched]
        self.assertTrue(still[-1] and not still[0], self.robot.touched)
        self.assertFalse(any(a and b for a, b in zip(still, still[1:])), self.robot.touched)

    def test_a_page_drives_and_lifts_the_finger(self):
        async def test(page, _):
            self.assertEqual(page.welcome['role'], 'rider')
            await page.take()
            await page.drive_in_time(0.5, -0.25)
            for _ in range(10):
                await page.drive(0.5, -0.25)
                await asyncio.sleep(0.03)
            page.seq += 1
            await page.send('halt', seq=page.seq)
            await page.until('ack', lambda f: f['seq'] == page.seq and f['ok'])

        self.run_it(test)
        self.ends_with_one_zero()
        # Half of the profile's 1.0 m/s and a quarter of its 2.0 rad/s, of which a chair that slips is told 1.25 times.
        self.assertIn((0.5, -0.625), [motion[1:] for motion in self.robot.touched])

    def test_a_command_is_repeated_and_ends_by_itself(self):
        async def test(page, _):
            await page.take()
            await page.drive_in_time(1.0)
            await asyncio.sleep(0.5)

        self.run_it(test)
        self.ends_with_one_zero()
        self.assertLessEqual(len(self.robot.touched), 4)

    def test_frames_that_were_held_move_nothing(self):
        async def test(page, _):
            await page.take()
            await page.drive_in_time(1.0)
            await asyncio.sleep(0.3)
            old = page.beat
            await asyncio.sleep(1.0)
            self.wait(self.stands, 'the zero does not come')
            before = len(self.robot.touched)
            numbers = [await page.drive(1.0, beat=max(1, old - k % 9)) for k in range(40)]
            await page.until('ack', lambda f: f['seq'] == numbers[-1])
            acks = [f for f in page.got if f['op'] == 'ack' and f['seq'] in numbers]
            self.assertEqual({(f['ok'], f.get('why')) for f in acks}, {(False, 'error.drive_late')})
            self.assertEqual(len(self.robot.touched), before)
            refused = await page.drive_in_time(1.0)
            self.assertEqual(refused.get('why'), 'error.drive_lift')

        self.run_it(test)
        self.ends_with_one_zero()

    def test_a_page_that_is_cut_off_stops(self):
        async def test(page, other):
            await page.take()
            await page.drive_in_time(1.0)
            page.socket._response.connection.transport.abort()  # as kill -9 does
            await other.until('driver', lambda f: f['session'] is None)

        self.run_it(test)
        self.ends_with_one_zero()

    def test_two_drivers(self):
        async def test(one, two):
            await one.take()
            await two.send('take')
            asked = await one.until('asked')
            self.assertEqual(asked['session'], two.welcome['session'])
            await two.drive(1.0, beat=one.beat)
            refused = await two.until('ack')
            self.assertEqual(refused['why'], 'error.drive_not_driver')
            await one.send('grant', session=asked['session'])
            await two.until('driver', lambda f: f['session'] == two.welcome['session'])
            await two.until('beat')
            self.assertTrue((await two.drive_in_time(-1.0))['ok'])

        self.run_it(test)
        self.ends_with_one_zero()
        self.assertEqual(self.robot.touched[0][1], -0.5)

    def test_stop_and_reset(self):
        async def test(page, other):
            await page.take()
            await page.drive_in_time(1.0)
            await other.send('stop')
            await page.until('state', lambda f: f['stopped'])
            self.wait(lambda: self.robot.stops[-1:] == [True], 'no emergency stop')
            refused = await page.drive_in_time(1.0)
            self.assertEqual(refused['why'], 'error.drive_stopped')
            self.robot.refusal = 'The emergency stop is released only when the chair stands still.'
            await page.send('reset')
            error = await page.until('error')
            self.assertEqual((error['key'], error['of']), ('error.reset_moving', 'reset'))
            self.robot.refusal = ''
            since = len(page.got)
            await page.send('reset')
            await page.until('state', lambda f: not f['stopped'], since)
            self.wait(lambda: self.robot.stops[-1:] == [False], 'the emergency stop is not released')
            history = await page.until('history', lambda f: f['list'][-1]['key'] == 'event.reset')
            self.assertIn('event.stop', [entry['key'] for entry in history['list']])

        self.run_it(test)
        self.ends_with_one_zero()

    def test_a_stop_after_a_reset_stays(self):
        async def test(page, other):
            await page.send('stop')
            await page.until('state', lambda f: f['stopped'])
            self.robot.refusal = 'The emergency stop is still pressed.'  # the reset is tried again
            count = len(self.robot.stops)
            await page.send('reset')
            self.wait(lambda: False in self.robot.stops[count:], 'the reset does not begin')
            await other.send('stop')
            error = await page.until('error')
            self.assertEqual((error['key'], error['of']), ('error.reset_pressed', 'reset'))
            self.wait(lambda: self.robot.stops[-1], 'no second stop')
            await asyncio.sleep(0.2)
            self.assertIs(self.robot.stops[-1], True)
            self.robot.refusal, since = '', len(page.got)
            await page.send('reset')
            await page.until('state', lambda f: not f['stopped'], since)

        self.run_it(test)

    def test_a_goal_that_waits_for_the_hand_to_leave_is_void_after_a_stop_or_a_cancel(self):
        async def test(page, other):
            await page.take()
            for op in ('stop', 'cancel'):
                self.robot.goal = None
                self.assertTrue((await page.drive_in_time(1.0))['ok'])
                await page.send('halt', seq=page.seq + 1)
                page.seq += 1
                await page.send('go', pose=[0.0, 0.0, 1.0])
                await page.send(op)
                await asyncio.sleep(1.0)  # longer than settle_s
                self.assertIsNone(self.robot.goal)
                if op == 'stop':
                    since = len(page.got)
                    await page.send('reset')
                    await page.until('state', lambda f: not f['stopped'], since)

        self.run_it(test)

    def test_a_goal(self):
        async def test(page, other):
            await page.send('place', name='table', pose=[1.0, 2.0, 0.0])
            await page.until('places', lambda f: f['places'].get('table') == [1.0, 2.0, 0.0])
            await page.send('go', place='table')
            await page.until('state', lambda f: f['goal'] and f['goal']['state'] == 'going')
            self.wait(lambda: self.robot.goal is not None, 'no goal comes')
            self.assertEqual((self.robot.goal.position.x, self.robot.goal.position.y), (1.0, 2.0))
            await page.send('pause')
            await page.until('state', lambda f: f['goal'] and f['goal']['state'] == 'paused')
            self.wait(lambda: not self.robot.server.is_active(), 'it goes on')
            await page.send('resume')
            self.wait(lambda: self.robot.server.is_active(), 'it does not go on')
            self.robot.ending = ''
            ended = await other.until('ended')
            self.assertEqual(ended, {'op': 'ended', 'key': 'goal.succeeded', 'values': {'place': 'table'}})
            await page.send('go', pose=[0.0, 0.0, 1.0])
            self.wait(lambda: self.robot.server.is_active(), 'no second goal')
            self.robot.ending = 'Goal aborted: The chair is stopping because the chair was hit by something.'
            ended = await page.until('ended', lambda f: f['key'] == 'goal.aborted')
            self.assertEqual(ended['values'], {'place': 'goal.unnamed', 'reason': 'reason.IMPACT'})

        self.run_it(test)

    def test_a_goal_of_which_move_base_says_nothing_any_more_is_cancelled_and_ends(self):
        server = self.robot.server.action_server

        async def test(page, _):
            await page.send('go', pose=[0.0, 0.0, 1.0])
            self.wait(self.robot.server.is_active, 'no goal comes')
            server.status_timer.shutdown()
            ended = await page.until('ended')
            self.assertEqual(ended['key'], 'goal.aborted')
            self.assertEqual(ended['values'], {'place': 'goal.unnamed', 'reason': 'why.no_navigation'})
            self.wait(lambda: not self.robot.server.is_active(), 'it is not cancelled')

        try:
            self.run_it(test)
        finally:
            server.status_timer = rospy.Timer(rospy.Duration(0.2), server.publish_status_async)

    def test_places(self):
        async def test(page, _):
            await page.send('place', name='chair')
            await page.until('places', lambda f: f['places'].get('chair') == [3.0, 0.0, 0.0])
            await page.send('rename', name='chair', to='sofa')
            await page.until('places', lambda f: 'sofa' in f['places'] and 'chair' not in f['places'])
            await page.send('delete', name='sofa')
            await page.until('places', lambda f: 'sofa' not in f['places'], len(page.got))
            self.assertNotIn('sofa', pathlib.Path(self.places).read_text(encoding='utf-8'))
            places.write(self.places, places.Place('stove', 1.0, 2.0, 0.0))  # as another program does
            await page.until('places', lambda f: f['places'].get('stove') == [1.0, 2.0, 0.0])

        async def begun(page, _):
            await page.until('state', lambda f: f['pose'] == [3.0, 0.0, 0.0])

        self.run_it(begun)
        self.run_it(test)

    def test_what_is_seen(self):
        cells = np.full((3, 4), -1, np.int8)
        cells[0, 0], cells[2, 3], cells[1, 1] = 100, 0, 50
        message = OccupancyGrid(data=cells.ravel().tolist())
        message.info.width, message.info.height, message.info.resolution = 4, 3, 0.5
        message.info.origin.orientation.w = 1.0
        self.robot.map.publish(message)
        self.robot.status.publish('The chair stands still because the chair was hit by something.')

        async def test(page, _):
            frame = await page.until('map', lambda f: f['width'] == 4)  # after the map of an earlier test
            self.assertEqual((frame['width'], frame['height'], frame['resolution']), (4, 3, 0.5))
            wanted = [[205, 205, 205, 254], [205, 127, 205, 205], [0, 205, 205, 205]]
            end = time.monotonic() + PATIENCE_S
            while not (page.images and np.asarray(Image.open(io.BytesIO(page.images[-1]))).tolist() == wanted):
                self.assertLess(time.monotonic(), end, 'the picture of the map does not come')
                await asyncio.sleep(0.01)
            state = await page.until('state', lambda f: f['gate'] and f['gate']['state'] == 'HELD')
            self.assertEqual(state['gate']['reasons'], ['IMPACT'])
            state = await page.until('state', lambda f: f['v'] == 0.25 and f['pose'] == [3.0, 0.0, 0.0])
            await page.until('state', lambda f: f['asked'] == {'v': 0.5, 'w': 1.0})  # without what the chair slips
            self.assertTrue(state['connected']['odom'])
            self.assertFalse(state['connected']['SDD_range'])
            seen = await page.until('ranges', lambda f: 'SDI' in f)
            self.assertEqual((seen['SDI']['range'], seen['SDI']['pose']), (1.5, [0.5, 0.0, 0.0]))
            await page.until('history', lambda f: f['list'][-1]['values'] == {'reason': 'reason.IMPACT'})

        self.run_it(test)
        self.robot.status.publish('The chair is ready.')

    def test_a_plan_is_shown_while_somebody_follows_it(self):
        rospy.set_param('/move_base/base_global_planner', 'navfn/NavfnROS')
        plans = rospy.Publisher('/move_base/NavfnROS/plan', Path, queue_size=1)
        plan = Path(poses=[PoseStamped(), PoseStamped()])
        plan.poses[1].pose.position.x = 2.0

        async def test(page, _):
            self.wait(lambda: plans.get_num_connections() > 0, 'nobody listens to the plan')
            await page.send('go', pose=[2.0, 0.0, 0.0])
            self.wait(self.robot.server.is_active, 'no goal comes')
            end = time.monotonic() + PATIENCE_S
            while not any(f['op'] == 'plan' and f['points'] for f in page.got) and time.monotonic() < end:
                plans.publish(plan)  # as move_base does; a status from before the goal may come after the first
                await asyncio.sleep(0.1)
            await page.until('plan', lambda f: len(f['points']) == 2)
            since = len(page.got)
            self.robot.ending = ''
            await page.until('plan', lambda f: f['points'] == [], since)

        self.run_it(test)

    def test_steering_by_hand_ends_a_goal_on_a_robot_without_a_gate(self):
        for has_gate in (True, False):
            cancels, commands = [], []
            robot = SimpleNamespace(
                turn_slip=1.0,
                has_gate=has_gate,
                _moves=False,
                _goals=SimpleNamespace(drove=lambda moves: None),
                _cancel=SimpleNamespace(publish=cancels.append),
                _out=SimpleNamespace(publish=commands.append),
            )
            for v, w in ((0.0, 0.0), (0.2, 0.0), (0.3, 0.0), (0.0, 0.0), (0.0, 0.1)):
                RosRobot.drive(robot, v, w)
            self.assertEqual((len(commands), len(cancels)), (5, 0 if has_gate else 2))

    def test_a_gate_that_has_gone_is_said_and_the_one_after_it_has_its_first_profile(self):
        async def test(page, _):
            await page.send('profile', name='gentle')
            await page.until('profile', lambda f: f['profile'] == 'gentle')
            since = len(page.got)
            self.robot.status.unregister()
            state = await page.until('state', lambda f: f['gate'] and f['gate']['state'] == 'SILENT', since)
            self.assertFalse(state['connected']['safety_gate/status'])
            await page.until('profile', lambda f: f['profile'] == 'brisk', since)
            since = len(page.got)
            await page.send('profile', name='gentle')
            self.assertEqual((await page.until('error'))['key'], 'error.no_gate')
            await page.until('profile', lambda f: f['profile'] == 'brisk', since)
            since = len(page.got)
            self.robot.status = rospy.Publisher('/safety_gate/status', String, queue_size=1, latch=True)
            self.robot.status.publish('The chair is ready.')
            state = await page.until('state', lambda f: f['gate']['state'] == 'IDLE', since)
            self.assertTrue(state['connected']['safety_gate/status'])

        self.run_it(test)

    def test_a_gate_that_hangs_is_said_until_it_goes_on(self):
        async def test(page, _):
            lives = threading.Event()
            lives.set()
            diagnostics = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=1)
            self.wait(diagnostics.get_num_connections, 'nobody listens to the diagnostics')

            def beat():
                while not self.robot.end.wait(0.2):
                    if lives.is_set():
                        diagnostics.publish(DiagnosticArray())

            threading.Thread(target=beat, daemon=True).start()
            await page.until('state', lambda f: f['gate'] and f['gate']['state'] == 'IDLE')
            await asyncio.sleep(1.0)
            lives.clear()
            await page.until('state', lambda f: f['gate']['state'] == 'SILENT', len(page.got))
            lives.set()
            await page.until('state', lambda f: f['gate']['state'] == 'IDLE', len(page.got))

        self.run_it(test)

    def test_where_nobody_takes_the_commands_they_are_refused(self):
        silent = self.robot.mux_is_gone

        async def drives_until(page, why):
            """Drive until the server says so, None: that it obeys; then lift the finger."""
            end = time.monotonic() + PATIENCE_S
            while (ack := await page.drive_in_time(0.5)).get('why') != why:
                self.assertLess(time.monotonic(), end, ack)
                await asyncio.sleep(0.1)
            page.seq += 1
            await page.send('halt', seq=page.seq)
            await page.until('ack', lambda f: f['seq'] == page.seq)

        async def test(page, _):
            await page.take()
            for end, begin in ((self.robot.touch.unregister, self.robot.listen_to_touch), (silent.set, silent.clear)):
                end()
                await drives_until(page, 'error.drive_unheard')
                begin()
                await drives_until(page, None)

        self.run_it(test)
        self.ends_with_one_zero()

    def test_profile_and_pose(self):
        async def test(page, other):
            await page.send('profile', name='gentle')
            told = await other.until('profile')
            self.assertEqual(told['limits'], {'max_forward': 0.5, 'max_reverse': 0.25, 'max_turn': 0.5})
            self.wait(lambda: self.robot.profiles[-1:] == ['gentle'], 'the gate hears nothing')
            await page.send('profile', name='brisk')
            await other.until('profile', lambda f: f['profile'] == 'brisk')
            await page.send('pose', pose=[1.0, -1.0, 0.5])
            self.wait(lambda: self.robot.poses, 'no pose')
            self.assertEqual(self.robot.poses[-1].pose.pose.position.y, -1.0)
            self.assertEqual(self.robot.poses[-1].pose.covariance[0], 0.05)
            await page.send('place', name='den', pose=[2.0, 1.0, 0.5])
            await page.until('places', lambda f: 'den' in f['places'])
            await page.send('pose', place='den')
            self.wait(lambda: len(self.robot.poses) == 2, 'no pose of the place')
            told = self.robot.poses[-1]
            self.assertEqual((told.header.frame_id, told.pose.pose.position.x), ('map', 2.0))
            self.assertEqual((told.pose.covariance[0], told.pose.covariance[7]), (1.0, 1.0))
            self.assertAlmostEqual(told.pose.covariance[35], math.radians(60.0) ** 2)

        self.run_it(test)

    def test_a_map_that_is_being_made_is_saved(self):
        answers = [TriggerResponse(True, '/maps/flat.yaml'), TriggerResponse(False, 'the disk is full')]

        async def test(page, other):
            await page.until('state', lambda f: not f['maps'])
            await page.send('save_map')
            await page.until('error', lambda f: f['key'] == 'error.no_map')
            service = rospy.Service('slam_gmapping/save', Trigger, lambda _request: answers.pop(0))
            await page.until('state', lambda f: f['maps'])
            await page.send('save_map')
            self.assertEqual((await other.until('saved'))['key'], 'event.map_saved')
            await page.send('save_map')
            await page.until('error', lambda f: f['key'] == 'error.map_file')
            service.shutdown()
            await page.until('state', lambda f: not f['maps'])

        self.run_it(test)

    def test_an_order_for_which_there_is_no_room_is_refused(self):
        begun, hold = threading.Event(), threading.Event()

        def save(_request):
            begun.set()
            hold.wait(PATIENCE_S)
            return TriggerResponse(True, '/maps/flat.yaml')

        async def test(page, _):
            service = rospy.Service('slam_gmapping/save', Trigger, save)
            await page.until('state', lambda f: f['maps'])
            await page.send('save_map')
            self.wait(begun.is_set, 'the map is not saved')
            for _ in range(80):
                await page.send('say', key='goal.going')
            await page.send('go', pose=[1.0, 0.0, 0.0])
            await page.send('reset')
            for op in ('go', 'reset'):
                self.assertEqual((await page.until('error', lambda f, op=op: f['of'] == op))['key'], 'error.rate')
            await page.until('state', lambda f: f['goal'] is None, len(page.got))
            hold.set()
            await page.until('saved')
            service.shutdown()
            await page.until('state', lambda f: not f['maps'])

        self.run_it(test)

    def test_the_map_is_drawn_over(self):
        with tempfile.TemporaryDirectory() as folder:
            path, answers = pathlib.Path(folder) / 'flat.edits.yaml', []

            def reload(_request):
                return answers.pop(0) if answers else TriggerResponse(True, str(path))

            async def test(page, other):
                await page.send('edit', kind='wall', points=[[0, 1], [0, 2]])
                await page.until('error', lambda f: f['key'] == 'error.no_edits')  # nobody publishes such a map
                service = rospy.Service('reload_edits', Trigger, reload)
                await page.until('edits', lambda f: f['edits'] == [])
                await page.send('edit', kind='wall', points=[[0, 1], [0, 2.0004]])
                door = {'kind': 'wall', 'points': [[0.0, 1.0], [0.0, 2.0]]}
                await other.until('edits', lambda f: f['edits'] == [door])
                self.assertEqual(edits.load(path), (Edit('wall', (0.0, 1.0), (0.0, 2.0)),))
                answers[:] = [
                    TriggerResponse(True, str(path)),
                    TriggerResponse(False, 'no'),
                ]  # the map does not take it
                await page.send('edit', kind='free', points=[[0, 0], [1, 1]])
                await page.until('error', lambda f: f['key'] == 'error.edits_file')
                self.assertEqual(len(edits.load(path)), 1)
                edits.write(path, [])  # by hand, and whoever publishes the map tells of it
                mask, since = rospy.Publisher('keepout_filter_mask', OccupancyGrid, queue_size=1), len(page.got)
                while not mask.get_num_connections():
                    await asyncio.sleep(0.01)
                mask.publish(OccupancyGrid())
                await page.until('edits', lambda f: f['edits'] == [], since)
                for op, wanted in (('edit', [door]), ('unedit', [])):
                    since = len(page.got)
                    await page.send(op, **door)
                    await page.until('edits', lambda f, wanted=wanted: f['edits'] == wanted, since)
                path.write_text('edits: no list')
                since = len(page.got)
                await page.send('edit', **door)
                await page.until('error', lambda f: f['key'] == 'error.edits_file', since)
                await page.until('edits', lambda f: f['edits'] is None, since)
                self.assertEqual(path.read_text(), 'edits: no list')
                service.shutdown()

            self.run_it(test)

    def test_a_pose_that_nobody_takes_is_refused(self):
        async def test(page, _):
            self.robot.set_pose.unregister()
            self.wait(lambda: not self.is_sent('/set_pose'), 'the server does not see that nobody listens')
            await page.send('pose', pose=[1.0, -1.0, 0.5])
            await page.until('error', lambda f: f['key'] == 'error.pose_kept')
            self.robot.listen_to_poses()

        self.run_it(test)

    def test_whether_it_is_lost(self):
        async def test(page, _):
            await page.until('state', lambda f: f['lost'] is None)
            for probability, lost in ((0.6, True), (math.nan, True), (0.3, True), (0.1, False)):
                self.robot.lost.publish(probability)
                await page.until('state', lambda f, lost=lost: f['lost'] is lost)
            await page.until('state', lambda f: f['lost'] is None)  # it has been silent

        self.run_it(test)

    def test_shared_control(self):
        async def none(page, _):
            await page.until('state', lambda f: f['assist'] is None)
            await page.send('override', on=True)
            error = await page.until('error')
            self.assertEqual((error['key'], error['of']), ('error.no_assist', 'override'))

        async def runs(page, other):
            command = Twist()
            command.linear.x, command.angular.z = 0.25, -1.25
            status.publish('The chair steers to the right to keep clear.')
            left.publish(17.4)
            wanted = {'does': 'RIGHT', 'command': {'v': 0.25, 'w': -1.0}, 'left': 17, 'lasts': 12}
            wanted |= {'profile': 'little', 'profiles': ['much', 'little']}
            end = time.monotonic() + PATIENCE_S
            while not any(f['op'] == 'state' and f['assist'] == wanted for f in page.got) and time.monotonic() < end:
                commands.publish(command)
                await asyncio.sleep(0.05)
            state = await page.until('state', lambda f: f['assist'] == wanted)
            self.assertFalse(any('shared_control' in topic for topic in state['connected']))
            await page.until('state', lambda f: f['assist'] == {**wanted, 'command': None}, len(page.got))
            await page.take()
            await other.send('override', on=True)
            self.assertEqual((await other.until('error'))['key'], 'error.other_drives')
            await page.send('override', on=True)
            self.wait(lambda: self.robot.overrides == [True], 'no override')
            await page.send('override', on=False)
            self.wait(lambda: self.robot.overrides == [True, False], 'the override does not end')
            await page.send('help', name='much')
            self.wait(lambda: self.robot.helps == ['much'], 'no other profile')
            status.publish('The chair follows the rider.')
            left.publish(float('nan'))
            await page.until('state', lambda f: f['assist'] == {**wanted, 'does': '', 'command': None, 'left': 0})
            since = len(page.got)
            status.unregister()
            await page.until('state', lambda f: f['assist'] is None, since)

        self.run_it(none)
        rospy.set_param('/shared_control/override_time', 12.0)
        rospy.set_param('/shared_control/profiles', {'much': {'help': 0.6}, 'little': {'help': 0.2}})
        status = rospy.Publisher('/shared_control/status', String, queue_size=1, latch=True)
        profile = rospy.Publisher('/shared_control/profile_in_use', String, queue_size=1, latch=True)
        profile.publish('little')
        left = rospy.Publisher('/shared_control/override_left', Float32, queue_size=1, latch=True)
        commands = rospy.Publisher('/cmd_vel/assisted', Twist, queue_size=1)
        self.run_it(runs)

    def test_foreign_pages_and_names_are_refused(self):
        async def test(_page, _other):
            async with aiohttp.ClientSession() as session:
                for headers, status in (
                    ({'Origin': 'http://evil.example'}, 403),
                    ({'Origin': 'null'}, 403),
                    ({'Host': 'evil.example'}, 421),
                ):
                    with self.assertRaises(aiohttp.WSServerHandshakeError) as refused:
                        await session.ws_connect(f'{self.url}/ws', headers=headers)
                    self.assertEqual(refused.exception.status, status)
                async with session.get(f'{self.url}/') as answer:
                    self.assertEqual(answer.status, 200)
                    self.assertIn("default-src 'self'", answer.headers['Content-Security-Policy'])
                for path in ('/../package.xml', '/%2e%2e/package.xml', '/words', '/nothing'):
                    async with session.get(aiohttp.client.URL(f'{self.url}{path}', encoded=True)) as answer:
                        self.assertEqual(answer.status, 404, path)

        self.run_it(test)

    def test_what_is_no_frame_or_too_long(self):
        async def test(page, other):
            await page.socket.send_str('[' * 3000)
            self.assertEqual((await page.until('error'))['key'], 'error.no_frame')
            await page.socket.send_bytes(b'x')
            await page.until('error', since=len(page.got))
            await page.socket.send_str('x' * 5000)
            end = time.monotonic() + PATIENCE_S
            while not page.socket.closed:
                self.assertLess(time.monotonic(), end, 'a long frame does not end the connection')
                await asyncio.sleep(0.01)
            await other.until('state', since=len(other.got))

        self.run_it(test)

    def test_rosbridge(self):
        """The frames of roslibpy: parameters, a service, a topic each way, and what is not on the list."""

        async def test(_page, _other):
            async with aiohttp.ClientSession() as session, session.ws_connect(f'{self.url}/', max_msg_size=0) as bridge:

                async def ask(**frame):
                    await bridge.send_json(frame)
                    return await asyncio.wait_for(bridge.receive(), PATIENCE_S)

                async def call(service, **args):
                    answer = await ask(op='call_service', id='c', service=service, args=args)
                    return json.loads(answer.data)

                answer = await call('/rosapi/get_param', name='/safety_gate/profile')
                self.assertEqual((answer['result'], json.loads(answer['values']['value'])), (True, 'brisk'))
                self.assertIn('no parameter', (await call('/rosapi/get_param', name='/nothing'))['values'])
                self.assertEqual(
                    (await call('/rosapi/topic_type', topic='/map'))['values'], {'type': 'nav_msgs/OccupancyGrid'}
                )
                self.assertIn('/hmi', (await call('/rosapi/nodes'))['values']['nodes'])
                self.robot.refusal = ''
                answer = await call('/emergency_stop/reset')
                self.assertEqual(answer['values'], {'success': True, 'message': ''})
                self.assertIn('no field', (await call('/emergency_stop/reset', now=True))['values'])
                self.assertIn('not on the list', (await call('/hmi/set_logger_level'))['values'])
                answer = await ask(op='subscribe', topic='/odometry/filtered', throttle_rate=50, compression='none')
                frame = json.loads(answer.data)
                self.assertEqual(frame['msg']['twist']['twist']['linear']['x'], 0.25)
                await bridge.send_json({'op': 'unsubscribe', 'topic': '/odometry/filtered'})
                message = OccupancyGrid(data=[100, -1])
                message.info.width, message.info.height, message.info.origin.orientation.w = 2, 1, 1.0
                self.robot.map.publish(message)
                await bridge.send_json({'op': 'subscribe', 'topic': '/map', 'compression': 'cbor'})
                came = None  # an answer to a request, or the map of an earlier test, may come before
                while came is None or came.type == aiohttp.WSMsgType.TEXT or b'ddata\xd8\x48\x42' not in came.data:
                    came = await asyncio.wait_for(bridge.receive(), PATIENCE_S)
                self.assertTrue(came.data.endswith(b'ddata\xd8\x48\x42\x64\xff'), came.data)
                # What the page listens to, too.
                diagnostics = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=1)
                await bridge.send_json({'op': 'subscribe', 'topic': '/diagnostics'})
                end = time.monotonic() + PATIENCE_S
                while came.type != aiohttp.WSMsgType.TEXT or 'of the test' not in came.data:
                    self.assertLess(time.monotonic(), end, came.data)
                    diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(name='of the test')]))
                    with contextlib.suppress(asyncio.TimeoutError):
                        came = await asyncio.wait_for(bridge.receive(), 0.2)
                await bridge.send_json({'op': 'unsubscribe', 'topic': '/diagnostics'})
                stops = len(self.robot.stops)
                await bridge.send_json({'op': 'advertise', 'topic': '/emergency_stop', 'type': 'std_msgs/Bool'})
                while len(self.robot.stops) == stops:
                    await bridge.send_json({'op': 'publish', 'topic': '/emergency_stop', 'msg': {'data': False}})
                    await asyncio.sleep(0.05)
                self.assertIs(self.robot.stops[-1], False)
                await bridge.send_json({'op': 'advertise', 'topic': '/cmd_vel/touch', 'type': 'geometry_msgs/Twist'})
                refused = None
                while refused is None or refused['op'] != 'status':  # diagnostics may still have been on their way
                    came = await asyncio.wait_for(bridge.receive(), PATIENCE_S)
                    self.assertFalse(bridge.closed)
                    refused = json.loads(came.data) if came.type == aiohttp.WSMsgType.TEXT else None
                self.assertIn('not on the list', refused['msg'])

        self.run_it(test)
        self.assertEqual(self.robot.touched, [])

    def test_z_the_last_word_is_zero(self):
        async def test(page, _):
            await page.take()
            await page.drive(1.0)
            while not self.robot.touched:
                await page.drive(1.0)
                await asyncio.sleep(0.02)
            rosnode.kill_nodes(['/hmi'])
            for _ in range(100):
                with contextlib.suppress(ConnectionError):
                    await page.drive(1.0)
                await asyncio.sleep(0.01)

        self.run_it(test)
        self.ends_with_one_zero()


if __name__ == '__main__':
    rospy.init_node('hmi_test')
    rostest.rosrun('sara_hmi', 'hmi', HmiTest)
