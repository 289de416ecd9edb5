"""The robot node: any differential robot on a map, with the topics, frames and service of stage_ros, and /clock."""

from __future__ import annotations

import sys
import threading
import time

import numpy as np
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyResponse
from tf2_msgs.msg import TFMessage

from sara_common.config import ConfigError
from sara_common.diagnostics import OK, WARN, Status
from sara_common.planar import yaw_from_quaternion
from sara_common.ros.diagnostics import diagnostic_array
from sara_common.ros.node import start_node
from sara_sim.bus.pacing import KEPT, Pacer, Speedometer
from sara_sim.chips.scanner import sweep_of
from sara_sim.robot.robot import SimulatedRobot
from sara_sim.robot.robot_config import STEP_S, STEPS_PER_S
from sara_sim.ros.messages import laser_scan
from sara_sim.ros.robot_messages import LASER, ODOM, SCAN, TRUTH, numbered, odometry, transforms
from sara_sim.ros.robot_settings import RobotSettings, made_robot
from sara_sim.world.obstacles import ObstacleError
from sara_sim.world.world import World, WorldError

WAITING_S = 5.0
SAID_S = 10.0


class RobotNode:
    """Steps the robot at the asked speed."""

    def __init__(self, robot: SimulatedRobot, settings: RobotSettings) -> None:
        self._robot, self._settings, self._tick = robot, settings, 0
        self._lock = threading.Lock()  # commands come in other threads
        self._speedometer = Speedometer()
        scanners = robot.config.scanners
        self._frames = numbered(LASER, scanners)
        self._clock = rospy.Publisher('/clock', Clock, queue_size=100)
        self._odom = rospy.Publisher(ODOM, Odometry, queue_size=10)
        self._truth = rospy.Publisher(TRUTH, Odometry, queue_size=10)
        self._tf = rospy.Publisher('/tf', TFMessage, queue_size=100)
        self._scans = [rospy.Publisher(topic, LaserScan, queue_size=10) for topic in numbered(SCAN, scanners)]
        self._diagnostics = rospy.Publisher('/diagnostics', DiagnosticArray, queue_size=5)
        rospy.Subscriber('cmd_vel', Twist, self._on_command, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber('cmd_pose', Pose, self._on_pose, queue_size=1, tcp_nodelay=True)
        rospy.Service('reset_positions', Empty, self._on_reset)

    def run(self) -> None:
        """Until ROS shuts down."""
        speed = self._settings.speed
        pacer = Pacer(STEP_S / speed, time.monotonic()) if speed else None
        while not rospy.is_shutdown():
            wait = pacer.wait(time.monotonic()) if pacer else 0.0
            if wait > 0.0:
                time.sleep(wait)
                continue
            self._step()
            if pacer:
                pacer.stepped(time.monotonic())

    def _on_command(self, message: Twist) -> None:
        with self._lock:
            obeyed = self._robot.command(message.linear.x, message.angular.z)
        if not obeyed:
            rospy.logwarn_throttle(SAID_S, 'cmd_vel holds a NaN or an infinity: the robot stops')
        elif message.linear.y:
            rospy.logwarn_once('cmd_vel asks for linear.y: this robot has two wheels and does not drive sideways')

    def _on_pose(self, message: Pose) -> None:
        q = message.orientation
        try:
            pose = message.position.x, message.position.y, yaw_from_quaternion(q.x, q.y, q.z, q.w)
            with self._lock:
                self._robot.place(*pose)
        except ValueError as error:
            rospy.logwarn('cmd_pose: %s; the robot stays where it is', error)

    def _on_reset(self, _) -> EmptyResponse:
        try:
            with self._lock:
                self._robot.reset()
        except WorldError as error:
            raise rospy.ServiceException(str(error)) from error
        return EmptyResponse()

    def _step(self) -> None:
        robot = self._robot
        with self._lock:
            stalls = robot.stalls
            robot.step()
            pose, scans = robot.pose, robot.scans
        self._tick += 1
        seconds, steps = divmod(self._tick, STEPS_PER_S)
        stamp = rospy.Time(seconds, steps * (1_000_000_000 // STEPS_PER_S))
        self._clock.publish(Clock(clock=stamp))
        if self._tick % (STEPS_PER_S // self._settings.odom_rate) == 0:
            self._publish(stamp)
        for number, scan in scans:
            if scan.stamp > 0.0:  # to tf a stamp of 0 means any time
                sweep = sweep_of(scan, robot.scanners[number].optics)
                period = 1.0 / robot.config.scanners[number].rate
                self._scans[number].publish(laser_scan(sweep, self._frames[number], period))
        if robot.stalls != stalls:
            rospy.logwarn_throttle(SAID_S, f'the robot is stalled at x {pose[0]:.2f} m, y {pose[1]:.2f} m')
        if self._tick % STEPS_PER_S == 0:
            self._report(stamp)

    def _publish(self, stamp) -> None:
        robot = self._robot
        self._tf.publish(transforms(stamp, robot.odometry.pose, robot.config.scanners))
        self._odom.publish(odometry(stamp, ODOM, robot.odometry.pose, robot.measured))
        self._truth.publish(odometry(stamp, 'map', robot.pose, robot.velocity))

    def _report(self, stamp) -> None:
        robot, asked = self._robot, self._settings.speed
        self._speedometer.mark(robot.time, time.monotonic())
        level, text = (WARN, 'the robot is stalled by a wall or an obstacle') if robot.stalled else (OK, 'running')
        if level == OK and self._speedometer.full and self._speedometer.speed < KEPT * asked:
            level, text = WARN, f'simulated at {self._speedometer.speed:.2f} times real time instead of {asked:g}'
        values = {
            'speed asked': asked,
            'speed reached': round(self._speedometer.speed, 2),
            'stalls': robot.stalls,
            'commands that were no numbers': robot.bad_commands,
        }
        status = Status('robot', level, text, tuple(values.items()))
        self._diagnostics.publish(diagnostic_array(stamp, [status], hardware_id='simulated'))


def _heard(topic: str) -> World:
    """The world of the first map on a topic. Raises WorldError."""
    while not rospy.is_shutdown():
        try:
            message = rospy.wait_for_message(topic, OccupancyGrid, WAITING_S)
        except rospy.ROSException:
            rospy.loginfo('waiting for a map on %s', rospy.resolve_name(topic))
            continue
        info, at = message.info, message.info.origin
        if len(message.data) != info.width * info.height:
            raise WorldError(f'{topic} has {len(message.data)} cells instead of {info.width} x {info.height}')
        cells = np.array(message.data, np.int8).reshape(info.height, info.width)
        try:
            q = at.orientation
            origin = at.position.x, at.position.y, yaw_from_quaternion(q.x, q.y, q.z, q.w)
            return World.from_grid(cells, info.resolution, origin)
        except ValueError as error:
            raise WorldError(f'{topic}: {error}') from error
    raise WorldError(f'no map came on {topic}')


def main() -> None:
    """Entry point of nodes/robot."""
    # This node makes the time the others live in.
    start_node('robot', disable_rostime=True)
    try:
        settings = RobotSettings.from_params(rospy.get_param('~', {}))
        robot = made_robot(settings, _heard(settings.map_topic) if settings.map_topic else None)
    except (ConfigError, WorldError, ObstacleError) as error:
        if rospy.is_shutdown():
            return
        rospy.logfatal('the robot cannot start: %s', error)
        sys.exit(1)
    rospy.loginfo(
        'a robot of %g x %g m drives on %s',
        *settings.robot.size,
        settings.map or settings.map_topic or 'an empty floor',
    )
    RobotNode(robot, settings).run()
