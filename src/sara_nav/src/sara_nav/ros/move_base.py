"""The node move_base: goals by action or topic in, cmd_vel out; the work is done in
sara_nav.move_base.state_machine.
"""

import sys
import threading
import time
from collections import deque
from typing import Any

import rospy
from geometry_msgs.msg import Twist
from move_base_msgs.msg import RecoveryStatus
from std_msgs.msg import Bool, Float32, String

from sara_common.config import ConfigError
from sara_common.diagnostics import WARN
from sara_common.ros.clock import Clock
from sara_common.ros.node import on_shutdown, start_node
from sara_nav.config.parameters import Parameters
from sara_nav.goals.move_base_config import ACTIVE, IDLE, MoveBaseConfig
from sara_nav.goals.plan_maker import LONG
from sara_nav.move_base import warming
from sara_nav.move_base.cycle_monitor import CycleWatch
from sara_nav.move_base.settings import Settings, read_settings
from sara_nav.ros import conversions as conv
from sara_nav.ros.common import TransformListener, move_parameters
from sara_nav.ros.goal_requests import GoalRequests
from sara_nav.ros.publishers import PlannerTopics
from sara_nav.ros.report import Report
from sara_nav.ros.robot_inputs import RobotInputs
from sara_nav.ros.services import Services
from sara_nav.ros.tuning import Tuning, shells

CATCH_UP = 0.05
"""s of the machine's own time for which messages that waited are heard after a cycle that took longer than LONG."""


def read_parameters() -> Parameters:
    """Return the Parameters of this node, with what is set in the namespaces above it."""
    tree = rospy.get_param('~', {})
    above, space = {}, rospy.get_name()
    while space:  # from the namespace above the node's own up to the root, as the peer searches
        space = space.rsplit('/', 1)[0]
        values = rospy.get_param(space or '/', {})
        if isinstance(values, dict):
            above = {**{name: value for name, value in values.items() if not isinstance(value, dict)}, **above}
    return Parameters(tree if isinstance(tree, dict) else {}, above)


