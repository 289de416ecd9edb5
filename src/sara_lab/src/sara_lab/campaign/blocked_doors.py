"""The campaign's part `blocked_doors`: a box that no map shows, in the only door to the goal."""

import functools
import itertools
from pathlib import Path

import numpy as np

from sara_lab.campaign.part import Part, lines_of
from sara_lab.experiments.gains import gain_of
from sara_lab.journeys.blocked_doors import FATES, attempt
from sara_lab.journeys.travel import POSES


def blocked_doors(seeds: int, folder: Path) -> Part:
    """A box in the only door to the goal, that stays or is taken away: true pose and fused."""

    def case(mode, fate, number):
        return attempt(mode, fate, number, gain_of(number, folder) if mode == 'fused' else None).to_json()

    cases = itertools.product(POSES, FATES, range(seeds))
    return Part({f'blocked_doors_{"_".join(map(str, of))}': functools.partial(case, *of) for of in cases}, _summary)


def _summary(results):
    figures = {}
    for mode in POSES:
        for fate in FATES:
            of = [result for result in results if (result['mode'], result['fate']) == (mode, fate)]
            figures[f'{mode}_{fate}'] = {
                'attempts': len(of),
                'reached': sum(result['reached'] for result in of),
                'touched': sum(bool(result['contacts']) for result in of),
                'seconds': float(np.median([result['judgement']['seconds'] for result in of])),
            }
    return lines_of(figures), figures
