"""Becoming a ROS node that ends on a signal, whatever its main thread is doing."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator

import rospy

from sara_common.ros.blas import use_one_blas_thread
from sara_common.ros.direct import send_directly
from sara_common.ros.members import current
from sara_common.ros.sleep import wake_when_due


def start_node(name: str, anonymous: bool = False, disable_rostime: bool = False) -> None:
    """`rospy.init_node` for a node that SIGTERM and SIGINT end; call it from the main thread.

    rospy's own handler unregisters the node within the main thread. A signal that comes while that thread registers a
    topic then waits for ever for the lock of the same call (rospy.core._LockedServerProxy): roslaunch kills such a node
    after 15 s, rosrun never. Here a thread of its own ends the node, and the main thread goes on until it sees
    `rospy.is_shutdown()`. A node that is one of several in its process (members.py) has been started with it.
    """
    if current() is not None:
        return

    def end(number: int, _frame: object) -> None:
        threading.Thread(target=rospy.signal_shutdown, args=(f'signal-{number}',), name='end of the node').start()

    send_directly()
    wake_when_due()
    use_one_blas_thread()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    rospy.init_node(name, anonymous=anonymous, disable_rostime=disable_rostime, disable_signals=True)


def on_shutdown(hook: Callable[[], None]) -> None:
    """`rospy.on_shutdown` that calls the hook once, even if the node is being ended while this registers it.

    rospy forgets such a hook: it waits for the end of the shutdown and then joins a list that nobody reads any more.
    A main thread that waits for what its hook sets then waits for ever.
    """
    called = threading.Lock()

    def once() -> None:
        if called.acquire(blocking=False):
            hook()

    rospy.on_shutdown(once)
    if rospy.is_shutdown():
        with contextlib.suppress(rospy.ROSException):  # its topics are closed already
            once()


@contextlib.contextmanager
def until_shutdown() -> Iterator[None]:
    """What publishes here on a topic that the node's shutdown has closed says nothing of it."""
    try:
        yield
    except rospy.ROSException:
        if not rospy.core.is_shutdown_requested():
            raise
