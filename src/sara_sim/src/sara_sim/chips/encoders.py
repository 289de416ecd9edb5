"""The wheels' counters: whole edges, and what faults make of them."""

from __future__ import annotations


class Encoders:
    """`frozen`: names of the wheels whose counter stands. `noise`: [(Generator, wheel, sigma in steps)]."""

    def __init__(self):
        self.frozen: frozenset = frozenset()
        self.noise: list[tuple] = []
        self._true = (0, 0)
        self._missed = [0, 0]

    def read(self, right: int, left: int) -> tuple[int, int]:
        """What the motor node counts when the wheels stand at these edges."""
        if not (self.frozen or self.noise or self._missed[0] or self._missed[1]):
            self._true = (right, left)
            return self._true
        counted = []
        for index, (wheel, true) in enumerate((('right', right), ('left', left))):
            if wheel in self.frozen:
                self._missed[index] += true - self._true[index]
            count = true - self._missed[index]
            for random, which, sigma in self.noise:
                if which in (wheel, 'both'):
                    count += round(float(random.normal(0.0, sigma)))
            counted.append(count)
        self._true = (right, left)
        return counted[0], counted[1]
