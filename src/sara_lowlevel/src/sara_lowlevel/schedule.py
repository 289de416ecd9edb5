"""Turns and slots of the nodes: what is due when, by the time and not by the number of calls.

The sensor node's cycle is two turns of 100 ms, each of ten 10 ms slots (thesis 2.6). Each turn triggers its sonars in
its first slot and reads them from 70 ms later on (an SRF02 needs 66 ms). At most one frame goes out in a slot: RANGES_1
in slot 10, RANGES_2 in slot 0 of the next cycle, the IMU's four in the last four slots of every IMU period, the rates
last, so that they are the freshest. The fast mode repeats the IMU's slots every 50 ms and leaves slots 0, 5, 10, 15
free: for the ranges, and on a bus that has it the magnetometer's frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import floor

SLOTS, SLOT_S = 20, 0.01
TRIGGER_SLOTS = (0, 10)  # of the turns
# The first slot in which a turn is read; what still ranges is asked again in the two slots after it.
READ_SLOTS = (7, 17)
READ_TRIES = 3
RANGE_FRAME_SLOTS = {10: 'RANGES_1', 0: 'RANGES_2'}
COMPASS_SLOTS = {5: 'COMPASS', 15: 'COMPASS'}
IMU_FRAMES = ('MADGWICK', 'COMPLEMENTARY', 'RANGE_ACCEL', 'IMPACT_GYRO')

# Times are sums of binary fractions: a duty due at 0.3 s must not slip to the next call for a rounding error.
TIME_TOLERANCE_S = 1e-6
# How much of a slot a call may come before it.
EARLY_SLOTS = 0.25


def frame_slots(imu_period: float, madgwick: bool = True, compass: bool = False) -> dict[int, str]:
    """{slot: message} of one cycle. `imu_period`: s, 0.2 or 0.05."""
    slots = {**RANGE_FRAME_SLOTS, **(COMPASS_SLOTS if compass else {})}
    period = round(imu_period / SLOT_S)
    for end in range(period, SLOTS + 1, period):
        for place, name in enumerate(reversed(IMU_FRAMES), 1):
            if name != 'MADGWICK' or madgwick:
                slots[end - place] = name
    return slots


class Cycle:
    """Which duties are due in a cycle of `SLOTS` slots that began with the first call. `missed`: slots that were not
    called in time.
    """

    def __init__(self, duties: Mapping[int, Iterable]) -> None:
        """`duties`: {slot: duties in their order}."""
        self._duties = [tuple(duties.get(slot, ())) for slot in range(SLOTS)]
        self._start: float | None = None
        self._index = 0
        self.missed = 0

    def advance(self, t: float) -> list | None:
        """The duties of the slots since the last call, oldest first; None when the slot of `t` (s) has been served
        already.

        A call up to 2.5 ms early or 7.5 ms late serves its own slot (loops are late more often than early). A later one
        serves the missed slots too, but no more than a cycle of them; the phase stays where it was. A clock that went
        back begins a new cycle.
        """
        if self._start is None:
            self._start = t
            return self._duties[0]
        index = floor((t - self._start) / SLOT_S + EARLY_SLOTS)
        late = index - self._index - 1
        if late == 0:
            self._index = index
            return self._duties[index % SLOTS]
        if late == -1:
            return None
        if late < 0:
            self._start, self._index = t, 0
            return self._duties[0]
        self.missed += late
        first = max(self._index + 1, index - SLOTS + 1)
        self._index = index
        return tuple(duty for slot in range(first, index + 1) for duty in self._duties[slot % SLOTS])


class Every:
    """Says when a duty with a fixed period is due, starting at the first call."""

    def __init__(self, period: float) -> None:
        """`period`: seconds, positive."""
        self.period = period
        self._next: float | None = None

    def due(self, t: float) -> bool:
        """True once per period. `t`: seconds. After a gap longer than a period the missed turns are dropped."""
        if self._next is None:
            self._next = t
        if t < self._next - TIME_TOLERANCE_S:
            return False
        self._next += self.period
        if self._next <= t:
            self._next = t + self.period
        return True
