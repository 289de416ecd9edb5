"""slam_sonar: a map built while driving, by range sensors with wide cones and odometry.

In: odom (Odometry in odom_frame), ~range_topics (Range), /tf for where the sensors sit. Out: map, map_metadata,
keepout_filter_mask, speed_filter_mask, ~walls_ahead, ~entropy, map -> odom, /diagnostics. Services: dynamic_map, ~save,
reload_edits.
"""

from __future__ import annotations

import math
import threading
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import OccupancyGrid, Odometry
from nav_msgs.srv import GetMap, GetMapRequest, GetMapResponse
from sensor_msgs.msg import Range
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from sara_common.diagnostics import ERROR, OK, WARN, Status, new_faults
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import start_node
from sara_localization.fake import true_pose
from sara_localization.ros import conversions
from sara_localization.ros.shell import configured, publish
from sara_localization.ros.tf2_transforms import Tf2Transforms
from sara_nav.maps.edits import EditsError
from sara_nav.maps.map_io import GridMap
from sara_nav.ros.conversions import grid_to_msg
from sara_slam.mapping.journal import JournalError
from sara_slam.ros.outputs import Outputs, journal_of, save_answer
from sara_slam.sonar.mapper import MapperError, SonarMapper
from sara_slam.sonar.node_config import SonarNodeConfig
from sara_slam.sonar.walls_ahead import WALLS_S, same

QUEUE = 200
SILENT_AFTER = 5.0
"""s without odometry or a reading until that is told."""
SHARE = 6.0
"""Times that a map took to draw, until the next one is begun at the earliest."""
FAULTS = ('bad_pose', 'bad_frame', 'bad_range', 'no_mount', 'no_pose', 'joined', 'not_kept')
NO_MAP = 'there is no map yet: no reading has been used'


