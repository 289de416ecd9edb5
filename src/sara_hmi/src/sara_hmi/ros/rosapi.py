"""rosapi's services, those that roslibjs and roslibpy need to look about: parameters, topics, services, nodes."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import rosgraph
import rospy
import rosservice

from sara_hmi.rosbridge.messages import MessageError


class Rosapi:
    """Answers from the ROS master."""

    def __init__(self) -> None:
        self._master = rosgraph.Master(rospy.get_name())
        self._services: dict[str, Callable[[dict], dict]] = {
            'get_param': self._get_param,
            'has_param': lambda a: {'exists': rospy.has_param(_text(a, 'name'))},
            'get_param_names': lambda a: {'names': sorted(rospy.get_param_names())},
            'topics': self._topics,
            'topic_type': lambda a: {'type': self.topic_type(_text(a, 'topic'))},
            'services': lambda a: {'services': self._names(2)},
            'service_type': lambda a: {'type': rosservice.get_service_type(_text(a, 'service')) or ''},
            'nodes': self._nodes,
            'get_time': lambda a: {'time': {'secs': rospy.Time.now().secs, 'nsecs': rospy.Time.now().nsecs}},
        }

    def call(self, name: str, arguments: Any) -> dict[str, Any]:
        """The answer of a service by its name below /rosapi/. Raises MessageError."""
        if name not in self._services:
            raise MessageError(f'there is no service /rosapi/{name[:40]}; there are {", ".join(self._services)}')
        if not isinstance(arguments, dict):
            raise MessageError('the arguments are no object')
        return self._services[name](arguments)

    def topic_type(self, topic: str) -> str:
        """The type of a topic, "" where nobody knows it."""
        return dict(self._master.getTopicTypes()).get(topic, '')

    def _get_param(self, arguments):
        """The value as JSON, as rosapi has it; without a default, what is not there is a fault."""
        name, default = _text(arguments, 'name'), arguments.get('default', '')
        if not rospy.has_param(name):
            if not default:
                raise MessageError(f'there is no parameter {name}')
            return {'value': default if isinstance(default, str) else json.dumps(default)}
        return {'value': json.dumps(rospy.get_param(name), default=str)}

    def _topics(self, _arguments):
        kinds = sorted(self._master.getTopicTypes())
        return {'topics': [topic for topic, _ in kinds], 'types': [kind for _, kind in kinds]}

    def _names(self, index):
        return sorted(name for name, _ in self._master.getSystemState()[index])

    def _nodes(self, _arguments):
        return {
            'nodes': sorted({node for part in self._master.getSystemState() for _, nodes in part for node in nodes})
        }


def _text(arguments, name):
    value = arguments.get(name)
    if not (isinstance(value, str) and value):
        raise MessageError(f'{name} is {str(value)[:40]!r}, allowed is a name')
    return value
