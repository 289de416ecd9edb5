"""How well a control cycle is kept: cycles that came late, and how long the work of one takes."""


class CycleWatch:
    """Told when each cycle begins and how long its work took; all times in s.

    ``missed``: how many cycles came more than half a period late since the start.
    """

    def __init__(self):
        self.missed = 0
        self._last = None
        self._worst = self._longest_work = self._work = 0.0
        self._cycles = 0

    def begins(self, t: float, frequency: float, matters: bool) -> str:
        """A cycle begins at t; return '' or the sentence that it came late. matters: False while nothing is driven."""
        last, self._last = self._last, t
        if last is None or not matters:
            return ''
        taken = t - last
        self._worst = max(self._worst, taken)
        if taken <= 1.5 / frequency:
            return ''
        self.missed += 1
        return (
            f'Control loop missed its desired rate of {frequency:.4f}Hz... the loop actually took {taken:.4f} seconds'
        )

    def worked(self, taken: float) -> None:
        """The work of a cycle took so long."""
        self._longest_work = max(self._longest_work, taken)
        self._work += taken
        self._cycles += 1

    def forget(self) -> None:
        """Time went back: the next cycle is the first."""
        self._last = None

    def values(self) -> dict[str, int | str]:
        """Return what there is to report since the last call, by name."""
        result = {
            'missed_cycles': self.missed,
            'worst_cycle_s': f'{self._worst:.3f}',
            'mean_work_s': '%.4f' % (self._work / max(self._cycles, 1)),
            'longest_work_s': f'{self._longest_work:.4f}',
        }
        self._worst = self._longest_work = self._work = 0.0
        self._cycles = 0
        return result
