"""A robot that speaks ROS: commands, goals, poses, the emergency stop, named places, speech."""

from __future__ import annotations

import math
import queue
import threading
from collections.abc import Callable
from pathlib import Path

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion, Twist
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from sara_common.config import is_number
from sara_common.planar import quaternion_from_yaw, yaw_of
from sara_control.assist.assist_config import AssistConfig
from sara_hmi.config.config import RobotConfig, profile_faults
from sara_hmi.hub.actions import Order
from sara_hmi.ros.edits import EditsFile, is_offered, without
from sara_hmi.ros.emergency_stop import PRESSED, EmergencyStop
from sara_hmi.ros.goals import Goals
from sara_hmi.ros.places_file import PlacesFile
from sara_hmi.ros.robot_inputs import RobotInputs
from sara_hmi.view.frames import View
from sara_hmi.view.map_image import give_back_memory, map_frame, png
from sara_hmi.web.screen import dumps
from sara_hmi.web.server import Server
from sara_hmi.words.catalogue import Catalogue
from sara_hmi.words.keys import gate
from sara_hmi.words.speaker import Speaker
from sara_nav.maps.places import Place

BUSY = 'error.rate'
SERVICE_S = 1.0  # of wall time that a service is waited for
POSE_VARIANCES = {0: 0.05, 7: 0.05, 35: 0.03}  # m2, m2, rad2: of a pose that is marked on the map
PLACE_VARIANCES = {0: 1.0, 7: 1.0, 35: math.radians(60.0) ** 2}  # of being somewhere in a named place


