"""The kinds of inputs: their message, how it becomes plain data, and the engine's method that takes it."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from typing import NamedTuple

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped, TwistWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu

from sara_localization.ros import conversions, wire


class Kind(NamedTuple):
    """message: its class; convert: message to data.py; read: its bytes to data.py; method: the FilterEngine's."""

    message: type
    convert: Callable
    read: Callable
    method: str

    @property
    def type(self) -> str:
        """E.g. 'nav_msgs/Odometry'."""
        return self.message._type  # pylint: disable=protected-access


def _pose(data: bytes):
    return conversions.pose(PoseWithCovarianceStamped().deserialize(data))


def _twist(data: bytes):
    return conversions.twist(TwistWithCovarianceStamped().deserialize(data))


KINDS = {
    'odom': Kind(Odometry, conversions.odometry, wire.odometry, 'add_odometry'),
    'imu': Kind(Imu, conversions.imu, wire.imu, 'add_imu'),
    'pose': Kind(PoseWithCovarianceStamped, conversions.pose, _pose, 'add_pose'),
    'twist': Kind(TwistWithCovarianceStamped, conversions.twist, _twist, 'add_twist'),
}


def resolved(topic: str) -> str:
    """The topic with a leading slash, as a bag names it."""
    return topic if topic.startswith('/') else '/' + topic


def why_silent(kind: str, topic: str, published: list[tuple[str, str]]) -> str:
    """Why nothing comes on a topic, from [(topic, type), ...] of what is published; '' where it is published as it
    should.
    """
    types, wanted = dict(published), KINDS[kind].type
    if topic in types:
        return '' if types[topic] in (wanted, '*') else f'{topic} is a {types[topic]}, a {wanted} is needed'
    alike = difflib.get_close_matches(topic, [name for name, type_ in published if type_ == wanted], 1, 0.5)
    others = sorted(name for name, type_ in published if type_ == wanted)
    hint = (
        f'is {alike[0]} meant?'
        if alike
        else ('{} comes on {}'.format(wanted, ', '.join(others[:4])) if others else f'there is no {wanted} at all')
    )
    return f'nobody publishes {topic} ({hint})'


def published_topics() -> list[tuple[str, str]]:
    """[(topic, type), ...] as the master knows them; [] where it does not answer."""
    try:
        return [tuple(pair) for pair in rospy.get_published_topics()]
    except Exception:  # pylint: disable=broad-except
        return []
