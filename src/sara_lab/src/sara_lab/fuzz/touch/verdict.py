"""What a robot heard while a page that drove it failed, and whether it was right."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from sara_lab.fuzz.touch.rest import Rest

AGAIN = 5  # trials that say nothing, for each one wanted, until the machine is too busy


class Limits(NamedTuple):
    """age: s, of a command's frame when the command is published; zero: s, from the first publication of the last
    command to the zero.
    """

    age: float = 0.2
    zero: float = 0.15


class Times(NamedTuple):
    """s that a page is frozen, and that frames are held."""

    freeze: float = 2.0
    hold: float = 5.0


class Trial(NamedTuple):
    """sent: {speed: when its frame was sent}. heard: [(when, speed)], in order. fault: when the page failed. All in m/s
    and s, on one clock. rest: how the chair came to rest, None where there is no chair.
    """

    sent: Mapping[float, float]
    heard: Sequence[tuple[float, float]]
    fault: float
    rest: Rest | None = None

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
    if trial.rest is not None and trial.rest.wrong:
        found.append(trial.rest.wrong)
    return found


class Result(NamedTuple):
    """Trials of one fault that count, how many did not, and what was wrong: (number of the trial, sentence)."""

    fault: str
    trials: list[Trial]
    disturbed: int
    wrong: list[tuple[int, str]]

    def line(self) -> str:
        """In a sentence."""
        oldest = 1e3 * max(trial.oldest for trial in self.trials)
        zero = 1e3 * np.array([trial.zero_after for trial in self.trials])
        return (
            f'{self.fault}: {len(self.trials)} times, {len({number for number, _ in self.wrong})} wrong; '
            f'oldest command {oldest:.0f} ms; '
            f'zero after {np.median(zero):.0f} ms (median), {zero.max():.0f} ms (most); '
            f'{self._rests()}{self.disturbed} repeated, as the machine paused'
        )

    def _rests(self):
        """How the chair came to rest, "" where there is none."""
        rests = [trial.rest for trial in self.trials if trial.rest is not None]
        if not rests:
            return ''
        speed, took, allowed = np.array(rests).T
        return (
            f'from {abs(speed).min():.2f} to {abs(speed).max():.2f} m/s at rest after {np.median(took):.2f} s '
            f'(median), {took.max():.2f} s (most), at least {(allowed - took).min():.2f} s before the gate must be; '
        )


def repeat(
    fault: str, make: Callable[[int], Trial], count: int, limits: Limits, tick: Callable[[], object] = lambda: None
) -> Result:
    """One fault so many times. make(number): a trial; those that say nothing are made again."""
    result, disturbed, number = Result(fault, [], 0, []), 0, 0
    while len(result.trials) < count:
        made = make(number)
        number += 1
        if made.disturbed:
            disturbed += 1
            if disturbed > AGAIN * count:
                raise RuntimeError(f'{fault}: the machine paused in {disturbed} of {number} drives')
            continue
        result.wrong.extend((number, sentence) for sentence in wrongs(made, limits))
        result.trials.append(made)
        tick()
    return result._replace(disturbed=disturbed)
