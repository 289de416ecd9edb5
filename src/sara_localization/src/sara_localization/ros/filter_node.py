"""ekf_localization_node and ukf_localization_node: robot_localization's interface in ROS around a FilterEngine."""

from __future__ import annotations

import sys
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import AccelWithCovarianceStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from tf2_msgs.msg import TFMessage

from robot_localization.srv import (
    SetPose,
    SetPoseRequest,
    SetPoseResponse,
    ToggleFilterProcessing,
    ToggleFilterProcessingRequest,
    ToggleFilterProcessingResponse,
)
from sara_common.diagnostics import ERROR
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import start_node
from sara_localization.checks import check_config
from sara_localization.checks.findings import sorted_findings
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.diagnostics import FilterDiagnostics, FrequencyDiagnostics
from sara_localization.engine.engine import FilterEngine
from sara_localization.geometry.stamps import Stamp
from sara_localization.ros import conversions, wire
from sara_localization.ros.cycle import Cycle
from sara_localization.ros.inputs import KINDS, published_topics, why_silent
from sara_localization.ros.mailbox import Mailbox
from sara_localization.ros.outbox import Outbox
from sara_localization.ros.tf2_transforms import Tf2Transforms
from sara_localization.ros.topic_watch import TopicWatch

DIAGNOSTICS_PERIOD = 1.0
WAITING_LOG_PERIOD = 5.0
CLOCK_PATIENCE = 3.0
MOST_ARRIVED = 10000  # messages that may wait for a cycle: more than come in a second
# rospy reads what has come on a connection at once and keeps the last queue_size of it. robot_localization's node takes
# every message as it comes, so that a queue of 1, its default, loses none there; on a busy computer it would here.
SHORTEST_QUEUE = 100


