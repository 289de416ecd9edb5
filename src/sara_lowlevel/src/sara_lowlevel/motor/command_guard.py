"""Which wheel commands the motor node believes: what was damaged on its way is not obeyed.

A PC changes a wheel's speed no faster than the safety gate brakes hard, and sets off by one step of the resolution, for
the gate's jerk is limited; both grow with the frames that were lost. All else is a jump, and obeyed only where
JUMP_FRAMES frames in a row say the same, as they do after an outage or from a PC without a safety gate. So is a start
from rest within DOUBT_S of a damaged frame, for it might be of one step alone. A stop is no jump.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sara_lowlevel.config import MotorConfig

JUMP_FRAMES = 5
DOUBT_S = 1.0
STANDS = (0.0, 0.0)


class Command(NamedTuple):
    """Wheel speeds (right, left; rad/s) and when (s) they were received."""

    wheels: tuple[float, float]
    t: float


class CommandGuard:
    """Follows the commands. `resolution`: rad/s, of a wheel's speed in a frame."""

    def __init__(self, config: MotorConfig, resolution: float) -> None:
        self.config = config
        self._step = 1.5 * resolution  # a step more or less, as the PC carries the rest over, and no two
        self._doubt_until = -math.inf
        self._known: list[Command] = []  # the last one obeyed, and where that is a stop, one just before it
        self._jump, self._agreed = None, 0

    def forget(self) -> None:
        """The wheels are not the PC's any more."""
        self._known, self._jump = [], None

    def damaged(self, t: float) -> None:
        """A frame that cannot be the PC's was received at t (s)."""
        self._doubt_until = t + DOUBT_S

    def stop(self, t: float) -> None:
        """The wheels stop at t (s)."""
        recent = t - 2.5 * self.config.command_period
        moving = [known for known in self._known if known.wheels != STANDS and known.t >= recent]
        self._known = [Command(STANDS, t), *moving]
        self._jump, self._agreed = None, 0

    def believes(self, wheels: tuple[float, float], t: float) -> bool:
        """Whether speeds (right, left; rad/s) received at t (s) are to be obeyed; if so, the next ones follow them."""
        new = Command(wheels, t)
        if wheels == STANDS:
            self.stop(t)
            return True
        if not any(self._follows(known, new) for known in self._known):
            self._agreed = self._agreed + 1 if self._jump is not None and self._follows(self._jump, new) else 1
            self._jump = new
            if self._agreed < JUMP_FRAMES:
                return False
        self._known, self._jump, self._agreed = [new], None, 0
        return True

    def _follows(self, old: Command, new: Command) -> bool:
        """Whether the PC may say `new` after `old`, the frames between them lost."""
        config, elapsed = self.config, new.t - old.t
        if elapsed > config.command_timeout:
            return False
        if old.wheels == STANDS and new.t < self._doubt_until:
            return False
        period = config.command_period
        grows = max(elapsed - 1.5 * period, 0.0) if old.wheels == STANDS else elapsed + period
        reach = self._step + config.wheel_acceleration * grows
        return all(abs(speed - before) <= reach for speed, before in zip(new.wheels, old.wheels))
