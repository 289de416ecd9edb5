"""Chips at register level for the tests of this package: an I2C bus, an MPU6050 that sleeps after a reset, SRF02s that
are busy while ranging.

The platform says where the chips sit; else independent of the stack.
Time is `bus.now`, set by the test (or by `clock`, for the commands).
"""

import struct
import time

from sara_common.platforms import chosen

IMU_ADDRESS = chosen().sensor_node.get('imu_address', 0x68)
SONAR_ADDRESSES = tuple(chosen().sensor_node['sonar_addresses'].values())


class FakeBus:
    """smbus2's methods over `devices`, {address: device}. `fails`: called before each access; True makes nobody
    acknowledge.
    """

    def __init__(self, devices, fails=lambda: False, clock=None):
        self.devices, self.fails, self._clock, self._now = devices, fails, clock, 0.0
        self.accesses = 0

    @property
    def now(self):
        return self._clock() if self._clock else self._now

    @now.setter
    def now(self, t):
        self._now = t

    def _device(self, address):
        self.accesses += 1
        if self.fails() or address not in self.devices:
            raise OSError(121, 'Remote I/O error')
        return self.devices[address]

    def read_byte_data(self, address, register):
        return self._device(address).read(register, 1, self.now)[0]

    def read_i2c_block_data(self, address, register, length):
        return list(self._device(address).read(register, length, self.now))

    def write_byte_data(self, address, register, value):
        self._device(address).write(register, [value], self.now)

    def write_i2c_block_data(self, address, register, values):
        self._device(address).write(register, values, self.now)


class FakeMpu:
    """measured = level + bias + 8 (offset - factory) (accelerometer), rate + bias + 4 offset (gyroscope), in counts.
    Asleep it measures nothing.

    `motion(k)`: counts (6) to add to the k-th sample.
    """

    def __init__(self, bias=(0,) * 6, factory=(0, 0, 0), motion=None):
        self.bias, self.factory, self.motion = bias, factory, motion
        self.samples = self.resets = 0
        self.busy_until = -1.0
        self.impact = False
        self.power_up()

    def power_up(self):
        self.registers = bytearray(128)
        self.registers[0x6B], self.registers[0x75] = 0x40, 0x68
        self.registers[0x06:0x0C] = struct.pack('>3h', *self.factory)

    @property
    def asleep(self):
        return bool(self.registers[0x6B] & 0x40)

    def read(self, register, length, now):
        if register == 0x3A:
            value, self.impact = 0x40 if self.impact else 0x00, False
            return [value]
        if register == 0x3B:
            self._measure()
        return self.registers[register : register + length]

    def write(self, register, values, now):
        if now < self.busy_until - 1e-5:
            return  # in reset: the write is lost
        if register == 0x6B and values[0] & 0x80:
            self.resets += 1
            self.power_up()
            self.busy_until = now + 0.1
            return
        for place, value in enumerate(values):
            if register + place in (0x06 + 1, 0x08 + 1, 0x0A + 1):
                value = value & 0xFE | self.registers[register + place] & 1
            if register + place != 0x68:
                self.registers[register + place] = value

    def _measure(self):
        if self.asleep:
            return
        offsets = (*struct.unpack('>3h', self.registers[0x06:0x0C]), *struct.unpack('>3h', self.registers[0x13:0x19]))
        counts = [0, 0, 16384, 0, 0, 0]
        added = self.motion(self.samples) if self.motion else (0,) * 6
        self.samples += 1
        for axis in range(6):
            step = 8 * (offsets[axis] - self.factory[axis]) if axis < 3 else 4 * offsets[axis]
            counts[axis] = min(max(round(counts[axis] + self.bias[axis] + step + added[axis]), -32768), 32767)
        self.registers[0x3B:0x41] = struct.pack('>3h', *counts[:3])
        self.registers[0x43:0x49] = struct.pack('>3h', *counts[3:])


class FakeSrf02:
    """Answers `distance` (cm) 66 ms after a command; `deaf`: reads 0xFF while ranging instead of not acknowledging."""

    def __init__(self, distance=100, deaf=False):
        self.distance, self.deaf, self.triggers = distance, deaf, []
        self._busy_until, self._result = -1.0, 0

    def _check(self, now):
        if now < self._busy_until - 1e-5:
            if not self.deaf:
                raise OSError(121, 'Remote I/O error')
            return True
        return False

    def write(self, register, values, now):
        if self._check(now):
            return
        assert register == 0 and values == [0x51]
        self.triggers.append(now)
        self._busy_until, self._result = now + 0.066, self.distance

    def read(self, register, length, now):
        if self._check(now):
            return [0xFF] * length
        return [6, 0x80, self._result >> 8, self._result & 0xFF, 0, 16][register : register + length]


def chair(clock=None, **mpu):
    """A whole I2C bus: (bus, mpu, {address: sonar})."""
    chip = FakeMpu(**mpu)
    sonars = {address: FakeSrf02(100 + k) for k, address in enumerate(SONAR_ADDRESSES)}
    return FakeBus({IMU_ADDRESS: chip, **sonars}, clock=clock), chip, sonars


def demo():
    """What `--i2c fake_chips:demo` calls."""
    return chair(time.monotonic)[0]
