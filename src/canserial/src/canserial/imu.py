"""Yaw from the calibrated yaw rate, over the real time between frames.

The rate is corrected first, k (gz - offset) (thesis 3.3 and table 4.11), and that corrected rate is both integrated and
given out; so a yaw that is set from outside is not scaled by k. A frame holds the mean rate of the turn that ended with it,
hence yaw grows by rate x dt exactly; what a lost frame would have said is taken as the mean of its neighbours.
"""

import math
from collections import deque

HISTORY = 64  # frames kept so that a yaw given for a past moment can be carried to now: 12.8 s


def wrap(angle):
    """The angle in [-pi, pi], rad."""
    return math.remainder(angle, math.tau)


class YawIntegrator:
    """Integrates a yaw rate; set() gives the yaw at a moment, past or present."""

    def __init__(self, period, max_gap, yaw=0.0):
        self.period = period
        self.max_gap = max_gap
        self.yaw = wrap(yaw)
        self.gaps = 0
        self._stamp = None
        self._rate = 0.0
        self._set_at = -math.inf
        self._history = deque(maxlen=HISTORY)

    def add(self, stamp, rate):
        """Take the mean rate (rad/s) of the turn that ends at stamp (s).

        Returns False, and leaves yaw alone, if the frame is not newer than the last one or than the last set().
        A clock that went back by more than max_gap is a new beginning: nothing is integrated over the jump.
        """
        if self._stamp is None or stamp < self._stamp - self.max_gap:
            if self._stamp is not None:
                self._set_at = -math.inf
                self._history.clear()
            self._remember(stamp, rate)
            return True
        if stamp <= self._stamp:
            return False
        if stamp <= self._set_at:
            self._stamp, self._rate = stamp, rate
            return False
        since = max(self._stamp, self._set_at)
        dt = stamp - since
        lost = max(0.0, dt - self.period) if stamp - self._stamp > 1.5 * self.period else 0.0
        self.gaps += lost > 0.0
        self.yaw = wrap(self.yaw + rate * (dt - lost) + 0.5 * (rate + self._rate) * lost)
        self._remember(stamp, rate)
        return True

    def set(self, yaw, stamp):
        """The yaw was `yaw` (rad) at `stamp` (s): what was turned since then is kept, and older frames are ignored."""
        turned = 0.0
        if self._history and stamp < self._history[-1][0]:
            turned = wrap(self._history[-1][1] - self._yaw_at(stamp))
        else:
            self._set_at = stamp
        shift = wrap(yaw + turned - self.yaw)
        self.yaw = wrap(yaw + turned)
        self._history = deque(((t, wrap(y + shift)) for t, y in self._history), maxlen=HISTORY)

    def _remember(self, stamp, rate):
        self._stamp, self._rate = stamp, rate
        self._history.append((stamp, self.yaw))

    def _yaw_at(self, stamp):
        """Between the frames yaw is interpolated; before the oldest kept, the oldest is the best there is."""
        later = self._history[-1]
        for earlier in reversed(self._history):
            if earlier[0] <= stamp:
                if later[0] == earlier[0]:
                    return earlier[1]
                part = (stamp - earlier[0]) / (later[0] - earlier[0])
                return wrap(earlier[1] + part * wrap(later[1] - earlier[1]))
            later = earlier
        return later[1]
