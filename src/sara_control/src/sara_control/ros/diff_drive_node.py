"""diff_drive_controller as a node: `~cmd_vel` in; odometry, TF and joints out. `~base` names the wheels' WheelBase."""

import math
import threading

import rospy
import tf2_ros
from dynamic_reconfigure.server import Server
from geometry_msgs.msg import TransformStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState

from canserial.ros.node import stop
from sara_common.config import ConfigError
from sara_common.diagnostics import ERROR, OK, WARN
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import on_shutdown, start_node
from sara_control.cfg import DiffDriveControllerConfig
from sara_control.ros.wheel_states import WheelStates
from sara_control.wheels.base import BaseError, WheelPositions, load_base
from sara_control.wheels.config import ControllerConfig, unknown
from sara_control.wheels.controller import DiffDriveController
from sara_control.wheels.odometry import OdometryState
from sara_control.wheels.pacer import Pacer

DYNAMIC = (
    'enable_odom_tf',
    'left_wheel_radius_multiplier',
    'right_wheel_radius_multiplier',
    'wheel_separation_multiplier',
    'publish_rate',
)
MULTIPLIERS = DYNAMIC[1:4]


class DiffDriveNode:
    """The shell around DiffDriveController and a WheelBase."""

    def __init__(self) -> None:
        params = rospy.get_param('~', {})
        try:
            config = self.config = ControllerConfig.from_params(params, rospy.get_param('robot_description', None))
            self.base = load_base(params.get('base', 'can'), config, params)
        except (ConfigError, BaseError) as error:
            stop(f'wrong configuration of {rospy.get_name()}: {error}')
        if params.get('base', 'can') == 'can':  # another robot may have parameters of its own
            for name in unknown(params):
                rospy.logwarn('~%s is set, but there is no such parameter', name)
        self.controller = DiffDriveController(config)
        self.pacer = Pacer(config.publish_rate)
        self.enable_odom_tf = config.enable_odom_tf
        self.lock = threading.Lock()
        self.stopping = threading.Event()
        self.diagnostics = Diagnostics('wheels', 'wheel base')
        self.joint_states = rospy.Publisher('joint_states', JointState, queue_size=10, tcp_nodelay=True)
        self.joint_commands = rospy.Publisher('joint_commands', JointState, queue_size=10, tcp_nodelay=True)
        self.command_out = self.wheel_states = None
        if config.publish_cmd:
            self.command_out = rospy.Publisher('~cmd_vel_out', TwistStamped, queue_size=10, tcp_nodelay=True)
        if config.publish_wheel_joint_controller_state:
            self.wheel_states = WheelStates(config)
        # Last of all: whoever waits for odometry may look for the other topics then.
        self.odom = rospy.Publisher('~odom', Odometry, queue_size=10, tcp_nodelay=True)
        self.broadcaster = tf2_ros.TransformBroadcaster()
        self._offered = None
        self.server = Server(DiffDriveControllerConfig, self.on_reconfigure)
        self.base.news = self.read_wheels
        self.commands = rospy.Subscriber('~cmd_vel', Twist, self.on_command, queue_size=1, tcp_nodelay=True)
        # reset: a simulation that is started anew sets the clock back, which would kill the timer.
        self.timer = rospy.Timer(rospy.Duration(1.0 / config.command_rate), self.on_timer, reset=True)
        on_shutdown(self.on_shutdown)

    def on_reconfigure(self, wanted: dict, level: int) -> dict:
        """Takes the values that were changed. The server clamps all to the fields' range; parameters may lie outside
        and stay there unless they were changed.
        """
        names = DYNAMIC if self._offered is not None else ()
        changes = {name: wanted[name] for name in names if wanted[name] != _in_range(name, self._offered[name])}
        with self.lock:
            try:
                for name, value in changes.items():
                    if name != 'enable_odom_tf' and not math.isfinite(value):
                        raise ConfigError(f'{name} is {value}, allowed are numbers')
                self.controller.set_geometry(**{name: changes[name] for name in MULTIPLIERS if name in changes})
                self.pacer.rate = changes.get('publish_rate', self.pacer.rate)
                self.enable_odom_tf = changes.get('enable_odom_tf', self.enable_odom_tf)
            except ConfigError as error:
                rospy.logwarn('not reconfigured: %s', error)
            values = {
                'enable_odom_tf': self.enable_odom_tf,
                'publish_rate': self.pacer.rate,
                **{name: getattr(self.controller.config, name) for name in MULTIPLIERS},
            }
        wanted.update(values)
        self._offered = values
        return wanted

    def on_command(self, message: Twist) -> None:
        """A new command for the robot."""
        with self.lock:
            self.controller.on_command(
                message.linear.x, message.angular.z, rospy.get_time(), self.commands.get_num_connections()
            )

    def read_wheels(self) -> None:
        """Positions the base has: odometry and joint states."""
        with self.lock:
            try:
                for positions in self.base.read(rospy.get_time()):
                    state = self.controller.on_wheels(*positions)
                    self.publish_joints(positions)
                    if state is not None:
                        self.publish_odometry(state)
            except Exception as error:  # a robot's own code, or what it returned
                if not rospy.core.is_shutdown_requested():  # then topics close while they are published on
                    self.base_failed('read', error)

    def base_failed(self, what: str, error: Exception) -> None:
        """The wheels' positions will be too old soon, and that stops everything."""
        self.base.counters[f'{what}_failed'] += 1
        rospy.logerr_throttle(10.0, f'the wheel base failed to {what}: {error!r}')

    def may_drive(self) -> bool:
        """Whether the wheels obey; not while the base cannot tell."""
        try:
            return self.base.may_drive
        except Exception as error:  # a robot's own code
            self.base_failed('tell who drives', error)
            return False

    def publish_joints(self, positions: WheelPositions) -> None:
        """Measured wheel positions and speeds."""
        left, right = (tuple(side) if hasattr(side, '__iter__') else (side,) for side in positions[:2])
        config = self.config
        if len(left) != len(config.left_joints) or len(right) != len(config.right_joints):
            self.base.counters['positions_without_joint'] += 1
            return
        message = JointState(name=[*config.left_joints, *config.right_joints], position=[*left, *right])
        message.header.stamp = rospy.Time.from_sec(positions.stamp)
        message.velocity = self.joint_speeds(message.position, positions)
        self.joint_states.publish(message)
        if self.wheel_states is not None:
            self.wheel_states.on_positions(message.position, message.velocity, positions.stamp)

    def joint_speeds(self, angles: list[float], positions: WheelPositions) -> list[float]:
        """rad/s, from the positions before; those of the last reading where there was no time between them."""
        before = getattr(self, '_joints', None)
        interval = (
            0.0 if before is None else positions.stamp - before[1] if positions.interval is None else positions.interval
        )
        if before is None:
            speeds = [0.0] * len(angles)
        elif interval > 0.0:
            speeds = [(angle - old) / interval for angle, old in zip(angles, before[0])]
        else:
            speeds = before[2]
        self._joints = angles, positions.stamp, speeds
        return speeds

    def publish_odometry(self, state: OdometryState) -> None:
        """Odometry and its transform, if it is time."""
        if not self.pacer.due(state.stamp):
            return
        config, message = self.config, Odometry()
        message.header.stamp = rospy.Time.from_sec(state.stamp)
        message.header.frame_id, message.child_frame_id = config.odom_frame_id, config.base_frame_id
        pose, twist = message.pose.pose, message.twist.twist
        pose.position.x, pose.position.y = state.x, state.y
        pose.orientation.z, pose.orientation.w = math.sin(0.5 * state.heading), math.cos(0.5 * state.heading)
        twist.linear.x, twist.angular.z = state.linear, state.angular
        message.pose.covariance = _diagonal(state.pose_covariance)
        message.twist.covariance = _diagonal(state.twist_covariance)
        if self.enable_odom_tf:
            transform = TransformStamped(header=message.header, child_frame_id=config.base_frame_id)
            transform.transform.translation.x, transform.transform.translation.y = state.x, state.y
            transform.transform.rotation = pose.orientation
            self.broadcaster.sendTransform(transform)
        self.odom.publish(message)

    def on_timer(self, _event: rospy.timer.TimerEvent) -> None:
        """A cycle: positions, then the wheel command."""
        self.read_wheels()
        stamp = rospy.Time.now()
        with self.lock:
            if self.stopping.is_set():  # asked and written under one lock: nothing follows the last stop
                return
            left, right = self.controller.update(stamp.to_sec(), self.may_drive())
            try:
                self.base.write(left, right, stamp.to_sec())
            except Exception as error:  # a robot's own code
                self.base_failed('write', error)
            if self.config.open_loop and self.controller.state is not None:
                self.publish_odometry(self.controller.state)
        config = self.config
        commands = [left] * len(config.left_joints) + [right] * len(config.right_joints)
        message = JointState(name=[*config.left_joints, *config.right_joints], velocity=commands)
        message.header.stamp = stamp
        self.joint_commands.publish(message)
        if self.command_out is not None:
            limited = TwistStamped()
            limited.header.stamp = stamp
            limited.header.frame_id = config.base_frame_id
            limited.twist.linear.x, limited.twist.angular.z = self.controller.command
            self.command_out.publish(limited)
        if self.wheel_states is not None:
            self.wheel_states.publish(commands, stamp)

    def on_shutdown(self) -> None:
        """The last word to the wheels is stop; the process may end only when it is on its way."""
        with self.lock:
            self.stopping.set()
            try:
                self.base.stop(rospy.get_time())
            except Exception as error:  # a robot's own code
                self.base_failed('stop', error)
        rospy.rostime.wallsleep(0.1)

    def run(self) -> None:
        """Diagnostics once a second of wall time until ROS shuts down."""
        warned = set()
        while not self.stopping.wait(1.0):
            with self.lock:
                counters = {**self.base.counters, **self.controller.counters}
                known, stopped_by = self.controller.wheels_known(rospy.get_time()), self.controller.stopped_by
                may_drive, who = self.may_drive(), self.base.state
            for kind in sorted(counters.keys() - warned):
                rospy.logwarn('dropped or lost: %s; counted in /diagnostics', kind.replace('_', ' '))
                warned.add(kind)
            if not known:
                level, text = (
                    ERROR,
                    f'waiting for the wheel positions of {type(self.base).__name__}: the wheels are stopped',
                )
                rospy.logwarn_throttle(10.0, text)
            elif may_drive and stopped_by:
                level, text = ERROR, f'{stopped_by}: the wheels are stopped; after a rest a fresh command tries again'
                rospy.logwarn_throttle(10.0, text)
            else:
                level, text = (OK if may_drive else WARN), who
            self.diagnostics.publish(level, text, counters)


def _in_range(name, value):
    """As dynamic_reconfigure clamps it."""
    kind = DiffDriveControllerConfig
    return value if isinstance(value, bool) else min(max(value, kind.min[name]), kind.max[name])


def _diagonal(values):
    """Six values as the diagonal of a row-major 6 x 6 matrix."""
    matrix = [0.0] * 36
    matrix[::7] = values
    return matrix


def main() -> None:
    """Run the node."""
    start_node('diff_drive_controller')
    DiffDriveNode().run()
    rospy.spin()  # until rospy has ended its own shutdown: leaving earlier would cut off the last stop
