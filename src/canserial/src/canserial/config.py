"""Settings of the reader, checked as a whole: every fault is reported at once, by the parameter's name."""

import math
from dataclasses import dataclass

# Table 4.10 of the thesis. Its gyro figures are in (deg/s)^2; these are the same in (rad/s)^2.
ACCELERATION_VARIANCES = (0.0032, 0.0011, 0.0020)
GYRO_VARIANCES = (2.6e-6, 2.8e-6, 1.6e-6)
ANGLE_VARIANCES = (0.01, 0.01, 0.0098)
# What the thesis's listing publishes, units unconverted: for comparison only.
THESIS_GYRO_VARIANCES = (0.0084, 0.0091, 0.0051)
THESIS_ANGLE_VARIANCES = (0.001, 0.001, 0.0098)


class ConfigError(ValueError):
    """One sentence per faulty parameter: its name, what it held, what is allowed."""


@dataclass(frozen=True)
class ReaderConfig:
    """How frames become readings.

    gain: factor k on the yaw rate (the gyro's scale error). calibration_frames: IMU frames at rest that make the gyro's offset.
    calibration: 'measure' at start. imu_period: s between IMU frames. max_gap: s after which a silent sensor's last value is
    not used any more. still_step, still_drift: deg/s, the largest excursion from the mean and the largest change of the mean
    over the calibration that count as rest. initial_yaw: rad, the yaw at start. still_steps: encoder steps that count as rest. range_min, range_max: m (REP-117).
    thesis_covariances: publish the variances of the thesis's listing.
    """

    gain: float = 1.08
    calibration_frames: int = 100
    calibration: str = 'measure'
    imu_period: float = 0.2
    max_gap: float = 1.0
    still_step: float = 0.8
    still_drift: float = 0.12
    still_steps: int = 20
    range_min: float = 0.16
    range_max: float = 2.5
    initial_yaw: float = 0.0
    thesis_covariances: bool = False

    def __post_init__(self):
        faults = []
        for name in ('gain', 'imu_period', 'max_gap', 'still_step', 'still_drift', 'range_min', 'range_max'):
            value = getattr(self, name)
            if not _is_number(value) or not value > 0:
                faults.append(f'{name} is {value!r}, allowed are numbers above 0')
        for name, least in (('calibration_frames', 2), ('still_steps', 0)):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < least:
                faults.append(f'{name} is {value!r}, allowed are whole numbers of {least} or more')
        if self.calibration == 'saved':
            faults.append("calibration is 'saved', which is not available yet: allowed is 'measure'")
        elif self.calibration != 'measure':
            faults.append(f"calibration is {self.calibration!r}, allowed is 'measure'")
        if not _is_number(self.initial_yaw):
            faults.append(f'initial_yaw is {self.initial_yaw!r}, allowed are finite numbers')
        if not isinstance(self.thesis_covariances, bool):
            faults.append(f'thesis_covariances is {self.thesis_covariances!r}, allowed are true and false')
        if not faults and self.range_min >= self.range_max:
            faults.append(f'range_min is {self.range_min!r}, allowed is less than range_max ({self.range_max!r})')
        if faults:
            raise ConfigError('; '.join(faults))

    @property
    def variances(self):
        """Three tuples of three: angles rad^2, angular velocity (rad/s)^2, acceleration (m/s2)^2."""
        if self.thesis_covariances:
            return THESIS_ANGLE_VARIANCES, THESIS_GYRO_VARIANCES, ACCELERATION_VARIANCES
        return ANGLE_VARIANCES, GYRO_VARIANCES, ACCELERATION_VARIANCES


def _is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
