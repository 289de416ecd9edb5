"""An encoder that stands still although its wheel must turn: found by the command, and sooner where the other wheel
turns.

The command passes a first-order lag (as the motors do) and is summed up while a wheel's positions do not follow; once
that makes a way no wheel can have missed, the wheel is called frozen. Where only one stands still, the other one bears
witness and half the way is enough. A wheel blocked by a wall looks the same, and the answer to it is the same: stop.
"""

import math
from functools import cache

from ahead_of_time import kernel

LAG = 0.15  # s; a little more than the motors have
SLOWEST = 0.1  # rad/s; below it friction may hold a wheel
FOLLOWING = 0.1  # a wheel that makes less than this share of its way does not follow


class WheelWatch:
    """distance: m of rim that a wheel may miss while the other one turns (twice that when both stand still). radii: of
    the left and the right wheel, m. hold: a command counts for so long (s), unless another one follows.

    Commands and positions come with their times (s, one clock): between two readings a wheel is expected to make the
    way that was commanded between them, however the cycles that command and read follow each other.

    `frozen`: names of the wheels ('left', 'right') that do not follow; kept until `reset`.
    `missed`: (left, right), m, the way that was commanded to frozen wheels so far.
    """

    def __init__(self, distance: float, radii: tuple, hold: float = 0.1) -> None:
        self.distance = distance
        self.hold = hold
        self.radii = tuple(map(float, radii))
        warm()
        self.reset()

    def reset(self) -> None:
        """Nothing is known: wait for motion anew."""
        self.frozen = ()
        self.missed = (0.0, 0.0)
        self._idle = [0.0, 0.0]
        self._speed = self._expected = (0.0, 0.0)
        self._positions = None
        self._command, self._counted_to, self._holds_to = (0.0, 0.0), 0.0, 0.0

    def on_command(self, left: float, right: float, t: float) -> None:
        """From t (s) on the wheels are to turn at these speeds (rad/s)."""
        self._count(t)
        self._command, self._counted_to, self._holds_to = (float(left), float(right)), t, t + self.hold

    def _count(self, t):
        """Adds the way that was commanded until t (s)."""
        until = min(t, self._holds_to)
        dt = until - self._counted_to
        if dt > 0.0:
            self._speed, self._expected = expected(self._speed, self._expected, self._command, self.radii, dt)
            self._counted_to = until

    def on_wheels(self, left: float, right: float, t: float) -> bool:
        """Wheel positions (rad) at t (s). True when this reading made a wheel be called frozen."""
        self._count(t)
        before, self._positions = self._positions, (left, right)
        expected, self._expected = self._expected, (0.0, 0.0)
        if self.frozen:
            self.missed = tuple(
                missed + way * (name in self.frozen)
                for missed, way, name in zip(self.missed, expected, ('left', 'right'))
            )
        if before is None or self.frozen:
            return False
        following = []
        for index in (0, 1):
            moved = abs(self._positions[index] - before[index]) * self.radii[index]
            following.append(moved > FOLLOWING * expected[index] and expected[index] > 0.0)
            # What is not expected to move neither proves nor disproves anything.
            if following[index]:
                self._idle[index] = 0.0
            else:
                self._idle[index] += expected[index]
        still = tuple(
            name
            for index, name in enumerate(('left', 'right'))
            if self._idle[index] > 0.0 and self._idle[index] >= self.distance * (1.0 if following[1 - index] else 2.0)
        )
        if still:
            self.frozen = still
            self.missed = tuple(way * (name in still) for way, name in zip(self._idle, ('left', 'right')))
        return bool(still)


@kernel
def expected(
    speeds: tuple[float, float],
    ways: tuple[float, float],
    commands: tuple[float, float],
    radii: tuple[float, float],
    dt: float,
) -> tuple[tuple[float, float], tuple[float, float]]:
    """(speeds, rad/s, and ways, m of rim, that (left, right) wheels are expected to have) after dt (s) of these
    commands (rad/s); radii: m.
    """
    gain = 1.0 - math.exp(-dt / LAG)
    left, left_way = _wheel(speeds[0], ways[0], commands[0], radii[0], gain, dt)
    right, right_way = _wheel(speeds[1], ways[1], commands[1], radii[1], gain, dt)
    return (left, right), (left_way, right_way)


@kernel
def _wheel(speed, way, command, radius, gain, dt):
    speed = speed + (command - speed) * gain
    # Neither what the wheel did before the command nor what it has not come to yet: the smaller of the two.
    if speed * command > 0.0:
        held = min(abs(speed), abs(command))
        if held >= SLOWEST:
            way += held * dt * radius
    return speed, way


@cache
def warm() -> None:
    """Compile, or load from the cache, the kernel for the types it is called with."""
    expected((0.0, 0.0), (0.0, 0.0), (1.0, 1.0), (0.1, 0.1), 0.02)
