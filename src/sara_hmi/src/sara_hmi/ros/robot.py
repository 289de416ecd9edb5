"""A robot that speaks ROS: commands, goals, poses, the emergency stop, named places, speech."""

from __future__ import annotations

import math
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path

import actionlib
import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion, Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from sara_common.config import is_number
from sara_common.planar import quaternion_from_yaw, yaw_of
from sara_control.assist.assist_config import AssistConfig
from sara_hmi.config.config import RobotConfig, profile_faults
from sara_hmi.hub.actions import Order
from sara_hmi.ros.edits import EditsFile, is_offered, without
from sara_hmi.ros.robot_inputs import RobotInputs
from sara_hmi.view.map_image import give_back_memory, map_frame, png
from sara_hmi.web.screen import dumps
from sara_hmi.web.server import Server
from sara_hmi.words import endings
from sara_hmi.words.catalogue import Catalogue
from sara_hmi.words.keys import gate
from sara_hmi.words.speaker import Speaker
from sara_nav.maps import places

SERVICE_S = 1.0  # of wall time that a service is waited for
RELEASE_TRIES, RELEASE_PAUSE_S = 5, 0.1
POSE_VARIANCES = {0: 0.05, 7: 0.05, 35: 0.03}  # m2, m2, rad2: of a pose that is marked on the map
PLACE_VARIANCES = {0: 1.0, 7: 1.0, 35: math.radians(60.0) ** 2}  # of being somewhere in a named place


