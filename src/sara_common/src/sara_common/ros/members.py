"""Several nodes in one process: each has its own name, and with it its private names, and its own remappings, as a
nodelet has. To the ROS master they are one node, that of the process.

A thread belongs to the member that started it; callbacks of topics and services, which run in rospy's threads, to the
member that subscribed or offered them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from contextvars import ContextVar
from functools import wraps
from typing import Any, NamedTuple

import rospy
import rospy.names


class Member(NamedTuple):
    """name: of the node, global. remappings: {name: what it is called instead}, both global."""

    name: str
    remappings: Mapping[str, str]


_current: ContextVar[Member | None] = ContextVar('member', default=None)


def current() -> Member | None:
    """Whose code runs; None in the process's own, which is all there is in most."""
    return _current.get()


def within(member: Member, function: Callable) -> Callable:
    """The function as a part of a member, in whichever thread."""

    @wraps(function)
    def called(*arguments: Any, **keywords: Any) -> Any:
        before = _current.set(member)
        try:
            return function(*arguments, **keywords)
        finally:
            _current.reset(before)

    return called


class Remappings(dict):
    """rospy's table of the process's remappings {global name: global name}, which knows those of members."""

    def __contains__(self, name: object) -> bool:
        return name in _own_remappings() or super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        own = _own_remappings()
        return own[name] if name in own else super().__getitem__(name)


def _own_remappings() -> dict[str, str]:
    member = current()
    return {} if member is None else member.remappings


def make_room() -> None:
    """Teach rospy and threading what a member is; called once, after rospy.init_node."""
    name_of_process = rospy.names.get_name

    def get_name() -> str:
        member = current()
        return name_of_process() if member is None else member.name

    rospy.names.get_name = rospy.get_name = get_name
    rospy.names._resolved_mappings = Remappings(rospy.names._resolved_mappings)
    start, subscribe, offer = threading.Thread.start, rospy.Subscriber.__init__, rospy.Service.__init__

    def owned(callback: Callable | None) -> Callable | None:
        member = current()
        return callback if member is None or callback is None else within(member, callback)

    def started(thread: threading.Thread) -> None:
        thread.run = owned(thread.run)
        start(thread)

    def subscribed(subscriber, name, data_class, callback=None, *arguments, **keywords) -> None:
        subscribe(subscriber, name, data_class, owned(callback), *arguments, **keywords)

    def offered(service, name, service_class, handler, *arguments, **keywords) -> None:
        offer(service, name, service_class, owned(handler), *arguments, **keywords)

    threading.Thread.start = started
    rospy.Subscriber.__init__, rospy.Service.__init__ = subscribed, offered
