"""explore: drives the robot by move_base to the frontiers of a map until none is left, under the names of
explore_lite's node.

In: the map (OccupancyGrid) and its updates, /tf, ~resume (Bool), safety_gate/status; with range sensors the first
reading (Range) of each of range_topics, and move_base's global costmap with its updates. Out: goals to move_base,
~frontiers (MarkerArray), ~status (String, latched), /diagnostics.
"""

from __future__ import annotations

import math
import sys
import threading
from collections import deque
from functools import partial

import actionlib
import numpy as np
import rospy
import tf2_ros
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from map_msgs.msg import OccupancyGridUpdate
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import Range
from std_msgs.msg import Bool, String
from visualization_msgs.msg import MarkerArray

from sara_common.config import ConfigError
from sara_common.diagnostics import OK, WARN, Status
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import on_shutdown, start_node
from sara_control.gate.reasons import HOLDS
from sara_localization.ros.shell import configured, publish
from sara_nav.config.parameters import Parameters
from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import LETHAL
from sara_nav.move_base.settings import Settings, read_settings
from sara_nav.ros import conversions as conv
from sara_nav.ros.common import TransformListener
from sara_slam.exploring.explore_config import ExploreConfig
from sara_slam.exploring.explorer import Explorer
from sara_slam.exploring.ground import ground_of, updated
from sara_slam.exploring.orders import Drive, State
from sara_slam.exploring.survey import Survey
from sara_slam.ros.markers import frontier_markers

BY_OTHERS = (GoalStatus.PREEMPTED, GoalStatus.RECALLED, GoalStatus.LOST)
"""How a goal ends that this node did not end."""
PERIOD_S = 0.1
"""s between two looks at how the goal has ended."""


