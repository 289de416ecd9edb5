"""An MPU6050 as its bus master meets it: a file of registers, fed one sample at a time.

After the maker's register map (RM-MPU-6000A, revision 4.2; 0x1F, 0x20, 0x69 and the offset registers from its earlier
revisions) and product specification. What a sample holds is the analogue value at the chip (specific force in g,
angular velocity in deg/s, the noise and the errors of the individual chip included: `imu.py`); the chip scales, shifts
by its offset registers, limits and rounds it.

Not modelled: FIFO, DMP, the auxiliary I2C bus, self-test, cycle mode, free-fall and zero-motion interrupts, DLPF,
sample rate divider, clock source and the temperature sensor (their registers hold what is written, the data do not
change for it).
"""

from __future__ import annotations

import struct
from math import exp

import numpy as np

from sara_sim.chips import mpu6050_sample

WHO_AM_I, ADDRESS = 0x75, 0x68
XA_OFFS, XG_OFFS = 0x06, 0x13
GYRO_CONFIG, ACCEL_CONFIG = 0x1B, 0x1C
MOT_THR, MOT_DUR, MOT_DETECT_CTRL = 0x1F, 0x20, 0x69
INT_PIN_CFG, INT_ENABLE, INT_STATUS = 0x37, 0x38, 0x3A
DATA, DATA_LENGTH = 0x3B, 14
SIGNAL_PATH_RESET, USER_CTRL, PWR_MGMT_1, PWR_MGMT_2 = 0x68, 0x6A, 0x6B, 0x6C
RESET_BIT, SLEEP_BIT, MOTION_BIT, DATA_READY_BIT = 0x80, 0x40, 0x40, 0x01

# Bits that keep what is written. A register that is not here is read-only or reserved: writing it changes nothing.
WRITABLE = {
    **dict.fromkeys(range(0x00, 0x0C), 0xFF),
    **dict.fromkeys(range(0x13, 0x1A), 0xFF),
    0x1A: 0x3F,
    0x1B: 0xF8,
    0x1C: 0xFF,
    **dict.fromkeys(range(0x1D, 0x24), 0xFF),
    0x24: 0xFF,
    **dict.fromkeys(range(0x25, 0x34), 0xFF),
    0x34: 0xDF,
    0x37: 0xFE,
    0x38: 0xF9,
    **dict.fromkeys(range(0x63, 0x68), 0xFF),
    0x69: 0x3F,
    0x6A: 0xF0,
    0x6B: 0x6F,
    0x6C: 0xFF,
}
REGISTERS = 128
RESET_S = 0.05  # after DEVICE_RESET registers take no writes (start-up time: 20 ms typical, 100 ms at most)
STARTUP_S = 0.03  # gyro start-up and signal path reset: the data registers hold still
WARM = 1e-4  # what is left of the transient below this is nothing
HIGH_PASS_HZ = {1: 5.0, 2: 2.5, 3: 1.25, 4: 0.63}
HIGH_PASS_RESET = (
    0  # the values above the frequencies' hold: the difference from the sample at which that was switched on
)
THRESHOLD_G = 0.002  # per count of MOT_THR
DECREMENT_MS = (None, 1, 2, 4)  # of MOT_COUNT; None: a sample below the threshold clears the counter
_PACK = struct.Struct('>hhhhhhh')


