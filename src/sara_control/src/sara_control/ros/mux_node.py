"""cmd_vel_mux: passes on the commands of one of several sources, publishes its name, and cancels the goals of sources
that are preempted.
"""

import threading
from collections.abc import Callable
from functools import partial

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist
from sensor_msgs.msg import Joy
from std_msgs.msg import Bool, String, UInt8

from canserial.dbc.modes import PC_DRIVES
from canserial.ros.node import stop
from sara_common.config import ConfigError
from sara_common.diagnostics import OK, WARN
from sara_common.ros.diagnostics import Diagnostics
from sara_common.ros.node import on_shutdown, start_node
from sara_control.mux.joystick import Joystick, JoystickConfig
from sara_control.mux.mux import NO_DRIVER, ROBOT, Mux, MuxConfig

RATE = 50.0  # Hz, at which timeouts are looked for
KNOWN = ('topics', 'locks', 'joystick', 'handshake', 'cancel')


class MuxNode:
    """The shell around Mux and Joystick."""

    def __init__(self) -> None:
        params = rospy.get_param('~', {})
        joystick = self.read(params)
        self.lock = threading.Lock()
        self.stopping = threading.Event()
        self.driver = None
        self.diagnostics = Diagnostics('who drives', 'commands')
        self.out = rospy.Publisher('cmd_vel_out', Twist, queue_size=1, tcp_nodelay=True)
        self.active = rospy.Publisher('~active', String, queue_size=1, latch=True, tcp_nodelay=True)
        self.cancel = {
            name: rospy.Publisher(topic, GoalID, queue_size=1, tcp_nodelay=True)
            for name, topic in params.get('cancel', {}).items()
        }
        for source in self.mux.config.topics:
            rospy.Subscriber(source.topic, Twist, partial(self.on_command, source.name), queue_size=1, tcp_nodelay=True)
        for lock in self.mux.config.locks:
            rospy.Subscriber(lock.topic, Bool, partial(self.on_lock, lock.name), queue_size=1, tcp_nodelay=True)
        if params.get('handshake', False):
            rospy.Subscriber('mode', UInt8, self.on_mode, queue_size=10, tcp_nodelay=True)
        self.joystick = Joystick(joystick)
        if joystick.enabled:
            self.joystick_command = rospy.Publisher('cmd_vel_joystick', Twist, queue_size=1, tcp_nodelay=True)
            rospy.Subscriber('joystick', Joy, self.on_joystick, queue_size=1, tcp_nodelay=True)
        self.act(lambda now: self.mux.update(now))
        # reset: a simulation that is started anew sets the clock back, which would kill the timer.
        self.timer = rospy.Timer(
            rospy.Duration(1.0 / RATE), lambda _: self.act(lambda now: self.mux.update(now)), reset=True
        )
        on_shutdown(self.stopping.set)

    def read(self, params: dict) -> JoystickConfig:
        """Makes the Mux; returns the JoystickConfig. Ends the node with every fault at once."""
        faults = [f'{name} is {params[name]!r}, but there is no such parameter' for name in params if name not in KNOWN]
        joystick = None
        try:
            joystick = JoystickConfig.from_params(params.get('joystick', {'enabled': False}))
        except ConfigError as error:
            faults.append(str(error))
        if not isinstance(params.get('handshake', False), bool):
            faults.append(f'handshake is {params["handshake"]!r}, allowed are true and false')
        cancel = params.get('cancel', {})
        if not isinstance(cancel, dict) or not all(isinstance(topic, str) and topic for topic in cancel.values()):
            faults.append(f'cancel is {cancel!r}, allowed is a mapping from sources to topics')
            cancel = {}
        try:
            self.mux = Mux(MuxConfig.from_params(params))
            names = [source.name for source in self.mux.config.topics]
            faults += [
                f'cancel/{name} is no source; allowed are {", ".join(names)}' for name in cancel if name not in names
            ]
        except ConfigError as error:
            faults.append(str(error))
        if faults:
            stop(f'wrong configuration of {rospy.get_name()}: {"; ".join(faults)}')
        return joystick

    def act(self, feed: Callable) -> None:
        """Feeds the multiplexer and passes on what it selects: first the driver's name, then its command."""
        with self.lock:
            selected = feed(rospy.get_time())
            driver, preempted = self.mux.driver, self.mux.take_preempted()
            if driver != self.driver:
                rospy.loginfo('%s drives', driver)
                self.active.publish(driver)
                self.driver = driver
            for name in preempted:
                if self.mux.is_blocked(name):
                    rospy.loginfo('%s was interrupted: it must command anew', name)
                if name in self.cancel:
                    self.cancel[name].publish(GoalID())
            if selected is not None:
                message = Twist()
                message.linear.x, message.angular.z = selected.v, selected.w
                self.out.publish(message)

    def on_command(self, name: str, message: Twist) -> None:
        """A source commands."""
        self.act(lambda now: self.mux.on_command(now, name, message.linear.x, message.angular.z))

    def on_lock(self, name: str, message: Bool) -> None:
        """A lock is set or released."""
        self.act(lambda now: self.mux.on_lock(now, name, message.data))

    def on_mode(self, message: UInt8) -> None:
        """The chair reports who drives."""
        self.act(lambda now: self.mux.on_robot(now, message.data not in PC_DRIVES))

    def on_joystick(self, message: Joy) -> None:
        """Axes to a command, which comes back by the joystick's topic like any other."""
        command = self.joystick.on_axes(message.axes, message.buttons)
        if command is not None:
            twist = Twist()
            twist.linear.x, twist.angular.z = command
            self.joystick_command.publish(twist)

    def run(self) -> None:
        """Diagnostics once a second of wall time until ROS shuts down."""
        warned = set()
        while not self.stopping.wait(1.0):
            with self.lock:
                dropped = {f'not finite from {name}': count for name, count in self.mux.dropped.items()}
                driver, locked = self.mux.driver, self.mux.locked(rospy.get_time())
            if self.joystick.dropped:
                dropped['joystick without its axes or buttons, or not finite'] = self.joystick.dropped
            for what in sorted(dropped.keys() - warned):
                rospy.logwarn('commands are dropped: %s; counted in /diagnostics', what)
                warned.add(what)
            values = {**dropped, 'locked below priority': locked}
            if driver == ROBOT:
                level, text = WARN, f'{ROBOT} drives'
            elif driver == NO_DRIVER:
                level, text = (
                    OK,
                    'no source commands; waiting for ' + ', '.join(source.topic for source in self.mux.config.topics),
                )
            else:
                level, text = OK, f'{driver} drives'
            self.diagnostics.publish(level if not dropped else max(level, WARN), text, values)


def main() -> None:
    """Run the node."""
    start_node('cmd_vel_mux')
    MuxNode().run()
    rospy.spin()  # until rospy has ended its own shutdown
