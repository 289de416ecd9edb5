"""range_localization: dead reckoning in the map, corrected by ranges against that map; amcl's place in the tree of
frames.

In: odom (Odometry: a pose in the map by dead reckoning), map, ~range_topics (Range), set_pose, /tf. Out: map -> odom,
odometry/corrected, amcl_pose, lost_probability, /diagnostics. Service: global_localization. While the place is searched
for only the last two are published.
"""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import rospkg
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import Range
from std_msgs.msg import Float32
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from tf2_msgs.msg import TFMessage

from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import start_node
from sara_localization.fake import true_pose
from sara_localization.filters import state_pose
from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.stamps import later
from sara_localization.inputs.data import StampedTransform
from sara_localization.particles.range_localizer import RangeLocalizer
from sara_localization.ranges import turn_scale
from sara_localization.ranges.range_config import RangeConfig
from sara_localization.ranges.range_data import RangeData
from sara_localization.ranges.range_status import Heard, status
from sara_localization.ros import conversions
from sara_localization.ros.shell import configured, publish
from sara_localization.ros.tf2_transforms import Tf2Transforms

QUEUE = 100
DIAGNOSTICS_PERIOD = 1.0
PATIENCE = 5.0
PAUSE = 0.004
"""s between the parts of a long work in another thread, which would else starve the callbacks: one thread runs at a
time.
"""
PLANAR = np.ix_((0, 1, 5), (0, 1, 5))
"""x, y, yaw in a (6, 6) covariance."""


