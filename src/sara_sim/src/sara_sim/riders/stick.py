"""What a rider holds, and what every rider is."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol


class Stick(NamedTuple):
    """How far a stick is deflected, -1..1 each, as the axes of sensor_msgs/Joy: to the left, forward."""

    left: float
    forward: float

    @classmethod
    def within(cls, left: float, forward: float) -> Stick:
        """The Stick that is pushed no further than it goes."""
        return cls(min(max(left, -1.0), 1.0), min(max(forward, -1.0), 1.0))


CENTRED = Stick(0.0, 0.0)


class Delayed:
    """Values as they were some time ago. delay: s."""

    def __init__(self, delay: float) -> None:
        self._delay, self._values = delay, deque()

    def pass_on(self, t: float, value: Any, until_then: Any) -> Any:
        """Take a value of t (s, never less than before); returns the one of `delay` s ago, or `until_then` where there
        was none yet.
        """
        values, past = self._values, t - self._delay + 1e-9
        values.append((t, value))
        while len(values) > 1 and values[1][0] <= past:
            values.popleft()
        return values[0][1] if values[0][0] <= past else until_then


class Rider(Protocol):
    """Steers by what is seen. `arrived`: whether the rider is where they wanted to go."""

    arrived: bool

    def stick(self, t: float, pose: Sequence[float]) -> Stick:
        """The Stick at t (s, never less than before) while the chair is at pose (x, y, yaw; m, rad, map frame)."""
