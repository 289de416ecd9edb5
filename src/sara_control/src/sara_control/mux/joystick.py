"""Joystick axes to commands, with a dead band and an optional dead-man's button; none while the stick is released."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sara_common.config import ConfigError, is_number, number_faults


@dataclass(frozen=True)
class JoystickConfig:
    """axis_forward, axis_left: which axes of sensor_msgs/Joy. max_linear: m/s. max_angular: rad/s. deadzone: 0..1 of
    the way.

    deadman_button: the button that must be held, -1 for none. enabled: whether it commands at all.
    """

    enabled: bool = True
    axis_forward: int = 1
    axis_left: int = 0
    max_linear: float = 0.4
    max_angular: float = 0.6
    deadzone: float = 0.05
    deadman_button: int = -1

    def __post_init__(self):
        faults = number_faults(self, above_0=('max_linear', 'max_angular'), prefix='joystick/')
        if not (is_number(self.deadzone) and 0 <= self.deadzone < 1):
            faults.append(f'joystick/deadzone is {self.deadzone!r}, allowed are numbers from 0 to below 1')
        for name, least in (('axis_forward', 0), ('axis_left', 0), ('deadman_button', -1)):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < least:
                faults.append(f'joystick/{name} is {value!r}, allowed are whole numbers of {least} or more')
        if not isinstance(self.enabled, bool):
            faults.append(f'joystick/enabled is {self.enabled!r}, allowed are true and false')
        if faults:
            raise ConfigError(faults)

    @classmethod
    def from_params(cls, params: object) -> 'JoystickConfig':
        """From a dictionary. Raises ConfigError."""
        if not isinstance(params, dict):
            raise ConfigError(f'joystick is {params!r}, allowed is a mapping of parameters')
        unknown = [
            f'joystick/{name} is {params[name]!r}, but there is no such parameter'
            for name in params
            if name not in cls.__dataclass_fields__
        ]
        if unknown:
            raise ConfigError('; '.join(unknown))
        return cls(**params)


class Joystick:
    """config: JoystickConfig. `dropped`: readings without those axes or not finite."""

    def __init__(self, config: JoystickConfig) -> None:
        self.config = config
        self.dropped = 0
        self._held = False

    def on_axes(self, axes: Sequence[float], buttons: Sequence[int]) -> tuple[float, float] | None:
        """(v m/s, w rad/s) for axes in -1..1 (left and forward positive) and buttons; one (0, 0) when the stick is
        released; else None.
        """
        config = self.config
        if max(config.axis_forward, config.axis_left) >= len(axes) or config.deadman_button >= len(buttons):
            self.dropped += 1
            return self._let_go()
        forward, left = axes[config.axis_forward], axes[config.axis_left]
        if not (math.isfinite(forward) and math.isfinite(left)):
            self.dropped += 1
            return self._let_go()
        forward, left = self._beyond(forward), self._beyond(left)
        held = config.deadman_button < 0 or bool(buttons[config.deadman_button])
        if not held or forward == left == 0.0:
            return self._let_go()
        self._held = True
        return forward * config.max_linear, left * config.max_angular

    def _let_go(self):
        was_held, self._held = self._held, False
        return (0.0, 0.0) if was_held else None

    def _beyond(self, value):
        """What is beyond the dead zone, without a jump at its edge."""
        size = (min(abs(value), 1.0) - self.config.deadzone) / (1.0 - self.config.deadzone)
        return math.copysign(max(size, 0.0), value)
