"""The rider wins: who presses override, or holds the stick fully against a correction, is left alone."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sara_control.assist.assist_config import AssistConfig


class Insistence:
    """config: AssistConfig. Times in s on one clock."""

    def __init__(self, config: AssistConfig) -> None:
        self.config = config
        self._until = -math.inf
        self._since = None  # s: fully deflected, and corrected, from then on
        self._corrected = self._alone = False

    def override(self, t: float, on: bool) -> None:
        """Pressed: no help for override_time from t on; or help again."""
        self._until = t + self.config.override_time if on else -math.inf
        self._alone = self._alone and on

    def override_left(self, t: float) -> float:
        """s that an override still lasts at t; 0 where there is none, or the clock was set back before it."""
        return self._until - t if t < self._until <= t + self.config.override_time else 0.0

    def corrected(self, corrected: bool) -> None:
        """Whether the last command went against the rider."""
        self._corrected = corrected

    def let_go(self) -> None:
        """The stick is centred: what it insisted on is over."""
        self._since, self._corrected, self._alone = None, False, False

    def alone(self, t: float, v: float, w: float) -> bool:
        """Whether a rider who asks for (v m/s, w rad/s) at t is to be left alone."""
        if self.override_left(t) > 0.0:
            return True
        if self._alone:
            return True
        c = self.config
        deflected = abs(v) / c.max_linear if v != 0.0 else abs(w) / c.max_angular
        if not (self._corrected and deflected >= c.insist):
            self._since = None
            return False
        if self._since is None or t < self._since:
            self._since = t
        self._alone = t - self._since >= c.insist_time
        return self._alone
