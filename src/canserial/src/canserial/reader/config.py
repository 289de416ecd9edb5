"""Settings of the reader, checked as a whole: every fault is reported at once, by the parameter's name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sara_common.config import ConfigError, is_number, is_whole, number_faults
from sara_common.platforms import OfPlatform, Platform

AUTO = 'auto'

# Table 4.10 of the thesis. Its gyro figures are in (deg/s)^2; these are the same in (rad/s)^2.
ACCELERATION_VARIANCES = (0.0032, 0.0011, 0.0020)
GYRO_VARIANCES = (2.6e-6, 2.8e-6, 1.6e-6)
ANGLE_VARIANCES = (0.01, 0.01, 0.0098)
# What the thesis's listing publishes, units unconverted: for comparison only.
THESIS_GYRO_VARIANCES = (0.0084, 0.0091, 0.0051)
THESIS_ANGLE_VARIANCES = (0.001, 0.001, 0.0098)

ABOVE_0 = (
    'calibration_time',
    'max_gap',
    'still_step',
    'still_drift',
    'range_min',
    'range_max',
    'range_limit',
    'stuck_time',
    'unseen_rate',
    'rate_limit',
    'acceleration_limit',
    'gravity_tolerance',
    'max_wheel_speed',
    'default_gain',
    'battery_max',
)


@dataclass(frozen=True)
class ReaderConfig(OfPlatform):
    """How frames become readings. config/read.yaml describes each line for users; `of` takes those of the robot.

    gain: factor k on the yaw rate (the gyro's scale error); None: that of the calibration file, else default_gain.
    calibration: 'measure' at start or 'saved'. calibration_time: s at rest that make the gyro's offset. imu_period: s
    between IMU frames, or 'auto'. max_gap: s after which a silent sensor's last value is not used any more. still_step,
    still_drift: deg/s, the largest excursion from the mean and the largest change of the mean over the calibration that
    count as rest.
    still_steps: encoder steps that count as rest. range_min, range_max: m (REP-117). range_limit: m, more no sensor can
    say.
    initial_yaw: rad, the yaw at start. stuck_time: s, see plausibility.StuckValue.
    frozen_frames: see plausibility.FrozenImu, 0: off. unseen_rate: rad/s that the chair may have turned while the IMU
    was silent or frozen. rate_limit: deg/s.
    acceleration_limit,
    gravity_tolerance: m/s2. max_wheel_speed: rad/s. encoder_steps_per_turn: of a wheel. battery_max: V. battery_empty,
    battery_full, battery_charging: V or None. thesis_covariances: publish the variances of the thesis's listing.
    """

    gain: float | None = None
    default_gain: float = 1.0
    calibration: str = 'measure'
    calibration_time: float = 20.0
    imu_period: float = AUTO
    max_gap: float = 1.0
    still_step: float = 0.8
    still_drift: float = 0.12
    still_steps: int = 0
    range_min: float = 0.16
    range_max: float = 2.5
    range_limit: float = 6.5
    initial_yaw: float = 0.0
    stuck_time: float = 5.0
    frozen_frames: int = 3
    unseen_rate: float = 1.0
    rate_limit: float = 251.0
    acceleration_limit: float = 21.6
    gravity_tolerance: float = 2.0
    max_wheel_speed: float = 0.0
    encoder_steps_per_turn: int = 0
    battery_max: float = 40.0
    battery_empty: float | None = None
    battery_full: float | None = None
    battery_charging: float | None = None
    thesis_covariances: bool = False

    def __post_init__(self):
        faults = number_faults(self, above_0=ABOVE_0)
        for name in ('gain', 'battery_empty', 'battery_full', 'battery_charging'):
            value = getattr(self, name)
            if value is not None and not (is_number(value) and value > 0):
                faults.append(f'{name} is {value!r}, allowed are numbers above 0, or leave it out')
        if self.imu_period != AUTO and not (is_number(self.imu_period) and self.imu_period > 0):
            faults.append(f"imu_period is {self.imu_period!r}, allowed are 'auto' and numbers above 0 (0.2, fast 0.05)")
        for name, least in (('still_steps', 0), ('encoder_steps_per_turn', 1)):
            value = getattr(self, name)
            if not is_whole(value, least):
                faults.append(f'{name} is {value!r}, allowed are whole numbers of {least} or more')
        if self.frozen_frames != 0 and not is_whole(self.frozen_frames, 2):
            faults.append(f'frozen_frames is {self.frozen_frames!r}, allowed are 0 and whole numbers of 2 or more')
        if self.calibration not in ('measure', 'saved'):
            faults.append(f"calibration is {self.calibration!r}, allowed are 'measure' and 'saved'")
        if not is_number(self.initial_yaw):
            faults.append(f'initial_yaw is {self.initial_yaw!r}, allowed are finite numbers')
        if not isinstance(self.thesis_covariances, bool):
            faults.append(f'thesis_covariances is {self.thesis_covariances!r}, allowed are true and false')
        if not faults:
            faults += self._contradictions()
        if faults:
            raise ConfigError(faults)

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """Those of its parameters of read.py that are fields."""
        return {name: value for name, value in platform.parameters('read').items() if name in cls.__dataclass_fields__}

    def _contradictions(self):
        faults = []
        if not self.range_min < self.range_max:
            faults.append(f'range_min is {self.range_min!r}, allowed is less than range_max ({self.range_max!r})')
        if self.range_limit < self.range_max:
            faults.append(f'range_limit is {self.range_limit!r}, allowed is range_max ({self.range_max!r}) and more')
        if self.imu_period != AUTO and self.imu_period > self.max_gap:
            faults.append(f'max_gap is {self.max_gap!r}, allowed is imu_period ({self.imu_period!r}) and more')
        if (self.battery_empty is None) != (self.battery_full is None):
            faults.append(
                f'battery_empty is {self.battery_empty!r} and battery_full {self.battery_full!r}, '
                'allowed are both or none'
            )
        elif self.battery_empty is not None and self.battery_empty >= self.battery_full:
            faults.append(
                f'battery_empty is {self.battery_empty!r}, allowed is less than battery_full ({self.battery_full!r})'
            )
        return faults

    @property
    def variances(self) -> tuple[tuple[float, float, float], ...]:
        """Three tuples of three: angles rad^2, angular velocity (rad/s)^2, acceleration (m/s2)^2."""
        if self.thesis_covariances:
            return THESIS_ANGLE_VARIANCES, THESIS_GYRO_VARIANCES, ACCELERATION_VARIANCES
        return ANGLE_VARIANCES, GYRO_VARIANCES, ACCELERATION_VARIANCES
