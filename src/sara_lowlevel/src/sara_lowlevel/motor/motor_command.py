"""`motor_node`: the motor node on an AX3500 (RS-232) and a real CAN bus. The last command to the amplifier is
to stop.
"""

from __future__ import annotations

import argparse
import time
from contextlib import suppress

from canserial.dbc.modes import ASSISTED, MANUAL, OFF, PC
from sara_lowlevel.config import AmplifierConfig, MotorConfig, SpeedLoopConfig
from sara_lowlevel.hardware import HardwareError, open_amplifier_port
from sara_lowlevel.motor import ax3500
from sara_lowlevel.motor.motor_node import MotorNode
from sara_lowlevel.motor.wheel_drive import WheelDrive
from sara_lowlevel.runner import Recorder, Runner, adapter_config, bus_named, common_arguments, main_of
from sara_lowlevel.schedule import Every

MODES = {OFF: 'nobody drives', MANUAL: 'joystick drives', ASSISTED: 'PC helps the joystick', PC: 'PC drives'}


def parser() -> argparse.ArgumentParser:
    """The command's options."""
    result = argparse.ArgumentParser(
        prog='motor_node', description='Wheel commands on CAN in, two wheels on a Roboteq AX3500, encoder frames out.'
    )
    result.add_argument(
        '--serial',
        required=True,
        metavar='DEVICE',
        help='serial port of the AX3500 (9600 baud, 7E1), such as /dev/ttyS0',
    )
    common_arguments(result)
    result.add_argument(
        '--right-channel', type=int, choices=(1, 2), default=1, help='channel of the right wheel (default 1)'
    )
    for side in ('right', 'left'):
        result.add_argument(
            f'--{side}-reversed', action='store_true', help=f'a positive command turns the {side} wheel backwards'
        )
        result.add_argument(
            f'--{side}-encoder-reversed',
            action='store_true',
            help=f'the {side} encoder counts down when driving forward',
        )
    _speed_arguments(result)
    return result


def _speed_arguments(result: argparse.ArgumentParser) -> None:
    result.add_argument(
        '--full-speed',
        type=float,
        default=SpeedLoopConfig.of().full_speed,
        help='rad/s of a wheel at full output without load (default %(default)s)',
    )
    result.add_argument(
        '--max-speed',
        type=float,
        default=MotorConfig.of().max_wheel_speed,
        help='rad/s of a wheel, no command goes beyond (default %(default)s)',
    )
    result.add_argument(
        '--kp', type=float, default=SpeedLoopConfig.kp, help='output per rad/s of error (default %(default)s)'
    )
    result.add_argument(
        '--ki', type=float, default=SpeedLoopConfig.ki, help='output per rad of error (default %(default)s)'
    )


class Port:
    """A serial port that may come and go; while it fails, nothing is read. `problem`: why, or ''."""

    def __init__(self, name: str) -> None:
        self._name, self._serial, self._retry = name, open_amplifier_port(name), Every(1.0)
        self.problem = ''

    def read(self, t: float) -> bytes:
        """What has arrived. Opens the port anew, once a second, where it was lost."""
        if self._serial is None:
            if self._retry.due(t):
                try:
                    self._serial, self.problem = open_amplifier_port(self._name), ''
                except HardwareError as error:
                    self.problem = str(error)
            return b''
        try:
            return self._serial.read(4096)
        except OSError as error:
            self._lose(error)
            return b''

    def write(self, data: bytes) -> None:
        """Send, or lose the port."""
        if data and self._serial is not None:
            try:
                self._serial.write(data)
            except OSError as error:
                self._lose(error)

    def stop_and_close(self) -> None:
        """Stop both motors: said three times, for a line that garbles may garble one. Once closed it stays closed."""
        for _ in range(3 if self._serial is not None else 0):
            self.write(ax3500.STOP)
            time.sleep(0.02)
        if self._serial is not None:
            try:
                self._serial.flush()
                self._serial.close()
            except OSError:
                pass  # no amplifier is left that could be stopped; its own watchdog does
        self._serial = None

    def _lose(self, error: Exception) -> None:
        self.problem = f'{self._name} was lost: {error}'
        with suppress(OSError):
            self._serial.close()
        self._serial = None


class MotorLoop:
    """MotorNode, WheelDrive and the port as one step of the runner."""

    def __init__(self, node: MotorNode, drive: WheelDrive, port: Port) -> None:
        self.node, self.drive, self.port = node, drive, port

    def step(self, t: float, frames: list) -> list:
        """One turn of 10 ms."""
        node, drive = self.node, self.drive
        for frame in frames:
            node.receive(frame, t)
        received = self.port.read(t)
        right, left, when = drive.steps(t) or (None, None, None)
        frames = node.update(
            t, right, left, battery=drive.amplifier.voltage if right is not None else None, measured_at=when
        )
        self.port.write(drive.update(t, node.target, received))
        return frames

    def status(self) -> str:
        """Who drives, how fast, what is wrong."""
        drive = self.drive
        parts = [MODES.get(self.node.mode, str(self.node.mode))]
        parts += [text for text in (drive.fault, self.port.problem) if text]
        counts = self.node.counts + drive.amplifier.counts
        return ', '.join(parts + [f'{count} {kind}' for kind, count in sorted(counts.items())])


def run(arguments: list[str] | None = None) -> int:
    """The command."""
    options = parser().parse_args(arguments)
    can, bus = adapter_config(options.can), bus_named(options.dbc)
    amplifier = AmplifierConfig(
        options.right_channel,
        options.right_reversed,
        options.left_reversed,
        options.right_encoder_reversed,
        options.left_encoder_reversed,
    )
    node = MotorNode(bus, MotorConfig.of(max_wheel_speed=options.max_speed))
    drive = WheelDrive(amplifier, SpeedLoopConfig.of(full_speed=options.full_speed, kp=options.kp, ki=options.ki))
    recorder = Recorder(options.record, can.port) if options.record else None
    port = Port(options.serial)
    try:
        loop = MotorLoop(node, drive, port)
        return Runner('motor_node', can, loop.step, loop.status, recorder, at_end=port.stop_and_close).run()
    finally:
        port.stop_and_close()


def main() -> None:
    """The executable."""
    main_of(run)
