"""What the frames of the bus say, in SI units. `stamp` is the time the frame was received, s."""

import math
from collections.abc import Sequence
from typing import NamedTuple

RIGHT, LEFT = 0, 1
NO_ESTIMATE = (-1.0, -1.0, -1.0)  # as variances: of that there is no estimate (sensor_msgs/Imu)
FIELD_OF_VIEW = math.radians(60.0)  # the cone in which an ultrasonic sensor hears an echo


class EncoderReading(NamedTuple):
    """A wheel's counters: `wheel` RIGHT or LEFT, `steps` and `time_100us` both modulo 2^32."""

    stamp: float
    wheel: int
    steps: int
    time_100us: int


class ImuReading(NamedTuple):
    """roll, pitch, yaw: rad (yaw in [-pi, pi]); angular_velocity: 3 x rad/s; linear_acceleration: 3 x m/s2, gravity in
    it.

    yaw_variance: rad2, to be added for what the chair may have turned unseen. frozen: the IMU's registers stand still,
    all but the stamp is old. unseen: rad2, of what it may have turned unseen since the reading before.
    """

    stamp: float
    roll: float
    pitch: float
    yaw: float
    angular_velocity: tuple
    linear_acceleration: tuple
    yaw_variance: float = 0.0
    frozen: bool = False
    unseen: float = 0.0

    def variances(self, stated: Sequence[tuple]) -> list[tuple]:
        """Return those of the angles, rates and accelerations, three each, of a sensor that states these; NO_ESTIMATE
        of a frozen one.
        """
        if self.frozen:
            return [NO_ESTIMATE] * 3
        (roll, pitch, yaw), rates, accelerations = stated
        return [(roll, pitch, yaw + self.yaw_variance), rates, accelerations]


class FieldReading(NamedTuple):
    """The magnetic field along the robot's axes, three uT; corrected: without the robot's own iron."""

    stamp: float
    field: tuple
    corrected: bool


class HeadingReading(NamedTuple):
    """As ImuReading, with the yaw of the compass and the gyroscope together; 0 is where compass_north has it.

    yaw_variance: rad2, of the yaw as a whole.
    """

    stamp: float
    roll: float
    pitch: float
    yaw: float
    angular_velocity: tuple
    linear_acceleration: tuple
    yaw_variance: float

    def variances(self, stated: Sequence[tuple]) -> list[tuple]:
        """As ImuReading's."""
        (roll, pitch, _), rates, accelerations = stated
        return [(roll, pitch, self.yaw_variance), rates, accelerations]


class AnglesReading(NamedTuple):
    """The sensor node's own angles, rad; source: 'complementary' or 'madgwick'. yaw is modulo 65.536 deg (16 bits on
    the bus).
    """

    stamp: float
    source: str
    roll: float
    pitch: float
    yaw: float


class RangeReading(NamedTuple):
    """Distance in m after REP-117: -Inf nearer than the sensor can measure, +Inf no echo within its range. `raw`: the
    last one as it came, NaN where that is not known; `range`: the median of the last three.
    """

    stamp: float
    name: str
    range: float
    raw: float = math.nan


class JoystickReading(NamedTuple):
    """left and forward: -1..1, 0 within the dead band; mode: the `modo` of the bus; the node's own wheel commands,
    rad/s.
    """

    stamp: float
    left: float
    forward: float
    mode: int
    right_wheel: float
    left_wheel: float


class ModeReading(NamedTuple):
    """Who drives, `modoPC` of the bus (dbc/modes.py)."""

    stamp: float
    mode: int


class BatteryReading(NamedTuple):
    """Voltage in V."""

    stamp: float
    voltage: float


class ImpactReading(NamedTuple):
    """Whether the sensor node reports an impact (`alarma` of the bus)."""

    stamp: float
    impact: bool
