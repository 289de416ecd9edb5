"""How much of a commanded turn rate the base really turns: a chair that slips turns less than it is told to.

Least squares, forgetting, of the measured rate over the command as a base with a first-order lag would answer it.
"""

import math

LAG = 0.15
"""Seconds of lag the base is taken to have; only turns that last longer count much."""
MEMORY = 8.0
"""Seconds after which what was seen counts 1/e."""
LEAST, MOST = 0.5, 1.2


class TurnGain:
    """``value``: measured over commanded turn rate, 1 until turns have been seen."""

    def __init__(self):
        self.value = 1.0
        self._answer = 0.0
        self._seen = self._told = 0.3  # what is believed before anything was seen: (rad/s)^2 s

    def update(self, dt: float, commanded: float, measured: float) -> float:
        """Take note of the rates (rad/s) last commanded and now measured, dt (s) after the last call; return value."""
        self._answer += (1.0 - math.exp(-dt / LAG)) * (commanded - self._answer)
        if abs(self._answer) > 0.05:
            keep = math.exp(-dt / MEMORY)
            self._seen = keep * self._seen + dt * self._answer * measured
            self._told = keep * self._told + dt * self._answer**2
            self.value = min(max(self._seen / self._told, LEAST), MOST)
        return self.value
