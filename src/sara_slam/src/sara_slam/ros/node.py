"""slam_gmapping: a map built while driving, under the names of gmapping's node.

In: scan (LaserScan), /tf. Out: map, map_metadata, keepout_filter_mask, speed_filter_mask, ~entropy, map -> odom,
/diagnostics. Services: dynamic_map, ~save, reload_edits.
"""

from __future__ import annotations

import threading

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.srv import GetMap, GetMapRequest, GetMapResponse
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Trigger, TriggerRequest, TriggerResponse

from sara_common.diagnostics import ERROR, OK, WARN, Status, new_faults
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import start_node
from sara_localization.ros.amcl.scans import WaitingScans
from sara_localization.ros.shell import configured, publish
from sara_localization.ros.tf2_transforms import Tf2Transforms
from sara_nav.maps.edits import EditsError
from sara_slam.mapping.journal import JournalError
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig
from sara_slam.ros.outputs import Outputs, journal_of, save_answer

SILENT_AFTER = 15.0
"""s without a scan until that is told."""
FAULTS = ('bad_scan', 'bad_odometry', 'bad_mount', 'no_transform', 'jump', 'not_kept')
NO_MAP = 'there is no map yet: no scan has been used'


class SlamNode:
    """Callbacks share one lock; the map is drawn under it, too, for it reads the poses."""

    def __init__(self, config: SlamConfig):
        self.config, self.lock = config, threading.RLock()
        self.slam = Slam(config, rospy.logwarn, journal_of(config.state_file))
        self.outputs = Outputs(config)
        self.transforms = None  # tf may come before the rest is there
        self.waiting = None
        self.transforms = Tf2Transforms(on_news=self.on_transforms)
        self.waiting = WaitingScans(self.transforms, self._lost)
        self.began, self.drawn_at, self.drawn = rospy.Time.now(), None, 0
        self.told = {}
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=10)
        self.scans = rospy.Subscriber('scan', numpy_msg(LaserScan), self.on_scan, queue_size=100, tcp_nodelay=True)
        self.services = [
            rospy.Service('dynamic_map', GetMap, self.on_dynamic_map),
            rospy.Service('~save', Trigger, self.on_save),
        ]
        self.timers = [rospy.Timer(rospy.Duration(1.0), self.diagnose, reset=True)]
        if config.transform_publish_period > 0.0:
            period = rospy.Duration.from_sec(config.transform_publish_period)
            self.timers.append(rospy.Timer(period, self.on_transform_due, reset=True))

    def _lost(self, sentence):
        self.slam.trouble('no_transform', sentence)

    def on_scan(self, msg: LaserScan) -> None:
        """Queue a scan, and use all whose transforms have come."""
        with self.lock:
            if self.waiting.add(msg, rospy.Time.now().to_sec()):  # the clock went back
                self.slam.forget_odometry()
                self.drawn_at = None
        self.on_transforms()

    def on_transforms(self) -> None:
        """Use the scans that tf now knows the robot's pose of."""
        if not self.waiting:
            return
        with self.lock:
            for scan in self.waiting.ready(self.config.odom_frame, self.config.base_frame):
                result = self.slam.on_scan(scan)
                if result is not None and result.used:
                    self.outputs.entropy(self.slam.entropy)
            self._draw_if_due(rospy.Time.now())

    def _draw_if_due(self, now):
        """The map anew, once map_update_interval is over and something was seen since."""
        due = self.drawn_at is None or (now - self.drawn_at).to_sec() >= self.config.map_update_interval
        if due and self.slam.counts['used'] > self.drawn:
            self._draw(now)

    def _draw(self, now):
        self.outputs.map(now, self.slam.map())
        self.drawn_at, self.drawn = now, self.slam.counts['used']

    def on_dynamic_map(self, _request: GetMapRequest) -> GetMapResponse:
        """The service: the map as it is now. Raises ServiceException before the first scan."""
        with self.lock:
            if not self.slam.scans:
                raise rospy.ServiceException(NO_MAP)
            if self.slam.counts['used'] > self.drawn:
                self._draw(rospy.Time.now())
            return GetMapResponse(map=self.outputs.message)

    def on_save(self, _request: TriggerRequest) -> TriggerResponse:
        """The service ~save: the map as it is now into `map_file`; the answer says where, or why not."""
        return save_answer(self.config.map_file, self._map_now, NO_MAP)

    def _map_now(self):
        with self.lock:
            return self.slam.map() if self.slam.scans else None

    def on_transform_due(self, _event: rospy.timer.TimerEvent) -> None:
        """map -> odom every transform_publish_period, from the start on, as the C++ node."""
        with self.lock:
            offset = self.slam.map_from_odom
        self.outputs.transform(rospy.Time.now().to_sec(), offset)

    def diagnose(self, _event: rospy.timer.TimerEvent) -> None:
        """Once a second to /diagnostics."""
        with self.lock:
            status = self._status(rospy.Time.now())
            self.told = dict(self.slam.counts)
        if status.level:
            rospy.logwarn_throttle(SILENT_AFTER, status.message)
        publish(self.diagnostics_pub, diagnostic_array(rospy.Time.now(), [status]))

    def _status(self, now):
        counts = self.slam.counts
        self.began = self.began or now  # there was no simulated time yet
        silent = now.to_sec() - (self.began.to_sec() if self.waiting.last is None else self.waiting.last)
        waiting = self.waiting.waiting_for(now.to_sec())
        faults = new_faults(counts, self.told, FAULTS)
        level, message = OK, f'{counts["used"]} scans used, {counts["loops"]} loops closed'
        if silent > SILENT_AFTER:
            level, message = ERROR, f'no scan on {self.scans.resolved_name} for {silent:.0f} s'
        elif waiting:
            level, message = ERROR, waiting
        elif self.slam.map_from_odom is None:
            level, message = WARN, 'the map is gone on with; the robot is looked for near where it ended'
        elif not counts['used']:
            level, message = WARN, f'waiting for a scan on {self.scans.resolved_name}'
        elif faults:
            level, message = WARN, faults
        return Status('slam_gmapping', level, message, tuple((what, str(n)) for what, n in sorted(counts.items())))


def main() -> None:
    start_node('slam_gmapping')
    try:
        SlamNode(configured(SlamConfig))
    except (JournalError, EditsError) as error:
        rospy.logfatal('%s', error)
        raise SystemExit(1) from error
    rospy.spin()
