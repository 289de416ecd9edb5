"""Whether the clock has gone back: a simulation that begins anew, or a computer whose time is set."""

from __future__ import annotations

import threading
from collections.abc import Callable

import rospy


class Clock:
    """The newest time that was asked for, by any thread: rospy calls a subscriber from one for each publisher. now:
    returns the rospy.Time.
    """

    def __init__(self, now: Callable[[], rospy.Time] = rospy.Time.now) -> None:
        self._lock, self._newest, self._now = threading.Lock(), rospy.Time(), now

    def went_back(self) -> float:
        """By how many s the time is before the newest one so far, 0 if it is not; it is the newest one from now on."""
        with self._lock:
            now = self._now()
            back, self._newest = (self._newest - now).to_sec(), now
        return max(back, 0.0)
