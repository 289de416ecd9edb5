"""Which process a node is."""

from __future__ import annotations

from xmlrpc.client import ServerProxy

import rosgraph
import rospy


def process_of(node: str) -> int:
    """Process id of a running node; the caller is a node, too. Errors: rosgraph.MasterException where no such node is
    registered, OSError where it does not answer, RuntimeError where it answers with an error.
    """
    caller = rospy.get_name()
    code, text, pid = ServerProxy(rosgraph.Master(caller).lookupNode(node)).getPid(caller)
    if code != 1:
        raise RuntimeError(f'{node} does not tell its process: {text}')
    return pid