class RangeNode:
    """Callbacks and the timer share one lock."""

    def __init__(self, config: RangeConfig):
        self.config, beside = config, ThreadPoolExecutor(1, 'places')
        self.localizer = RangeLocalizer(
            config, turn_scale=_kept(config), submit=lambda work: beside.submit(work, lambda: time.sleep(PAUSE))
        )
        self.correction = self.localizer.correction
        self.lock, self.transforms = threading.Lock(), Tf2Transforms()
        self.mounts, self.missing, self.told, self.counted = {}, '', set(), {}
        self.last_pose = self.last_range = None
        self.odometry_pub = rospy.Publisher('odometry/corrected', Odometry, queue_size=20, tcp_nodelay=True)
        self.transform_pub = rospy.Publisher('/tf', TFMessage, queue_size=100, tcp_nodelay=True)
        self.pose_pub = rospy.Publisher('amcl_pose', PoseWithCovarianceStamped, queue_size=1, latch=True)
        self.lost_pub, self.lost_said = rospy.Publisher('lost_probability', Float32, queue_size=2, latch=True), None
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=10)
        self.subscribers = [
            rospy.Subscriber('map', OccupancyGrid, self.on_map, queue_size=1),
            rospy.Subscriber('set_pose', PoseWithCovarianceStamped, self.on_set_pose, queue_size=1, tcp_nodelay=True),
            rospy.Subscriber('odom', Odometry, self.on_odometry, queue_size=QUEUE, tcp_nodelay=True),
        ]
        self.subscribers += [
            rospy.Subscriber(topic, Range, self.on_range, topic, queue_size=QUEUE, tcp_nodelay=True)
            for topic in config.range_topics
        ]
        self.service = rospy.Service('global_localization', Empty, self.on_global_localization)
        rospy.on_shutdown(self.keep_turn_scale)
        self.timer = rospy.Timer(rospy.Duration.from_sec(DIAGNOSTICS_PERIOD), self.diagnose, reset=True)

    def on_map(self, msg: OccupancyGrid) -> None:
        """A map takes the place of the one before."""
        try:
            if msg.header.frame_id.lstrip('/') not in ('', self.config.global_frame_id):
                raise ValueError(f'it is in the frame "{msg.header.frame_id}", not in {self.config.global_frame_id}')
            map_ = conversions.range_map(msg, self.config.map_occupied_above)
        except ValueError as error:
            rospy.logwarn('the map is not used: %s', error)
            return
        with self.lock:
            fault = self.localizer.set_map(map_)
        if fault:
            rospy.logwarn('the place is not searched for any more: %s', fault)

    def on_global_localization(self, _request: EmptyRequest) -> EmptyResponse:
        """The service: the robot may be anywhere on the map."""
        with self.lock:
            fault = self.localizer.start_anywhere()
        if fault:
            raise rospy.ServiceException(fault)
        return EmptyResponse()

    def keep_turn_scale(self) -> None:
        """Save what was learned of the scale of turns, where that is asked for and more is known than at the start."""
        c = self.config
        with self.lock:
            learned = self.correction.turn_scale
        if c.turn_scale_file and 0.0 < learned.sigma < c.turn_scale_sigma:
            try:
                turn_scale.save(_path(c), learned)
            except OSError as error:
                rospy.logwarn('the scale of turns is not saved: %s', error)

    def on_set_pose(self, msg: PoseWithCovarianceStamped) -> None:
        """Whoever dead-reckons begins there: it is believed anew; but for a pose that the filter refuses."""
        data, frame, wanted = conversions.pose(msg), msg.header.frame_id.lstrip('/'), self.config.global_frame_id
        known = frame in ('', wanted) or self.transforms.lookup(wanted, frame, data.stamp) is not None
        if not known or true_pose(data.position, data.orientation) is None or not np.isfinite(data.covariance).all():
            rospy.logwarn('set_pose is ignored: it is no pose, or in the unknown frame "%s"', frame)
            return
        with self.lock:
            self.localizer.forget()

    def on_odometry(self, msg: Odometry) -> None:
        """Dead reckoning: take it, and give out what it is in the map."""
        data = conversions.odometry(msg)
        pose = true_pose(data.position, data.orientation)
        faulty = self._faulty(data, pose)
        if faulty:
            with self.lock:
                self._count(faulty[0], 'odom', faulty[1])
            return
        with self.lock:
            self.last_pose = data.stamp
            self.localizer.on_pose(data.stamp, (pose.translation[0], pose.translation[1], pose.yaw))
            if self.localizer.searching:
                return
            x, y, yaw = self.correction.offset
            corrected, P = Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, yaw) @ pose, self.correction.P_given_out
            map_from_odom = self._map_from_odom(data, corrected) if self.config.tf_broadcast else None
        if map_from_odom is not None:
            publish(self.transform_pub, TFMessage([conversions.transform_message(map_from_odom)]))
        covariance = np.array(data.pose_covariance)
        covariance[PLANAR] = P
        msg.pose.covariance = covariance.ravel().tolist()
        conversions.fill_pose(msg.pose.pose, corrected)
        publish(self.odometry_pub, msg)

    def _faulty(self, data, pose):
        """(what it counts as, a sentence) for dead reckoning that cannot be used, else None."""
        if data.frame_id.lstrip('/') != self.config.global_frame_id:
            wanted = self.config.global_frame_id
            return 'bad_frame', f'odom is in the frame "{data.frame_id}": ignored; it must be in {wanted}'
        if pose is None or data.stamp <= 0.0:
            return 'bad_pose', f'odom holds {"what is no pose" if pose is None else "no time stamp"}: dropped'
        return None

    def _map_from_odom(self, data, corrected) -> StampedTransform | None:
        """What is broadcast for a pose that was corrected; None, and told, where odom -> base_link is not known."""
        c = self.config
        base_from_odom = self.transforms.lookup(c.base_frame_id, c.odom_frame_id, data.stamp)
        if base_from_odom is None:
            self.missing = (
                f'no transform {c.odom_frame_id} -> {c.base_frame_id}: {c.global_frame_id} -> {c.odom_frame_id} cannot '
                'be published'
            )
            return None
        self.missing = ''
        if c.join_at_odometry_time:
            age = self.transforms.age(c.base_frame_id, c.odom_frame_id, data.stamp)
            corrected = state_pose.pose_earlier(corrected, (*data.linear, *data.angular), age)
        dated = later(data.stamp, c.transform_tolerance)
        return StampedTransform(dated, c.global_frame_id, c.odom_frame_id, corrected @ base_from_odom)

    def on_range(self, msg: Range, topic: str) -> None:
        """A reading; where its sensor sits is looked up once."""
        stamp, frame = conversions.seconds(msg.header.stamp), msg.header.frame_id
        with self.lock:
            mount = self.mounts.get(frame)
            if mount is None:
                found = self.transforms.lookup(self.config.base_frame_id, frame.lstrip('/'), stamp) if frame else None
                if found is None:
                    self._count(
                        'no_mount',
                        topic,
                        f'a reading on {topic} comes from the frame "{frame}", of which tf does not know where it is',
                    )
                    return
                mount = self.mounts[frame] = (found.translation[0], found.translation[1], found.yaw)
            what = self.localizer.on_range(
                RangeData(topic, stamp, mount, msg.range, msg.min_range, msg.max_range, msg.field_of_view)
            )
            self.last_range = rospy.get_time()
            if what == 'bad_range':
                self._warn_once(topic + what, f'a reading on {topic} holds what is no range: dropped')
            pose, P = self.correction.pose, self.correction.P
            lost = self.localizer.lost_probability
        if lost != self.lost_said:
            self._publish_lost(lost)
        if what in ('used', 'found'):
            self._publish_pose(msg.header.stamp, pose, P)

    def _publish_lost(self, probability):
        self.lost_said = probability
        publish(self.lost_pub, Float32(probability))

    def _publish_pose(self, stamp, pose, P):
        msg = PoseWithCovarianceStamped()
        msg.header.stamp, msg.header.frame_id = stamp, self.config.global_frame_id
        conversions.fill_pose(msg.pose.pose, Transform.from_xyz_rpy(pose[0], pose[1], 0.0, 0.0, 0.0, pose[2]))
        covariance = np.zeros((6, 6))
        covariance[PLANAR] = P
        msg.pose.covariance = covariance.ravel().tolist()
        publish(self.pose_pub, msg)

    def _count(self, what, key, sentence):
        self.correction.counts[what] += 1
        self._warn_once(key + what, sentence)

    def _warn_once(self, key, sentence):
        if key not in self.told:
            self.told.add(key)
            rospy.logwarn(sentence)

    def diagnose(self, _event: rospy.timer.TimerEvent) -> None:
        """Once a second to /diagnostics; and to the log what is being waited for."""
        with self.lock:
            now = rospy.Time.now()
            lost = self.localizer.lost_probability
            heard = Heard(self.last_pose, self.last_range, self.missing, self.localizer.told, lost)
            told = status('range_localization', self.correction, now.to_sec(), heard, self.counted)
            self.counted = dict(self.correction.counts)
        if told.level:
            rospy.logwarn_throttle(PATIENCE, told.message)
        self._publish_lost(lost)
        publish(self.diagnostics_pub, diagnostic_array(now, [told]))


def _path(config):
    return Path(rospkg.get_ros_home()) / config.turn_scale_file


def _kept(config):
    """The scale of turns that an earlier drive left, None where there is none."""
    if not config.turn_scale_file:
        return None
    try:
        return turn_scale.load(_path(config), config.turn_scale_sigma)
    except ValueError as error:
        rospy.logwarn('the scale of turns is learned anew: %s', error)
        return None


def main() -> None:
    start_node('range_localization')
    RangeNode(configured(RangeConfig))  # kept alive by its subscribers
    rospy.spin()
