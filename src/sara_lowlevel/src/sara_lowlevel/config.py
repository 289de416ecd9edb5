"""Settings of the motor, joystick and sensor nodes. `of` takes what the robot decides from its platform: what has no
use as a default is 0 or empty.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from sara_common.config import ConfigError, fault, is_whole, number_faults
from sara_common.platforms import OfPlatform, Platform

FAST_IMU, SLOW_IMU = 0.05, 0.2
"""s between the IMU's frames: in the fast mode, and as in the thesis."""


@dataclass(frozen=True)
class _Checked:
    """A configuration whose numbers must be positive and finite and whose switches must be True or False."""

    def __post_init__(self):
        faults = self.validate()
        if faults:
            raise ConfigError(faults)

    def validate(self) -> list[str]:
        """One sentence for every fault found; empty when all is well."""
        switches = [field.name for field in fields(self) if isinstance(field.default, bool)]
        numbers = [
            field.name
            for field in fields(self)
            if isinstance(field.default, (int, float)) and not isinstance(field.default, bool)
        ]
        return [
            fault(self, name, 'are true and false') for name in switches if not isinstance(getattr(self, name), bool)
        ] + number_faults(self, above_0=numbers)

    def _whole(self, name: str, low: int, high: int) -> list[str]:
        if is_whole(getattr(self, name), low, high):
            return []
        return [fault(self, name, f'are whole numbers from {low} to {high}')]


@dataclass(frozen=True)
class MotorConfig(_Checked, OfPlatform):
    """The motor node: periods and timeouts in seconds, speeds in rad/s of the wheel.

    `wheel_acceleration`: rad/s2, the most that the PC changes a wheel's speed by: safety_gate's hard braking, 1.5 m/s2
    and 3 rad/s2, at the rim, (1.5 + 3 x separation / 2) / radius. `release_time`: within it a PC that helps follows a
    stick that was let go or drawn back: its most careful rider's braking, after speeding up, takes 2.6. `notice_time`:
    for so long a stick is pushed in vain before it drives without help. `joystick_max`: of an axis; a frame with more
    is damaged.
    """

    encoder_period: float = 0.1
    mode_period: float = 0.2
    battery_period: float = 1.0
    command_period: float = 0.02
    command_timeout: float = 0.2
    wheel_acceleration: float = 0.0
    joystick_timeout: float = 0.5
    release_time: float = 3.0
    notice_time: float = 1.0
    max_wheel_speed: float = 0.0
    joystick_centre: int = 512
    joystick_max: int = 1023
    joystick_dead_band: int = 40

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """The wheels' limits."""
        return {name: platform.motor_node[name] for name in ('max_wheel_speed', 'wheel_acceleration')}


@dataclass(frozen=True)
class JoystickConfig(_Checked, OfPlatform):
    """The joystick node: 10-bit axes, wheel speeds in rad/s at full deflection."""

    period: float = 0.1
    centre: int = 512
    dead_band: int = 40
    full_scale: int = 512
    max_forward: float = 0.0
    max_turn: float = 0.0

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """What full deflection means."""
        return dict(platform.joystick_node)


@dataclass(frozen=True)
class AmplifierConfig(_Checked):
    """How the AX3500 is wired. `right_channel`: 1 or 2, motor and encoder of the right wheel; `*_reversed`: a positive
    command turns it backwards,
    `*_encoder_reversed`: forward counts down. Times in s; `reply_timeout`: until the next question, `stale_after`:
    counts older than this stop the wheels.
    """

    right_channel: int = 1
    right_reversed: bool = False
    left_reversed: bool = False
    right_encoder_reversed: bool = False
    left_encoder_reversed: bool = False
    reply_timeout: float = 0.1
    stale_after: float = 0.3
    battery_period: float = 1.0

    def validate(self) -> list[str]:
        """As the base, and the channel's number."""
        return super().validate() + self._whole('right_channel', 1, 2)