class FilterNode:
    """Parameters in, messages to plain data, the engine, plain data to messages. Callbacks and timer share one lock.

    findings: what check_config found, told in /diagnostics for as long as the node runs.
    """

    def __init__(self, config: FilterConfig, findings=()):
        self.config = config
        self.lock = threading.Lock()
        self.transforms = Tf2Transforms(config.transform_timeout)
        simulated = bool(rospy.get_param('/use_sim_time', False))
        self.engine = FilterEngine(config, self.transforms, self._report, restarts=simulated)
        self.silent_tf_failure = bool(rospy.get_param('/silent_tf_failure', False))
        self.mailbox = Mailbox(MOST_ARRIVED)
        self.failures, self.last_diagnostics = 0, None
        self.topic_watch = TopicWatch(published_topics, WAITING_LOG_PERIOD)
        self.topics = {i.name: (i.kind, rospy.resolve_name(i.topic)) for i in config.inputs}
        self.filter_diagnostics = FilterDiagnostics(config, findings)
        self.frequency_diagnostics = FrequencyDiagnostics(config.frequency)
        self._advertise()
        self._subscribe()
        self.cycle = Cycle(1.0 / config.frequency, self.tick)

    def _advertise(self):
        self.odometry_out = Outbox('odometry/filtered', Odometry)
        self.transform_out = Outbox('/tf', TFMessage, most=100)
        self.acceleration_pub = None
        if self.config.publish_acceleration:
            self.acceleration_pub = rospy.Publisher(
                'accel/filtered', AccelWithCovarianceStamped, queue_size=20, tcp_nodelay=True
            )
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=10)
        self.services = [
            rospy.Service('set_pose', SetPose, self.set_pose_service),
            rospy.Service('~enable', Empty, self.enable),
            rospy.Service('~toggle', ToggleFilterProcessing, self.toggle),
            rospy.Service('~reset', Empty, self.reset),
        ]

    def _subscribe(self):
        self.subscribers = {i.name: self._subscribe_input(i) for i in self.config.inputs}
        self.set_pose_sub = rospy.Subscriber(
            'set_pose', PoseWithCovarianceStamped, self.set_pose, queue_size=1, tcp_nodelay=True
        )
        control = self.config.control
        if control is not None:
            self.control_sub = rospy.Subscriber(
                'cmd_vel', TwistStamped if control.stamped else Twist, self.on_control, queue_size=1, tcp_nodelay=True
            )

    def _subscribe_input(self, i):
        kind = KINDS[i.kind]
        add = getattr(self.engine, kind.method)

        def take(data):
            add(i.name, kind.read(data))

        return self.mailbox.subscribe(
            i.topic, kind.message, take, max(i.queue_size, SHORTEST_QUEUE) if i.queue_size else None
        )

    def _report(self, sentence):
        if not (self.silent_tf_failure and 'no transform' in sentence):
            rospy.logwarn(sentence)

    def on_control(self, msg: Twist | TwistStamped) -> None:
        """A command to the robot's wheels."""
        now, base = conversions.seconds(rospy.Time.now()), self.config.base_link_frame
        try:
            stamp, command = conversions.command(msg, now, base)
        except ValueError as error:
            rospy.logwarn_throttle(WAITING_LOG_PERIOD, str(error))
            return
        with self.lock:
            self.engine.add_control(command, stamp)

    def set_pose(self, msg: PoseWithCovarianceStamped) -> None:
        """The robot is at this pose, at rest: from RViz or a program."""
        with self.lock:
            now = conversions.seconds(rospy.Time.now())
            self._deliver(now)
            refused = self.engine.set_pose(conversions.pose(msg), now)
        if refused:
            rospy.logwarn(refused)
        else:
            at, frame = msg.pose.pose.position, msg.header.frame_id or self.config.world_frame
            rospy.loginfo('set_pose: the robot is at x %.3f, y %.3f in %s', at.x, at.y, frame)

    def set_pose_service(self, request: SetPoseRequest) -> SetPoseResponse:
        """As the topic set_pose."""
        self.set_pose(request.pose)
        return SetPoseResponse()

    def enable(self, _request: EmptyRequest) -> EmptyResponse:
        """Start a filter that was disabled_at_startup."""
        with self.lock:
            self._deliver(conversions.seconds(rospy.Time.now()))
            started = self.engine.enable()
        if started:
            rospy.loginfo('the filter is enabled')
        else:
            rospy.logwarn('~enable was called, but the filter was enabled already')
        return EmptyResponse()

    def toggle(self, request: ToggleFilterProcessingRequest) -> ToggleFilterProcessingResponse:
        """Stop or resume the use of measurements; the output goes on."""
        with self.lock:
            changed = self.engine.toggle(request.on)
        if changed:
            rospy.loginfo('measurements are %s', 'used again' if request.on else 'no longer used')
        else:
            rospy.logwarn('~toggle was called, but measurements are %s already', 'used' if request.on else 'unused')
        return ToggleFilterProcessingResponse(status=changed)

    def reset(self, _request: EmptyRequest) -> EmptyResponse:
        """Forget everything: the filter starts anew from initial_state."""
        with self.lock:
            self.mailbox.forget()
            self.engine.reset()
        rospy.loginfo('the filter starts anew')
        return EmptyResponse()

    def tick(self, now: Stamp) -> None:
        """A cycle of the filter at `now` (Stamp); whatever goes wrong in one must not end the timer."""
        try:
            with self.lock:
                jumps = self.engine.time_jumps
                self._deliver(now)
                output = self.engine.tick(now)
                jumped = self.engine.time_jumps != jumps
            if jumped and (self.config.reset_on_time_jump or not self.engine.restarts):
                self.transforms.clear()
            if output is not None:
                self._publish(output)
            self._diagnose(now, output)
        except Exception as error:  # pylint: disable=broad-except
            if not rospy.core.is_shutdown_requested():  # then topics close while they are published on
                self._failed(error)

    def _deliver(self, now):
        self.engine.clock(now)
        self.mailbox.deliver()

    def _failed(self, error):
        self.failures += 1
        rospy.logerr_throttle(5.0, f'a filter cycle failed ({type(error).__name__}: {error}); the next one is tried')

    def _publish(self, output):
        if output.transform is not None:
            self.transforms.enter(output.transform)
            self.transform_out.send(wire.write_transform, output.transform)
        if output.published:
            self.odometry_out.send(wire.write_odometry, output)
            self.frequency_diagnostics.tick()
            if self.acceleration_pub:
                self.acceleration_pub.publish(conversions.acceleration_message(output))

    def _diagnose(self, now, output):
        """Once a second: what is right and wrong to /diagnostics, and to the log what is being waited for."""
        if self.last_diagnostics is not None and 0.0 <= now - self.last_diagnostics < DIAGNOSTICS_PERIOD:
            return
        self.last_diagnostics = now
        with self.lock:
            statuses, lines = list(self.engine.inputs.values()), self.engine.status_lines(now)
            silent = [status.name for status in statuses if not status.received]
            because = self._why_silent(silent, now)
            waiting = '; '.join(lines) if output is None else self.engine.missing_transform
            if not self.engine.enabled:
                waiting = 'disabled at startup; call the service {}'.format(rospy.resolve_name('~enable'))
            counters = [
                ('published', self.frequency_diagnostics.count),
                ('time jumps', self.engine.time_jumps),
                ('cycles failed', self.failures),
                ('states not finite', self.engine.not_finite),
                *self._extensions(statuses),
                *((name + '_silent', why) for name, why in because.items()),
            ]
            status = self.filter_diagnostics.status(now, statuses, waiting, counters)
        if status.level and (waiting or silent):
            rospy.logwarn_throttle(
                WAITING_LOG_PERIOD, '; '.join(filter(None, (status.message, '; '.join(because.values()))))
            )
        told = [status] if self.config.print_diagnostics else []
        self.diagnostics_pub.publish(
            diagnostic_array(conversions.ros_time(now), told + [self.frequency_diagnostics.status(now)])
        )

    def _extensions(self, statuses):
        """(key, value) for what is only there when an extension asks for it."""
        told = []
        if self.config.publish_nis:
            told += [
                (s.name + ' NIS', f'{s.consistency:.3g} per variable (about 1 where the variances are honest)')
                for s in statuses
            ]
        for i in self.config.inputs:
            if i.kind == 'imu' and i.gyro_bias != 'off':
                told.append(
                    (i.name + ' gyro bias', '{:.6f} {:.6f} {:.6f} rad/s'.format(*tuple(self.engine.gyro_bias(i.name))))
                )
        if self.engine.preprocessor.standstill is not None:
            told.append(('parked', self.engine.parked))
        return told

    def _why_silent(self, silent, now):
        """{input on whose topic nothing came: who, if anybody, publishes it}; without those where all is right."""
        published = self.topic_watch.published(now) if silent else None
        if published is None:
            return {}
        return {name: why for name in silent if (why := why_silent(*self.topics[name], published))}


