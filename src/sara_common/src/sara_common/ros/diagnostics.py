"""Statuses (sara_common.diagnostics) as messages on /diagnostics."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from sara_common.diagnostics import Status


def diagnostic_array(stamp: rospy.Time, statuses: Iterable[Status], hardware_id: str = 'none') -> DiagnosticArray:
    """The message of some statuses, each named after the node and itself."""
    node, array = rospy.get_name().lstrip('/'), DiagnosticArray()
    array.header.stamp = stamp
    array.status = [
        DiagnosticStatus(
            name=f'{node}: {status.name}',
            level=status.level,
            message=status.message,
            hardware_id=hardware_id,
            values=[KeyValue(str(key), str(value)) for key, value in status.values],
        )
        for status in statuses
    ]
    return array


class Diagnostics:
    """Publishes one status of a node on /diagnostics. name: of the status; hardware_id: what it is about."""

    def __init__(self, name: str, hardware_id: str = '') -> None:
        self._publisher = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=5)
        self._name, self._hardware_id = name, hardware_id

    def publish(self, level: int, message: str, values: Mapping[str, object]) -> None:
        """Publish a level (OK, WARN, ERROR), a sentence, and values by name, sorted by it."""
        status = Status(self._name, level, message, tuple(sorted(values.items())))
        self._publisher.publish(diagnostic_array(rospy.Time.now(), [status], self._hardware_id))
