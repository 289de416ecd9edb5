"""navsat_transform_node: a GPS receiver's fixes in a robot's world frame, under the names of robot_localization's.

In: odometry/filtered, imu/data, gps/fix, gps/vel, tf. Out: odometry/gps, gps/filtered, gps/heading, the transform
between UTM (or a local plane) and the world frame, /diagnostics. Services: datum, toLL, fromLL, fromLLArray,
setUTMZone.
"""

from __future__ import annotations

import threading

import rospy
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, NavSatFix

from geographic_msgs.msg import GeoPoint
from robot_localization.srv import (
    FromLL,
    FromLLArray,
    FromLLArrayRequest,
    FromLLArrayResponse,
    FromLLRequest,
    FromLLResponse,
    SetDatum,
    SetDatumRequest,
    SetDatumResponse,
    SetUTMZone,
    SetUTMZoneRequest,
    SetUTMZoneResponse,
    ToLL,
    ToLLRequest,
    ToLLResponse,
)
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import start_node
from sara_localization.geometry.stamps import Stamp
from sara_localization.gps.navsat import TOPICS, NavSat
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.navsat_status import problem_counts, status
from sara_localization.gps.velocity_heading import VELOCITY, VelocityHeading
from sara_localization.ros import conversions, wire
from sara_localization.ros.cycle import Cycle
from sara_localization.ros.mailbox import Mailbox
from sara_localization.ros.navsat import messages
from sara_localization.ros.shell import configured, publish
from sara_localization.ros.tf2_transforms import Tf2Transforms

PATIENCE = 15.0
DIAGNOSTICS_PERIOD = 1.0
MOST_ARRIVED, QUEUE = 10000, 1000


