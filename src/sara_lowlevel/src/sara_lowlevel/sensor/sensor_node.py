"""The sensor node: an MPU6050 and SRF02s on I2C in, frames of ranges and of the IMU out (thesis 2.5, 2.6); on a bus
that has the frame COMPASS, a magnetometer too.

`update` is called every 10 ms and never waits. Every call samples the IMU and feeds both filters; the cycle of
`schedule` says when sonars are triggered and read and which frame goes out. What the IMU is doing is said by
`imu_states`: only while it is running IMU frames go out, and none holds a sample older than its turn. Ranges go out
always.
"""

from __future__ import annotations

from collections import Counter, deque
from functools import partial
from math import inf, radians

from canserial.dbc.bus import BusDescription
from canserial.frame import Frame
from sara_lowlevel.config import SensorConfig
from sara_lowlevel.hardware import I2cBus
from sara_lowlevel.schedule import (
    READ_SLOTS,
    READ_TRIES,
    SLOT_S,
    SLOTS,
    TRIGGER_SLOTS,
    Cycle,
    frame_slots,
)
from sara_lowlevel.sensor.complementary import ComplementaryFilter
from sara_lowlevel.sensor.imu_states import RUNNING, ImuStates
from sara_lowlevel.sensor.madgwick import MadgwickFilter
from sara_lowlevel.sensor.magnetometer import Magnetometer
from sara_lowlevel.sensor.mpu6050 import ACCEL_COUNTS_PER_G, GYRO_COUNTS_PER_DPS, Mpu6050
from sara_lowlevel.sensor.rangers import Rangers

_ANGLE_SPAN_DEG, _ANGLE_LIMIT_DEG = 65.536, 32.767
_DPS, _RPS = 1.0 / GYRO_COUNTS_PER_DPS, radians(1.0 / GYRO_COUNTS_PER_DPS)
# A gap longer than this is not bridged by the last rate: the filters take their tilt from gravity anew.
_LONGEST_STEP_S = 0.1
# An impact is told in so many frames in a row: one of them may get lost.
_IMPACT_FRAMES = 3


