"""Who sleeps in simulated time is woken when that time has come, not by every message of the clock, as rospy does."""

from __future__ import annotations

import threading
from typing import NamedTuple

import rospy
import rospy.timer

CHECK_S = 0.5  # of wall time: how late the end of the node is seen, as in rospy


class Sleep(NamedTuple):
    """From when to when (rospy.Time) somebody sleeps."""

    began: rospy.Time
    until: rospy.Time

    def over(self) -> bool:
        """Whether its time has come, or the clock went back."""
        return not self.began <= rospy.get_rostime() < self.until


class ClockCondition(threading.Condition):
    """What rospy notifies of each new time, having set it; it knows until when each sleeper sleeps."""

    def __init__(self) -> None:
        super().__init__()
        self._sleepers: list[tuple[Sleep, threading.Lock]] = []

    def notifyAll(self) -> None:  # noqa: N802 - rospy's name for it
        """Wake who waits for any new time, and the sleepers whose time has come."""
        self.notify_all()
        for sleep, alarm in self._sleepers:
            if alarm.locked() and sleep.over():
                alarm.release()

    def sleep(self, sleep: Sleep) -> None:
        """Wait until it is over, CHECK_S at most."""
        alarm = threading.Lock()
        alarm.acquire()
        with self:  # no new time is told meanwhile: it is either seen here or wakes
            if sleep.over():
                return
            self._sleepers.append((sleep, alarm))
        alarm.acquire(timeout=CHECK_S)
        with self:
            self._sleepers = [sleeper for sleeper in self._sleepers if sleeper[1] is not alarm]


def wake_when_due() -> None:
    """Make rospy.sleep, Rate and Timer of this process sleep so; called before rospy.init_node."""
    if isinstance(rospy.rostime.get_rostime_cond(), ClockCondition):
        return
    clock, as_rospy = ClockCondition(), rospy.sleep

    def sleep(duration: rospy.Duration | float) -> None:
        """rospy.sleep: seconds of ROS time; raise what it raises when the clock goes back or the node ends."""
        began = rospy.get_rostime()
        if rospy.rostime.is_wallclock() or not began:
            return as_rospy(duration)
        if not hasattr(duration, 'to_nsec'):
            duration = rospy.Duration.from_sec(duration)
        asleep = Sleep(began, began + duration)
        while not (asleep.over() or rospy.is_shutdown()):
            clock.sleep(asleep)
        if rospy.get_rostime() < began:
            raise rospy.exceptions.ROSTimeMovedBackwardsException((began - rospy.get_rostime()).to_sec())
        if rospy.is_shutdown():
            raise rospy.exceptions.ROSInterruptException('ROS shutdown request')

    rospy.rostime._rostime_cond = clock
    rospy.sleep = rospy.timer.sleep = sleep
