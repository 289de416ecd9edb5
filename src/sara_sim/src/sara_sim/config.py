"""The numbers of the simulated chair: the distributions, and one chair drawn from them.

Every published figure comes from the defaults; `ChairConfig.changes` says which of them a run has altered.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sara_common.config import ConfigError, is_number

_NOT_ZERO = frozenset(
    (
        'length',
        'width',
        'wheel_radius',
        'track',
        'steps_per_turn',
        'motor_lag',
        'samples_per_frame',
        'sonar_rays',
        'gravity',
    )
)


@dataclass(frozen=True)
class Checked:
    """Numbers that are checked as a whole: those of a class derived from it, by its `validate`. Raises ConfigError that
    names every fault.
    """

    def __post_init__(self):
        faults = self.validate()
        if faults:
            raise ConfigError(faults)

    def changes(self) -> dict[str, tuple]:
        """{name: (value, default)} of everything that is not the default."""
        return {
            field.name: (getattr(self, field.name), field.default)
            for field in fields(self)
            if getattr(self, field.name) != field.default
        }


@dataclass(frozen=True)
class ChairConfig(Checked):
    """What chairs are drawn from. Pairs named `_range` are uniform limits, names ending in `_sigma` standard
    deviations.
    """

    length: float = 1.08  # m
    width: float = 0.58  # m
    wheel_radius: float = 0.155  # m
    wheel_radius_sigma: float = 0.005  # relative, each wheel
    track: float = 0.525  # m
    steps_per_turn: int = 64000  # encoder edges per turn of a wheel
    slip_range: tuple = (1.25, 1.30)  # yaw the wheels say / yaw of the chair
    motor_lag: float = 0.10  # s, first order
    dead_band: float = 0.02  # rad/s of the wheel
    max_wheel_speed: float = 7.0  # rad/s
    gyro_scale_range: tuple = (0.920, 0.927)  # z only
    gyro_bias: tuple = (-0.49, -0.91, -0.65)  # deg/s
    gyro_bias_sigma: float = 0.02  # deg/s
    gyro_drift: float = 0.003  # deg/s per square root of a minute
    gyro_frame_sigma: tuple = (0.0841, 0.0971, 0.0734)  # deg/s of the 200 ms means (table 4.5)
    accel_offset: tuple = (-0.9498, -0.0752, 9.5638 - 9.80665)  # m/s2 on the level chair, tilt included (table 4.1)
    accel_sigma_low: tuple = (0.0576, 0.0365, 0.0476)  # m/s2 of a 10 ms sample, which is what is sent (table 4.1)
    accel_sigma_high: tuple = (0.1097, 0.0594, 0.0628)  # m/s2 (table 4.2)
    samples_per_frame: int = 20  # 10 ms samples in a 200 ms mean
    tilt_sigma: float = 1.0  # deg, roll and pitch of the IMU's mounting
    frame_jitter: float = 0.010  # s, uniform from 0
    frame_loss: float = 1.0e-4  # fraction
    sonar_sigma: float = 0.01  # m
    sonar_lost: float = 0.02  # fraction
    sonar_steepest: float = 60.0  # deg between beam and wall normal
    sonar_cone: float = 60.0  # deg, full
    sonar_rays: int = 13
    sonar_limit: float = 6.0  # m
    battery: float = 25.4  # V at rest
    gravity: float = 9.80665  # m/s2

    def validate(self) -> list[str]:
        """One sentence for every fault found: all are finite, none but biases and offsets negative, ranges in order,
        sizes not zero.
        """
        faults = []
        for field in fields(self):
            value = getattr(self, field.name)
            pair = field.name.endswith('_range')
            wanted = len(field.default) if isinstance(field.default, tuple) else 0
            numbers = value if isinstance(value, tuple) else (value,)
            if (wanted and not (isinstance(value, tuple) and len(value) == wanted)) or not all(map(is_number, numbers)):
                allowed = f'are {wanted} finite numbers' if wanted else 'is a finite number'
                faults.append(f'{field.name} is {value!r}, allowed {allowed}')
            elif pair and not 0 < value[0] <= value[1]:
                faults.append(f'{field.name} is {value!r}, allowed is (lowest, highest), both positive')
            elif field.name in _NOT_ZERO and value <= 0:
                faults.append(f'{field.name} is {value!r}, allowed are numbers above 0')
            elif field.name not in ('gyro_bias', 'accel_offset') and min(numbers) < 0:
                faults.append(f'{field.name} is {value!r}, allowed are numbers of 0 or more')
        return faults


@dataclass(frozen=True)
class DrawnChair:
    """One chair: what is constant in a run. Units as in ChairConfig; `slip` = yaw of the chair / yaw the wheels say."""

    slip: float
    right_radius: float
    left_radius: float
    gyro_scale: float
    gyro_bias: tuple
    accel_sigma: tuple
    roll: float
    pitch: float

    @classmethod
    def draw(cls, config: ChairConfig, random: np.random.Generator) -> DrawnChair:
        """A chair from `config`. Every number is drawn whatever the others are, so one setting changes one thing."""
        slip = 1.0 / random.uniform(*config.slip_range)
        right, left = config.wheel_radius * random.normal(1.0, config.wheel_radius_sigma, 2)
        scale = random.uniform(*config.gyro_scale_range)
        bias = np.array(config.gyro_bias) + random.normal(0.0, config.gyro_bias_sigma, 3)
        sigma = random.uniform(config.accel_sigma_low, config.accel_sigma_high)
        roll, pitch = random.normal(0.0, config.tilt_sigma, 2)
        return cls(
            slip,
            float(right),
            float(left),
            scale,
            tuple(bias.tolist()),
            tuple(sigma.tolist()),
            float(roll),
            float(pitch),
        )
