"""teleop: drive from a terminal. Keys in, geometry_msgs/Twist on `cmd_vel` out, which is /cmd_vel/keyboard unless
remapped, a source of cmd_vel_mux.

The keys' clock is the wall's, whatever ROS time does. On the way out, however that comes about, the chair is told to
stop and the terminal is as it was.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import termios
import time
import tty

import rosgraph
import rospy
from geometry_msgs.msg import Twist

from sara_bringup.missions.teleop import HELP, Decoder, Teleop, TeleopConfig

WRONG, HUNG_UP = 2, 1


class Terminal:
    """Standard input in cbreak mode: keys come at once and are not echoed. A context manager; also restored before the
    process is suspended.
    """

    def __init__(self) -> None:
        self.descriptor = sys.stdin.fileno()
        self._before = termios.tcgetattr(self.descriptor)
        self._decoder = Decoder()

    def __enter__(self):
        tty.setcbreak(self.descriptor)
        signal.signal(
            signal.SIGCONT, lambda *_: tty.setcbreak(self.descriptor)
        )  # the shell set its own modes while we were suspended
        return self

    def __exit__(self, *_):
        signal.signal(signal.SIGCONT, signal.SIG_DFL)
        with contextlib.suppress(termios.error):  # the terminal is closed
            termios.tcsetattr(self.descriptor, termios.TCSADRAIN, self._before)

    def keys(self, seconds: float) -> list[str]:
        """What was pressed within so long. Raises EOFError when the terminal is closed."""
        if not select.select([self.descriptor], [], [], seconds)[0]:
            return self._decoder.flush()
        try:
            held = os.read(self.descriptor, 4096)
        except OSError as error:
            raise EOFError from error
        if not held:
            raise EOFError
        return self._decoder.feed(held.decode(errors='replace'))


def read_config() -> TeleopConfig:
    """TeleopConfig of the node's parameters; the peer's `key_timeout` stands for both timeouts. Ends the node with
    every fault at once.
    """
    given = rospy.get_param('~', {})
    if 'key_timeout' in given:
        timeout = given.pop('key_timeout')
        given = {'first_timeout': timeout, 'repeat_timeout': timeout, **given}
    known = TeleopConfig.__dataclass_fields__
    faults = [
        f'{name} is no parameter; there are {", ".join(known)} and key_timeout' for name in given if name not in known
    ]
    faults += [
        f'{name} is {value!r}, allowed are numbers'
        for name, value in given.items()
        if name in known and (isinstance(value, bool) or not isinstance(value, (int, float)))
    ]
    if not faults:
        config = TeleopConfig(**{name: float(value) for name, value in given.items()})
        faults = config.faults()
    if faults:
        print(f'teleop: {"; ".join(faults)}', file=sys.stderr)
        sys.exit(WRONG)
    return config


def drive(config: TeleopConfig, publisher: rospy.Publisher, terminal: Terminal) -> int:
    """Until a key, a signal or the end of the terminal ends it."""
    teleop, period = Teleop(config), 1.0 / config.repeat_rate
    status, due = 0, time.monotonic()
    print(f'{HELP}\nspeed {config.speed:.2f} m/s, turning {config.turn:.2f} rad/s', flush=True)

    def publish():
        command = teleop.command(time.monotonic())
        if command is not None:
            message = Twist()
            message.linear.x, message.angular.z = command
            publisher.publish(message)
        return command

    try:
        while not teleop.quit and not rospy.is_shutdown():
            for key in terminal.keys(max(0.0, due - time.monotonic())):
                teleop.on_key(key, time.monotonic())
                if teleop.said:
                    print(teleop.said, flush=True)
            if time.monotonic() >= due:
                publish()
                due = time.monotonic() + period
    except EOFError:
        status = HUNG_UP
    except KeyboardInterrupt:
        pass
    finally:
        teleop.on_key(' ', time.monotonic())
        while publish() is not None:
            time.sleep(period)  # each of the zeros goes out before the node ends
    return status


def main() -> None:
    """Exit status: 0 ended by a key, 1 the terminal was closed, 2 there is none, or no master, or a wrong parameter."""
    if {'-h', '--help'} & set(sys.argv):
        print(
            f'{__doc__}\n{HELP}\n\nParameters (_speed:=0.3): {TeleopConfig.__doc__}\nkey_timeout sets both '
            f"timeouts, as teleop_twist_keyboard's users know it.\nDefaults: {TeleopConfig()}"
        )
        sys.exit(0)
    if not sys.stdin.isatty():
        print('teleop needs a terminal: its standard input is none', file=sys.stderr)
        sys.exit(WRONG)
    if not rosgraph.is_master_online():
        print('no ROS master answers: start `roslaunch sara_bringup sara.launch` first', file=sys.stderr)
        sys.exit(WRONG)

    def end(*_):
        raise KeyboardInterrupt

    rospy.init_node('teleop', disable_signals=True)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, end)
    config = read_config()
    publisher = rospy.Publisher(
        rospy.resolve_name('cmd_vel') if rospy.resolve_name('cmd_vel') != '/cmd_vel' else '/cmd_vel/keyboard',
        Twist,
        queue_size=1,
        tcp_nodelay=True,
    )
    with Terminal() as terminal:
        if not publisher.get_num_connections():
            time.sleep(0.5)
        if not publisher.get_num_connections():
            print(f'nobody listens to {publisher.name} yet', flush=True)
        status = drive(config, publisher, terminal)
    rospy.signal_shutdown('the end')
    sys.exit(status)
