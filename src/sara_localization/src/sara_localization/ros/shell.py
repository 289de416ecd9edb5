"""What the nodes of this package share: parameters that are right or the node does not start, messages while it is
being shut down, /diagnostics.
"""

from __future__ import annotations

import sys
from typing import Any

import rospy

from sara_common.config import ConfigError
from sara_common.ros.node import until_shutdown


def configured(config_class: type) -> Any:
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


def publish(publisher: rospy.Publisher, message: object) -> None:
    """Publish; a message that comes while the node is being shut down is not told any more."""
    with until_shutdown():
        publisher.publish(message)