@dataclass(frozen=True)
class SpeedLoopConfig(_Checked, OfPlatform):
    """The speed loop of a wheel: rad/s of the wheel, outputs of 0..1 of the amplifier's full scale.

    `full_speed`: what full output gives without load; `lag`: s, of the motor and the line together. `kp`: per rad/s,
    `ki`: per rad.
    `rest_speed`: below it the wheel stands. `max_speed`: above it a count is a glitch. `stall_output`, `stall_time`:
    this much output this long (s) without motion is a stall, `stall_integral`: what the integral may reach until then.
    `reversed_output`, `reversed_time`: the same for motion against the output. `unreadable_time`: s of nothing but
    glitches.
    """

    steps_per_turn: int = 0
    full_speed: float = 0.0
    lag: float = 0.2
    kp: float = 0.06
    ki: float = 0.3
    max_acceleration: float = 10.0
    rest_speed: float = 0.15
    max_speed: float = 20.0
    stall_output: float = 0.25
    stall_time: float = 0.6
    stall_integral: float = 0.2
    reversed_output: float = 0.1
    reversed_time: float = 0.25
    unreadable_time: float = 0.3

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """Encoder and motor."""
        return {'steps_per_turn': platform.wheels.steps_per_turn, 'full_speed': platform.motor_node['full_speed']}


@dataclass(frozen=True)
class SensorConfig(_Checked, OfPlatform):
    """The sensor node: addresses, what is sent, calibration, filters.

    `imu_address`, `sonar_addresses` {name: address}: 7-bit I2C addresses; the sonars are named as the ranges on the
    bus. `turns`: two groups of them, each triggered at the same time. `imu_period`: s, 0.2, or 0.05 in the fast mode.
    `calibrate`: measure the offsets after power-up: discard `settle_time`, average `calibration_time` (s) at rest. Rest
    is 0.2 s means that stay within `still_accel` (m/s2) and `still_rate` (deg/s) of each other; a correction beyond
    `max_accel_bias` (m/s2) or `max_rate_bias` (deg/s; the data sheet's zero-rate limit) is refused.
    `complementary_weight`: A of eq. 2.16. `madgwick`: send its angles too; `madgwick_beta`: rad/s, the optimum Madgwick
    found without a magnetometer. `retry_period`: s between attempts to start a chip that does not answer.
    `motion_threshold`, `motion_duration`: registers MOT_THR (2 mg each) and MOT_DUR (ms).
    """

    imu_address: int = 0x68
    sonar_addresses: Mapping = field(default_factory=dict)
    turns: tuple = ((), ())
    imu_period: float = SLOW_IMU
    calibrate: bool = True
    settle_time: float = 10.0
    calibration_time: float = 20.0
    still_accel: float = 0.3
    still_rate: float = 1.0
    max_accel_bias: float = 4.9
    max_rate_bias: float = 20.0
    gravity: float = 9.80665
    complementary_weight: float = 0.9
    madgwick: bool = True
    madgwick_beta: float = 0.033
    retry_period: float = 1.0
    motion_threshold: int = 20
    motion_duration: int = 40

    def validate(self) -> list[str]:
        """As the base, and the limits of single settings."""
        faults = super().validate()
        faults += self._whole('imu_address', 0x08, 0x77)
        faults += self._whole('motion_threshold', 1, 255) + self._whole('motion_duration', 1, 255)
        faults += self._sonar_faults()
        if self.imu_period not in (SLOW_IMU, FAST_IMU):
            faults.append(f'imu_period is {self.imu_period!r}, allowed are 0.2 and 0.05')
        weight = self.complementary_weight
        if isinstance(weight, (int, float)) and weight >= 1.0:
            faults.append(f'complementary_weight is {weight!r}, allowed are numbers from 0 to 1')
        return faults

    def _sonar_faults(self):
        addresses, faults = self.sonar_addresses, []
        known = list(addresses.values()) if isinstance(addresses, Mapping) else [None]
        if len(set(known)) != len(known) or not all(is_whole(a, 0x08, 0x7F) and a != self.imu_address for a in known):
            faults.append(
                f'sonar_addresses is {addresses!r}, allowed are names with different I2C addresses (0x08 to 0x7f), '
                'none of them imu_address'
            )
        if len(self.turns) != 2 or sorted(sum(map(list, self.turns), [])) != sorted(addresses):
            faults.append(f'turns is {self.turns!r}, allowed are two lists that hold each name of sonar_addresses once')
        return faults

    @classmethod
    def known_of(cls, platform: Platform) -> dict[str, Any]:
        """The chips' addresses, and when they are asked."""
        known = dict(platform.sensor_node)
        return {**known, 'turns': tuple(map(tuple, known.get('turns', ())))}
