"""Runs the cases of experiments in several processes, with progress; the result does not depend on how many there are,
or on who finished first.
"""

from __future__ import annotations

import pickle
import re
import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sara_common.files import write_whole
from sara_lab.experiments import turns
from sara_lab.workers.processes import each
from sara_lab.workers.sources import folder_of

if TYPE_CHECKING:
    from sara_lab.experiments.core import Case, Results
    from sara_lab.workers.cluster import Cluster


def run(
    cases: Sequence[Case],
    where: int | Cluster = 2,
    progress: Callable[[int], Any] | None = None,
    keep: Path | None = None,
    costs: dict[tuple, float] | None = None,
) -> Results:
    """{key: result} in the order of `cases`. Those that need a chair's gain get it from E6's procedure, which runs
    first for their seeds. `where`: how many processes, or a Cluster.

    `progress(total)`, if given, is a context manager whose `update()` is called after each. `keep`: a folder (Path)
    where each result is kept, and taken from where it is there already, if robot and code are still the same. `costs`:
    a dict that is filled with {key: s of CPU} of what was run, not taken.
    """
    keep = keep and folder_of(Path(keep))
    costs = {} if costs is None else costs
    prior = {case.key: case for case in cases if case.key[0] == 'E6'}
    for seed in sorted({case.seed for case in cases if case.gain}):
        prior.setdefault(('E6', seed), turns.case_of(seed))
    later = [case for case in cases if case.key not in prior]
    results: dict[tuple, Any] = {}
    with progress(len(prior) + len(later)) if progress else nullcontext() as done:

        def run_all(tasks):
            for _, (key, result, cost) in each(_run, tasks, where):
                results[key] = result
                costs.update({} if cost is None else {key: cost})
                if done is not None:
                    done.update()

        run_all([(case, None, keep) for case in prior.values()])
        gains = {key[1]: result['gain'] for key, result in results.items()}
        run_all([(case, gains[case.seed] if case.gain else None, keep) for case in later])
    return {case.key: results[case.key] for case in cases}


def _run(task):
    case, gain, keep = task
    path = keep and keep / (re.sub(r'[^\w.-]+', '_', '_'.join(map(str, case.key))) + '.pickle')
    if path and path.exists():
        return case.key, pickle.loads(path.read_bytes()), None
    began = time.process_time()
    result = case.function(case.seed, **case.options, **({} if gain is None else {'gain': gain}))
    if path:
        write_whole(path, pickle.dumps(result))
    return case.key, result, time.process_time() - began
