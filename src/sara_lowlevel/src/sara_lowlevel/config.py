"""Settings of the motor, joystick and sensor nodes, with the figures of the chair as defaults."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields


class ConfigError(ValueError):
    """One or more settings hold a value that is not allowed; the text names each."""


@dataclass(frozen=True)
class _Positive:
    """A configuration all of whose numbers must be positive and finite."""

    def __post_init__(self):
        faults = self.validate()
        if faults:
            raise ConfigError(' '.join(faults))

    def validate(self) -> list[str]:
        """One sentence for every fault found; empty when all is well."""
        faults = []
        for field in fields(self):
            value = getattr(self, field.name)
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not number or not math.isfinite(value) or value <= 0:
                faults.append(f'{field.name} is {value!r} but must be a positive number.')
        return faults


@dataclass(frozen=True)
class MotorConfig(_Positive):
    """The motor node: periods and timeouts in seconds, speeds in rad/s of the wheel."""

    encoder_period: float = 0.1
    mode_period: float = 0.2
    battery_period: float = 1.0
    command_timeout: float = 0.2
    joystick_timeout: float = 0.5
    max_wheel_speed: float = 7.0
    joystick_centre: int = 512
    joystick_dead_band: int = 40


@dataclass(frozen=True)
class JoystickConfig(_Positive):
    """The joystick node: 10-bit axes, wheel speeds in rad/s at full deflection."""

    period: float = 0.1
    centre: int = 512
    dead_band: int = 40
    full_scale: int = 512
    max_forward: float = 3.0
    max_turn: float = 1.5


@dataclass(frozen=True)
class SensorConfig(_Positive):
    """The sensor node: scales of the MPU6050 in its power-up ranges, and the weight A of the complementary filter."""

    accel_counts_per_g: float = 16384.0
    gyro_counts_per_dps: float = 131.0
    gravity: float = 9.80665
    sample_period: float = 0.01
    complementary_weight: float = 0.9

    def validate(self) -> list[str]:
        """As the base, and the filter's weight below 1."""
        faults = super().validate()
        if not faults and self.complementary_weight >= 1.0:
            faults.append(f'complementary_weight is {self.complementary_weight!r} but must be between 0 and 1.')
        return faults
