"""`fit_lost`: the numbers of lost.LostLaw that are likeliest over simulated drives; how well calibrated over others.

The drives are those of carried.py, on each map, with and without pedestrians and with both kinds of odometry. The
likelihood of a law is that of Bernoulli trials: at each measurement the pose is wrong with the probability that the
filter gives. No number is a drive of `campaign kidnapped`, whose drives stay unseen.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from tqdm import tqdm

from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.carried import KEEPS_HEADING, Case, Step, drive
from sara_lab.studies.consistency import reliability
from sara_localization.particles.amcl import NOT_KNOWN
from sara_localization.particles.lost import LAW, Agreement, Evidence, LostFilter, LostLaw

FIRST = 1000
"""The first drive's number: far above those of `campaign kidnapped`."""
STEP = 1e-3
"""Of the finite differences."""
PRIOR = 3e-4
"""What the square of a Dirichlet parameter's logarithm costs, nats of a measurement: else a kind of reading that was
never seen in a state would count as impossible there.
"""
_LEAST = 1e-6

Moment = tuple[Evidence, bool]
"""A measurement, and whether the pose was wrong then."""


def moments_of(steps: Iterable[Step]) -> list[Moment]:
    """Of a drive's steps; of those before the first evidence there are none."""
    return [(step.evidence, step.wrong) for step in steps if step.evidence is not None]


def probabilities(drive_: Sequence[Moment], law: LostLaw) -> list[float]:
    """What the filter says after each measurement of a drive that begins at a pose that was told."""
    lost, said = LostFilter(law), []
    lost.start(NOT_KNOWN)
    for evidence, _ in drive_:
        lost.update(evidence)
        said.append(lost.probability)
    return said


def loss(drives: Sequence[Sequence[Moment]], law: LostLaw) -> float:
    """The mean negative log likelihood of a measurement's verdict, nats."""
    total = count = 0.0
    for moments in drives:
        for (_, wrong), said in zip(moments, probabilities(moments, law)):
            total -= math.log(max(said if wrong else 1.0 - said, _LEAST))
            count += 1
    return total / count


def packed(law: LostLaw) -> np.ndarray:
    """(13,) the law's numbers without bounds: logarithms of the Dirichlet parameters, log odds of all that is a
    probability or a share.
    """
    shares = np.array(law[2:])
    return np.concatenate((np.log(law.found), np.log(law.lost), np.log(shares / (1.0 - shares))))


def unpacked(numbers: np.ndarray) -> LostLaw:
    """The law of `packed` numbers."""
    alphas, shares = np.exp(numbers[:8]).tolist(), (1.0 / (1.0 + np.exp(-numbers[8:]))).tolist()
    return LostLaw(tuple(alphas[:4]), tuple(alphas[4:]), *shares)


def fitted(drives: Sequence[Sequence[Moment]], law: LostLaw = LAW, iterations: int = 60) -> LostLaw:
    """The law that is likeliest a posteriori over drives, sought from a law on (L-BFGS-B)."""
    found = minimize(
        lambda numbers: loss(drives, unpacked(numbers)) + PRIOR * float(numbers[:8] @ numbers[:8]),
        packed(law),
        method='L-BFGS-B',
        bounds=[(n - 5.0, n + 5.0) for n in packed(law)],
        options={'maxiter': iterations, 'eps': STEP},
    )
    return unpacked(found.x)


def rounded(law: LostLaw) -> LostLaw:
    """To three digits, as it is written down."""
    short = lambda number: float(f'{number:.3g}')
    return LostLaw(tuple(map(short, law.found)), tuple(map(short, law.lost)), *map(short, law[2:]))


def calibration(drives: Sequence[Sequence[Moment]], law: LostLaw) -> float:
    """The expected calibration error over all measurements of drives."""
    return reliability(
        [(said, wrong) for moments in drives for (_, wrong), said in zip(moments, probabilities(moments, law))]
    )[1]


def recorded_drives(numbers: Iterable[int], folder: Path) -> list[list[Moment]]:
    """The moments of the drives of these numbers, each kept in a file of the folder and driven once."""
    cases = [
        Case(name, number, people, heading=heading)
        for number, heading, people, name in product(numbers, KEEPS_HEADING, (False, True), MAPS)
    ]
    return [_recorded(case, folder) for case in tqdm(cases, unit='drive', desc='drives')]


def _recorded(case, folder):
    path = folder / f'{case.heading}_{case.map}_{"people" if case.people else "alone"}_{case.number}.json'
    if not path.exists():
        path.write_text(json.dumps(moments_of(drive(case))))
    return [
        (Evidence(Agreement(*agreement), outside, moved), wrong)
        for (agreement, outside, moved), wrong in json.loads(path.read_text())
    ]


def options_of(words: list[str] | None, name: str, says: str, seeds: int, held_out: int) -> argparse.Namespace:
    """`seeds`, `held_out`, `out` (Path) of a program that fits a law to drives; the numbers given are the defaults."""
    parser = argparse.ArgumentParser(prog=name, description=says)
    parser.add_argument('--seeds', type=int, default=seeds, help='drives of each kind (default: %(default)s)')
    parser.add_argument('--held-out', type=int, default=held_out, help='and that judge (default: %(default)s)')
    parser.add_argument('--out', type=Path, default=Path('out', name), help='where drives are kept')
    options = parser.parse_args(words)
    if min(options.seeds, options.held_out) < 1:
        parser.error('--seeds and --held-out are whole numbers of 1 or more')
    options.out.mkdir(parents=True, exist_ok=True)
    return options


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/fit_lost."""
    options = options_of(words, 'fit_lost', __doc__, 10, 5)
    middle = FIRST + options.seeds
    fit, held_out = (
        recorded_drives(numbers, options.out)
        for numbers in (range(FIRST, middle), range(middle, middle + options.held_out))
    )
    law = rounded(fitted(fit))
    for name, each in (('present', LAW), ('fitted', law)):
        print(
            f'{name:8} loss {loss(fit, each):.4f}, held out {loss(held_out, each):.4f}; calibration error '
            f'{calibration(fit, each):.4f}, held out {calibration(held_out, each):.4f}'
        )
    print(f'LAW = {tuple(law)}')
