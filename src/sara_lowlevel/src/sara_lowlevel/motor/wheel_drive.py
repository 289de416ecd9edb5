"""Two wheels behind an AX3500: wheel speeds wanted in, bytes for the port out, encoder counts of one instant back.

Whatever goes wrong stops both wheels: no answers, old counts, a wheel that stalls or runs the wrong way. They turn
again only after the target has been zero.
"""

from __future__ import annotations

from collections import Counter
from math import tau

from sara_lowlevel.config import AmplifierConfig, SpeedLoopConfig
from sara_lowlevel.motor.ax3500 import Ax3500, Count
from sara_lowlevel.motor.speed_loop import SpeedLoop


class WheelDrive:
    """`fault`: '' or why the wheels stand. `counts`: faults by kind. `amplifier`, `right`, `left`: the parts."""

    def __init__(self, amplifier: AmplifierConfig = AmplifierConfig(), loop: SpeedLoopConfig | None = None) -> None:
        self.amplifier = Ax3500(amplifier)
        loop = loop or SpeedLoopConfig.of()
        self.right, self.left = SpeedLoop(loop), SpeedLoop(loop)
        self.fault = ''
        self.counts: Counter = Counter()
        self._seen: dict[SpeedLoop, Count | None] = {self.right: None, self.left: None}
        self._was_fresh = False

    def update(self, t: float, target: tuple[float, float], received: bytes = b'') -> bytes:
        """`t`: s; `target`: (right, left) rad/s; `received`: from the port since the last call. Returns what to write
        to the port.
        """
        amplifier = self.amplifier
        amplifier.feed(received, t)
        fresh = amplifier.fresh(t)
        if fresh:
            for loop, count, wanted in (
                (self.right, amplifier.right, target[0]),
                (self.left, amplifier.left, target[1]),
            ):
                if count is not self._seen[loop]:
                    self._seen[loop] = count
                    loop.update(count.steps, count.t, wanted, allowed=not self.fault)
        else:
            self.right.reset()
            self.left.reset()
        self._judge(fresh, target)
        if self.fault:
            amplifier.drive(0.0, 0.0)
        else:
            amplifier.drive(self.right.output, self.left.output)
        return amplifier.poll(t)

    def steps(self, t: float) -> tuple[int, int, float] | None:
        """(right, left, when): the counts at the instant of the newer one, s; None when they are old.

        The controller is asked for one counter after the other; the older is carried on by its wheel's speed over that
        one exchange.
        """
        amplifier = self.amplifier
        if not amplifier.fresh(t):
            return None
        when = max(amplifier.right.t, amplifier.left.t)
        return self._at(self.right, amplifier.right, when), self._at(self.left, amplifier.left, when), when

    def _at(self, loop: SpeedLoop, count: Count, when: float) -> int:
        return count.steps + round(loop.speed * (when - count.t) * loop.config.steps_per_turn / tau)

    def _judge(self, fresh: bool, target: tuple[float, float]) -> None:
        found = '' if fresh else 'the motor controller does not answer'
        for side, loop in (('right', self.right), ('left', self.left)):
            if loop.fault:
                found = found or f'the {side} wheel is {loop.fault}'
        if found and found != self.fault:
            if fresh or self._was_fresh:
                self.counts[found] += 1
            self.fault = found
        elif not found and target == (0.0, 0.0):
            self.fault = ''
        self._was_fresh = self._was_fresh or fresh