class SonarNode:
    """Callbacks share one lock; a map is drawn beside it, of a snapshot."""

    def __init__(self, config: SonarNodeConfig):
        self.config, self.lock, self.drawing = config, threading.Lock(), threading.Lock()
        self.mapper = SonarMapper(config.model, rospy.logwarn, journal_of(config.state_file))
        self.outputs, self.transforms = Outputs(config), Tf2Transforms()
        self.mounts, self.said, self.told = {}, set(), {}
        self.began, self.last_pose, self.last_range = rospy.Time.now(), None, None
        self.grid, self.drawn, self.rest_until = None, 0, -math.inf
        self.walls, self.walls_pub = None, rospy.Publisher('~walls_ahead', OccupancyGrid, queue_size=1, latch=True)
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=10)
        self.odometry = rospy.Subscriber('odom', Odometry, self.on_odometry, queue_size=QUEUE, tcp_nodelay=True)
        self.ranges = [
            rospy.Subscriber(topic, Range, self.on_range, topic, queue_size=QUEUE, tcp_nodelay=True)
            for topic in config.range_topics
        ]
        self.services = [
            rospy.Service('dynamic_map', GetMap, self.on_dynamic_map),
            rospy.Service('~save', Trigger, self.on_save),
        ]
        self.timers = [rospy.Timer(rospy.Duration(1.0), self.diagnose, reset=True)]
        for period, act in (
            (config.transform_publish_period, self.on_transform_due),
            (config.map_update_interval, self.on_map_due),
            (WALLS_S, self.on_walls_due),
        ):
            if period > 0.0:
                self.timers.append(rospy.Timer(rospy.Duration.from_sec(period), act, reset=True))

    def on_odometry(self, msg: Odometry) -> None:
        """Where the robot is by its odometry."""
        data = conversions.odometry(msg)
        pose = true_pose(data.position, data.orientation)
        with self.lock:
            if data.frame_id.lstrip('/') != self.config.odom_frame:
                wanted = self.config.odom_frame
                self._fault('bad_frame', '', f'odom is in the frame "{data.frame_id}": ignored; it must be in {wanted}')
            elif pose is None:
                self._fault('bad_pose', '', 'odom holds what is no pose: dropped')
            else:
                self.last_pose = data.stamp
                self.mapper.on_pose(data.stamp, (pose.translation[0], pose.translation[1], pose.yaw))

    def on_range(self, msg: Range, topic: str) -> None:
        """A reading; where its sensor sits is looked up once."""
        stamp, frame = conversions.seconds(msg.header.stamp), msg.header.frame_id
        with self.lock:
            mount = self.mounts.get(frame) or self._mount(topic, frame, msg, stamp)
            if mount is None:
                return
            distance = math.inf if msg.range > msg.max_range else -math.inf if msg.range < msg.min_range else msg.range
            self.last_range = rospy.get_time()
            if math.isnan(distance):
                self._fault('bad_range', topic, f'a reading on {topic} holds what is no range: dropped')
                return
            self.mapper.on_range(stamp, topic, mount, distance)

    def _mount(self, topic, frame, msg, stamp):
        """Where the sensor of a first reading sits; None, and told, where tf does not know it."""
        found = self.transforms.lookup(self.config.base_frame, frame.lstrip('/'), stamp) if frame else None
        if found is None:
            of = f'a reading on {topic} comes from the frame "{frame}", of which tf does not know where it is'
            self._fault('no_mount', topic, of)
            return None
        cone = self.config.model.field_of_view
        if not abs(msg.field_of_view - cone) < 0.1 * cone:
            rospy.logwarn('%s says a field_of_view of %.3g rad; the parameter is %.3g', topic, msg.field_of_view, cone)
        mount = self.mounts[frame] = (found.translation[0], found.translation[1], found.yaw)
        return mount

    def _fault(self, what, key, sentence):
        self.mapper.counts[what] += 1
        if (what, key) not in self.said:
            self.said.add((what, key))
            rospy.logwarn(sentence)

    def on_transform_due(self, _event: rospy.timer.TimerEvent) -> None:
        """map -> odom every transform_publish_period."""
        with self.lock:
            offset = self.mapper.map_from_odom
        self.outputs.transform(rospy.Time.now().to_sec(), offset)

    def on_map_due(self, _event: rospy.timer.TimerEvent) -> None:
        """The map anew, where something was heard since and the last one did not take long."""
        if time.monotonic() >= self.rest_until:
            self._draw()

    def on_walls_due(self, _event: rospy.timer.TimerEvent) -> None:
        """What stands beside the robot, where that has changed."""
        with self.lock:
            walls, before = self.mapper.slam.walls_ahead(), self.walls
            self.walls = walls
        if not same(before, walls):
            stamp, frame = rospy.Time.now(), self.config.map_frame
            publish(self.walls_pub, grid_to_msg(walls.data, walls.geometry, 0.0, frame, stamp))

    def _draw(self) -> GridMap | None:
        """The map as it is now, published if it is a new one; None before the first reading."""
        with self.drawing:
            began = time.monotonic()
            with self.lock:
                snapshot, heard, entropy = self.mapper.snapshot(), len(self.mapper.slam.kept), self.mapper.entropy
            if not heard:
                return None
            if heard > self.drawn:
                solved = snapshot.solved()
                self.grid, doorways = snapshot.drawn(solved)
                with self.lock:
                    self.mapper.settle(solved, doorways)
                self.drawn = heard
                self.outputs.map(rospy.Time.now(), self.grid)
                self.outputs.entropy(entropy)
                now = time.monotonic()
                self.rest_until = now + SHARE * (now - began)
            return self.grid

    def on_dynamic_map(self, _request: GetMapRequest) -> GetMapResponse:
        """The service: the map as it is now. Raises ServiceException before the first reading."""
        if self._draw() is None:
            raise rospy.ServiceException(NO_MAP)
        return GetMapResponse(map=self.outputs.message)

    def on_save(self, _request: TriggerRequest) -> TriggerResponse:
        """The service ~save: the map as it is now into `map_file`; the answer says where, or why not."""
        return save_answer(self.config.map_file, self._draw, NO_MAP)

    def diagnose(self, _event: rospy.timer.TimerEvent) -> None:
        """Once a second to /diagnostics."""
        with self.lock:
            status = self._status(rospy.Time.now())
            self.told = dict(self.mapper.counts)
        if status.level:
            rospy.logwarn_throttle(SILENT_AFTER, status.message)
        publish(self.diagnostics_pub, diagnostic_array(rospy.Time.now(), [status]))

    def _status(self, now):
        counts, walls = self.mapper.counts, len(self.mapper.slam.filter.walls)
        self.began = self.began or now  # there was no simulated time yet
        level, message = OK, f'{counts["used"]} readings used, {walls} walls'
        faults = new_faults(counts, self.told, FAULTS)
        if faults:
            level, message = WARN, faults
        odometry = f'odometry on {self.odometry.resolved_name}'
        for what, last in (('reading', self.last_range), (odometry, self.last_pose)):
            silent = now.to_sec() - (self.began.to_sec() if last is None else last)
            if silent > SILENT_AFTER:
                level, message = ERROR, f'no {what} for {silent:.0f} s'
        values = tuple((what, str(n)) for what, n in sorted({**counts, 'walls': walls}.items()))
        return Status('slam_sonar', level, message, values)


def main() -> None:
    start_node('slam_sonar')
    config = configured(SonarNodeConfig)
    try:
        SonarNode(config)  # kept alive by its subscribers
    except (JournalError, MapperError, EditsError) as error:
        rospy.logfatal('%s: %s', config.state_file, error)
        raise SystemExit(1) from error
    rospy.spin()
