"""How long `results` takes to answer a question about 10 000 drives, the start of its process included."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from sara_lab.benches.timed import Limit, timed

if TYPE_CHECKING:
    from sara_lab.benches.timed import Timed

DRIVES, FIGURES, RUNS = 10_000, 100, 5
QUESTION = 'school, fused, contacts by seed'


def question(drives: int = DRIVES, runs: int = RUNS) -> Iterator[Timed]:
    """The question about made rows, as many times, after one that is not counted."""
    with tempfile.TemporaryDirectory(prefix='sara_results_') as folder:
        # By another process: what this one holds at its most, the processes that it starts are counted as holding.
        made = multiprocessing.get_context('fork').Process(target=_make, args=(drives, Path(folder)))
        made.start()
        made.join()
        command = ['rosrun', 'sara_lab', 'results', QUESTION, '--in', folder, '--csv']
        used = [_cpu(command) for _ in range(runs + 1)][1:]
    yield timed(
        f'results: a question about {drives} drives',
        's',
        [seconds for seconds, _ in used],
        limit=Limit('median', 1.0),
        memory=max(memory for _, memory in used),
        text=f'{QUESTION!r}, {FIGURES} figures a drive; CPU time of rosrun and the process, its start included',
    )


def _make(drives: int, folder: Path) -> None:
    from sara_lab.campaign.results.rows import Origin, rows, write

    results = {f'travel_{number}': _result(number) for number in range(drives)}
    write(folder / 'made' / 'travel.parquet', rows(Origin('made', 'made', 'made'), 'travel', results))


def _result(number):
    """A drive of one of three maps in one of four modes, made up."""
    figures = {f'figure_{column}': number % (column + 2) / 7.0 for column in range(FIGURES)}
    return {
        'map': ('flat', 'school', 'hall')[number % 3],
        'mode': ('true', 'fused', 'boxes', 'pedestrians')[number // 3 % 4],
        'number': number // 12,
        'contacts': [{}] * (number % 5 == 0),
        'judgement': figures,
    }


def _cpu(command: list[str]) -> tuple[float, float]:
    """(s of CPU, MB at the most) of a process and those that it starts. Raises CalledProcessError."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0
