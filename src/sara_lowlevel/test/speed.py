#!/usr/bin/env python3
"""Prints what the sensor node's 10 ms turn costs on a bus that costs nothing, and the motor node's wheels."""

import sys
import time
from pathlib import Path

from canserial.dbc.bus import BusDescription
from sara_lowlevel.config import SensorConfig
from sara_lowlevel.motor.wheel_drive import WheelDrive
from sara_lowlevel.sensor.sensor_node import SensorNode

sys.path.insert(0, str(Path(__file__).parent / 'unit'))
from fake_amplifier import FakeAmplifier  # noqa: E402

TURNS = 9400  # the thesis's square


class FreeBus:
    """smbus2's methods on registers that hold what is written; samples that vary."""

    def __init__(self):
        self.registers, self.turn = {0x75: 0x68}, 0

    def read_i2c_block_data(self, address, register, length):
        self.turn += 1
        if register == 0x3B:
            return [0, self.turn & 15, 0, 2, 64, 0, 0, 0, 0, 1, 0, 2, 0, self.turn & 31]
        return [6, 128, 1, 44][:length] if length == 4 else [0] * length

    def read_byte_data(self, address, register):
        return self.registers.get(register, 0)

    def write_byte_data(self, address, register, value):
        if address == 0x68:
            self.registers[register] = value


def best(turn, first=200):
    """us per turn, the best of five runs."""
    for k in range(first):
        turn(k)
    times = []
    for run in range(5):
        start = time.process_time()
        for k in range(first + run * TURNS, first + (run + 1) * TURNS):
            turn(k)
        times.append(time.process_time() - start)
    return min(times) / TURNS * 1e6


def main():
    """Run and print."""
    for name, options in (
        ('IMU frames every 200 ms', {}),
        ('without Madgwick', {'madgwick': False}),
        ('every 50 ms', {'imu_period': 0.05}),
    ):
        node = SensorNode(BusDescription.default(), FreeBus(), SensorConfig.of(calibrate=False, **options))
        cost = best(lambda k, node=node: node.update(k / 100))
        assert node.state == 'running'
        print(f'sensor node, {name}: {cost:.1f} us per turn of 10 ms')
    drive, fake = WheelDrive(), FakeAmplifier()

    def turn(k):
        fake.advance(k / 100)
        fake.write(drive.update(k / 100, (2.0, 2.0), fake.read()))

    print(f'wheel drive with its simulated controller: {best(turn):.1f} us per turn of 10 ms')


if __name__ == '__main__':
    main()
