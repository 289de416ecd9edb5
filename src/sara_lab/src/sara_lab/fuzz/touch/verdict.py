"""What a robot heard while a page that drove it failed, and whether it was right."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple


class Limits(NamedTuple):
    """age: s, of a command's frame when the command is published; zero: s, from the first publication of the last
    command to the zero.
    """

    age: float = 0.2
    zero: float = 0.15


class Trial(NamedTuple):
    """sent: {speed: when its frame was sent}. heard: [(when, speed)], in order. fault: when the page failed. All in m/s
    and s, on one clock.
    """

    sent: Mapping[float, float]
    heard: Sequence[tuple[float, float]]
    fault: float

    @property
    def disturbed(self) -> bool:
        """Whether a zero came before the fault, because the machine paused: then the trial says nothing."""
        return not self.heard or any(t < self.fault and v == 0.0 for t, v in self.heard)

    @property
    def oldest(self) -> float:
        """The greatest age of a command's frame at its publication, s; infinite where no frame asked for it."""
        ages = [t - self.sent.get(round(v, 9), -math.inf) for t, v in self.heard if v != 0.0]
        return max(ages, default=0.0)

    @property
    def zero_after(self) -> float:
        """s from the first publication of the last command before the first zero to that zero; infinite without one."""
        first: dict[float, float] = {}
        last = math.inf
        for t, v in self.heard:
            if v == 0.0:
                return max(0.0, t - last) if last < math.inf else math.inf
            last = first.setdefault(v, t)
        return math.inf


def wrongs(trial: Trial, limits: Limits = Limits()) -> list[str]:
    """What is wrong, in sentences; nothing where all is right."""
    found = []
    if trial.oldest > limits.age:
        found.append(f'a command was published whose frame was {1e3 * trial.oldest:.0f} ms old')
    if trial.zero_after > limits.zero:
        late = f'after {1e3 * trial.zero_after:.0f} ms' if trial.zero_after < math.inf else 'never'
        found.append(f'the zero came {late}')
    still = [v == 0.0 for _, v in trial.heard]
    after = still[still.index(True) + 1 :] if True in still else []
    if True in after:
        found.append(f'{1 + sum(after)} zeros were published')
    if False in after:
        found.append(f'{after.count(False)} commands were published after the zero')
    return found
