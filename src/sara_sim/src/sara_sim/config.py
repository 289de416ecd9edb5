"""The numbers of the simulated chair: the distributions, and one chair drawn from them.

What the robot decides is its platform's (`ChairConfig.of`); every published figure comes from that and the defaults,
and `changes` says which of them a run has altered.
"""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields
from typing import Any

import numpy as np

from sara_common.config import ConfigError, is_number
from sara_common.platforms import OfPlatform, Platform

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
_SIZES = ('length', 'width', 'wheel_radius', 'track', 'steps_per_turn')
_LENGTHS = dict.fromkeys(('gyro_bias', 'gyro_frame_sigma', 'accel_offset', 'accel_sigma_low', 'accel_sigma_high'), 3)


@dataclass(frozen=True)
class Checked:
    """Numbers that are checked as a whole: those of a class derived from it, by its `validate`. Raises ConfigError that
    names every fault.
    """

    def __post_init__(self):
        faults = self.validate()
        if faults:
            raise ConfigError(faults)

    def changes(self, reference: Any = None) -> dict[str, tuple]:
        """{name: (value, usual)} of everything that is not as in `reference`, the defaults without one."""
        reference = reference or type(self)()
        return {
            field.name: (getattr(self, field.name), getattr(reference, field.name))
            for field in fields(self)
            if getattr(self, field.name) != getattr(reference, field.name)
        }


@dataclass(frozen=True)
class ChairConfig(Checked, OfPlatform):
    """What chairs are drawn from. Pairs named `_range` are uniform limits, names ending in `_sigma` standard
    deviations.
    """

    length: float  # m
    width: float  # m
    wheel_radius: float  # m
    wheel_radius_sigma: float  # relative, each wheel
    track: float  # m
    steps_per_turn: int  # encoder edges per turn of a wheel
    slip_range: tuple  # yaw the wheels say / yaw of the chair
    motor_lag: float  # s, first order
    dead_band: float  # rad/s of the wheel
    max_wheel_speed: float  # rad/s
    gyro_scale_range: tuple  # z only
    gyro_bias: tuple  # deg/s
    gyro_bias_sigma: float  # deg/s
    gyro_drift: float  # deg/s per square root of a minute
    gyro_frame_sigma: tuple  # deg/s of the 200 ms means
    accel_offset: tuple  # m/s2 on the level chair, tilt included
    accel_sigma_low: tuple  # m/s2 of a 10 ms sample, which is what is sent
    accel_sigma_high: tuple  # m/s2
    tilt_sigma: float  # deg, roll and pitch of the IMU's mounting
    battery: float  # V at rest
    samples_per_frame: int = 20  # 10 ms samples in a 200 ms mean
    frame_jitter: float = 0.010  # s, uniform from 0
    frame_loss: float = 1.0e-4  # fraction
    sonar_sigma: float = 0.01  # m
    sonar_lost: float = 0.02  # fraction
    sonar_steepest: float = 60.0  # deg between beam and wall normal
    sonar_cone: float = 60.0  # deg, full
    sonar_rays: int = 13
    sonar_limit: float = 6.0  # m
    gravity: float = 9.80665  # m/s2

    def validate(self) -> list[str]:
        """One sentence for every fault found: all are finite, none but biases and offsets negative, ranges in order,
        sizes not zero.
        """
        faults = []
        for field in fields(self):
            value = getattr(self, field.name)
            pair = field.name.endswith('_range')
            wanted = _LENGTHS.get(field.name, 2 if pair else 0)
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

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """Its sizes, and what its simulated chairs are drawn from. Raises ConfigError where a number is missing."""
        known = {name: tuple(value) if isinstance(value, list) else value for name, value in platform.simulated.items()}
        missing = [
            field.name for field in fields(cls) if field.default is MISSING and field.name not in {*known, *_SIZES}
        ]
        strange = [name for name in known if name not in cls.__dataclass_fields__]
        if missing or strange:
            raise ConfigError(
                [f'platform/simulated/{name} is missing' for name in missing]
                + [f'platform/simulated/{name} is {known[name]!r}, but there is no such number' for name in strange]
            )
        wheels = platform.wheels
        sizes = (*platform.size, wheels.radius, wheels.separation, wheels.steps_per_turn)
        return {**known, **dict(zip(_SIZES, sizes))}


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