class Mpu6050:
    """One chip. `silent`: it does not acknowledge; `stuck`: its data registers do not change (faults).

    `trim`: what the accelerometer's offset registers hold after a reset, counts. `settling`: (accelerometer in g, gyro
    in deg/s, time constant in s) of the transient after waking up from cold: a chip that slept for a moment only is
    still warm.
    """

    def __init__(
        self, trim: tuple[int, int, int] = (-1230, 411, 1507), settling: tuple[float, float, float] = (0.02, 0.3, 1.5)
    ):
        self.trim = tuple(trim)
        self.settling = settling
        self.silent = self.stuck = False
        self.resets = 0
        self._cold = 1.0  # 1: slept for long, 0: settled
        self._cooling_for, self._stays = -1.0, 1.0
        self._value = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        mpu6050_sample.warm()  # nothing compiles on the move
        self._power_up()

    @property
    def asleep(self) -> bool:
        """True while no new samples reach the data registers, because SLEEP is set."""
        return bool(self._registers[PWR_MGMT_1] & SLEEP_BIT)

    @property
    def counts(self) -> tuple[int, ...]:
        """What the data registers hold: ax, ay, az, gx, gy, gz. For tests: it clears nothing."""
        ax, ay, az, _, gx, gy, gz = _PACK.unpack_from(self._registers, DATA)
        return ax, ay, az, gx, gy, gz

    @property
    def interrupt_pin(self) -> bool:
        """Level of the INT pin. Without LATCH_INT_EN it is a pulse of 50 us, too short to be seen here."""
        latched = self._registers[INT_PIN_CFG] & 0x20 and self._registers[INT_STATUS] & self._registers[INT_ENABLE]
        return bool(latched) != bool(self._registers[INT_PIN_CFG] & 0x80)

    def step(self, dt: float, value: tuple[float, ...]) -> None:
        """One sample, `dt` s after the last: ax, ay, az (g), gx, gy, gz (deg/s), in the chip's axes."""
        if self._unsettled or self.stuck:
            value = self._let_through(dt, value)
            if value is None:
                return
        self._value = value
        if mpu6050_sample.take(self._data, self._settings, self._motion, self._detects, dt, value):
            self._registers[INT_STATUS] |= MOTION_BIT
        if self._tells_of_data:
            self._registers[INT_STATUS] |= DATA_READY_BIT

    def _let_through(self, dt: float, value: tuple) -> tuple | None:
        """What of a sample reaches the data registers while the chip is not what it mostly is, awake, warm and whole;
        None: nothing.
        """
        if self._busy > 0.0:
            self._busy -= dt
            if self._busy <= 1e-9:
                self._busy = 0.0
                self._registers[PWR_MGMT_1] &= ~RESET_BIT
            self._cold = 1.0 - (1.0 - self._cold) * self._share(dt)
            return None
        if self._asleep:
            self._cold = 1.0 - (1.0 - self._cold) * self._share(dt)
            return None
        if self._cold:
            self._cold = self._cold * self._share(dt) if self._cold > WARM else 0.0
        if self._hold_s > 0.0:
            self._hold_s -= dt
            return None
        self._unsettled = bool(self._cold or self._standby)
        if self._cold:
            accel, gyro = self._cold * self.settling[0], self._cold * self.settling[1]
            value = *(force + accel for force in value[:3]), *(rate + gyro for rate in value[3:])
        if self.stuck:
            return None
        if self._standby:
            value = tuple(
                old if self._standby & 0x20 >> axis else new for axis, (old, new) in enumerate(zip(self._value, value))
            )
        return value

    def read(self, register: int, length: int) -> list[int]:
        """`length` bytes from `register` on. Reading INT_STATUS clears it."""
        registers, end = self._registers, register + length
        data = [*registers[register:end]]
        if register <= INT_STATUS < end or registers[INT_PIN_CFG] & 0x10:
            registers[INT_STATUS] = 0
        if end > REGISTERS:  # the address wraps at the end of the file
            data += registers[: length - len(data)]
        return data

    def write(self, register: int, values: list[int]) -> None:
        """Bytes from `register` on. Reserved bits and read-only registers keep what they hold."""
        for offset, value in enumerate(values):
            self._write(register + offset & 0x7F, value)

    def _write(self, register: int, value: int) -> None:
        if self._busy > 0.0:
            return
        mask = WRITABLE.get(register, 0)
        before = self._registers[register]
        self._registers[register] = before & ~mask & 0xFF | value & mask
        if register == PWR_MGMT_1:
            if value & RESET_BIT:
                self._power_up()
                self.resets += 1
                self._busy = RESET_S
                self._registers[PWR_MGMT_1] |= RESET_BIT
            elif before & SLEEP_BIT and not value & SLEEP_BIT:
                self._hold_s = STARTUP_S - 1e-9
                self._clear_motion()
        elif register == SIGNAL_PATH_RESET and value & 0x07 or register == USER_CTRL and value & 0x01:
            self._value = (0.0,) * 6
            self._registers[DATA : DATA + DATA_LENGTH] = bytes(DATA_LENGTH)
            self._clear_motion()
            self._hold_s = STARTUP_S - 1e-9
        elif register in (ACCEL_CONFIG, MOT_THR, MOT_DUR, MOT_DETECT_CTRL):
            self._clear_motion()
        self._configure()

    def _power_up(self) -> None:
        self._registers = registers = bytearray(REGISTERS)
        self._data = np.frombuffer(registers, np.uint8)[DATA : DATA + DATA_LENGTH]  # the same bytes, for compiled code
        registers[WHO_AM_I] = ADDRESS
        registers[PWR_MGMT_1] = SLEEP_BIT
        for axis, trim in enumerate(self.trim):
            struct.pack_into('>h', registers, XA_OFFS + 2 * axis, trim)
        self._busy = self._hold_s = 0.0
        self._clear_motion()
        self._configure()

    def _configure(self) -> None:
        """What a sample needs of the registers, worked out when they change."""
        registers = self._registers
        self._unsettled = True  # until a sample shows that it is not
        self._asleep = bool(registers[PWR_MGMT_1] & SLEEP_BIT)
        self._standby = registers[PWR_MGMT_2] & 0x3F
        accel_scale = 16384.0 / (1 << (registers[ACCEL_CONFIG] >> 3 & 3))
        gyro_scale = 131.0 / (1 << (registers[GYRO_CONFIG] >> 3 & 3))
        shift = []
        for axis in range(3):
            offset = struct.unpack_from('>h', registers, XA_OFFS + 2 * axis)[0]
            shift.append(((offset & ~1) - (self.trim[axis] & ~1)) / 2048.0 * accel_scale)
        for axis in range(3):
            shift.append(struct.unpack_from('>h', registers, XG_OFFS + 2 * axis)[0] / 32.8 * gyro_scale)
        high_pass, decrement = registers[ACCEL_CONFIG] & 7, DECREMENT_MS[registers[MOT_DETECT_CTRL] & 3]
        self._detects = (
            bool(registers[INT_ENABLE] & MOTION_BIT) and high_pass != HIGH_PASS_RESET
        )  # else the filter's output is zero
        self._tells_of_data = bool(registers[INT_ENABLE] & DATA_READY_BIT)
        self._settings = np.array(
            [
                accel_scale,
                gyro_scale,
                *shift,
                registers[MOT_THR] * THRESHOLD_G,
                registers[MOT_DUR],
                -1.0 if decrement is None else decrement,
                HIGH_PASS_HZ.get(high_pass, 0.0),
            ]
        )

    def _share(self, dt: float) -> float:
        """What is left of warmth or cold after `dt` s."""
        if dt != self._cooling_for:
            self._cooling_for, self._stays = dt, exp(-dt / self.settling[2])
        return self._stays

    def _clear_motion(self) -> None:
        self._motion = np.zeros(mpu6050_sample.MOTION)
