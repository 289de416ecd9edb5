"""Where the chair was in the last seconds, by its wheels' way and its turn rate: in this frame scans are remembered.

It begins anywhere and drifts by a per cent of what is driven, which matters little for seconds. Where wheels or turn
rate were silent for long, nothing is known of the way between, and it says so.
"""

import math
from bisect import bisect_left
from collections import deque

from sara_common.planar import advanced, between

LONGEST_GAP = 0.5  # s without wheels or turn rate: how the chair moved meanwhile is not known
KEPT = 1.0  # s of past poses


class Reckoning:
    """Poses are (x, y, yaw), m, rad. `breaks`: how often the way was lost."""

    def __init__(self) -> None:
        self.breaks = 0
        self._past = deque()  # (t, x, y, yaw) of the last KEPT seconds
        self._pose = 0.0, 0.0, 0.0
        self._speed = self._rate = 0.0  # m/s, rad/s
        self._ahead = 0.0  # m, reckoned since the last way
        self._way = self._wheels_at = self._turn_at = None

    def on_way(self, stamp: float, way: float) -> None:
        """The wheels' mean has rolled `way` (m, from anywhere) until stamp (s)."""
        known = self._advance(stamp)
        if known and self._way is not None and 0.0 < stamp - self._wheels_at <= LONGEST_GAP:
            moved = way - self._way
            x, y, yaw = self._pose
            self._pose = x + (moved - self._ahead) * math.cos(yaw), y + (moved - self._ahead) * math.sin(yaw), yaw
            self._speed = moved / (stamp - self._wheels_at)
            self._past[-1] = self._past[-1][0], *self._pose
        else:
            self._speed = 0.0
        self._way, self._wheels_at, self._ahead = way, stamp, 0.0

    def on_turn(self, stamp: float, rate: float) -> None:
        """The chair turns at a rate (rad/s), measured at stamp (s)."""
        self._advance(stamp)
        self._rate, self._turn_at = rate, stamp

    def at(self, t: float, now: float) -> tuple[float, float, float] | None:
        """The pose at t (s), not later than now and not long ago; None if the way until then is not known."""
        self._advance(now)
        if not self._known(now) or not self._past or not self._past[0][0] <= t <= now:
            return None
        after = bisect_left(self._past, t, key=lambda entry: entry[0])
        if after == 0:
            return self._past[0][1:]
        (before, *a), (then, *b) = self._past[after - 1], self._past[after]
        return between(a, b, (t - before) / (then - before))

    def _known(self, t):
        return all(at is not None and t - at <= LONGEST_GAP for at in (self._wheels_at, self._turn_at))

    def _advance(self, t):
        """Go on to t (s); False where the way until then was lost, and everything begins anew."""
        last = self._past[-1][0] if self._past else None
        if last is not None and (t < last - LONGEST_GAP or t > last + LONGEST_GAP or not self._still_known(t)):
            self._past.clear()
            self._way, self._speed, self._ahead = None, 0.0, 0.0
            self.breaks += 1
            last = None
        if last is not None and t > last:
            self._pose = advanced(*self._pose, self._speed, self._rate, t - last)
            self._ahead += self._speed * (t - last)
        if last is None or t > last:
            self._past.append((t, *self._pose))
        while self._past[0][0] < t - KEPT:
            self._past.popleft()
        return last is not None

    def _still_known(self, t):
        """Whether what has once come has not been silent for long."""
        return all(at is None or t - at <= LONGEST_GAP for at in (self._wheels_at, self._turn_at))
