"""A filter and navsat_transform_node together over a bag, each feeding the other, in lockstep with the recorded times.

The node has its own rate: its cycles run with the first tick of the filter at or after their time. It takes the
filter's output as odometry/filtered; odometry/gps and gps/heading go to the inputs of these topics, and never come from
the bag.
"""

from __future__ import annotations

import datetime
from collections.abc import Callable, Sequence
from typing import NamedTuple

import rospy

from sara_localization.config.filter_config import FilterConfig
from sara_localization.geometry.stamps import Stamp
from sara_localization.gps.navsat import TOPICS, NavSat
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.gps.velocity_heading import VelocityHeading
from sara_localization.inputs.data import FilterOutput, OdometryData
from sara_localization.ros import conversions
from sara_localization.ros.bags.bag_filter import BagFilter
from sara_localization.ros.bags.bag_tools import UsageError
from sara_localization.ros.inputs import resolved
from sara_localization.ros.navsat import messages

GPS, HEADING = '/odometry/gps', '/gps/heading'


class GpsInputs(NamedTuple):
    """The node's parameters, and the bag's topics (with a leading slash) of fixes, of the IMU that tells the heading,
    and of the receiver's velocities, which count with velocity_heading.
    """

    config: NavSatConfig
    fix: str = '/gps/fix'
    imu: str = '/imu/data'
    velocity: str = '/gps/vel'


class GpsBagFilter(BagFilter):
    """A BagFilter with the node beside it.

    Args:
        gps: what the node runs on. config, static and the rest: as of BagFilter.
        on_gps: called with (time of the tick in s, OdometryData) for every odometry/gps.
        given: whether odometry/gps of a stamp (s) is given to the filter.
        inform: called with a sentence when the world frame has been laid on the earth.
    """

    def __init__(
        self,
        gps: GpsInputs,
        config: FilterConfig,
        static: Sequence = (),
        on_gps: Callable[[Stamp, OdometryData], None] = lambda now, data: None,
        given: Callable[[float], bool] = lambda stamp: True,
        inform: Callable[[str], None] = lambda sentence: None,
        **rest,
    ):
        super().__init__(config, static, **rest)
        if GPS not in self._by_topic:
            raise UsageError(f'no input of the filter is {GPS}: give it one, for instance odom1: {GPS[1:]}')
        self.gps, self._on_gps, self._given = gps, on_gps, given
        names = {**TOPICS, 'fix': gps.fix, 'imu': gps.imu}
        self.navsat = NavSat(gps.config, self.buffer, self.report, inform, no_date, topics=names)
        self.heading = None
        if gps.config.velocity_heading:
            self.heading = VelocityHeading(self.navsat, self.buffer, self.report, gps.velocity)
        self._cycles = 0

    @property
    def topics(self) -> list[str]:
        """All topics to be read from the bag, with a leading slash."""
        own = [self.gps.fix, self.gps.imu] + ([self.gps.velocity] if self.heading else [])
        return [topic for topic in super().topics if topic not in (GPS, HEADING)] + own

    def deliver(self, topic: str, msg: object, received: rospy.Time | Stamp) -> None:
        """One message of the bag, at the time it was received."""
        super().deliver(topic, msg, received)
        topic = resolved(topic)
        if topic == self.gps.fix:
            now = received if isinstance(received, Stamp) else conversions.seconds(received)
            self.navsat.on_fix(messages.fix(_read(msg, topic, 'sensor_msgs/NavSatFix')), now)
        elif topic == self.gps.imu and self.navsat.needs_imu:
            self.navsat.on_imu(conversions.imu(_read(msg, topic, 'sensor_msgs/Imu')))
        elif topic == self.gps.velocity and self.heading:
            found = self.heading.on_velocity(messages.velocity(_read(msg, topic, 'geometry_msgs/TwistStamped')))
            if found is not None and self._given(found.stamp):
                self._enter(HEADING, found)

    def _took(self, now: Stamp, output: FilterOutput) -> None:
        if output.published:
            self.navsat.on_odometry(output.odometry)
        if now.nanoseconds < self.start + round(self._cycles * 1e9 / self.gps.config.frequency):
            return
        self._cycles += 1
        for data in self.navsat.tick(now).gps:
            self._on_gps(now, data)
            if self._given(data.stamp):
                self._enter(GPS, data)


def no_date() -> datetime.date:
    """A bag without real dates: its declination is not known, whenever it is played."""
    return datetime.date.min


def _read(msg, topic, wanted):
    if msg._type != wanted:
        raise UsageError(f'{topic} is a {msg._type} in this bag, a {wanted} is needed')
    return getattr(msg, 'message', msg)
