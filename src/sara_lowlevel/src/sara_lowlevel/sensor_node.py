"""The sensor node: samples the IMU every 10 ms, ranges in two turns of 100 ms, sends frames every 200 ms.

A cycle has 20 slots of 10 ms. Each turn triggers its ultrasonic sensors in its first slot and reads them 70 ms later (the SRF02 needs
65 ms). The IMU frames have a slot each, at the end of the cycle, so that they never collide and the rates, which the PC publishes
on, come last and are the freshest.
"""

from __future__ import annotations

from canserial.frame import Frame

from sara_lowlevel.complementary import ComplementaryFilter
from sara_lowlevel.config import SensorConfig

TURN_1 = ('SDI', 'STD', 'SLDD', 'SLIT')
TURN_2 = ('SLID', 'SDD', 'SLDT', 'STI', 'SJO')
SENSORS = TURN_1 + TURN_2
SLOTS = 20
TRIGGER_SLOT = {0: TURN_1, 10: TURN_2}
READ_SLOT = {7: TURN_1, 17: TURN_2}
SLOT_RANGES_1, SLOT_COMPLEMENTARY, SLOT_ACCEL, SLOT_GYRO, SLOT_RANGES_2 = 8, 17, 18, 19, 0
_ANGLE_SPAN_DEG, _ANGLE_LIMIT_DEG, _ACCEL_LIMIT, _RATE_LIMIT_DPS = 65.536, 32.767, 32.767, 327.67


class SensorNode:
    """Turns raw samples into frames. Call `update` every 10 ms."""

    def __init__(self, bus, config: SensorConfig = SensorConfig()):
        """`bus`: canserial.bus.BusDescription."""
        self.config = config
        self.filter = ComplementaryFilter(config.complementary_weight, config.sample_period)
        self._bus = bus
        self._slot = 0
        self._started = False
        self._window: list[tuple] = []
        self._ranges = dict.fromkeys(SENSORS, 0)
        self._impact = False

    def update(self, t: float, accel: tuple[int, int, int], gyro: tuple[int, int, int], sonars, impact: bool = False) -> list[Frame]:
        """One slot.

        `t`: s. `accel`, `gyro`: int16 counts of the MPU6050 (x, y, z). `sonars`: has `trigger(names)` and `read(name)` -> whole cm, 0 =
        no echo. `impact`: the motion interrupt; it is kept until a frame has told of it. Returns the frames to send now.
        """
        slot = self._slot
        self._slot = (slot + 1) % SLOTS
        self._impact = self._impact or impact
        self._sample(accel, gyro)
        if slot in TRIGGER_SLOT:
            sonars.trigger(TRIGGER_SLOT[slot])
        if slot in READ_SLOT:
            for name in READ_SLOT[slot]:
                self._ranges[name] = sonars.read(name)
        return self._frames(slot)

    def _sample(self, accel, gyro) -> None:
        self._window.append((*accel, *gyro))
        if len(self._window) > SLOTS:
            del self._window[0]
        scale = self.config.gyro_counts_per_dps
        self.filter.update(accel, (gyro[0] / scale, gyro[1] / scale, gyro[2] / scale))

    def _mean(self, axis: int) -> float:
        """Mean of the last turn's counts; axes 0..2 accelerometer, 3..5 gyro."""
        return sum(sample[axis] for sample in self._window) / len(self._window)

    def _frames(self, slot: int) -> list[Frame]:
        if slot == SLOT_RANGES_1:
            return [self._range_frame('RANGES_1', ('STD', 'SDI', 'SLIT', 'SLDD'))]
        if slot == SLOT_RANGES_2 and self._started:
            return [self._range_frame('RANGES_2', ('SDD', 'SLID', 'STI', 'SLDT'))]
        if slot == SLOT_COMPLEMENTARY:
            angles = self.filter
            yaw = (angles.yaw + _ANGLE_SPAN_DEG / 2) % _ANGLE_SPAN_DEG - _ANGLE_SPAN_DEG / 2
            return [self._bus.encode('COMPLEMENTARY', rx=_limited(angles.roll, _ANGLE_LIMIT_DEG, 3),
                                     ry=_limited(angles.pitch, _ANGLE_LIMIT_DEG, 3), rz=_limited(yaw, _ANGLE_LIMIT_DEG, 3))]
        if slot == SLOT_ACCEL:
            factor = self.config.gravity / self.config.accel_counts_per_g
            ax, ay, az = (_limited(self._mean(axis) * factor, _ACCEL_LIMIT, 3) for axis in range(3))
            return [self._bus.encode('RANGE_ACCEL', SJO=self._ranges['SJO'] / 100, az=az, ay=ay, ax=ax)]
        if slot == SLOT_GYRO:
            self._started = True
            factor = 1.0 / self.config.gyro_counts_per_dps
            gx, gy, gz = (_limited(self._mean(axis) * factor, _RATE_LIMIT_DPS, 2) for axis in range(3, 6))
            impact, self._impact = self._impact, False
            return [self._bus.encode('IMPACT_GYRO', alarma=int(impact), gz=gz, gy=gy, gx=gx)]
        return []

    def _range_frame(self, message: str, names: tuple[str, ...]) -> Frame:
        return self._bus.encode(message, **{name: min(max(self._ranges[name], 0), 65535) / 100 for name in names})


def _limited(value: float, limit: float, digits: int) -> float:
    """`value` rounded to the frame's step and kept inside what its 16 bits hold."""
    return round(min(max(value, -limit), limit), digits)
