"""The node move_base: goals by action or topic in, cmd_vel out; the work is done in sara_nav.move_base."""
import sys
import threading
import time

import actionlib
import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import (MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult)
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from std_msgs.msg import String

from sara_nav import costmap as cm
from sara_nav import kernels
from sara_nav import move_base as mb
from sara_nav.parameters import ParameterError, Parameters
from sara_nav.ros import conversions as conv
from sara_nav.ros.common import ERROR, OK, WARN, Diagnostics, TransformListener
from sara_nav.settings import read_settings

ODOM_TIMEOUT = 0.5
"""Seconds after which a measured velocity is no longer believed."""


def read_parameters():
    """Return the Settings of this node's parameters; raises ParameterError."""
    tree = rospy.get_param('~', {})
    found = {}
    for name in ('footprint', 'robot_radius'):
        space = rospy.get_name()
        while space:  # from the namespace above the node's own up to the root, as the peer searches
            space = space.rsplit('/', 1)[0]
            if rospy.has_param(space + '/' + name):
                found[name] = rospy.get_param(space + '/' + name)
                break
    return read_settings(Parameters(tree if isinstance(tree, dict) else {}), **found)


class MoveBaseNode:
    """The shell around MoveBase; see the module."""

    def __init__(self, settings):
        self.settings = settings
        self.machine = settings.make_move_base()
        self._lock = threading.Lock()
        self._map = None
        self._abort_reason = None
        self._odom = None
        self._pose_problem = ''
        self.counts = {'missed_cycles': 0, 'bad_maps': 0, 'bad_odometry': 0, 'refused_goals': 0}
        self._worst_cycle = 0.0
        self._last_cycle = None
        self._last_end = ''
        self._diagnostics_at = -1.0
        kernels.warm()
        self.diagnostics = Diagnostics('navigation')
        self.tf = TransformListener()
        self.cmd_vel = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
        self.current_goal = rospy.Publisher('~current_goal', PoseStamped, queue_size=1)
        planner = settings.move_base.base_global_planner.split('/')[-1]
        self.plan = rospy.Publisher('~%s/plan' % planner, Path, queue_size=1, latch=True)
        self.costmap = rospy.Publisher('~global_costmap/costmap', OccupancyGrid, queue_size=1, latch=True)
        self._odom_subscriber = rospy.Subscriber('odom', Odometry, self._on_odom, queue_size=1, tcp_nodelay=True)
        self._map_subscriber = rospy.Subscriber(settings.map_topic, OccupancyGrid, self._on_map, queue_size=1,
                                                tcp_nodelay=True)
        self._abort_subscriber = rospy.Subscriber('~abort', String, self._on_abort, queue_size=10, tcp_nodelay=True)
        self.server = None
        rospy.on_shutdown(self._on_shutdown)

    # -- messages in -------------------------------------------------------------------------------------------

    def _on_odom(self, msg):
        twist = msg.twist.twist
        velocity = twist.linear.x, twist.angular.z
        if not all(abs(v) < 100.0 for v in velocity):  # false for NaN too
            self.counts['bad_odometry'] += 1
            rospy.logwarn_once('odometry with velocity %s is dropped: not a sound speed', velocity)
            return
        self._odom = velocity, msg.header.stamp.to_sec()

    def _on_map(self, msg):
        if self.settings.first_map_only and self.machine.costmap is not None:
            return
        try:
            if msg.header.frame_id.lstrip('/') != self.settings.global_frame:
                raise ValueError('it is in frame %r but global_frame is %r' % (
                    msg.header.frame_id, self.settings.global_frame))
            grid_map = conv.grid_from_msg(msg)
            if abs(grid_map.origin_yaw) > 1e-6:
                raise ValueError('its origin is turned by %.3f rad but must not be' % grid_map.origin_yaw)
            built = self.settings.make_costmap(grid_map)
        except ValueError as error:
            self.counts['bad_maps'] += 1
            rospy.logerr('a map was dropped: %s', error)
            return
        with self._lock:
            self._map = built

    def _on_abort(self, msg):
        with self._lock:
            self._abort_reason = msg.data

    def _on_simple_goal(self, msg):
        action = MoveBaseActionGoal(goal=MoveBaseGoal(target_pose=msg))
        action.header.stamp = rospy.Time.now()
        self._goal_publisher.publish(action)

    # -- running -----------------------------------------------------------------------------------------------

    def run(self):
        """Wait for the map, bring the action server up, and control until ROS shuts down."""
        while not rospy.is_shutdown() and not self._take_map():
            rospy.loginfo_throttle(5.0, 'waiting for a map on %s', self._map_subscriber.resolved_name)
            self._publish_diagnostics(WARN, 'waiting for a map on %s' % self._map_subscriber.resolved_name)
            time.sleep(0.05)
        if rospy.is_shutdown():
            return
        self.server = actionlib.SimpleActionServer('move_base', MoveBaseAction, auto_start=False)
        self.server.start()
        self._goal_publisher = rospy.Publisher('move_base/goal', MoveBaseActionGoal, queue_size=1)
        self._simple_subscriber = rospy.Subscriber('move_base_simple/goal', PoseStamped, self._on_simple_goal,
                                                   queue_size=1, tcp_nodelay=True)
        rospy.loginfo('ready for goals (%s, %s)', self.settings.move_base.base_global_planner,
                      self.settings.move_base.base_local_planner)
        rate = rospy.Rate(self.settings.move_base.controller_frequency)
        while not rospy.is_shutdown():
            self._cycle()
            try:
                rate.sleep()
            except rospy.ROSTimeMovedBackwardsException:
                rospy.logwarn('time went back: transforms and the goal are forgotten')
                self.tf.buffer.clear()
                self._odom, self._last_cycle = None, None
                self._diagnostics_at = -1.0
                self.machine.abort('Goal aborted: time went back.')
                rate = rospy.Rate(self.settings.move_base.controller_frequency)
            except rospy.ROSInterruptException:
                break

    def _take_map(self):
        with self._lock:
            built, self._map = self._map, None
        if built is None:
            return False
        self.machine.set_costmap(built)
        g = built.geometry
        rospy.loginfo('global costmap of %d x %d cells of %.3g m', g.width, g.height, g.resolution)
        self.costmap.publish(conv.grid_to_msg(cm.to_occupancy(built.costs), g, 0.0, self.settings.global_frame,
                                              rospy.Time.now()))
        return True

    def _cycle(self):
        now = rospy.Time.now()
        t = now.to_sec()
        self._measure_cycle(t)
        self._take_map()
        self._take_abort()
        self._take_requests(t)
        pose, pose_time = self._robot_pose()
        was_active = self.machine.active
        result = self.machine.step(t, pose, self._velocity(t), pose_time)
        if result.status == mb.ACTIVE:
            self.cmd_vel.publish(conv.twist_to_msg(*result.command))
            if pose is not None:
                self.server.publish_feedback(MoveBaseFeedback(
                    base_position=conv.pose_stamped(pose, self.settings.global_frame, now)))
            if result.text:
                rospy.logwarn_throttle(2.0, '%s%s', result.text, self._pose_problem and ': ' + self._pose_problem)
        elif result.status != mb.IDLE:
            self._finish(result)
        elif was_active:
            self.cmd_vel.publish(Twist())
        if result.plan is not None:
            self.plan.publish(conv.path_to_msg(result.plan, self.settings.global_frame, now))
        self._report(result)

    def _measure_cycle(self, t):
        last, self._last_cycle = self._last_cycle, t
        if last is None or not self.machine.active:
            return
        taken = t - last
        self._worst_cycle = max(self._worst_cycle, taken)
        if taken > 1.5 / self.settings.move_base.controller_frequency:
            self.counts['missed_cycles'] += 1
            rospy.logwarn_throttle(5.0, 'a control cycle took %.3f s, controller_frequency asks for %.3f s', taken,
                                   1.0 / self.settings.move_base.controller_frequency)

    def _take_abort(self):
        """Give up the goal that somebody says cannot be reached now; one that comes later is not meant."""
        with self._lock:
            reason, self._abort_reason = self._abort_reason, None
        if reason is not None:
            self.machine.abort('Goal aborted: %s' % reason)

    def _take_requests(self, t):
        if self.server.is_new_goal_available():
            self._accept(self.server.accept_new_goal(), t)
        if self.server.is_preempt_requested() and not self.server.is_new_goal_available():
            self.machine.cancel(t)

    def _accept(self, goal, t):
        target = goal.target_pose
        frame = target.header.frame_id.lstrip('/')
        try:
            if not frame:
                raise ValueError('its frame_id is empty')
            pose = conv.pose_from_msg(target.pose)
            if frame != self.settings.global_frame:
                there = self.tf.latest(self.settings.global_frame, frame)
                pose = conv.pose_from_transform(there.transform).compose(pose)
        except (ValueError, tf2_ros.TransformException) as error:
            text = 'Goal refused: %s.' % error
            self.machine.abort(text)
        else:
            text = self.machine.set_goal(pose, t)
        if text:
            self.counts['refused_goals'] += 1
            self.machine.step(t, None)  # takes the machine's own word about the end; it is said here
            self._finish(mb.StepResult((0.0, 0.0), mb.ABORTED, text))
            return
        rospy.loginfo('goal (%.2f, %.2f, %.2f rad)', pose.x, pose.y, pose.yaw)
        self.current_goal.publish(conv.pose_stamped(pose, self.settings.global_frame, rospy.Time.now()))

    def _finish(self, result):
        """Stand still and tell the client how it ended."""
        self.cmd_vel.publish(conv.twist_to_msg(*result.command))
        self._last_end = result.text
        if not self.server.is_active():
            return
        if result.status == mb.SUCCEEDED:
            rospy.loginfo('%s', result.text)
            self.server.set_succeeded(MoveBaseResult(), result.text)
        elif result.status == mb.PREEMPTED:
            rospy.loginfo('%s', result.text)
            self.server.set_preempted(MoveBaseResult(), result.text)
        else:
            rospy.logerr('%s', result.text)
            self.server.set_aborted(MoveBaseResult(), result.text)

    def _robot_pose(self):
        """Return (Pose2D, stamp s) of the robot in the global frame, or (None, None)."""
        try:
            msg = self.tf.latest(self.settings.global_frame, self.settings.robot_base_frame)
            pose = conv.pose_from_transform(msg.transform)
        except (ValueError, tf2_ros.TransformException) as error:
            self._pose_problem = str(error)
            return None, None
        self._pose_problem = ''
        return pose, (None if msg.header.stamp.is_zero() else msg.header.stamp.to_sec())

    def _velocity(self, t):
        odom = self._odom
        if odom is None or not -ODOM_TIMEOUT < t - odom[1] < ODOM_TIMEOUT:
            return None
        return odom[0]

    # -- reporting ---------------------------------------------------------------------------------------------

    def _report(self, result):
        if self._pose_problem:
            text = 'waiting for the transform %s -> %s: %s' % (
                self.settings.global_frame, self.settings.robot_base_frame, self._pose_problem)
            (rospy.logwarn_throttle if self.machine.active else rospy.loginfo_throttle)(5.0, '%s', text)
            self._publish_diagnostics(ERROR if self.machine.active else WARN, text)
        elif self._odom is None:
            text = 'waiting for odometry on %s; the velocity is reckoned from the commands' % (
                self._odom_subscriber.resolved_name)
            rospy.loginfo_throttle(10.0, '%s', text)
            self._publish_diagnostics(WARN, text)
        elif self.machine.active:
            self._publish_diagnostics(WARN if result.text else OK, result.text or '%s (%s)' % (
                result.phase, self.machine.local_planner.phase))
        else:
            self._publish_diagnostics(OK, 'waiting for a goal on move_base or move_base_simple/goal')

    def _publish_diagnostics(self, level, text):
        now = rospy.Time.now().to_sec()
        if self._diagnostics_at >= 0.0 and 0.0 <= now - self._diagnostics_at < 1.0:
            return
        self._diagnostics_at = now
        values = dict(vars(self.machine.counters), **self.counts)
        values['worst_cycle_s'] = '%.3f' % self._worst_cycle
        values['last_end'] = self._last_end
        self._worst_cycle = 0.0
        self.diagnostics.publish(level, text, values)

    def _on_shutdown(self):
        if self.machine.active:
            self.cmd_vel.publish(Twist())


def main():
    """Run the node until ROS shuts down; exit status 1 when its parameters cannot be used."""
    rospy.init_node('move_base')
    try:
        settings = read_parameters()
    except ParameterError as error:
        rospy.logfatal('move_base cannot start: %s', error)
        sys.exit(1)
    for warning in settings.warnings:
        rospy.logwarn('%s', warning)
    MoveBaseNode(settings).run()
