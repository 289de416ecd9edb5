"""A function called at a rate of ROS time, in a thread of its own.

As roscpp's Timer, and unlike rospy's, it is due as soon as there is time at all and then at whole periods from that
instant, however coarse the clock is (`rosbag play --clock`): which message reaches which cycle of a filter depends on
it.
"""

from __future__ import annotations

import threading
import time

import rospy
from rospy.rostime import is_wallclock

from sara_localization.geometry.stamps import Stamp


class Cycle:
    """Calls `work(now)` every `period` (s) until the node is shut down, with the ROS time as a Stamp; cycles that were
    missed are not made up for.
    """

    def __init__(self, period: float, work):
        self._period, self._work = rospy.Duration.from_sec(period).to_nsec(), work
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        due = now = None  # ns
        while not rospy.is_shutdown():
            try:
                if due is None:
                    rospy.sleep(0.0)  # until there is time
                    due = now = _now()
                if due - now > self._period:
                    due = now  # the clock went back
                elif due > now:
                    _sleep(due - now)
                    now = _now()
            except rospy.ROSTimeMovedBackwardsException:
                due = now = _now()
            except rospy.ROSInterruptException:
                return
            self._work(Stamp(*divmod(now, 10**9)))
            due += self._period
            now = _now()
            if due < now:
                due = now + self._period


def _now() -> int:
    return time.time_ns() if is_wallclock() else rospy.get_rostime().to_nsec()


def _sleep(duration: int):
    if is_wallclock():
        time.sleep(duration * 1e-9)
    else:
        rospy.sleep(rospy.Duration(*divmod(duration, 10**9)))
