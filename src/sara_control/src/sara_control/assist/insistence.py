"""The rider wins: who presses override, or holds the stick fully against a correction, is left alone."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sara_control.assist.assist_config import AssistConfig


ASIDE = 0.85
"""Of full deflection, from which on a stick is held to a side."""


class Insistence:
    """config: AssistConfig. Times in s on one clock."""

    def __init__(self, config: AssistConfig) -> None:
        self.config = config
        self._until = -math.inf
        self._since = None  # s: fully deflected against a correction from then on
        self._against: float | None = None
        self._alone = False

    def override(self, t: float, on: bool) -> None:
        """Pressed: no help for override_time from t on; or help again."""
        self._until = t + self.config.override_time if on else -math.inf
        self._alone = self._alone and on

    def override_left(self, t: float) -> float:
        """s that an override still lasts at t; 0 where there is none, or the clock was set back before it."""
        return self._until - t if t < self._until <= t + self.config.override_time else 0.0

    def corrected(self, side: float | None) -> None:
        """To which side the last command was corrected: 1 to the left, -1 to the right, 0 where it was stopped; None
        where it was not.
        """
        self._against = side

    def let_go(self) -> None:
        """The stick is centred: what it insisted on is over."""
        self._since, self._against, self._alone = None, None, False

    def alone(self, t: float, v: float, w: float) -> bool:
        """Whether a rider who asks for (v m/s, w rad/s) at t is to be left alone."""
        if self.override_left(t) > 0.0:
            return True
        if self._alone:
            return True
        if not self._insists(v, w):
            self._since = None
            return False
        if self._since is None or t < self._since:
            self._since = t
        self._alone = t - self._since >= self.config.insist_time
        return self._alone

    def _insists(self, v, w):
        """Whether the stick is fully deflected, and to the other side than the correction's."""
        forward, left = v / self.config.max_linear, w / self.config.max_angular
        if self._against is None or math.hypot(forward, left) < self.config.insist:
            return False
        return self._against == 0.0 or -self._against * left >= ASIDE