class ExploreNode:
    """Callbacks share one lock. `settings`: move_base's, whose planner and footprint are used."""

    def __init__(self, config: ExploreConfig, settings: Settings):
        self.config, self.lock = config, threading.RLock()
        self.status_pub = rospy.Publisher('~status', String, queue_size=10, latch=True)
        self.markers_pub = rospy.Publisher('~frontiers', MarkerArray, queue_size=1, latch=True)
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=10)
        self.said, self.bad_maps, self.gate = '', 0, ''
        costmap = settings.global_costmap.make(None)
        footprint = costmap.footprint
        self.survey = Survey(config.range_reach, costmap.free_margin) if config.sensors == 'ranges' else None
        self.explorer = Explorer(config, settings.global_planner, footprint, self.say, self.survey)
        self.ground: Costmap | None = None
        self.frame, self.stepped_at = settings.global_frame, rospy.Time()
        self.ends, self.goals = deque(), 0
        self.tf = TransformListener()
        self.client, self.handle = actionlib.ActionClient(config.move_base, MoveBaseAction), None
        topics = (
            (config.costmap_topic, numpy_msg(OccupancyGrid), self.on_map, 1),
            (config.costmap_updates_topic, numpy_msg(OccupancyGridUpdate), self.on_update, 10),
            ('~resume', Bool, self.on_resume, 10),
            ('safety_gate/status', String, self.on_gate, 10),
        )
        if self.survey is not None:
            costmap_topic = f'{config.move_base}/global_costmap/costmap'
            topics += (
                (costmap_topic, numpy_msg(OccupancyGrid), self.on_costmap, 1),
                (f'{costmap_topic}_updates', numpy_msg(OccupancyGridUpdate), self.on_costmap_update, 10),
            )
        self.subscribers = [
            rospy.Subscriber(topic, kind, callback, queue_size=queue) for topic, kind, callback, queue in topics
        ]
        self.ranges = {
            topic: rospy.Subscriber(topic, Range, self.on_range, topic, queue_size=1)
            for topic in (config.range_topics if self.survey else ())
        }
        self.timer = rospy.Timer(rospy.Duration.from_sec(PERIOD_S), self.on_timer, reset=True)
        on_shutdown(self.on_end)

    def say(self, sentence: str) -> None:
        """To the log, and to ~status."""
        self.said = sentence
        rospy.loginfo('%s', sentence)
        publish(self.status_pub, String(sentence))

    # -- messages in ---------------------------------------------------------------------------------------------

    def on_map(self, msg: OccupancyGrid) -> None:
        """A whole map."""
        self._take(lambda: self._explore_on(ground_of(conv.grid_from_msg(msg)), msg.header.frame_id.lstrip('/')))

    def on_update(self, msg: OccupancyGridUpdate) -> None:
        """A part of it."""
        if self.ground is not None:
            self._take(lambda: self._explore_on(updated(self.ground, msg.x, msg.y, _values(msg)), self.frame))

    def _explore_on(self, ground, frame):
        self.ground, self.frame = ground, frame
        self.explorer.on_costmap(ground)
        if self.config.visualize:
            publish(self.markers_pub, frontier_markers(self.explorer, frame, rospy.Time.now()))

    def on_costmap(self, msg: OccupancyGrid) -> None:
        """What move_base plans by."""
        self._take(lambda: self.survey.on_obstacles(ground_of(conv.grid_from_msg(msg))))

    def on_costmap_update(self, msg: OccupancyGridUpdate) -> None:
        """A part of it."""
        if self.survey.obstacles is not None:
            self._take(lambda: self.survey.on_obstacles(updated(self.survey.obstacles, msg.x, msg.y, _values(msg))))

    def _take(self, take):
        try:
            with self.lock:
                take()
        except ValueError as error:
            self.bad_maps += 1
            rospy.logwarn_throttle(10.0, 'a map was dropped: %s', error)

    def on_range(self, msg: Range, topic: str) -> None:
        """A reading of a range sensor: where it sits and how wide its cone is are taken from the first one."""
        try:
            found = self.tf.latest(self.config.robot_base_frame, msg.header.frame_id.lstrip('/'))
            mount = conv.pose_from_transform(found.transform)
        except (tf2_ros.TransformException, ValueError) as error:
            rospy.logwarn_throttle(10.0, 'where the sensor of %s sits is not known: %s', topic, error)
            return
        with self.lock:
            subscriber = self.ranges.pop(topic, None)
            if subscriber is None:
                return
            subscriber.unregister()
            if 0.0 < msg.field_of_view < math.pi:
                self.survey.add_sensor((mount.x, mount.y, mount.yaw), msg.field_of_view)
            else:
                rospy.logwarn('%s says a field_of_view of %r rad: it is not used', topic, msg.field_of_view)

    def on_resume(self, msg: Bool) -> None:
        """True: go on; False: pause."""
        with self.lock:
            if msg.data:
                self.explorer.resume()
            else:
                self._do(self.explorer.pause('it was asked to.'))

    def on_gate(self, msg: String) -> None:
        """What the safety gate says: no goal is given while it would not let the robot drive."""
        self.gate = msg.data if msg.data in HOLDS else ''

    def on_goal_end(self, number: int, handle: actionlib.ClientGoalHandle) -> None:
        """A goal has changed its state. Its end is only noted, for actionlib's locks are held."""
        if handle.get_comm_state() == actionlib.CommState.DONE:
            self.ends.append((number, handle.get_goal_status(), handle.get_goal_status_text()))

    def on_timer(self, _event: rospy.timer.TimerEvent) -> None:
        """Hear how goals ended; decide every 1 / planner_frequency and after each end."""
        with self.lock:
            now = rospy.Time.now()
            ended = self._hear_ends(now.to_sec())
            if not ended and abs((now - self.stepped_at).to_sec()) < 1.0 / self.config.planner_frequency - 1e-3:
                return
            self.stepped_at = now
            self._do(self.explorer.step(now.to_sec(), self._pose(now), self._hold()))
            publish(self.diagnostics_pub, diagnostic_array(now, [self._status()]))

    def _hold(self):
        """Why no goal would do now; '' if one would."""
        if self.survey is not None and not self.survey.sensors:
            return 'no range sensor of range_topics has told anything yet'
        return self.gate or ('' if self.client.wait_for_server(rospy.Duration(0.01)) else 'move_base is not there')

    def _hear_ends(self, now):
        ended = False
        while self.ends:
            number, status, text = self.ends.popleft()
            if number != self.goals:
                continue  # it was stopped, or another one was given
            ended = True
            if status in BY_OTHERS:
                self.explorer.taken_over(text)
            else:
                self.explorer.ended(now, status == GoalStatus.SUCCEEDED, text)
        return ended

    def _pose(self, now):
        """The robot's Pose2D in the map; None where it is not known, or too old."""
        try:
            found = self.tf.latest(self.frame, self.config.robot_base_frame)
            pose = conv.pose_from_transform(found.transform)
        except (tf2_ros.TransformException, ValueError):
            return None
        return pose if abs((now - found.header.stamp).to_sec()) <= self.config.transform_tolerance else None

    def _status(self):
        explorer = self.explorer
        level = WARN if explorer.state is State.PAUSED or self.bad_maps else OK
        values = {
            'state': explorer.state.value,
            'frontiers': len(explorer.found),
            'given_up': sum(map(explorer.given_up, explorer.found)),
            'way': f'{explorer.way:.1f} m',
            'bad_maps': self.bad_maps,
        }
        if self.survey is not None:
            known = self.survey.obstacles
            cells = 0 if known is None else np.count_nonzero(known.costs == LETHAL)
            values['obstacles'] = 'no costmap' if known is None else f'{cells} cells'
        return Status('explore', level, self.said or 'waiting for a map', tuple(sorted(values.items())))

    # -- orders out ----------------------------------------------------------------------------------------------

    def _do(self, order):
        if order is None:
            return
        self.goals += 1
        if isinstance(order, Drive):
            goal = MoveBaseGoal(conv.pose_stamped(order.pose, self.frame, rospy.Time.now()))
            self.handle = self.client.send_goal(goal, partial(self.on_goal_end, self.goals))
        elif self.handle is not None:
            self.handle.cancel()

    def on_end(self) -> None:
        """The node ends: so does the goal that it gave."""
        with self.lock:
            self._do(self.explorer.pause('the node ends.'))
        rospy.rostime.wallsleep(0.1)


def _values(msg):
    if len(msg.data) != msg.width * msg.height:
        raise ValueError(f'an update says {msg.width} x {msg.height} cells but holds {len(msg.data)}')
    return np.array(msg.data, np.int8).reshape(msg.height, msg.width)


def main() -> None:
    """Run the node until ROS shuts down; exit status 1 when its parameters cannot be used."""
    start_node('explore')
    config = configured(ExploreConfig)
    try:
        settings = read_settings(Parameters(rospy.get_param(config.move_base, {})))
    except ConfigError as error:
        rospy.logfatal('explore plans as %s does, and cannot use its parameters: %s', config.move_base, error)
        sys.exit(1)
    ExploreNode(config, settings)
    rospy.spin()
