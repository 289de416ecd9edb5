"""fake_localization: the true pose of a simulator in the place of a localiser, with the navigation stack's interface.

In: base_pose_ground_truth (Odometry), initialpose. Out: map -> odom, amcl_pose, particlecloud (one particle).
~relay_set_pose: what comes on set_pose goes to initialpose too, so that it can stand in for ekf_se unseen.
"""

from __future__ import annotations

import threading
from collections import Counter, deque

import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

from sara_common.diagnostics import ERROR, OK, Status
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import start_node
from sara_localization.fake import FakeConfig, FakeLocalization, true_pose
from sara_localization.ros import conversions
from sara_localization.ros.shell import configured, publish

QUEUE = 100
PATIENCE = 5.0
DIAGNOSTICS_PERIOD = 1.0


class FakeNode:
    """True poses wait until the odometry's transform for their time is there."""

    def __init__(self, config: FakeConfig):
        self.config, self.fake = config, FakeLocalization(config)
        self.lock = threading.Lock()
        self.waiting, self.counts = deque(maxlen=QUEUE), Counter()
        self.last_diagnostics = None
        self.buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(self.buffer, tcp_nodelay=True)
        self.broadcaster = tf2_ros.TransformBroadcaster()
        self.pose_pub = rospy.Publisher('amcl_pose', PoseWithCovarianceStamped, queue_size=1, latch=True)
        self.cloud_pub = rospy.Publisher('particlecloud', PoseArray, queue_size=1, latch=True)
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=10)
        self.subscribers = [
            rospy.Subscriber(
                'base_pose_ground_truth', Odometry, self.on_ground_truth, queue_size=QUEUE, tcp_nodelay=True
            ),
            rospy.Subscriber(
                'initialpose', PoseWithCovarianceStamped, self.on_initial_pose, queue_size=1, tcp_nodelay=True
            ),
        ]
        if config.relay_set_pose:
            self.relay_pub = rospy.Publisher('initialpose', PoseWithCovarianceStamped, queue_size=1)
            self.subscribers.append(
                rospy.Subscriber(
                    'set_pose', PoseWithCovarianceStamped, self.relay_pub.publish, queue_size=1, tcp_nodelay=True
                )
            )
        self.timer = rospy.Timer(rospy.Duration.from_sec(DIAGNOSTICS_PERIOD), self.diagnose, reset=True)

    def on_initial_pose(self, msg: PoseWithCovarianceStamped) -> None:
        """The robot is to be there: the true frame is moved under it."""
        with self.lock:
            refused = self.fake.on_initial_pose(conversions.pose(msg))
        if refused:
            rospy.logwarn(refused)

    def on_ground_truth(self, msg: Odometry) -> None:
        """Queue a true pose, and use all whose transform has come meanwhile."""
        data = conversions.odometry(msg)
        truth = true_pose(data.position, data.orientation)
        with self.lock:
            self.counts['received'] += 1
            if truth is None or data.stamp <= 0.0:
                kind = 'bad_pose' if truth is None else 'no_stamp'
                self.counts[kind] += 1
                if self.counts[kind] == 1:
                    rospy.logwarn(
                        'base_pose_ground_truth holds %s: dropped',
                        'what is no pose' if truth is None else 'no time stamp',
                    )
                return
            if self.waiting and data.stamp < self.waiting[-1][0].to_sec():
                self.waiting.clear()  # the clock went back
            if len(self.waiting) == QUEUE:
                self.counts['no_transform'] += 1
            self.waiting.append((msg.header.stamp, truth))
            while self.waiting and self._use(*self.waiting[0]):
                self.waiting.popleft()

    def _use(self, stamp, truth) -> bool:
        """Whether the pose is done with."""
        config = self.config
        try:
            found = self.buffer.lookup_transform_core(config.odom_frame_id, config.base_frame_id, stamp)
        except tf2_ros.ExtrapolationException:
            # Older than what tf remembers will never come; younger is waited for.
            try:
                newest = self.buffer.lookup_transform_core(
                    config.odom_frame_id, config.base_frame_id, rospy.Time(0)
                ).header.stamp
            except tf2_ros.TransformException:
                return False
            if stamp < newest:
                self.counts['no_transform'] += 1
                return True
            return False
        except tf2_ros.TransformException:
            return False
        output = self.fake.on_ground_truth(conversions.seconds(stamp), truth, conversions.transform(found).transform)
        self.counts['used'] += 1
        self.broadcaster.sendTransform(conversions.transform_message(output.transform))
        self._publish_pose(stamp, output.pose)
        return True

    def _publish_pose(self, stamp, pose):
        msg, cloud = PoseWithCovarianceStamped(), PoseArray()
        msg.header.stamp = cloud.header.stamp = stamp
        msg.header.frame_id = cloud.header.frame_id = self.config.global_frame_id
        conversions.fill_pose(msg.pose.pose, pose)
        cloud.poses.append(msg.pose.pose)
        publish(self.pose_pub, msg)
        publish(self.cloud_pub, cloud)

    def diagnose(self, _event: rospy.timer.TimerEvent) -> None:
        """Once a second to /diagnostics; and to the log what is being waited for."""
        with self.lock:
            counts, waiting = dict(self.counts), len(self.waiting)
        level, message = OK, 'map -> odom is published'
        if not counts.get('received'):
            level, message = ERROR, 'waiting for true poses on {}'.format(rospy.resolve_name('base_pose_ground_truth'))
        elif not counts.get('used') or waiting == QUEUE:
            level, message = (
                ERROR,
                f'waiting for the transform {self.config.odom_frame_id} -> {self.config.base_frame_id}',
            )
        if level:
            rospy.logwarn_throttle(PATIENCE, message)
        told = Status(
            'fake_localization', level, message, tuple((key, str(count)) for key, count in sorted(counts.items()))
        )
        publish(self.diagnostics_pub, diagnostic_array(rospy.Time.now(), [told]))


def main() -> None:
    start_node('fake_localization')
    FakeNode(configured(FakeConfig))  # kept alive by its subscribers
    rospy.spin()
