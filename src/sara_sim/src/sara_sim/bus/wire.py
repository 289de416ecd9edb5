"""The chair's bus as far as the PC: frames arrive late, or never, and faults may happen to them on the way."""

from __future__ import annotations

import heapq
from collections import Counter

import numpy as np

from canserial.frame import Frame

_BLOCK = 256


class Wire:
    """Two queues. `plugged`: False while the adapter is pulled out. `faults`: [(faults.FrameFault, identifiers or None,
    Generator)].
    """

    def __init__(self, random: np.random.Generator, jitter: float, loss: float):
        """`jitter`: s, uniform from 0. `loss`: fraction."""
        self.plugged = True
        self.faults: list[tuple] = []
        self.counts: Counter = Counter()
        self.log = None
        self._random, self._jitter, self._loss = random, jitter, loss
        self._luck: list = []
        self._order = 0
        self._to_pc: list = []
        self._from_pc: list = []

    def send(self, frame: Frame, now: float) -> None:
        """A frame of one of the chair's nodes sets out for the PC."""
        self._carry(self._to_pc, frame, now, 'to_pc')

    def receive(self, frame: Frame, now: float) -> None:
        """A frame of the PC sets out for the nodes."""
        self._carry(self._from_pc, frame, now, 'from_pc')

    def to_nodes(self, now: float) -> list[Frame]:
        """The PC's frames that reach the nodes by `now`."""
        queue, arrived = self._from_pc, []
        while queue and queue[0][0] <= now:
            arrived.append(heapq.heappop(queue)[2])
        return arrived

    def to_pc(self, now: float) -> list[Frame]:
        """The frames that reach the PC by `now`, in order, each with its time (s)."""
        queue, arrived = self._to_pc, []
        while queue and queue[0][0] <= now:
            when, _, frame = heapq.heappop(queue)
            if not self.plugged:
                self.counts['frames lost, unplugged'] += 1
                continue
            arrived.append(Frame(frame.id, frame.data, when, frame.extended))
            if self.log:
                self.log.write(frame, when)
        return arrived

    def _carry(self, queue: list, frame: Frame, now: float, direction: str) -> None:
        # Drawn whatever becomes of the frame: a fault must not change the luck of the frames it spares.
        if not self._luck:
            self._luck = self._random.random(2 * _BLOCK).tolist()
        loss, delay = self._luck.pop(), self._luck.pop()
        if loss < self._loss:
            self.counts['frames lost'] += 1
            return
        if not self.plugged and direction == 'from_pc':
            self.counts['frames lost, unplugged'] += 1
            return
        late = delay * self._jitter
        if not (self.faults or self.log):
            self._order += 1
            heapq.heappush(queue, (now + late, self._order, frame))
            return
        copies = [(frame, late)]
        for fault, identifiers, random in self.faults:
            if fault.direction in (direction, 'both') and (identifiers is None or frame.id in identifiers):
                copies = [changed for copy in copies for changed in self._happen(fault, random, *copy)]
        for copy, late in copies:
            self._set_out(queue, copy, now, late, direction)

    def _set_out(self, queue: list, frame: Frame, now: float, late: float, direction: str) -> None:
        self._order += 1
        heapq.heappush(queue, (now + late, self._order, frame))
        if self.log and direction == 'from_pc':
            self.log.write(frame, now)

    def _happen(self, fault, random: np.random.Generator, frame: Frame, delay: float) -> list[tuple[Frame, float]]:
        """What one faults.FrameFault makes of one frame."""
        from sara_sim.faults.faults import FramesCorrupted, FramesDelayed, FramesDropped, FramesDuplicated

        if random.random() >= fault.probability:
            return [(frame, delay)]
        self.counts[fault.name] += 1
        if isinstance(fault, FramesDropped):
            return []
        if isinstance(fault, FramesDelayed):
            return [(frame, delay + fault.delay)]
        if isinstance(fault, FramesDuplicated):
            return [(frame, delay), (frame, delay)]
        assert isinstance(fault, FramesCorrupted)
        total = 8 * len(frame.data)
        bits = int.from_bytes(frame.data, 'big')
        for bit in random.choice(total, min(fault.bits, total), replace=False) if total else ():
            bits ^= 1 << int(bit)
        return [(Frame(frame.id, bits.to_bytes(len(frame.data), 'big'), frame.time, frame.extended), delay)]


class CandumpLog:
    """A file in the format of `candump -l`: what passes the PC's adapter, both ways."""

    def __init__(self, path, channel: str = 'can0'):
        """`path`: file to (over)write. Raises OSError."""
        self._file = open(path, 'w', encoding='ascii')  # noqa: SIM115, closed by `close`
        self._channel = channel

    def write(self, frame: Frame, when: float) -> None:
        """One line. `when`: s."""
        identifier = f'{frame.id:08X}' if frame.extended else f'{frame.id:03X}'
        self._file.write(f'({when:.6f}) {self._channel} {identifier}#{frame.data.hex().upper()}\n')

    def close(self) -> None:
        """Write out what is left."""
        self._file.close()
