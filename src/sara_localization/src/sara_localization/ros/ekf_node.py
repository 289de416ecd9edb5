"""ekf_localization_node: robot_localization's topics, services, parameters and transforms around a FilterEngine."""
from __future__ import annotations

import sys
import threading

import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import AccelWithCovarianceStamped, PoseWithCovarianceStamped, TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_localization.srv import SetPose, SetPoseResponse

from ..config import ConfigError, FilterConfig
from ..engine import FilterEngine
from . import conversions
from .tf2_transforms import Tf2Transforms

TYPES = {'odom': (Odometry, conversions.odometry, 'add_odometry'),
         'imu': (Imu, conversions.imu, 'add_imu'),
         'pose': (PoseWithCovarianceStamped, conversions.pose, 'add_pose'),
         'twist': (TwistWithCovarianceStamped, conversions.twist, 'add_twist')}
DIAGNOSTICS_PERIOD = 1.0
WAITING_LOG_PERIOD = 5.0


class EkfNode:
    """Parameters in, messages to plain data, the engine, plain data to messages. Callbacks and timer share one lock."""

    def __init__(self, config: FilterConfig):
        self.config = config
        self.lock = threading.Lock()
        self.transforms = Tf2Transforms(config.transform_timeout)
        self.engine = FilterEngine(config, self.transforms, report=rospy.logwarn)
        self.published = self.failures = 0
        self.last_diagnostics = None
        self.odometry_pub = rospy.Publisher('odometry/filtered', Odometry, queue_size=20, tcp_nodelay=True)
        self.acceleration_pub = None
        if config.publish_acceleration:
            self.acceleration_pub = rospy.Publisher('accel/filtered', AccelWithCovarianceStamped, queue_size=20,
                                                    tcp_nodelay=True)
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=1)
        self.broadcaster = tf2_ros.TransformBroadcaster()
        self.subscribers = [self._subscribe(i) for i in config.inputs]
        self.subscribers.append(rospy.Subscriber('set_pose', PoseWithCovarianceStamped, self.set_pose, queue_size=1,
                                                 tcp_nodelay=True))
        self.service = rospy.Service('set_pose', SetPose, self.set_pose_service)
        # reset=True: the timer goes on when simulated time jumps back.
        self.timer = rospy.Timer(rospy.Duration.from_sec(1.0 / config.frequency), self.tick, reset=True)

    def _subscribe(self, i):
        message_type, convert, method = TYPES[i.kind]
        add = getattr(self.engine, method)

        def receive(msg):
            data = convert(msg)
            with self.lock:
                add(i.name, data)

        return rospy.Subscriber(i.topic, message_type, receive, queue_size=i.queue_size or None, tcp_nodelay=True)

    def set_pose(self, msg):
        """The robot is at this pose, at rest: from RViz or a program."""
        with self.lock:
            refused = self.engine.set_pose(conversions.pose(msg), rospy.Time.now().to_sec())
        if refused:
            rospy.logwarn(refused)
        else:
            rospy.loginfo('set_pose: the robot is at x %.3f, y %.3f in %s', msg.pose.pose.position.x,
                          msg.pose.pose.position.y, msg.header.frame_id or self.config.world_frame)

    def set_pose_service(self, request):
        self.set_pose(request.pose)
        return SetPoseResponse()

    def tick(self, _event):
        """A cycle of the filter; whatever goes wrong in one must not end the timer."""
        try:
            now = rospy.Time.now().to_sec()
            with self.lock:
                jumps = self.engine.time_jumps
                output = self.engine.tick(now)
                jumped = self.engine.time_jumps != jumps
            if jumped and self.config.reset_on_time_jump:
                self.transforms.clear()
            if output is not None:
                self._publish(output)
            self._diagnose(now, output)
        except rospy.ROSException as error:
            if not rospy.core.is_shutdown_requested():
                self._failed(error)
        except Exception as error:  # pylint: disable=broad-except
            self._failed(error)

    def _failed(self, error):
        self.failures += 1
        rospy.logerr_throttle(5.0, 'a filter cycle failed (%s: %s); the next one is tried' % (type(error).__name__, error))

    def _publish(self, output):
        if output.transform is not None:
            self.broadcaster.sendTransform(conversions.transform_message(output.transform))
        if output.published:
            self.odometry_pub.publish(conversions.odometry_message(output))
            self.published += 1
            if self.acceleration_pub:
                self.acceleration_pub.publish(conversions.acceleration_message(output))

    def _diagnose(self, now, output):
        """Once a second: counters to /diagnostics, and to the log what is being waited for."""
        if self.last_diagnostics is not None and 0.0 <= now - self.last_diagnostics < DIAGNOSTICS_PERIOD:
            return
        self.last_diagnostics = now
        with self.lock:
            inputs, lines = list(self.engine.inputs.values()), self.engine.status_lines(now)
            waiting = [status for status in inputs if not status.healthy]
        status = DiagnosticStatus(name=rospy.get_name() + ': filter', hardware_id='none')
        status.level, status.message = DiagnosticStatus.OK, 'the filter is running'
        if waiting or self.engine.missing_transform:
            status.level = DiagnosticStatus.WARN
            status.message = '; '.join([s.line(now) for s in waiting] + ([self.engine.missing_transform]
                                                                       if self.engine.missing_transform else []))
        if output is None:
            status.level = DiagnosticStatus.ERROR
            status.message = 'no estimate yet: ' + '; '.join(lines)
        if status.level != DiagnosticStatus.OK:
            rospy.logwarn_throttle(WAITING_LOG_PERIOD, status.message)
        values = [('published', self.published), ('time jumps', self.engine.time_jumps),
                  ('cycles failed', self.failures), ('states not finite', self.engine.not_finite)]
        for s in inputs:
            values += [(s.name, s.line(now))] + [('%s %s' % (s.name, kind), n) for kind, n in sorted(s.problems.items())]
        status.values = [KeyValue(key, str(value)) for key, value in values]
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.from_sec(now)
        self.diagnostics_pub.publish(array)


def main():
    rospy.init_node('ekf_navigation_node')
    try:
        config = FilterConfig.from_params(rospy.get_param('~', {}))
    except ConfigError as error:
        for fault in error.faults:
            rospy.logfatal(fault)
        sys.exit(1)
    for warning in config.warnings:
        rospy.logwarn(warning)
    if rospy.get_param('/use_sim_time', False):
        rospy.loginfo('waiting for simulated time on /clock')
    EkfNode(config)
    rospy.spin()