class SensorNode:
    """Chips in, frames out. Call `update` every 10 ms.

    `counts`: what went wrong, by kind. `filter`, `madgwick`: the two filters (None where it is not sent). `imu`,
    `rangers`, `magnetometer` (None on a bus without its frame): the chips.
    """

    def __init__(self, bus: BusDescription, i2c: I2cBus, config: SensorConfig | None = None) -> None:
        """`bus`: canserial.dbc.bus.BusDescription. `i2c`: has smbus2's methods; OSError where no chip acknowledges.
        `config`: without it, of the chosen platform.
        """
        config = config or SensorConfig.of()
        self.config = config
        self.filter = ComplementaryFilter(config.complementary_weight, SLOT_S)
        self.madgwick = MadgwickFilter(config.madgwick_beta) if config.madgwick else None
        self.imu = Mpu6050(i2c, config.imu_address, config.motion_threshold, config.motion_duration)
        self._states = ImuStates(self.imu, config)
        self.counts: Counter = self._states.counts
        self.rangers = Rangers(i2c, config.sonar_addresses)
        self.magnetometer = Magnetometer(i2c, config.retry_period) if 'COMPASS' in bus.names else None
        self._bus, self._sensors = bus, bus.ranges
        self._limits = {name: bus.resolution(*name) * 32767 for name in (('RANGE_ACCEL', 'ax'), ('IMPACT_GYRO', 'gx'))}
        self._mps2 = config.gravity / ACCEL_COUNTS_PER_G
        self._period_slots = round(config.imu_period / SLOT_S)
        self._cycle = Cycle(self._duties())
        self._outbox: deque[Frame] = deque()
        self._ranged = False
        self._sampled: float | None = None
        self._impact_at = -inf
        self._accel = (0, 0, 0)
        self._forget()

    def update(self, t: float) -> list[Frame]:
        """One slot; `t`: s. Returns the frame to send now, or nothing. A second call within a slot does nothing."""
        due = self._cycle.advance(t)
        if due is None:
            return []
        sample = self._states.update(t)
        if sample is not None:
            self._take(t, sample)
        elif self._count or self._whole:
            self._forget()
        for duty in due:
            frame = duty(t)
            if frame is not None:
                self._outbox.append(frame)
        if not self._outbox:
            return []
        # One frame in a slot, even when a late call has several due; what cannot catch up within a cycle is dropped.
        while len(self._outbox) > 6:
            self._outbox.popleft()
            self.counts['frames dropped'] += 1
        return [self._outbox.popleft()]

    def recalibrate(self) -> None:
        """The push-button: settle, measure and write the offsets anew; until then no IMU frame goes out."""
        self._states.recalibrate()

    @property
    def state(self) -> str:
        """'starting', 'settling', 'calibrating', 'running' or 'fault'."""
        return self._states.state

    @property
    def reason(self) -> str:
        """Why it is at fault, or does not get beyond calibrating; else ''."""
        return self._states.reason

    @property
    def offsets(self) -> tuple | None:
        """The registers ((ax, ay, az), (gx, gy, gz)) that the calibration found, None without one."""
        return self._states.offsets

    @property
    def missed(self) -> int:
        """Slots that were not called in time."""
        return self._cycle.missed

    # --- the cycle ---------------------------------------------------------------------------------------------------

    def _duties(self) -> dict[int, list]:
        duties: dict[int, list] = {slot: [] for slot in range(SLOTS)}
        turns = self.config.turns
        for slot, names in zip(TRIGGER_SLOTS, turns):
            duties[slot].append(partial(self._trigger, names))
        for slot, names in zip(READ_SLOTS, turns):
            for k in range(READ_TRIES):
                duties[slot + k].append(partial(self._read, names, k == READ_TRIES - 1))
        senders = {
            'RANGES_1': self._ranges_1,
            'RANGES_2': self._ranges_2,
            'MADGWICK': self._angles_madgwick,
            'COMPLEMENTARY': self._angles_complementary,
            'RANGE_ACCEL': self._range_accel,
            'IMPACT_GYRO': self._impact_gyro,
            'COMPASS': self._field,
        }
        compass = self.magnetometer is not None
        for slot, name in frame_slots(self.config.imu_period, self.config.madgwick, compass).items():
            duties[slot].append(senders[name])
        return duties

    def _trigger(self, names, t: float) -> None:
        self.rangers.trigger(names, t)

    def _read(self, names, last: bool, t: float) -> None:
        self.rangers.read(names, t, last)
        self._ranged = self._ranged or last and names is self.config.turns[1]

    def _ranges_1(self, t: float) -> Frame:
        return self._range_frame('RANGES_1')

    def _ranges_2(self, t: float) -> Frame | None:
        return self._range_frame('RANGES_2') if self._ranged else None

    def _range_frame(self, message: str) -> Frame:
        return self._bus.encode(message, **self._ranges(message))

    def _ranges(self, message: str) -> dict[str, float]:
        cm = self.rangers.cm
        return {name: cm[name] / 100 for name in self._sensors.get(message, ())}

    def _field(self, t: float) -> Frame | None:
        field = self.magnetometer.read(t)
        return field and self._bus.encode('COMPASS', mz=field[2], my=field[1], mx=field[0])

    # --- frames of the IMU -------------------------------------------------------------------------------------------

    def _may_send(self, t: float) -> bool:
        """Running, a whole period of samples behind it, and a chip that is still awake."""
        return self._whole and self._states.awake(t)

    def _angles_madgwick(self, t: float) -> Frame | None:
        if not self._may_send(t):
            return None
        angles = self.madgwick
        return self._bus.encode(
            'MADGWICK', roll=_tilt(angles.roll), pitch=_tilt(angles.pitch), yaw=_round_yaw(angles.yaw)
        )

    def _angles_complementary(self, t: float) -> Frame | None:
        if not self._may_send(t):
            return None
        angles = self.filter
        return self._bus.encode(
            'COMPLEMENTARY', rx=_tilt(angles.roll), ry=_tilt(angles.pitch), rz=_round_yaw(angles.yaw)
        )

    def _range_accel(self, t: float) -> Frame | None:
        if not self._may_send(t):
            return None
        limit, factor = self._limits['RANGE_ACCEL', 'ax'], self._mps2
        ax, ay, az = (min(max(count * factor, -limit), limit) for count in self._accel)
        return self._bus.encode('RANGE_ACCEL', **self._ranges('RANGE_ACCEL'), az=az, ay=ay, ax=ax)

    def _impact_gyro(self, t: float) -> Frame | None:
        """Closes the IMU period: the mean of its rates, and whether there was an impact in it or just before."""
        if self._states.state != RUNNING:
            return None
        sums, count, whole = self._sums, self._count, self._whole
        self._sums, self._count, self._whole = (0, 0, 0), 0, True
        if not whole:
            return None
        if 2 * count < self._period_slots:
            self.counts['short turns'] += 1
            return None
        impact = self._states.impact(t) if self._states.awake(t) else None
        if impact is None:
            return None
        if impact:
            self._impact_at = t
        told = t - self._impact_at < (_IMPACT_FRAMES - 0.5) * self.config.imu_period
        limit = self._limits['IMPACT_GYRO', 'gx']
        gx, gy, gz = (min(max(total * _DPS / count, -limit), limit) for total in sums)
        return self._bus.encode('IMPACT_GYRO', alarma=int(told), gz=gz, gy=gy, gx=gx)

    # --- the IMU -----------------------------------------------------------------------------------------------------

    def _take(self, t: float, sample: tuple[int, int, int, int, int, int]) -> None:
        """A sample of this slot: three accelerations and three rates, in counts."""
        ax, ay, az, gx, gy, gz = sample
        sx, sy, sz = self._sums
        self._sums = (sx + gx, sy + gy, sz + gz)
        self._count += 1
        self._accel = accel = (ax, ay, az)
        dt = SLOT_S if self._sampled is None else t - self._sampled
        self._sampled = t
        if dt > _LONGEST_STEP_S:
            self._restart_filters()
        self.filter.update(accel, (gx * _DPS, gy * _DPS, gz * _DPS), dt)
        if self.madgwick is not None:
            self.madgwick.update(accel, (gx * _RPS, gy * _RPS, gz * _RPS), dt)

    def _forget(self) -> None:
        """No sample of before may reach a frame of after."""
        self._sums, self._count, self._whole = (0, 0, 0), 0, False
        self._sampled = None
        self._restart_filters()

    def _restart_filters(self) -> None:
        self.filter.restart()
        if self.madgwick is not None:
            self.madgwick.restart()


def _tilt(angle: float) -> float:
    """Degrees, kept inside what the frame's 16 bits hold."""
    return min(max(angle, -_ANGLE_LIMIT_DEG), _ANGLE_LIMIT_DEG)


def _round_yaw(angle: float) -> float:
    """Degrees modulo 65.536, in the frame's 16 bits."""
    return _tilt((angle + _ANGLE_SPAN_DEG / 2) % _ANGLE_SPAN_DEG - _ANGLE_SPAN_DEG / 2)
