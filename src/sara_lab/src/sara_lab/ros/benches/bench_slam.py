"""What slam_gmapping costs while a robot with a laser scanner drives up and down the flat's corridor, over ROS and in
real time: CPU and memory.
"""

from __future__ import annotations

import math
import os
import time
from typing import Any

import rosgraph
import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import OccupancyGrid, Odometry

from sara_bringup.ros.masters import environment, launched
from sara_bringup.ros.processes import process_of
from sara_common.planar import yaw_of
from sara_lab.journeys.travel_cases import map_file
from sara_lab.workers.cost import cpu_seconds, peak_memory_mb
from sara_sim.robot.script import Along, Face, Script

WEST, EAST, SPEED = (2.0, 4.9), (8.6, 4.9), 0.6  # m, m/s
TURN_ROUND = (Face(math.pi), Along((WEST,), SPEED), Face(0.0))
PATIENCE_S = 60.0


def drive() -> dict[str, Any]:
    """{name: figure} of a drive there and back, twice, with a ROS master of its own. Raises RuntimeError."""
    env = environment()
    os.environ['ROS_MASTER_URI'] = env['ROS_MASTER_URI']
    with (
        open(os.devnull, 'w', encoding='utf-8') as log,
        launched('sara_lab', 'bench_slam.launch', {'map': map_file('flat')}, env, stdout=log, stderr=log),
    ):
        while not rosgraph.is_master_online():
            time.sleep(0.1)
        rospy.init_node('bench_slam', disable_signals=True, disable_rostime=True)
        return _measure()


def _measure():
    heard = {}
    for topic, kind in (('map', OccupancyGrid), ('base_pose_ground_truth', Odometry)):
        rospy.Subscriber(topic, kind, lambda message, name=topic: heard.update({name: message}), tcp_nodelay=True)
    command = rospy.Publisher('cmd_vel', Twist, queue_size=1, tcp_nodelay=True)
    begun = time.monotonic()
    while len(heard) < 2:
        if time.monotonic() - begun > PATIENCE_S:
            raise RuntimeError(f'there is no map after {PATIENCE_S:.0f} s')
        time.sleep(0.1)
    pid, script = process_of('/slam_gmapping'), Script([Along((EAST,), SPEED), *TURN_ROUND] * 2)
    before, begun, way, last = cpu_seconds(pid), time.monotonic(), 0.0, WEST
    while not script.done and time.monotonic() - begun < 4.0 * PATIENCE_S:
        message = heard['base_pose_ground_truth']
        place = message.pose.pose.position.x, message.pose.pose.position.y
        way, last = way + math.dist(place, last), place
        twist = Twist()
        pose = (*place, yaw_of(message.pose.pose.orientation))
        twist.linear.x, twist.angular.z = script.command(message.header.stamp.to_sec(), pose)
        command.publish(twist)
        time.sleep(0.05)
    seconds = time.monotonic() - begun
    used = cpu_seconds(pid) - before
    return {
        'cpu_percent': 100.0 * used / seconds,
        'memory_mb': peak_memory_mb(pid),
        'seconds': seconds,
        'way': way,
        'done': script.done,
    }
