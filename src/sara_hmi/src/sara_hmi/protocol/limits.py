"""How much may come: a bucket of tokens that fills steadily."""

from __future__ import annotations


class Bucket:
    """Holds `burst` tokens, filled at `rate` (1/s)."""

    def __init__(self, rate: float, burst: float) -> None:
        self._rate, self._burst = rate, burst
        self._held, self._at = burst, None

    def take(self, t: float) -> bool:
        """Takes one token at t (s); False where there is none."""
        if self._at is not None:
            self._held = min(self._burst, self._held + max(0.0, t - self._at) * self._rate)
        self._at = t
        if self._held < 1.0:
            return False
        self._held -= 1.0
        return True
