"""The whole of SARA, simulated on a map, with its touch screen: started on a ROS master of its own, and ended."""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rospkg
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry

from sara_bringup.ros.masters import launched
from sara_bringup.ros.own_master import own_master
from sara_common.planar import yaw_of
from sara_common.ports import free_port
from sara_lab.ros.touch.stand_in import url

PATIENCE_S = 60.0


def end_cleanly() -> None:
    """SIGTERM and Ctrl-C end this process by an exception, so that what it started is ended too; call it first."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    signal.signal(signal.SIGINT, signal.default_int_handler)  # who is started in the background inherits none


class Truth:
    """What the simulator knows: `track`, [(t, x, y, yaw)] since `begin`, and how often the chair touched something."""

    def __init__(self) -> None:
        self.track: list[tuple[float, float, float, float]] = []
        self._contacts = 0
        self._told = threading.Event()
        self._ears = [
            rospy.Subscriber('/ground_truth', Odometry, self._on_pose),
            rospy.Subscriber('/diagnostics', DiagnosticArray, self._on_diagnostics),
        ]

    def _on_pose(self, message):
        pose = message.pose.pose
        self.track.append((message.header.stamp.to_sec(), pose.position.x, pose.position.y, yaw_of(pose.orientation)))

    def _on_diagnostics(self, message):
        for status in message.status:
            values = {value.key: value.value for value in status.values}
            if status.hardware_id == 'simulated' and 'contacts' in values:
                self._contacts = int(values['contacts'])
                self._told.set()

    def contacts(self) -> int:
        """How often the chair has touched something until now."""
        for _ in range(2):  # the first that comes may have been on its way
            self._told.clear()
            if not self._told.wait(PATIENCE_S):
                raise TimeoutError(f'the simulator has said nothing for {PATIENCE_S:.0f} s')
        return self._contacts


@contextmanager
def a_node(name: str) -> Iterator[None]:
    """This process is a node of a ROS master of its own, and ends what it started when it is ended."""
    end_cleanly()
    with own_master():
        rospy.init_node(name, disable_signals=True, disable_rostime=True)
        yield


@contextmanager
def whole_chair(map_name: str, start: Sequence[float], log: str | Path = os.devnull, **arguments: Any) -> Iterator[str]:
    """The page's address while sara.launch runs on this process's master, once the chair is ready. map_name: of
    sara_bringup's maps, a copy of which is used. start: x, y (m), yaw (rad). log: to which is added what the nodes say.
    arguments: more of sara.launch.
    """
    if rospy.has_param('/hmi/url'):
        rospy.delete_param('/hmi/url')  # of a chair before this one: the next one says where it is when it is
    maps = Path(rospkg.RosPack().get_path('sara_bringup')) / 'maps'
    with tempfile.TemporaryDirectory(prefix='sara_touch_', ignore_cleanup_errors=True) as folder:
        for file in maps.glob(f'{map_name}.*'):
            shutil.copy(file, folder)
        env = {**os.environ, 'ROS_HOME': folder, 'XDG_RUNTIME_DIR': folder, 'ROS_LOG_DIR': f'{folder}/log'}
        x, y, yaw = start
        given = {'hmi': 'true', 'hmi_port': free_port(), 'map': f'{folder}/{map_name}.yaml', 'x': x, 'y': y, 'yaw': yaw}
        with (
            open(log, 'a', encoding='utf-8') as said,
            # A session of its own: a Ctrl-C of the terminal ends this process first, which then ends the chair.
            launched(
                'sara_bringup', 'sara.launch', given | arguments, env, stdout=said, stderr=said, start_new_session=True
            ),
        ):
            yield url()