class MoveBaseNode:
    """The shell around MoveBase; see the module. ``lock`` is held while the machine works."""

    def __init__(self, settings: Settings):
        self.settings = settings
        self.machine = settings.make_move_base()
        self.lock = threading.RLock()
        self._abort_reasons, self._lost_heard = deque(maxlen=10), deque(maxlen=10)
        self._excused = False
        self._stopped, self._clock = False, Clock()
        warming.warm()
        self.watch = CycleWatch()
        self.report = Report(self)
        self.tf = TransformListener()
        self.robot = RobotInputs(settings, self.tf)
        self.cmd_vel = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        self.machine.before_planning = lambda: self.cmd_vel.publish(Twist())
        self.goals = GoalRequests(self.machine, self.robot, settings.global_frame, self.cmd_vel)
        self.recovery_status = rospy.Publisher('move_base/recovery_status', RecoveryStatus, queue_size=1)
        self.help = rospy.Publisher('~help', String, queue_size=1, latch=True)
        self.asked = ''  # what a person is asked for now
        self.topics = self._planner_topics()
        self._abort_subscriber = rospy.Subscriber('~abort', String, self._on_abort, queue_size=10, tcp_nodelay=True)
        topic = settings.move_base.lost_topic
        self._lost_subscriber = topic and rospy.Subscriber(topic, Float32, self._on_lost, queue_size=1)
        self._wait_subscriber = rospy.Subscriber('~wait', Bool, self._on_wait, queue_size=1, tcp_nodelay=True)
        self.shells = shells(settings, self.machine, self.tf, self.lock)
        self._drawn = self._maps_and_masks()
        on_shutdown(self.stop)

    # -- messages in -------------------------------------------------------------------------------------------

    def _on_abort(self, msg):
        self._abort_reasons.append(msg.data)

    def _on_lost(self, msg):
        self._lost_heard.append((msg.data, rospy.get_time()))

    def _on_wait(self, msg):
        self._excused |= msg.data

    # -- running -----------------------------------------------------------------------------------------------

    def run(self) -> None:
        """Wait for the map, bring action server and services up, and control until ROS shuts down."""
        while not rospy.is_shutdown():
            self._take_in(rospy.Time.now())
            missing = self.machine.costmaps.missing()
            if not missing:
                break
            rospy.loginfo_throttle(5.0, 'waiting: %s', missing)
            self.report.publish(WARN, f'waiting: {missing}')
            time.sleep(0.05)
        if rospy.is_shutdown():
            return
        self.machine.costmaps.ensure(rospy.get_time())
        self.services = Services(self)
        self.tuning = Tuning(self)
        self.goals.start()
        rospy.loginfo(
            'ready for goals (%s, %s)', self.machine.config.base_global_planner, self.machine.config.base_local_planner
        )
        frequency, rate = None, None
        while not rospy.is_shutdown():
            if frequency != self.machine.config.controller_frequency:
                frequency = self.machine.config.controller_frequency
                rate = rospy.Rate(frequency)
            try:
                with self.lock:
                    if self._stopped:
                        break
                    if self._clock.went_back():  # the clock of a real robot, too, which rospy does not look at
                        raise rospy.ROSTimeMovedBackwardsException(rospy.get_time())
                    self._cycle()
                rate.sleep()
            except rospy.ROSTimeMovedBackwardsException:
                self._time_went_back()
                frequency = None
            except rospy.ROSException:
                if not rospy.is_shutdown():
                    raise
                break

    def _time_went_back(self):
        rospy.logwarn('time went back: transforms and the goal are forgotten')
        self.robot.forget()
        self.watch.forget()
        self._lost_heard.clear()
        self.machine.lost.forget()
        for shell in self.shells.values():
            shell.time_went_back()
        self.report.forget()
        self.goals.time_went_back()
        with self.lock:
            self.machine.abort('Goal aborted: time went back.')

    def reconfigure(self, config: MoveBaseConfig, global_planner: Any = None, local_planner: Any = None) -> None:
        """Go on with another configuration of move_base; new planners come with their topics. Called with the lock
        held.
        """
        old = self.machine.config
        listed = ('clearing_rotation_allowed', 'conservative_reset_dist')
        other = any(getattr(old, name) != getattr(config, name) for name in listed)
        self.machine.reconfigure(
            config, global_planner, local_planner, self.settings.recoveries.make(config) if other else None
        )
        if global_planner or local_planner:
            self.topics.close()
            self.topics = self._planner_topics()
        if global_planner:
            self.services.offer(global_planner)

    def _planner_topics(self):
        return PlannerTopics(
            self.machine.global_planner,
            self.machine.local_planner,
            self.settings.global_frame,
            self.settings.local_frame,
        )

    def is_wanted(self) -> bool:
        """True when a goal has come: whatever else is under way makes room."""
        return self.goals.waiting or rospy.is_shutdown()

    def _take_in(self, now):
        """Hand what sensors and map servers sent to the costmaps; a new map is planned on at once, and a new mask, too,
        without replan_when_blocked, which looks whether it lies on the plan.
        """
        # before there is a server, a first map is waited for
        listen = self.machine.costmaps_run or not self.goals.listening
        for shell in self.shells.values():
            (shell.inputs.start if listen else shell.inputs.stop)()
            shell.take_in(now)
        before, self._drawn = self._drawn, self._maps_and_masks()
        maps, masks = (any(new is not old for new, old in zip(*pair)) for pair in zip(self._drawn, before))
        if maps or masks and not self.machine.config.replan_when_blocked:
            self.machine.replan()

    def _maps_and_masks(self):
        """What static layers, and what keep-out filters hold: other objects once another map or mask came."""
        costmaps = (self.machine.global_costmap, self.machine.local_costmap)
        return (
            [getattr(layer, 'costs', None) for costmap in costmaps for layer in costmap.map_layers.values()],
            [layer.mask for costmap in costmaps for layer in costmap.keepout_layers.values()],
        )

    def _cycle(self):
        now = rospy.Time.now()
        t = now.to_sec()
        machine = self.machine
        late = self.watch.begins(t, machine.config.controller_frequency, machine.active)
        if late:
            rospy.logwarn_throttle(5.0, '%s', late)
        self._take_in(now)
        self._hear_whether_lost()
        self._hear_who_stops()
        self.goals.take(t)
        pose, pose_time, local_pose = self.robot.poses()
        began = time.perf_counter()
        result = machine.step(t, pose, self.robot.velocity(t), pose_time, local_pose)
        self.watch.worked(time.perf_counter() - began)
        late = rospy.get_time() - t > LONG  # the robot is no more where its command is for
        for kind, window in machine.costmaps.take_changed().items():
            self.shells[kind].publish(window, pose if kind == 'global' else local_pose or pose, now)
        self._announce(result, pose, now)
        if result.status == ACTIVE:
            self.cmd_vel.publish(Twist() if late else conv.twist_to_msg(*result.command))
            if pose is not None:
                self.goals.feedback(pose, now)
                g = machine.local_costmap.geometry
                self.topics.publish_cycle(pose, 0.5 * max(g.width, g.height) * g.resolution, now)
            if result.text:
                rospy.logwarn_throttle(2.0, '%s%s', result.text, self.robot.problem and ': ' + self.robot.problem)
            self.goals.tell(result.text or result.doing)
        elif result.status != IDLE:
            self.goals.finish(result)
        self.report.cycle(result, t)
        if late:
            rospy.rostime.wallsleep(CATCH_UP)

    def _announce(self, result, pose, now):
        """Publish what begins in this step: that a person is asked for help (or '' that it is over), a recovery
        behaviour, a plan, another goal than the one that was asked for.
        """
        frame = self.settings.global_frame
        if result.help != self.asked:
            self.asked = result.help
            self.help.publish(String(self.asked))
        if result.recovery is not None:
            index, total, name = result.recovery
            rospy.logwarn('recovery behaviour %d of %d: %s', index + 1, total, result.text or name)
            self.recovery_status.publish(RecoveryStatus(conv.pose_stamped(pose, frame, now), index, total, name))
        if result.plan is not None:
            self.topics.publish_plan(result.plan, self.machine.global_costmap.costmap, now)
        if result.goal_used is not None:
            rospy.logwarn('%s', result.text)
            self.goals.show(result.goal_used, now)

    def _hear_whether_lost(self):
        config = self.machine.config
        while self._lost_heard:
            dropped = self.machine.lost.hear(*self._lost_heard.popleft(), config.lost_limit, config.found_limit)
            if dropped:
                self.robot.counts['bad_lost'] += 1
                rospy.logwarn_once('%s', dropped)

    def _hear_who_stops(self):
        """Give up the goal that whoever stops the robot says cannot be reached now, one that comes later is not meant;
        or do not take standing for being stuck.
        """
        while self._abort_reasons:
            self.machine.abort(f'Goal aborted: {self._abort_reasons.popleft()}')
        if self._excused:
            self._excused = False
            self.machine.excuse_standing()

    def stop(self) -> None:
        """The node ends: the last word to the wheels is zero, and to the client that the goal is given up."""
        with self.lock:  # after this no cycle commands anything
            self._stopped = True
            if not self.machine.active:
                return
            self.cmd_vel.publish(Twist())
            self.goals.give_up('Aborting on the goal because the node has been killed')
            rospy.rostime.wallsleep(0.1)  # the messages are to get out


def main() -> None:
    """Run the node until ROS shuts down; exit status 1 when its parameters cannot be used."""
    start_node('move_base')
    parameters = read_parameters()
    try:
        settings = read_settings(parameters)
    except ConfigError as error:
        rospy.logfatal('move_base cannot start: %s', error)
        sys.exit(1)
    for warning in settings.warnings:
        rospy.logwarn('%s', warning)
    move_parameters(parameters)
    node = MoveBaseNode(settings)
    try:
        node.run()
    except Exception:  # a fault of ours: the node ends, but not with the robot under way
        node.stop()
        raise
