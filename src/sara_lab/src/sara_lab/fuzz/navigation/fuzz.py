"""Goals, maps, sensor messages and cancels at random against move_base: a clear refusal each, no crash, no motion
without a valid goal.

A robot that obeys is driven through a small house (fuzz_world.py) and meanwhile given whatever comes (fuzz_inputs.py);
after each input the machine makes a step, and what it commands is judged (fuzz_trial.py).
"""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import TYPE_CHECKING

from sara_lab.fuzz.navigation.fuzz_inputs import choose
from sara_lab.fuzz.navigation.fuzz_trial import ZERO, FuzzFailure, Trial

if TYPE_CHECKING:
    from sara_nav.goals.move_base_config import StepResult

INPUTS_PER_MACHINE = 400


def fuzz_move_base(count: int, seed: int, on_result: Callable[[StepResult], None] | None = None) -> dict[str, int]:
    """Give ``count`` random inputs to machines; return {what came of them: how often}.

    on_result: called with each StepResult. Raises FuzzFailure, or whatever the machine raised. The same seed gives the
    same inputs and results.
    """
    chance = random.Random(seed)
    tally = {}
    trial = None
    for number in range(count):
        if number % INPUTS_PER_MACHINE == 0:
            trial = Trial(chance, tally)
        kind = choose(trial, chance)
        try:
            kind(trial, chance)
            result = trial.step()
        except FuzzFailure as failure:
            raise FuzzFailure(f'seed {seed}, input {number} ({kind.__name__}): {failure}') from None
        trial.count(result.status)
        if result.command != ZERO:
            trial.count('moving while ' + result.phase)
        if on_result:
            on_result(result)
    return tally
