"""The whole chair and stack in one process: how many times faster than real time it drives the square."""

import time

from sara_lab.benches.timed import Limit, timed
from sara_lab.experiments.missions import run

DRIVES = 2


def square(drives=DRIVES, clock=time.process_time):
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
