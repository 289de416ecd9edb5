"""`sensor_node`: the sensor node on a real I2C bus and CAN bus. SIGUSR1 is the push-button that calibrates anew."""

from __future__ import annotations

import argparse
import signal
import threading
from collections.abc import Iterable

from canserial.frame import Frame
from sara_lowlevel.config import FAST_IMU, SLOW_IMU, SensorConfig
from sara_lowlevel.hardware import open_i2c
from sara_lowlevel.runner import Recorder, Runner, adapter_config, bus_named, common_arguments, main_of
from sara_lowlevel.sensor.sensor_node import SensorNode


def parser() -> argparse.ArgumentParser:
    """The command's options."""
    result = argparse.ArgumentParser(
        prog='sensor_node',
        description='MPU6050 and SRF02s on I2C in, frames of ranges and IMU on CAN out; with --dbc +compass an '
        'HMC5883L or QMC5883L too.',
    )
    result.add_argument(
        '--i2c',
        required=True,
        metavar='DEVICE|MODULE:FACTORY',
        help='/dev/i2c-1, or what a factory in a Python module returns (sara_sim.chips.demo:demo)',
    )
    common_arguments(result)
    result.add_argument(
        '--slow', action='store_true', help='IMU frames every 200 ms, as in the thesis, instead of 50 ms'
    )
    result.add_argument('--no-calibrate', action='store_true', help='leave the offset registers as they are')
    result.add_argument('--no-madgwick', action='store_true', help='leave out the frame MADGWICK')
    result.add_argument('--no-settle', action='store_true', help='calibrate without the 10 s of settling (for trials)')
    return result


def describe(node: SensorNode) -> str:
    """The node's state in one line."""
    silent = [name for name, count in node.rangers.counts.items() if count and node.rangers.cm[name] == 0xFFFF]
    parts = [node.state + (f' ({node.reason})' if node.reason else '')]
    if silent:
        parts.append('silent: ' + ' '.join(silent))
    counts = node.counts
    if node.magnetometer is not None:
        chip = node.magnetometer.chip or f'no magnetometer ({node.magnetometer.reason})'
        parts.append(chip)
        counts = counts + node.magnetometer.counts
    if node.missed:
        parts.append(f'{node.missed} slots missed')
    return ', '.join(parts + [f'{count} {kind}' for kind, count in sorted(counts.items()) if kind != 'chip starts'])


def run(arguments: list[str] | None = None) -> int:
    """The command."""
    options = parser().parse_args(arguments)
    settle = {'settle_time': 0.01} if options.no_settle else {}
    config = SensorConfig.of(
        imu_period=SLOW_IMU if options.slow else FAST_IMU,
        calibrate=not options.no_calibrate,
        madgwick=not options.no_madgwick,
        **settle,
    )
    can, bus = adapter_config(options.can), bus_named(options.dbc)
    i2c = open_i2c(options.i2c)
    try:
        node = SensorNode(bus, i2c, config)
        recorder = Recorder(options.record, can.port) if options.record else None
        pressed = threading.Event()
        signal.signal(signal.SIGUSR1, lambda *_: pressed.set())

        def step(t: float, _frames: list[Frame]) -> Iterable[Frame]:
            if pressed.is_set():
                pressed.clear()
                node.recalibrate()
            return node.update(t)

        return Runner('sensor_node', can, step, lambda: describe(node), recorder).run()
    finally:
        if hasattr(i2c, 'close'):
            i2c.close()


def main() -> None:
    """The executable."""
    main_of(run)
