"""Runs the cases of experiments in several processes, with progress; the result does not depend on how many there are, or on who finished first."""
import multiprocessing
import os
import pickle
import re

from sara_bringup.experiments import turns


def run(cases, processes=2, progress=None, keep=None):
    """{key: result} in the order of `cases`. Those that need a chair's gain get it from E6's procedure, which runs first for their seeds.

    `progress(total)` is a context manager whose `update()` is called after each. `keep`: a folder (Path) where each result is kept, and taken from where it is
    there already; it knows nothing of the code having changed.
    """
    prior = {case.key: case for case in cases if case.key[0] == "E6"}
    for seed in sorted({case.seed for case in cases if case.gain}):
        prior.setdefault(("E6", seed), turns.case_of(seed))
    later = [case for case in cases if case.key not in prior]
    with _pool(processes) as run_all:
        total = len(prior) + len(later)
        results = {}
        with progress(total) as done:
            for key, result in run_all(_run, [(case, None, keep) for case in prior.values()]):
                results[key] = result
                done.update()
            gains = {key[1]: result["gain"] for key, result in results.items()}
            for key, result in run_all(_run, [(case, gains[case.seed] if case.gain else None, keep) for case in later]):
                results[key] = result
                done.update()
    return {case.key: results[case.key] for case in cases}


def _run(task):
    case, gain, keep = task
    path = keep and keep / (re.sub(r"[^\w.-]+", "_", "_".join(map(str, case.key))) + ".pickle")
    if path and path.exists():
        return case.key, pickle.loads(path.read_bytes())
    result = case.function(case.seed, **case.options, **({} if gain is None else {"gain": gain}))
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
        new = path.with_suffix(".new")
        new.write_bytes(pickle.dumps(result))
        os.replace(new, path)
    return case.key, result


class _pool:
    """Something like map over processes, or over none where one is enough."""

    def __init__(self, processes):
        self._pool = multiprocessing.get_context("fork").Pool(processes) if processes > 1 else None

    def __enter__(self):
        return map if self._pool is None else self._pool.imap_unordered

    def __exit__(self, kind, *_):
        if self._pool is not None:
            (self._pool.close if kind is None else self._pool.terminate)()
            self._pool.join()
