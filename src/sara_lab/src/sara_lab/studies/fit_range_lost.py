"""`fit_range_lost`: the numbers of range_lost.RangeLaw that are likeliest over simulated drives; how soon a wrong pose
is noticed on others, and how often a right one is doubted.

The two distributions are the likeliest for the counts of windows of STEPS steps at right and at wrong poses
(misplaced.py). The prior is chosen, not found: how often chairs are misplaced no simulator knows.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from multiprocessing import get_context
from os import cpu_count

import numpy as np
from scipy.optimize import minimize
from tqdm import tqdm

from sara_lab.studies.fit_lost import options_of
from sara_lab.studies.misplaced import KINDS, Case, Step, cases, steps
from sara_localization.particles.lost import Dirichlet, log_likelihood
from sara_localization.particles.range_lost import LAW, STEPS, RangeLaw

FIRST = 1000
"""The first drive's number: far above those of `campaign global_start`."""
PRIOR = 1e-3
"""What the square of a parameter's logarithm costs, nats of a window: else what was never seen would be impossible."""
DOUBTED = 0.5
"""The probability from which on move_base lets a goal wait."""


def windows(drive: Sequence[Step], wrong: bool) -> list[tuple[int, ...]]:
    """The counts of windows, half of each in the next one, in which the pose was wrong, or right, throughout."""
    found = []
    for end in range(STEPS, len(drive) + 1, STEPS // 2):
        window = drive[end - STEPS : end]
        if all(step.wrong == wrong for step in window):
            found.append(tuple(map(sum, zip(*(step.agreement for step in window)))))
    return found


def likeliest(counts: Sequence[tuple[int, ...]]) -> Dirichlet:
    """The parameters for which counts (n, 4) are likeliest a posteriori."""

    def loss(logarithms):
        alphas = np.exp(logarithms).tolist()
        return PRIOR * float(logarithms @ logarithms) - np.mean([log_likelihood(count, alphas) for count in counts])

    return tuple(float(f'{alpha:.3g}') for alpha in np.exp(minimize(loss, np.zeros(4)).x))


def fitted(drives: Iterable[Sequence[Step]]) -> RangeLaw:
    """The law that is likeliest over drives, with the prior as it is."""
    found, lost = [], []
    for drive in drives:
        found += windows(drive, False)
        lost += windows(drive, True)
    return RangeLaw(likeliest(found), likeliest(lost), LAW.prior)


def noticed(drive: Sequence[Step]) -> float | None:
    """m from when the pose became wrong until it is doubted; None where it never is."""
    since = next(step.way for step in drive if step.wrong)
    return next((step.way - since for step in drive if step.wrong and step.probability >= DOUBTED), None)


def doubted(drive: Sequence[Step]) -> bool:
    """Whether a pose is doubted that has been right throughout the window."""
    return any(
        step.probability >= DOUBTED and not any(before.wrong for before in drive[max(i - STEPS + 1, 0) : i + 1])
        for i, step in enumerate(drive)
    )


def table(drives: Sequence[tuple[Case, Sequence[Step]]]) -> list[str]:
    """Lines of a table, one for each of KINDS."""
    lines = ['| drives | doubted though right | wrong | noticed | after m, median / p90 |', '|---|---|---|---|---|']
    for kind in KINDS:
        of = [drive for case, drive in drives if case.kind == kind]
        wrong = [drive for drive in of if any(step.wrong for step in drive)]
        ways = [way for way in map(noticed, wrong) if way is not None]
        after = f'{np.median(ways):.1f} / {np.quantile(ways, 0.9):.1f}' if ways else ''
        lines.append(f'| {len(of)} {kind} | {sum(map(doubted, of))} | {len(wrong)} | {len(ways)} | {after} |')
    return lines


def _recorded(job):
    case, folder = job
    return case, steps(case, folder)


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/fit_range_lost."""
    options = options_of(words, 'fit_range_lost', __doc__, 6, 4)
    middle, end = FIRST + options.seeds, FIRST + options.seeds + options.held_out
    jobs = [(case, options.out) for case in cases(range(FIRST, end))]
    with get_context('fork').Pool(cpu_count()) as pool:
        drives = list(tqdm(pool.imap(_recorded, jobs, chunksize=len(KINDS)), total=len(jobs), unit='drive'))
    law = fitted(drive for case, drive in drives if case.number < middle)
    print(f'fitted: found {law.found}, lost {law.lost}; present: found {LAW.found}, lost {LAW.lost}')
    print('Held out, by the present law:')
    print('\n'.join(table([(case, drive) for case, drive in drives if case.number >= middle])))
