"""Runs the cases of experiments in several processes, with progress; the result does not depend on how many there are, or on who finished first."""
import multiprocessing

from sara_bringup.experiments import turns

GAIN = "turns"


def run(cases, processes=2, progress=iter):
    """{key: result} in the order of `cases`. Those that need a chair's gain get it from E6's procedure, which runs first for their seeds. `progress(iterable, total)` wraps what is done."""
    prior = {case.key: case for case in cases if case.key[0] == "E6"}
    for seed in sorted({case.seed for case in cases if case.gain}):
        prior.setdefault(("E6", seed), turns.case_of(seed))
    later = [case for case in cases if case.key not in prior]
    with _pool(processes) as run_all:
        total = len(prior) + len(later)
        results = {}
        with progress(total) as done:
            for key, result in run_all(_run, [(case, None) for case in prior.values()]):
                results[key] = result
                done.update()
            gains = {key[1]: result["gain"] for key, result in results.items()}
            for key, result in run_all(_run, [(case, gains[case.seed] if case.gain else None) for case in later]):
                results[key] = result
                done.update()
    return {case.key: results[case.key] for case in cases}


def _run(task):
    case, gain = task
    return case.key, case.function(case.seed, **case.options, **({} if gain is None else {"gain": gain}))


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
