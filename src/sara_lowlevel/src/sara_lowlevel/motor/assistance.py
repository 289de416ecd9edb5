"""The mode ASSISTED of the motor node: the rider's stick is a wish, the PC drives with its help, and what it may do.

Only while the switch says ASSISTED, and a PC that helps has asked for control with the stick centred. Three rules do
not rest on the PC:

- The command follows the stick. Within `release_time` after a stick was let go or drawn back, the wheels stand or turn
  its way: otherwise the PC loses control. Once it has stood with the stick centred it may drive by itself, to a goal,
  until the stick is moved.
- Without help nobody drives (`modoPC` OFF). The rider gets the wheels without help (MANUAL) by a push in vain of
  `notice_time`, which tells that the help is gone, and letting go, which agrees to it.
- When the switch is turned the wheels stop, and the stick must be let go before it drives again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from canserial.dbc.modes import ASSISTED, MANUAL, OFF
from sara_lowlevel.config import MotorConfig

LONGEST_GAP_S = 0.2  # a push is counted for at most so long without news of it


class Stick(NamedTuple):
    """mode: `modo`, the switch. sense: 1 forward, -1 backward, 0 neither. deflected: off the centre, any way."""

    mode: int
    sense: int
    deflected: bool


class Assistance:
    """`resolution`: rad/s, of a wheel's speed in a command. `switched`: whether the switch says ASSISTED. Times in s on
    one clock.
    """

    def __init__(self, config: MotorConfig, resolution: float) -> None:
        self.config = config
        self.switched = False
        self._slack = 1.25 * resolution  # of the wheels' mean, by rounding
        self._turned = False  # since then the stick was not centred
        self._pushed_at: float | None = None  # the last news, where that is of a push
        self.begin()

    def on_stick(self, t: float, mode: int, stick: Stick) -> int | None:
        """News of the stick at t, while `mode` is in force: the mode from now on. None: ASSISTED has no say in it."""
        pushed = 0.0 if self._pushed_at is None else min(max(t - self._pushed_at, 0.0), LONGEST_GAP_S)
        self._pushed_at = t if stick.deflected else None
        turned, self.switched = (stick.mode == ASSISTED) != self.switched, stick.mode == ASSISTED
        if turned:
            self._turned, self._in_vain = stick.deflected, 0.0
            return OFF
        if self._turned and stick.deflected:
            return OFF
        self._turned = False
        if not self.switched:
            return None
        if mode == ASSISTED:
            self._heed(t, stick)
        elif mode == OFF:
            self._in_vain += pushed
            return MANUAL if self._in_vain >= self.config.notice_time and not stick.deflected else OFF
        return mode

    def begin(self) -> None:
        """The PC has got control: it stands, and the stick is centred."""
        self._follows = False
        self._in_vain = 0.0  # s
        self._moves = 0  # the sense of the command obeyed last
        self._wished: dict[int, float] = {}  # when the stick last pointed so

    def agrees(self, wheels: tuple[float, float], t: float) -> bool:
        """Whether the PC may command these speeds (right, left; rad/s) at t."""
        mean = 0.5 * sum(wheels)
        sense = 0 if abs(mean) <= self._slack else 1 if mean > 0.0 else -1
        if self._follows and not self._may(wheels, sense, t):
            return False
        if wheels == (0.0, 0.0) and self._pushed_at is None:
            self._follows = False
        self._moves = sense
        return True

    def _may(self, wheels, sense, t):
        if wheels == (0.0, 0.0):
            return True
        asked = max(self._wished.values()) if sense == 0 else self._wished.get(sense, -math.inf)
        return t - asked <= self.config.release_time

    def _heed(self, t, stick):
        if not stick.deflected:
            return
        if not self._follows:
            self._follows, self._wished = True, {self._moves: t}
        self._wished[stick.sense] = t
