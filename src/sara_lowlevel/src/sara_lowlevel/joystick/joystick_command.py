"""`joystick_node`: the joystick node on a Linux joystick device and a real CAN bus.

While the device is unplugged no frame goes out, and half a second later the motor node stops the wheels.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable

from canserial.dbc.bus import BusError
from canserial.dbc.modes import has_assisted
from canserial.frame import Frame
from sara_lowlevel.config import JoystickConfig
from sara_lowlevel.hardware import HardwareError, open_joystick
from sara_lowlevel.joystick.joystick_device import JoystickState
from sara_lowlevel.joystick.joystick_node import JoystickNode
from sara_lowlevel.runner import Recorder, Runner, adapter_config, bus_named, common_arguments, main_of
from sara_lowlevel.schedule import Every


def parser() -> argparse.ArgumentParser:
    """The command's options."""
    result = argparse.ArgumentParser(
        prog='joystick_node', description='A Linux joystick in, frame JOYSTICK on CAN out.'
    )
    result.add_argument('--device', default='/dev/input/js0', help='joystick device (default %(default)s)')
    common_arguments(result)
    result.add_argument('--x-axis', type=int, default=0, help='number of the axis to the right (default 0)')
    result.add_argument('--y-axis', type=int, default=1, help='number of the axis to the front (default 1)')
    result.add_argument('--hold-button', type=int, help='the stick counts only while this button is held')
    result.add_argument(
        '--assist-switch',
        type=int,
        metavar='BUTTON',
        help='the PC helps while this button is pressed, a switch best; needs a --dbc with the mode assisted',
    )
    result.add_argument(
        '--max-forward',
        type=float,
        default=JoystickConfig.of().max_forward,
        help='rad/s of the wheels, stick fully forward (default %(default)s)',
    )
    result.add_argument(
        '--max-turn',
        type=float,
        default=JoystickConfig.of().max_turn,
        help='rad/s of the wheels, stick fully sideways (default %(default)s)',
    )
    return result


class Device:
    """The joystick device, which may be unplugged. `state`: None while it is."""

    def __init__(self, options: argparse.Namespace) -> None:
        self._options, self._retry = options, Every(1.0)
        self.problem = ''
        self._open()

    def poll(self, t: float) -> JoystickState | None:
        """Read what there is at `t` (s); opened anew once a second where it was lost."""
        if self.state is None and self._retry.due(t):
            try:
                self._open()
            except HardwareError as error:
                self.problem = str(error)
        if self.state is None:
            return None
        try:
            while data := os.read(self._file, 4096):
                self.state.feed(data)
            self._lose('it ended')
        except BlockingIOError:
            pass
        except OSError as error:
            self._lose(error.strerror)
        return self.state

    def close(self) -> None:
        """Let go of the device."""
        if self.state is not None:
            os.close(self._file)
            self.state = None

    def _open(self) -> None:
        options = self._options
        self.state = None
        self._file = open_joystick(options.device)
        self.state = JoystickState(options.x_axis, options.y_axis, options.hold_button)
        self.problem = ''

    def _lose(self, why: str) -> None:
        self.close()
        self.problem = f'{self._options.device} was lost: {why}'


def run(arguments: list[str] | None = None) -> int:
    """The command."""
    options = parser().parse_args(arguments)
    can, bus = adapter_config(options.can), bus_named(options.dbc)
    switch = options.assist_switch
    if switch is not None and not has_assisted(bus):
        raise BusError(f'--assist-switch: the bus {bus.path} has no such mode; see its VAL_ of modo')
    node = JoystickNode(bus, JoystickConfig.of(max_forward=options.max_forward, max_turn=options.max_turn))
    recorder = Recorder(options.record, can.port) if options.record else None
    device = Device(options)

    def step(t: float, frames: list[Frame]) -> Iterable[Frame]:
        for frame in frames:
            node.receive(frame, t)
        state = device.poll(t)
        if state is None:
            return []
        return node.update(t, *state.stick, assisted=switch is not None and state.buttons.get(switch, False))

    def status() -> str:
        if device.state is None:
            return device.problem
        return 'stick {} {}'.format(*device.state.stick) if any(device.state.axes.values()) else 'stick at rest'

    try:
        return Runner('joystick_node', can, step, status, recorder).run()
    finally:
        device.close()


def main() -> None:
    """The executable."""
    main_of(run)
