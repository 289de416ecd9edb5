"""How well move_base keeps its control cycle: cycles that came late, and how long the work of one takes."""
import time

import rospy


class CycleWatch:
    """Call ``begins`` when a cycle begins and ``works`` with its work; read ``values`` once in a while."""

    def __init__(self):
        self.missed = 0
        self._last = None
        self._worst = self._longest_work = self._work = 0.0
        self._cycles = 0

    def begins(self, t, frequency, matters):
        """A cycle begins at t (s of the node's clock). matters: False while nothing is driven, when none is missed."""
        last, self._last = self._last, t
        if last is None or not matters:
            return
        taken = t - last
        self._worst = max(self._worst, taken)
        if taken > 1.5 / frequency:
            self.missed += 1
            rospy.logwarn_throttle(5.0, 'Control loop missed its desired rate of %.4fHz... the loop actually took %.4f seconds',
                                   frequency, taken)

    def works(self, work):
        """Call ``work`` and return what it returns; its duration (wall time) is noted."""
        began = time.perf_counter()
        result = work()
        taken = time.perf_counter() - began
        self._longest_work = max(self._longest_work, taken)
        self._work += taken
        self._cycles += 1
        return result

    def forget(self):
        """Time went back: the next cycle is the first."""
        self._last = None

    def values(self):
        """Return what there is to report since the last call, by name."""
        result = {'missed_cycles': self.missed, 'worst_cycle_s': '%.3f' % self._worst,
                  'mean_work_s': '%.4f' % (self._work / max(self._cycles, 1)),
                  'longest_work_s': '%.4f' % self._longest_work}
        self._worst = self._longest_work = self._work = 0.0
        self._cycles = 0
        return result