class RosRobot(RobotInputs):
    """Carries out the server's orders, those that may take long in a thread of their own."""

    def __init__(self, config: RobotConfig, server: Server, words: Path) -> None:
        self._server, self._words = server, words
        self._orders: queue.Queue[Callable[[], None]] = queue.Queue(maxsize=64)
        self._speaker = Speaker()
        self._has_profiles = self._moves = False
        self._out = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        self._stop = EmergencyStop()
        self._cancel = rospy.Publisher('move_base/cancel', GoalID, queue_size=1, tcp_nodelay=True)
        self._set_pose = rospy.Publisher('set_pose', PoseWithCovarianceStamped, queue_size=1, tcp_nodelay=True)
        self._profile = rospy.Publisher('safety_gate/profile', String, queue_size=1, tcp_nodelay=True)
        self._override = rospy.Publisher('shared_control/override', Bool, queue_size=1, tcp_nodelay=True)
        self._help_profile = rospy.Publisher('shared_control/profile', String, queue_size=1, tcp_nodelay=True)
        self._goals = Goals(
            config.map_frame,
            config.settle_s,
            lambda number, key, why: server.post(server.on_end, number, key, why),
            self.forget_plan,
        )
        self._edits = EditsFile(lambda held: server.post(server.screen.on_edits, held))
        self._places = PlacesFile(
            config.places or rospy.get_param('/places_file', ''),
            lambda held: server.post(server.screen.on_places, held),
        )
        super().__init__(config, lambda message: self._later(self._on_map, message), self._on_said)
        self._masks = [
            rospy.Subscriber(topic, numpy_msg(OccupancyGrid), lambda _: self._later(self._edits.read), queue_size=1)
            for topic in ('keepout_filter_mask', 'speed_filter_mask')
        ]
        threading.Thread(target=self._work, name='orders', daemon=True).start()
        self._later(self._places.read)

    # The server's thread

    def view(self) -> View:
        """The newest of everything."""
        view = super().view()
        view.obeys = self._out.get_num_connections() > 0 and not self.mux_is_gone
        return view

    def drive(self, v: float, w: float) -> None:
        """Publish the command of a motion of the robot, m/s and rad/s, at once. It ends a goal: SARA's cmd_vel_mux sees
        to that, here it is done for robots without a gate.
        """
        message = Twist()
        message.linear.x, message.angular.z = v, w * self.turn_slip
        begins, self._moves = bool(v or w) and not self._moves, bool(v or w)
        self._goals.drove(self._moves)
        if begins and not self.has_gate:
            self._cancel.publish(GoalID())
        self._out.publish(message)

    def order(self, order: Order) -> None:
        """Begin to carry out an order: what stops the robot at once, others in their turn."""
        if order.op == 'stop':
            self._stop.press()
            self._goals.forget()
            if not self.has_gate:
                self._cancel.publish(GoalID())
        elif order.op == 'cancel':
            self._goals.cancel()
        elif order.op == 'reset':
            self._begin(order, self._do_reset, self._stop.presses)
        else:
            if order.op == 'go':
                self._goals.want(order.values[0])
            self._begin(order, getattr(self, f'_do_{order.op}'), *order.values)

    def _begin(self, order, function, *arguments):
        if self._later(function, order.client, *arguments):
            return
        if order.op == 'go':
            self._server.post(self._server.on_end, order.values[0], 'goal.cancelled', '')
        self._refuse(order.client, BUSY, order.op)

    def _later(self, function, *arguments):
        """Do it in its turn; False where too much waits."""
        try:
            self._orders.put_nowait(lambda: function(*arguments))
        except queue.Full:
            rospy.logwarn_throttle(5.0, 'orders come faster than they can be carried out: one is dropped')
            return False
        return True

    def _work(self):
        while not rospy.is_shutdown():
            try:
                work = self._orders.get(timeout=1.0)
            except queue.Empty:
                work = self._look_for_parameters
            try:
                self._goals.end_if_unheard()
                work()
            except Exception as error:  # whatever it is: the orders behind it are carried out
                rospy.logwarn('%s: %s', type(error).__name__, error)
            work = None  # else it keeps a map until there is something else to do

    def _refuse(self, client, key, of, **values):
        self._server.post(self._server.on_refusal, client, key, of, values)

    def _say_why(self, client, of, why):
        if why:
            self._refuse(client, why, of)

    # Goals and the emergency stop

    def _do_go(self, client, number, pose):
        if not self._goals.send(number, pose):
            self._refuse(client, 'error.no_navigation', 'go')

    def _do_reset(self, client, presses):
        why = self._stop.release(presses, self.has_gate)
        if why == 'error.no_gate':
            self._refuse(client, why, 'reset')
            return

        def told() -> None:
            self._server.on_reset(client, why if presses == self._stop.presses else PRESSED)

        self._server.post(told)

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

    def _do_profile(self, client, name):
        if self.gate_is_gone:
            self._refuse(client, 'error.no_gate', 'profile')
            return
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
        self._places.look()
        self.maps = is_offered('save_map')
        self._has_profiles = self._has_profiles and not self.gate_is_gone  # one that is started anew has its first
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

    def _do_place(self, client, name, pose):
        self._say_why(client, 'place', self._places.add(Place(name, *pose)))

    def _do_rename(self, client, name, to):
        self._say_why(client, 'rename', self._places.rename(name, to))

    def _do_delete(self, client, name):
        self._say_why(client, 'delete', self._places.remove(name))

    # What is drawn over the map

    def _do_edit(self, client, edit):
        self._say_why(client, 'edit', self._edits.change(lambda held: (*held, edit)))

    def _do_unedit(self, client, edit):
        self._say_why(client, 'unedit', self._edits.change(lambda held: without(held, edit)))

    # Speech

    def _do_say(self, client, key, values, language, asked):
        known = self._server.hub.clients.get(client)
        language = language or (known.language if known else '')
        catalogue = known and Catalogue.load(self._words, language)
        sentence = catalogue and catalogue.say(key, values)
        if not sentence:
            self._refuse(client, 'error.no_words', 'say')
        elif not (self._config.speech and self._speaker.say(language, sentence, asked)):
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
