"""composed: runs several nodes of ours in one process; see members.py.

`~nodes`: {name: {module: whose main() is the node, remap: [name:=other_name, ...]}}. Parameters are each node's own,
below its name. Where one node ends, for whatever reason, the process ends.
"""

from __future__ import annotations

import importlib
import sys
import threading
import traceback
from collections.abc import Callable
from typing import NamedTuple

import rospy
from rosgraph.names import resolve_name

from sara_common.config import ConfigError
from sara_common.ros.members import Member, make_room, within
from sara_common.ros.node import start_node


class Node(NamedTuple):
    """member: what it is called. main: runs it until ROS shuts down."""

    member: Member
    main: Callable[[], None]


def nodes_of(wanted: object, process: str) -> list[Node]:
    """The Nodes of the parameter `~nodes`, whose names are relative to the namespace of the process (its global name).

    Raises ConfigError with every fault.
    """
    if not isinstance(wanted, dict) or not wanted:
        raise ConfigError([f'nodes is {wanted!r}, allowed is a mapping from names to module and remap'])
    faults, nodes = [], []
    for name, described in sorted(wanted.items()):
        described = described if isinstance(described, dict) else {}
        module, remap = described.get('module'), described.get('remap', [])
        for key in sorted(described.keys() - {'module', 'remap'}):
            faults.append(f'nodes/{name}/{key} is {described[key]!r}, but there is no such parameter')
        pairs = [str(pair).split(':=') for pair in remap] if isinstance(remap, list) else [[]]
        if not all(len(pair) == 2 and all(pair) for pair in pairs):
            faults.append(f'nodes/{name}/remap is {remap!r}, allowed is a list of name:=other_name')
            continue
        try:
            main = importlib.import_module(module).main
        except (ImportError, AttributeError, TypeError, ValueError) as error:
            faults.append(f'nodes/{name}/module is {module!r}, allowed are modules with a main(): {error}')
            continue
        own = resolve_name(name, process)
        nodes.append(Node(Member(own, {resolve_name(a, own): resolve_name(b, own) for a, b in pairs}), main))
    if faults:
        raise ConfigError(faults)
    return nodes


def main() -> None:
    """Run the nodes until ROS shuts down, or one of them ends; exit status 1 then."""
    start_node('composed')
    try:
        nodes = nodes_of(rospy.get_param('~nodes', None), rospy.get_name())
    except ConfigError as error:
        rospy.logfatal('%s cannot start: %s', rospy.get_name(), error)
        sys.exit(1)
    make_room()
    ended: list[str] = []
    for node in nodes:
        threading.Thread(target=_run, args=(node, ended), name=node.member.name, daemon=True).start()
    rospy.spin()
    sys.exit(bool(ended))


def _run(node, ended):
    name = node.member.name
    try:
        within(node.member, node.main)()
    except SystemExit as end:  # it has said why
        rospy.logfatal('%s has ended with exit status %s', name, end.code)
    except Exception:
        rospy.logfatal('%s has ended: %s', name, traceback.format_exc())
    if not rospy.is_shutdown():
        ended.append(name)
        rospy.signal_shutdown(f'{name} has ended')
