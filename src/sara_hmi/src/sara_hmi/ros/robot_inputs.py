"""What is known of the robot: the newest message of each topic."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import partial

import genpy
import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import BatteryState, Range
from std_msgs.msg import Float32, String

from sara_common.planar import yaw_of
from sara_control.assist.assist_config import AssistConfig
from sara_hmi.config.config import RobotConfig
from sara_hmi.view.frames import Assist, Pose, Seen, View, finite_pairs
from sara_hmi.words.keys import assist
from sara_nav.move_base.lost import LostWatch

LATELY_S = 2.0  # of wall time: what came within is connected
SILENT_S = 3.5  # of wall time without diagnostics, which come once a second, after which a node hangs
ASKED_S = 0.5  # of wall time for which a command counts as asked
OLDEST_POSE_S = 2.0  # of ROS time


class RobotInputs:
    """Subscribes to all that the page shows. on_map and on_said are called from ROS's threads, on_said with a topic's
    name and its text. turn_slip: the turn rate of a command over that of the motion it asks for, as the safety gate
    counts; motions are shown and asked for as the robot's own. override_s: s that an override of shared control lasts;
    helps: its profiles. maps: whether a map is being made.
    """

    def __init__(
        self,
        config: RobotConfig,
        on_map: Callable[[OccupancyGrid], None],
        on_said: Callable[[str, str], None],
    ) -> None:
        self._config = config
        self.turn_slip = 1.0
        self.override_s, self.helps, self.maps = AssistConfig.override_time, (), False
        self._heard: dict[str, float] = {}
        self._subscribers: dict[str, rospy.Subscriber] = {}
        self._speakers: dict[str, str] = {}  # the node that spoke last on a topic
        self._alive: dict[str, float] = {}  # when a node last gave its diagnostics
        self._diagnostics = rospy.Subscriber('/diagnostics', DiagnosticArray, self._on_diagnostics, queue_size=50)
        self._shown: dict[str, bool] = {}
        self._odometry: Odometry | None = None
        self._asked: Twist | None = None
        self._assisted: Twist | None = None
        self._does, self._override_left, self._help = '', 0.0, ''
        self._battery: BatteryState | None = None
        self._ranges: dict[str, Range] = {}
        self._sensors: dict[str, Pose] = {}
        self._plan: Sequence[tuple[float, float]] = ()
        self._buffer = tf2_ros.Buffer(rospy.Duration(10.0))
        self._listener = tf2_ros.TransformListener(self._buffer)
        self._listen('odom', Odometry, lambda m: setattr(self, '_odometry', m))
        self._listen('cmd_vel_asked', Twist, lambda m: setattr(self, '_asked', m), shown=False)
        self._listen('battery', BatteryState, lambda m: setattr(self, '_battery', m))
        self._listen('map', numpy_msg(OccupancyGrid), on_map, latched=True)
        self._listen('safety_gate/status', String, lambda m: on_said('status', m.data), latched=True)
        self._listen('safety_gate/give_up', String, lambda m: on_said('give_up', m.data), shown=False)
        self._listen('safety_gate/profile', String, lambda m: on_said('profile', m.data), shown=False)
        self._listen('cmd_vel_assisted', Twist, lambda m: setattr(self, '_assisted', m), shown=False)
        self._listen('shared_control/override_left', Float32, self._on_override_left, shown=False)
        self._listen('shared_control/profile_in_use', String, lambda m: setattr(self, '_help', m.data), shown=False)
        self._lost = LostWatch()
        self._listen('lost_probability', Float32, self._on_lost, shown=False)
        self._listen('shared_control/status', String, lambda m: setattr(self, '_does', assist(m.data)), shown=False)
        for topic in config.range_topics:
            self._listen(
                topic, Range, partial(self._ranges.__setitem__, topic.rsplit('/', 1)[-1].removesuffix('_range'))
            )
        self._plan_subscriber: rospy.Subscriber | None = None

    def _listen(self, topic: str, kind: type, handle: Callable, shown: bool = True, latched: bool = False) -> None:
        self._heard[topic] = -math.inf
        if shown:
            self._shown[topic] = latched

        def heard(message: genpy.Message) -> None:
            self._heard[topic] = time.monotonic()
            self._speakers[topic] = _sender(message)
            handle(message)

        self._subscribers[topic] = rospy.Subscriber(topic, kind, heard, queue_size=1, tcp_nodelay=True)

    def follow_plan(self, planner: str) -> None:
        """Listen to the plan of move_base's global planner."""
        topic = f'move_base/{planner.split("/")[-1]}/plan'
        self._plan_subscriber = rospy.Subscriber(topic, Path, self._on_plan, queue_size=1, tcp_nodelay=True)

    @property
    def follows_plan(self) -> bool:
        """Whether the planner's name is known."""
        return self._plan_subscriber is not None

    @property
    def has_gate(self) -> bool:
        """Whether a safety gate has spoken."""
        return self._heard['safety_gate/status'] > -math.inf

    @property
    def has_assist(self) -> bool:
        """Whether shared control runs: it has spoken, and is still there."""
        return self._is_there('shared_control/status')

    def _is_there(self, topic):
        """Whether who speaks on a topic only now and then has spoken, and is still there."""
        return self._heard[topic] > -math.inf and self._subscribers[topic].get_num_connections() > 0

    @property
    def gate_is_gone(self) -> bool:
        """Whether the safety gate has spoken, and is not there any more."""
        return self._is_gone('safety_gate/status')

    @property
    def gate_hangs(self) -> bool:
        """Whether the safety gate's node is connected, gave diagnostics, and gives none any more."""
        last = self._alive.get(self._speakers.get('safety_gate/status', ''), math.inf)
        return time.monotonic() - last > SILENT_S and self._is_there('safety_gate/status')

    @property
    def mux_is_gone(self) -> bool:
        """Whether who passes on the commands has spoken, and is not there any more."""
        return self._is_gone('cmd_vel_asked')

    def _is_gone(self, topic):
        return self._heard[topic] > -math.inf and not self._is_there(topic)

    def _on_diagnostics(self, message):
        self._alive[_sender(message)] = time.monotonic()

    def _on_override_left(self, message):
        self._override_left = message.data if math.isfinite(message.data) else 0.0

    def _on_lost(self, message):
        config = self._config
        dropped = self._lost.hear(message.data, time.monotonic(), config.lost_limit, config.found_limit)
        if dropped:
            rospy.logwarn_once('%s', dropped)

    def _on_plan(self, message):
        self._plan = finite_pairs((held.pose.position.x, held.pose.position.y) for held in message.poses)

    def forget_plan(self) -> None:
        """Nobody follows a plan."""
        self._plan = ()

    def plan(self) -> Sequence[tuple[float, float]]:
        """The newest plan's points."""
        return self._plan

    def pose(self) -> Pose | None:
        """Where the robot is in the map, None where that is not known, or too old."""
        try:
            found = self._buffer.lookup_transform(self._config.map_frame, self._config.base_frame, rospy.Time(0))
        except tf2_ros.TransformException:
            return None
        if abs((rospy.Time.now() - found.header.stamp).to_sec()) > OLDEST_POSE_S:
            return None
        return _finite(found.transform)

    def view(self) -> View:
        """The newest of everything."""
        now = time.monotonic()
        view = View(pose=self.pose(), maps=self.maps, gate_is_gone=self.gate_is_gone or self.gate_hangs)
        if self._odometry is not None and now - self._heard['odom'] < LATELY_S:
            twist = self._odometry.twist.twist
            view.v, view.w = twist.linear.x, twist.angular.z
        view.asked = self._motion('cmd_vel_asked', self._asked, now)
        if self.has_assist:
            command = self._motion('cmd_vel_assisted', self._assisted, now)
            view.assist = Assist(
                self._does, command, self._override_left, self.override_s, self._help, tuple(self.helps)
            )
        view.lost = None if self._lost.silent(now) else self._lost.lost
        if self._battery is not None:
            view.battery = (self._battery.percentage, self._battery.voltage)
        view.connected = {
            topic: self._is_there(topic) if latched else now - self._heard[topic] < LATELY_S
            for topic, latched in self._shown.items()
        }
        return view

    def _motion(self, topic, command, now):
        """(m/s, rad/s) of the motion that a command asks for; None where none came of late."""
        if command is None or not now - self._heard[topic] < ASKED_S:
            return None
        return command.linear.x, command.angular.z / self.turn_slip

    def ranges(self) -> dict[str, Seen]:
        """The newest readings of the sensors whose place is known."""
        seen = {}
        for name, message in list(self._ranges.items()):
            pose = self._place(message.header.frame_id)
            if pose is not None and not math.isnan(message.range):
                seen[name] = Seen(pose, message.range, message.min_range, message.max_range, message.field_of_view)
        return seen

    def _place(self, frame):
        """Where a sensor sits on the robot; it stays there."""
        if frame not in self._sensors:
            try:
                found = self._buffer.lookup_transform(self._config.base_frame, frame, rospy.Time(0))
            except tf2_ros.TransformException:
                return None
            pose = _finite(found.transform)
            if pose is None:
                return None
            self._sensors[frame] = pose
        return self._sensors[frame]


def _sender(message):
    """The name of the node that a message came from; empty where rospy does not tell."""
    return (getattr(message, '_connection_header', None) or {}).get('callerid', '')


def _finite(transform):
    """The pose of a transform, None where it holds no numbers."""
    pose = (transform.translation.x, transform.translation.y, yaw_of(transform.rotation))
    return pose if all(map(math.isfinite, pose)) else None
