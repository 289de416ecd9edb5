"""What the nodes of this package share: parameters that are right or the node does not start, messages while it is
being shut down, /diagnostics.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from sara_common.config import ConfigError
from sara_localization.engine.diagnostics import Status


def configured(config_class):
    """config_class.from_params of the node's private parameters; what is wrong with them goes to the log, and if it
    must not be the process ends.
    """
    try:
        config = config_class.from_params(rospy.get_param('~', {}))
    except ConfigError as error:
        for fault in error.faults:
            rospy.logfatal(fault)
        for warning in error.warnings:
            rospy.logwarn(warning)
        sys.exit(1)
    for warning in config.warnings:
        rospy.logwarn(warning)
    return config


def publish(publisher, message):
    """Publish; a message that comes while the node is being shut down is not told any more."""
    try:
        publisher.publish(message)
    except rospy.ROSException:
        if not rospy.core.is_shutdown_requested():
            raise


def diagnostic_array(stamp: rospy.Time, statuses: Iterable[Status]) -> DiagnosticArray:
    """The message of some statuses, each named after the node and itself."""
    node, array = rospy.get_name().lstrip('/'), DiagnosticArray()
    array.header.stamp = stamp
    array.status = [
        DiagnosticStatus(
            name=f'{node}: {status.name}',
            level=status.level,
            message=status.message,
            hardware_id='none',
            values=[KeyValue(key, value) for key, value in status.values],
        )
        for status in statuses
    ]
    return array