def watch_clock() -> None:
    """Say it when simulated time is asked for and nobody gives it: nothing else would ever run."""
    began, said = time.monotonic(), 0.0
    while not rospy.is_shutdown() and rospy.Time.now().is_zero():
        time.sleep(0.1)
        waited = time.monotonic() - began
        if waited > CLOCK_PATIENCE and waited - said > WAITING_LOG_PERIOD:
            said = waited
            rospy.logwarn(
                'use_sim_time is true, but there is no time on /clock for %.0f s: start the simulation or "rosbag '
                'play --clock", '
                'or set use_sim_time to false',
                waited,
            )


def parameters() -> dict:
    """The node's private parameters; tf_prefix is searched for upwards, as tf's users expect."""
    params = dict(rospy.get_param('~', {}))
    prefix = rospy.search_param('tf_prefix')
    if prefix is not None and 'tf_prefix' not in params:
        params['tf_prefix'] = rospy.get_param(prefix)
    return params


def run(kind: str) -> FilterNode:
    """The node of that kind ('ekf' or 'ukf') until it is shut down."""
    start_node(kind + '_navigation_node')
    config, findings = check_config.check(parameters(), kind)
    for finding in sorted_findings(findings):
        error = rospy.logfatal if config is None else rospy.logerr
        (error if finding.level == ERROR else rospy.logwarn)(finding.sentence)
    if config is None:
        sys.exit(1)
    if rospy.get_param('/use_sim_time', False):
        threading.Thread(target=watch_clock, daemon=True).start()
    node = FilterNode(config, findings)
    rospy.spin()
    return node
