"""The straight stretches of a drive in a bag, for navsat_transform_node's parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rosbag

from sara_common.ros import bags
from sara_localization.checks.gps_heading import Stretches, stretches
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.gps.fixes import usable
from sara_localization.gps.grid import NoPlace
from sara_localization.gps.heading import correction, robot_heading
from sara_localization.gps.utm import Utm, Zone
from sara_localization.ros import conversions
from sara_localization.ros.bags import bag_tools
from sara_localization.ros.bags.bag_tools import TF_TOPICS, UsageError
from sara_localization.ros.bags.gps_filter import GpsInputs, no_date
from sara_localization.ros.inputs import resolved
from sara_localization.ros.navsat import messages

BASE = 'base_link'


def survey(path: str, gps: GpsInputs, static: Sequence = ()) -> Stretches:
    """Where the GPS says that the robot went, and the headings that navsat_transform_node would take, both on the grid.

    static: [(parent, child, Transform)] that the bag lacks. Raises UsageError.
    """
    buffer = TransformBuffer()
    for parent, child, transform in static:
        buffer.set_transform(parent, child, transform)
    fixes, headings, why = [], [], 'no message came'
    with rosbag.Bag(path) as bag:
        types = dict(bag_tools.topic_types(bag))
        for topic, wanted in ((gps.fix, 'sensor_msgs/NavSatFix'), (gps.imu, 'sensor_msgs/Imu')):
            if types.get(topic) != wanted:
                raise UsageError(
                    f'{topic} is {types.get(topic, "not")} in this bag, a {wanted} is needed (--fix, --imu)'
                )
        names = [t for t in bag.get_type_and_topic_info().topics if resolved(t) in (gps.fix, gps.imu, *TF_TOPICS)]
        for name, msg, _ in bags.messages(bag, names):
            topic = resolved(name)
            if topic in TF_TOPICS:
                bag_tools.enter_transforms(buffer, topic, msg)
            elif topic == gps.fix:
                fix, _ = usable(messages.fix(msg), True, gps.config.assumed_sigma)
                fixes += [fix] if fix is not None else []
            else:
                data = conversions.imu(msg)
                yaw = robot_heading(data, BASE, buffer)
                if isinstance(yaw, float):
                    headings.append((data.stamp, yaw))
                else:
                    why = yaw.sentence
    if not (fixes and headings):
        raise UsageError(f'{gps.imu if fixes else gps.fix}: nothing in the bag can be used: {why}')
    return _on_the_grid(gps, fixes, np.array(headings))


def _on_the_grid(gps, fixes, headings):
    first = fixes[0]
    try:
        grid = Utm(Zone.of(first.latitude, first.longitude))
        places = np.array([(fix.stamp, *grid.forward(fix.latitude, fix.longitude)) for fix in fixes])
        headings[:, 1] += grid.convergence(first.latitude, first.longitude)
    except NoPlace as error:
        raise UsageError(f'{gps.fix}: {error}') from None
    headings[:, 1] += correction(gps.config, first, no_date, measured=True).angle
    return stretches(places[np.argsort(places[:, 0])], headings[np.argsort(headings[:, 0])])