class RosRobot(RobotInputs):
    """Carries out the server's orders, those that may take long in a thread of their own."""

    def __init__(self, config: RobotConfig, server: Server, words: Path) -> None:
        self._server, self._words = server, words
        self._orders: queue.Queue[Callable[[], None]] = queue.Queue(maxsize=64)
        self._speaker = Speaker()
        self._has_profiles = False
        self._driven = -math.inf
        self._out = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        self._stop = rospy.Publisher('emergency_stop', Bool, queue_size=1, latch=True, tcp_nodelay=True)
        self._cancel = rospy.Publisher('move_base/cancel', GoalID, queue_size=1, tcp_nodelay=True)
        self._set_pose = rospy.Publisher('set_pose', PoseWithCovarianceStamped, queue_size=1, tcp_nodelay=True)
        self._profile = rospy.Publisher('safety_gate/profile', String, queue_size=1, tcp_nodelay=True)
        self._override = rospy.Publisher('shared_control/override', Bool, queue_size=1, tcp_nodelay=True)
        self._help_profile = rospy.Publisher('shared_control/profile', String, queue_size=1, tcp_nodelay=True)
        self._goals = actionlib.ActionClient('move_base', MoveBaseAction)
        self._goal: actionlib.ClientGoalHandle | None = None
        self._edits = EditsFile(lambda held: server.post(server.screen.on_edits, held))
        self._places_file = config.places or rospy.get_param('/places_file', '')
        super().__init__(config, lambda message: self._later(self._on_map, message), self._on_said)
        self._masks = [
            rospy.Subscriber(topic, rospy.AnyMsg, lambda _: self._later(self._edits.read), queue_size=1)
            for topic in ('keepout_filter_mask', 'speed_filter_mask')
        ]
        threading.Thread(target=self._work, name='orders', daemon=True).start()
        self._later(self._tell_places)

    # The server's thread

    def drive(self, v: float, w: float) -> None:
        """Publish the command of a motion of the robot, m/s and rad/s, at once."""
        message = Twist()
        message.linear.x, message.angular.z = v, w * self.turn_slip
        self._driven = time.monotonic()
        self._out.publish(message)

    def order(self, order: Order) -> None:
        """Begin to carry out an order: the emergency stop at once, others in their turn."""
        if order.op == 'stop':
            self._stop.publish(Bool(True))
            if not self.has_gate:
                self._cancel.publish(GoalID())
        elif order.op == 'cancel':
            self._later(self._cancel_goal)
        else:
            self._later(getattr(self, f'_do_{order.op}'), order.client, *order.values)

    def _later(self, function, *arguments):
        try:
            self._orders.put_nowait(lambda: function(*arguments))
        except queue.Full:
            rospy.logwarn_throttle(5.0, 'orders come faster than they can be carried out: one is dropped')

    def _work(self):
        while not rospy.is_shutdown():
            try:
                work = self._orders.get(timeout=1.0)
            except queue.Empty:
                self._look_for_parameters()
                continue
            try:
                work()
            except (rospy.ROSException, rospy.ServiceException, OSError, ValueError) as error:
                rospy.logwarn('%s', error)
            work = None  # else it keeps a map until there is something else to do

    def _refuse(self, client, key, of, **values):
        self._server.post(self._server.on_refusal, client, key, of, values)

    # Goals

    def _do_go(self, client, number, pose):
        if not self._goals.wait_for_server(rospy.Duration(SERVICE_S)):
            self._refuse(client, 'error.no_navigation', 'go')
            self._server.post(self._server.on_end, number, 'goal.rejected', 'error.no_navigation')
            return
        while not rospy.is_shutdown() and (rest := self._driven + self._config.settle_s - time.monotonic()) > 0.0:
            rospy.rostime.wallsleep(rest)  # else cmd_vel_mux takes the page to drive still, and cancels the goal
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id, goal.target_pose.header.stamp = self._config.map_frame, rospy.Time.now()
        goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = pose[:2]
        goal.target_pose.pose.orientation = Quaternion(*quaternion_from_yaw(pose[2]))

        def heard(handle: actionlib.ClientGoalHandle) -> None:
            if handle.get_comm_state() != actionlib.CommState.DONE:
                return
            status, text = handle.get_goal_status(), handle.get_goal_status_text()
            rospy.loginfo('the goal of the page has ended: %s', text)
            unreached = endings.ending(status) in ('goal.aborted', 'goal.rejected')
            why = endings.why(text) if unreached else ''
            self._server.post(self._server.on_end, number, endings.ending(status), why)

        self._goal = self._goals.send_goal(goal, heard)

    def _cancel_goal(self):
        if self._goal is not None:
            self._goal.cancel()

    # The emergency stop

    def _do_reset(self, client):
        if not self.has_gate:
            self._stop.publish(Bool(False))
            self._server.post(self._server.on_reset, client, '')
            return
        try:
            rospy.wait_for_service('emergency_stop/reset', SERVICE_S)
        except rospy.ROSException:
            self._refuse(client, 'error.no_gate', 'reset')
            return
        release = rospy.ServiceProxy('emergency_stop/reset', Trigger)
        for _ in range(RELEASE_TRIES):
            self._stop.publish(Bool(False))
            rospy.rostime.wallsleep(RELEASE_PAUSE_S)  # the gate hears it
            answer = release()
            if answer.success or endings.reset(answer.message) != 'error.reset_pressed':
                break
        self._server.post(self._server.on_reset, client, '' if answer.success else endings.reset(answer.message))

    # Pose and profile

    def _do_pose(self, client, pose, somewhere):
        if not self._set_pose.get_num_connections():
            self._refuse(client, 'error.pose_kept', 'pose')
            return
        x, y, yaw = pose
        message = PoseWithCovarianceStamped()
        message.header.frame_id, message.header.stamp = self._config.map_frame, rospy.Time.now()
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation = Quaternion(*quaternion_from_yaw(yaw))
        covariance = [0.0] * 36
        for index, variance in (PLACE_VARIANCES if somewhere else POSE_VARIANCES).items():
            covariance[index] = variance
        message.pose.covariance = covariance
        self._set_pose.publish(message)

    def _do_save_map(self, client):
        try:
            rospy.wait_for_service('save_map', SERVICE_S)
            answer = rospy.ServiceProxy('save_map', Trigger)()
        except (rospy.ROSException, rospy.ServiceException) as error:
            rospy.logwarn('%s', error)
            self._refuse(client, 'error.no_map', 'save_map')
            return
        if answer.success:
            saved = dumps({'op': 'saved', 'key': 'event.map_saved', 'values': {}})
            self._server.post(self._server.everyone, saved)
        else:
            rospy.logwarn('the map is not saved: %s', answer.message)
            self._refuse(client, 'error.map_file', 'save_map')

    def _do_profile(self, _client, name):
        self._profile.publish(String(name))

    def _do_override(self, _client, on):
        self._override.publish(Bool(on))

    def _do_help(self, _client, name):
        self._help_profile.publish(String(name))

    def _look_for_parameters(self):
        """What a launch may set later than this node starts: the gate's profiles and slip, shared control's profiles
        and how long its override lasts, the planner's name, and whether somebody makes a map.
        """
        self._edits.look()
        self.maps = is_offered('save_map')
        profiles = None if self._has_profiles else rospy.get_param('safety_gate/profiles', None)
        if profiles is not None and not profile_faults(profiles):
            self._has_profiles = True
            slip = rospy.get_param('safety_gate/turn_slip', 1.0)
            self.turn_slip = float(slip) if is_number(slip) and 1.0 <= slip <= 2.0 else 1.0
            use = rospy.get_param('safety_gate/profile', next(iter(profiles)))
            self._server.post(self._server.on_profiles, profiles, use)
        lasts = rospy.get_param_cached('shared_control/override_time', None) if self.has_assist else None
        self.override_s = float(lasts) if is_number(lasts) else AssistConfig.override_time
        helps = rospy.get_param_cached('shared_control/profiles', None) if self.has_assist else None
        self.helps = tuple(map(str, helps)) if isinstance(helps, dict) else ()
        planner = rospy.get_param('move_base/base_global_planner', '') if not self.follows_plan else ''
        if planner:
            self.follow_plan(planner)

    # Places

    def _tell_places(self):
        if not self._places_file or not Path(self._places_file).is_file():
            return
        try:
            found = places.load(self._places_file)
        except places.PlacesError as error:
            rospy.logwarn('%s', error)
            return
        self._server.post(self._server.screen.on_places, {name: (p.x, p.y, p.yaw) for name, p in found.items()})

    def _change_places(self, client, of, change):
        if not self._places_file:
            self._refuse(client, 'error.places_file', of)
            return
        try:
            change()
        except places.PlacesError as error:
            rospy.logwarn('%s', error)
            self._refuse(client, 'error.places_file', of)
        self._tell_places()

    def _do_place(self, client, name, pose):
        self._change_places(client, 'place', lambda: places.write(self._places_file, places.Place(name, *pose)))

    def _do_rename(self, client, name, to):
        self._change_places(client, 'rename', lambda: places.rename(self._places_file, name, to))

    def _do_delete(self, client, name):
        self._change_places(client, 'delete', lambda: places.remove(self._places_file, name))

    # What is drawn over the map

    def _do_edit(self, client, edit):
        why = self._edits.change(lambda held: (*held, edit))
        if why:
            self._refuse(client, why, 'edit')

    def _do_unedit(self, client, edit):
        why = self._edits.change(lambda held: without(held, edit))
        if why:
            self._refuse(client, why, 'unedit')

    # Speech

    def _do_say(self, client, key, values):
        known = self._server.hub.clients.get(client)
        catalogue = known and Catalogue.load(self._words, known.language)
        sentence = catalogue and catalogue.say(key, values)
        if not sentence:
            self._refuse(client, 'error.no_words', 'say')
        elif not (self._config.speech and self._speaker.say(known.language, sentence)):
            self._refuse(client, 'error.no_speech', 'say')

    # ROS's threads

    def _on_said(self, topic, text):
        post, server = self._server.post, self._server
        if topic == 'profile':
            post(server.on_profile, text)
            return
        post(server.screen.on_gate, (*gate(text), text))

    def _on_map(self, message: OccupancyGrid):
        info = message.info
        origin = (info.origin.position.x, info.origin.position.y, yaw_of(info.origin.orientation))
        if not all(map(math.isfinite, origin)):
            rospy.logwarn('a map whose origin is no number is not shown')
            return
        image = png(message.data, info.width, info.height)
        frame = map_frame(image, (info.width, info.height), info.resolution, origin)
        self._server.post(self._server.screen.show, frame, image)
        self._edits.read()
        give_back_memory()