class NavSatNode:
    """Messages wait for the cycle; cycle and services share one lock."""

    def __init__(self, config: NavSatConfig):
        self.config, self.lock = config, threading.RLock()
        transforms = Tf2Transforms(config.transform_timeout)
        self.navsat = NavSat(
            config,
            transforms,
            report=rospy.logwarn,
            inform=rospy.loginfo,
            topics={name: rospy.resolve_name(topic) for name, topic in TOPICS.items()},
            restarts=bool(rospy.get_param('/use_sim_time', False)),
        )
        self.last_fix = self.last_diagnostics = None
        self.counted: dict[str, int] = {}
        self.now = Stamp(0)
        self.gps_pub = rospy.Publisher('odometry/gps', Odometry, queue_size=100, tcp_nodelay=True)
        self.filtered_pub = None
        if config.publish_filtered_gps:
            self.filtered_pub = rospy.Publisher('gps/filtered', NavSatFix, queue_size=10, tcp_nodelay=True)
        self.diagnostics_pub = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=10)
        self.broadcaster = tf2_ros.StaticTransformBroadcaster()
        self.mailbox = Mailbox(MOST_ARRIVED)
        self.subscribers = [
            self.mailbox.subscribe(TOPICS['odometry'], Odometry, self.on_odometry, QUEUE),
            self.mailbox.subscribe(TOPICS['imu'], Imu, self.on_imu, QUEUE),
            self.mailbox.subscribe(TOPICS['fix'], NavSatFix, self.on_fix, QUEUE),
        ]
        if config.velocity_heading:
            self.heading_pub = rospy.Publisher('gps/heading', Imu, queue_size=10, tcp_nodelay=True)
            self.heading = VelocityHeading(self.navsat, transforms, rospy.logwarn, rospy.resolve_name(VELOCITY))
            self.subscribers.append(self.mailbox.subscribe(VELOCITY, TwistStamped, self.on_velocity, QUEUE))
        self.services = [
            rospy.Service('datum', SetDatum, self.on_datum),
            rospy.Service('toLL', ToLL, self.on_to_ll),
            rospy.Service('fromLL', FromLL, self.on_from_ll),
            rospy.Service('fromLLArray', FromLLArray, self.on_from_ll_array),
            rospy.Service('setUTMZone', SetUTMZone, self.on_utm_zone),
        ]
        self.cycle = Cycle(1.0 / config.frequency, self.tick)

    # Messages, as bytes

    def on_odometry(self, data: bytes) -> None:
        """The robot's pose in the world frame."""
        self.navsat.on_odometry(wire.odometry(data))

    def on_imu(self, data: bytes) -> None:
        """The robot's heading; read only while it is waited for."""
        if self.navsat.needs_imu:
            self.navsat.on_imu(wire.imu(data))

    def on_fix(self, data: bytes) -> None:
        """A receiver's fix."""
        self.last_fix = self.now
        self.navsat.on_fix(messages.fix(NavSatFix().deserialize(data)), self.now)

    def on_velocity(self, data: bytes) -> None:
        """A receiver's velocity."""
        heading = self.heading.on_velocity(messages.velocity(TwistStamped().deserialize(data)))
        if heading is not None:
            publish(self.heading_pub, messages.heading_message(heading))

    def tick(self, now: Stamp) -> None:
        """A cycle at `now`; whatever goes wrong in one must not end the next."""
        try:
            with self.lock:
                self.now = now
                self.mailbox.deliver()
                output = self.navsat.tick(now)
            if output.transform is not None:
                self.broadcaster.sendTransform(conversions.transform_message(output.transform))
            for data in output.gps:
                publish(self.gps_pub, messages.odometry_message(data))
            if output.filtered is not None:
                publish(self.filtered_pub, messages.fix_message(output.filtered))
            self._diagnose(now)
        except Exception as error:  # pylint: disable=broad-except
            if not rospy.core.is_shutdown_requested():
                rospy.logerr_throttle(5.0, f'a cycle failed ({type(error).__name__}: {error}); the next one is tried')

    # Services

    def on_datum(self, request: SetDatumRequest) -> SetDatumResponse:
        """Where the origin of the world frame is, and which way it heads."""
        place, q = request.geo_pose.position, request.geo_pose.orientation
        with self.lock:
            _answered(self.navsat.set_datum, place.latitude, place.longitude, place.altitude, (q.x, q.y, q.z, q.w))
        return SetDatumResponse()

    def on_to_ll(self, request: ToLLRequest) -> ToLLResponse:
        """From the world frame to the earth."""
        p = request.map_point
        with self.lock:
            return ToLLResponse(GeoPoint(*_answered(self.navsat.to_ll, (p.x, p.y, p.z))))

    def on_from_ll(self, request: FromLLRequest) -> FromLLResponse:
        """From the earth to the world frame."""
        with self.lock:
            return FromLLResponse(self._point(request.ll_point))

    def on_from_ll_array(self, request: FromLLArrayRequest) -> FromLLArrayResponse:
        """As fromLL, of many points; all of them or none."""
        with self.lock:
            return FromLLArrayResponse([self._point(place) for place in request.ll_points])

    def _point(self, place):
        return Point(*_answered(self.navsat.from_ll, place.latitude, place.longitude, place.altitude))

    def on_utm_zone(self, request: SetUTMZoneRequest) -> SetUTMZoneResponse:
        """The zone to calculate in."""
        with self.lock:
            _answered(self.navsat.set_zone, request.utm_zone)
        return SetUTMZoneResponse()

    def _diagnose(self, now):
        """Once a second to /diagnostics; and to the log what is being waited for."""
        if self.last_diagnostics is not None and 0.0 <= now - self.last_diagnostics < DIAGNOSTICS_PERIOD:
            return
        self.last_diagnostics = now
        with self.lock:
            told = status(self.navsat, now, self.last_fix, self.counted)
            self.counted = problem_counts(self.navsat)
        if told.level:
            rospy.logwarn_throttle(PATIENCE, told.message)
        publish(self.diagnostics_pub, diagnostic_array(conversions.ros_time(now), [told]))


def _answered(question, *arguments):
    """The answer, or a failed service that says why there is none."""
    try:
        return question(*arguments)
    except ValueError as error:
        raise rospy.ServiceException(str(error)) from None


def main() -> None:
    start_node('navsat_transform_node')
    NavSatNode(configured(NavSatConfig))  # kept alive by its services
    rospy.spin()
