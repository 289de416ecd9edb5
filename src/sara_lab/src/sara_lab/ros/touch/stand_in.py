"""A stand-in for the rest of the robot: what the touch screen's server hears of a chair, at a chair's rates, and ears
for what it says. `serving` starts the server on a ROS master of its own.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import rosgraph
import rospy
from geometry_msgs.msg import TransformStamped, Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import Range
from std_msgs.msg import Bool, String
from tf2_msgs.msg import TFMessage

from sara_bringup.ros.masters import environment, launched
from sara_common.platforms import chosen

PATIENCE_S = 60.0
TF_HZ, RANGES_HZ = 50.0, 10.0
Grid = numpy_msg(OccupancyGrid)


class StandIn:
    """tf and odometry at 50 Hz, the robot's range sensors at 10 Hz, the gate's status, a map on request.

    touched: [(when, v, w)] of /cmd_vel/touch; stops: when /emergency_stop came, both by the monotonic clock, s.
    """

    def __init__(self) -> None:
        self.touched: list[tuple[float, float, float]] = []
        self.stops: list[float] = []
        self._ears = [
            rospy.Subscriber('/cmd_vel/touch', Twist, self._on_touch, tcp_nodelay=True),
            rospy.Subscriber('/emergency_stop', Bool, lambda m: self.stops.append(time.monotonic()), tcp_nodelay=True),
        ]
        self._status = rospy.Publisher('/safety_gate/status', String, queue_size=1, latch=True)
        self._map = rospy.Publisher('/map', Grid, queue_size=1, latch=True)
        self._tf = rospy.Publisher('/tf', TFMessage, queue_size=10)
        self._odometry = rospy.Publisher('/odometry/filtered', Odometry, queue_size=1)
        self._ranges = {name: rospy.Publisher(f'/{name}_range', Range, queue_size=1) for name in chosen().sonars}
        self._status.publish('The chair is ready.')
        self._end = threading.Event()
        self._speaking = threading.Thread(target=self._speak, daemon=True)
        self._speaking.start()

    def _on_touch(self, message):
        self.touched.append((time.monotonic(), message.linear.x, message.angular.z))

    def show_map(self, cells: np.ndarray) -> None:
        """Publish a map: cells (rows, columns) as in OccupancyGrid."""
        message = Grid(data=cells.ravel())
        message.info.height, message.info.width = cells.shape
        message.info.resolution, message.info.origin.orientation.w = 0.05, 1.0
        self._map.publish(message)

    def _speak(self):
        number, due = 0, time.monotonic()
        while not self._end.wait(max(0.0, due - time.monotonic())):
            self._tf.publish(TFMessage(self._transforms(number / TF_HZ)))
            odometry = Odometry()
            odometry.header.stamp, odometry.twist.twist.linear.x = rospy.Time.now(), 0.25
            self._odometry.publish(odometry)
            if number % round(TF_HZ / RANGES_HZ) == 0:
                for name, topic in self._ranges.items():
                    reading = Range(min_range=0.16, max_range=6.0, field_of_view=1.0, range=1.5)
                    reading.header.frame_id = f'{name}_frame'
                    topic.publish(reading)
            number, due = number + 1, max(due + 1.0 / TF_HZ, time.monotonic())

    @staticmethod
    def _transforms(x):
        """The chair drives along x, so that every pose is another; the sensors sit on it."""
        made = []
        frames = [('map', 'base_link', x), *(('base_link', f'{name}_frame', 0.5) for name in chosen().sonars)]
        for parent, child, x_m in frames:
            one = TransformStamped(child_frame_id=child)
            one.header.frame_id, one.header.stamp = parent, rospy.Time.now()
            one.transform.translation.x, one.transform.rotation.w = x_m, 1.0
            made.append(one)
        return made

    def close(self) -> None:
        """Say nothing more."""
        self._end.set()
        self._speaking.join()


def url() -> str:
    """Where the server's page is, once it is."""
    end = time.monotonic() + PATIENCE_S
    while not rospy.has_param('/hmi/url'):
        if time.monotonic() > end:
            raise TimeoutError(f"the touch screen's server has not started within {PATIENCE_S:.0f} s")
        time.sleep(0.05)
    return rospy.get_param('/hmi/url').replace('localhost', '127.0.0.1')


@contextmanager
def serving() -> Iterator[tuple[str, StandIn]]:
    """(the page's address, the stand-in) while the server's node runs; this process becomes a node of its master."""
    env = environment()
    os.environ['ROS_MASTER_URI'] = env['ROS_MASTER_URI']
    arguments = {'port': 0, 'range_topics': '[' + ', '.join(f'{name}_range' for name in chosen().sonars) + ']'}
    with (
        tempfile.TemporaryDirectory(prefix='sara_') as folder,
        open(os.devnull, 'w', encoding='utf-8') as log,
        launched('sara_hmi', 'hmi.launch', arguments, {**env, 'ROS_HOME': folder}, stdout=log, stderr=log),
    ):
        while not rosgraph.is_master_online():
            time.sleep(0.1)
        rospy.init_node('stand_in', anonymous=True, disable_signals=True)
        robot = StandIn()
        try:
            yield url(), robot
        finally:
            robot.close()
