"""amcl: where a robot with laser scanners is in a known map, under the names of the C++ node.

In: scan (LaserScan, of any number of scanners), initialpose, static_map (service) or map, /tf. Out: map -> odom,
amcl_pose, particlecloud, lost_probability, /diagnostics. Services: global_localization, request_nomotion_update,
set_map.
"""

from __future__ import annotations

import threading

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from nav_msgs.srv import GetMap, SetMap, SetMapRequest, SetMapResponse
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from sara_common.config import ConfigError
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import on_shutdown, start_node
from sara_common.ros.reconfigure import Reconfigure
from sara_localization.fake import true_pose
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.amcl import Amcl
from sara_localization.particles.amcl_config import CLIENT_LIMITS, DYNAMIC, AmclConfig
from sara_localization.particles.amcl_status import Heard, statuses
from sara_localization.ros import conversions
from sara_localization.ros.amcl.outputs import PLANAR, Outputs, save, saved
from sara_localization.ros.amcl.scans import WaitingScans
from sara_localization.ros.shell import configured, publish
from sara_localization.ros.tf2_transforms import Tf2Transforms

PATIENCE = 15.0
MAP_RETRY = 0.5
"""s between two calls of static_map."""


class AmclNode:
    """Callbacks share one lock. What is on the parameter server has one of its own, taken after that one: nobody reads
    half a pose there.
    """

    def __init__(self, config: AmclConfig):
        self.config, self.amcl, self.lock = config, Amcl(config, rospy.logwarn), threading.RLock()
        self.outputs, self.known, self.saving = Outputs(config), saved(), threading.Lock()
        self.waiting = None  # while tf comes before the rest is there
        self.transforms = Tf2Transforms(on_news=self.on_transforms)
        self.waiting = WaitingScans(self.transforms, lambda sentence: self.amcl.trouble('no_transform', sentence))
        self.began, self.last_odometry, self.counted = rospy.Time.now(), None, {}
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=10)
        self.scans = rospy.Subscriber('scan', numpy_msg(LaserScan), self.on_scan, queue_size=100, tcp_nodelay=True)
        self.poses = rospy.Subscriber(
            'initialpose', PoseWithCovarianceStamped, self.on_initial_pose, queue_size=2, tcp_nodelay=True
        )
        self.map_topic = None
        self.services = [
            rospy.Service('global_localization', Empty, self.on_global_localization),
            rospy.Service('request_nomotion_update', Empty, self.on_nomotion_update),
            rospy.Service('set_map', SetMap, self.on_set_map),
        ]
        self._listen_to_map(config.use_map_topic)
        self.reconfigure = Reconfigure('', config, CLIENT_LIMITS, self.on_reconfigure, DYNAMIC)
        self.timer = rospy.Timer(rospy.Duration(1.0), self.diagnose, reset=True)
        on_shutdown(self.save_pose)

    # Maps

    def _listen_to_map(self, wanted):
        if wanted and self.map_topic is None:
            self.map_topic = rospy.Subscriber('map', numpy_msg(OccupancyGrid), self.on_map, queue_size=1)
        elif not wanted and self.map_topic is not None:
            self.map_topic.unregister()
            self.map_topic = None

    def request_map(self) -> None:
        """Ask static_map until there is a map, from there or from anywhere else."""
        call = rospy.ServiceProxy('static_map', GetMap)
        while not rospy.is_shutdown() and self.amcl.map is None and not self.config.use_map_topic:
            try:
                msg = call().map
            except (rospy.ServiceException, rospy.ROSException) as error:
                rospy.logwarn_throttle(PATIENCE, 'waiting for the map of %s: %s', call.resolved_name, error)
            else:
                if not self.take_map(msg):
                    return
            rospy.rostime.wallsleep(MAP_RETRY)

    def on_map(self, msg: OccupancyGrid) -> None:
        """A map on the topic takes the place of the one before."""
        if self.config.first_map_only and self.amcl.map is not None:
            return
        self.take_map(msg)

    def take_map(self, msg: OccupancyGrid) -> str:
        """Use a map; returns '' or the sentence why it is not used. An initial pose that was put on the parameter
        server since this node last wrote it there is taken, too.
        """
        wanted = self.config.global_frame_id
        if msg.header.frame_id.lstrip('/') != wanted:
            rospy.logwarn_throttle_identical(
                PATIENCE, f'the map is in the frame "{msg.header.frame_id}", not in global_frame_id, "{wanted}"'
            )
        with self.lock:
            try:
                self.amcl.set_map(conversions.range_map(msg, self.config.map_occupied_above))
            except ValueError as error:
                rospy.logwarn_throttle_identical(PATIENCE, f'the map is not used: {error}')
                return str(error)
            with self.saving:
                now, before = saved(), self.known
                self.known = now
            if now != before:
                self._start_at_saved(now)
        return ''

    def _start_at_saved(self, values):
        try:
            config = AmclConfig.from_params(values)
        except ConfigError as error:
            rospy.logwarn('the initial pose on the parameter server is not used: %s', error)
            return
        self.amcl.set_pose(config.initial_pose, np.diag(config.initial_variances))

    def on_set_map(self, request: SetMapRequest) -> SetMapResponse:
        """The service: a map and the pose in it."""
        with self.lock:
            fault = self.take_map(request.map) or self.set_pose(request.initial_pose)
        return SetMapResponse(success=not fault)

    # Poses

    def on_initial_pose(self, msg: PoseWithCovarianceStamped) -> None:
        """The robot was there at the time of the stamp; it may have moved since."""
        self.set_pose(msg)

    def set_pose(self, msg: PoseWithCovarianceStamped) -> str:
        """Take a pose in the map; returns '' or the sentence why it is refused."""
        frame, wanted = msg.header.frame_id.lstrip('/'), self.config.global_frame_id
        data = conversions.pose(msg)
        pose = true_pose(data.position, data.orientation)
        if frame not in ('', wanted):
            fault = f'it is in the frame "{frame}", not in {wanted}'
        elif pose is None:
            fault = 'it is no pose'
        else:
            with self.lock:
                pose = pose @ self._moved_since(data.stamp)
                place = (*pose.translation[:2], pose.yaw)
                fault = self.amcl.set_pose(place, np.array(data.covariance)[PLANAR])
        if fault:
            rospy.logwarn('initialpose is ignored: %s', fault)
        else:
            rospy.loginfo('starting at x %.3f m, y %.3f m, yaw %.3f rad', *place)
        return fault

    def _moved_since(self, stamp) -> Transform:
        """base at a time (s) -> base now by the odometry; none where tf does not know."""
        c = self.config
        then = self.transforms.lookup_at(c.odom_frame_id, c.base_frame_id, stamp) if stamp > 0.0 else None
        now = self.transforms.latest(c.odom_frame_id, c.base_frame_id) if then is not None else None
        return Transform() if now is None else then.inverse() @ now

    def on_global_localization(self, _request: EmptyRequest) -> EmptyResponse:
        """The service: the robot may be anywhere."""
        with self.lock:
            fault = self.amcl.start_anywhere()
        if fault:
            raise rospy.ServiceException(fault)
        return EmptyResponse()

    def on_nomotion_update(self, _request: EmptyRequest) -> EmptyResponse:
        """The service: the next scans count although the robot stands."""
        with self.lock:
            self.amcl.force_update()
        return EmptyResponse()

    def save_pose(self) -> None:
        """Leave the pose on the parameter server, for the next start."""
        with self.lock:
            belief, offset, odometry = self.amcl.belief, self.amcl.map_from_odom, self.last_odometry
        if belief is None or odometry is None or self.config.save_pose_rate <= 0.0:
            return
        try:
            with self.saving:
                save(offset @ odometry, belief)
                self.known = saved()
        except OSError as error:  # the master is gone
            rospy.logwarn_throttle(PATIENCE, 'the pose is not saved for the next start: %s', error)

    # Scans

    def on_scan(self, msg: LaserScan) -> None:
        """Queue a scan, and use all whose transforms have come."""
        with self.lock:
            if self.waiting.add(msg, rospy.Time.now().to_sec()):  # the clock went back
                self.amcl.forget_odometry()
        self.on_transforms()

    def on_transforms(self) -> None:
        """Use the scans that tf now knows the robot's pose of."""
        if not self.waiting:
            return
        with self.lock:
            scans = self.waiting.ready(self.config.odom_frame_id, self.config.base_frame_id)
            due = False
            for scan in scans:
                due = self._use(scan) or due
        if due:
            self.save_pose()

    def _use(self, scan) -> bool:
        """Whether it is time to save the pose."""
        result = self.amcl.on_scan(scan)
        if result is None or result.map_from_odom is None:
            return False
        self.last_odometry, stamp = scan.odometry, scan.sweep.stamp
        self.outputs.transform(stamp, result.map_from_odom)
        if result.pose is not None:
            self.outputs.pose(stamp, result.pose)
        if result.counted:
            self.outputs.lost(self.amcl.lost.probability)
            self.outputs.cloud(stamp, self.amcl.filter.poses)
        return self.outputs.save_is_due(stamp)

    # Parameters and diagnostics

    def on_reconfigure(self, config: AmclConfig) -> str:
        """Take other parameters; the particles stay."""
        with self.lock:
            self.config = self.outputs.config = config
            self.amcl.reconfigure(config)
        self._listen_to_map(config.use_map_topic)
        return ''

    def diagnose(self, _event: rospy.timer.TimerEvent) -> None:
        """Once a second to /diagnostics; and to the log what is being waited for."""
        with self.lock:
            now = rospy.Time.now()
            self.began = self.began or now  # there was no simulated time yet
            waits = self.waiting.waiting_for(now.to_sec())
            heard = Heard(self.waiting.last, self.began.to_sec(), self.scans.resolved_name, waits)
            told = statuses(self.amcl, now.to_sec(), heard, self.counted)
            self.counted = dict(self.amcl.counts)
            self.outputs.lost(self.amcl.lost.probability)
        if told[0].level:
            rospy.logwarn_throttle(PATIENCE, told[0].message)
        publish(self.diagnostics_pub, diagnostic_array(now, told))


def main() -> None:
    start_node('amcl')
    node = AmclNode(configured(AmclConfig))
    node.request_map()
    rospy.spin()
