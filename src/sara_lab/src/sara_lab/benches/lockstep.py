"""The whole chair and stack in one process: how many times faster than real time it drives the square."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from sara_lab.benches.timed import Limit, timed
from sara_lab.experiments.missions import run

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock, Timed

DRIVES = 2


def square(drives: int = DRIVES, clock: Clock = time.process_time) -> Iterator[Timed]:
    """Drives of seed 0, after one that is not counted."""
    run('square', 0)
    rates = []
    for _ in range(drives):
        begin = clock()
        _, lockstep = run('square', 0)
        rates.append(lockstep.time / (clock() - begin))
    yield timed(
        'lockstep square, whole stack',
        'times real time',
        rates,
        rate=True,
        limit=Limit('median', 150.0),
        text=f"{lockstep.time:.1f} s of the chair's time; CPU time of the process, its start left out",
    )
