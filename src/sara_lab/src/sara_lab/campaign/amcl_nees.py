"""The campaign's part `amcl_nees`: whether amcl's covariance is as large as its errors, by measurement model."""

from pathlib import Path

import numpy as np

from sara_lab.campaign.part import Part
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.amcl_consistency import KINDS, SIMULATED, fair, simulated
from sara_lab.studies.consistency import CONSISTENT, PLANAR_POSE, QUANTILE, interval

RIGHT = 'likelihood_field_power'
"""The group whose mean NEES must be within its interval."""
NOT_TOO_SURE = 'likelihood_field', 'beam', 'likelihood_field_prob_power', *(f'simulated_{kind}' for kind in SIMULATED)
"""Groups whose covariance must not be too small. In the others each beam counts as independent of all others, as the
C++ node's likelihood_field_prob has it; there the figures say how much too small it is.
"""


def amcl_nees(seeds: int, _folder: Path) -> Part:
    """On each map as many robots of each kind as chairs, and a fifth as many simulated ones."""
    cases = {
        f'amcl_nees_{kind}_{name}_{number}': lambda kind=kind, name=name, number=number: _result(
            kind, name, fair(KINDS[kind], name, number)
        )
        for kind in KINDS
        for name in MAPS
        for number in range(seeds)
    }
    cases |= {
        f'amcl_nees_simulated_{kind}_{name}_{number}': lambda kind=kind, name=name, number=number: _result(
            f'simulated_{kind}', name, simulated(KINDS[kind], name, number)
        )
        for kind in SIMULATED
        for name in MAPS
        for number in range(-(-seeds // 5))
    }
    return Part(cases, _summary, _verdict)


def _result(kind, name, values):
    return {'kind': kind, 'map': name, 'nees': [round(value, 3) for value in values], 'faults': []}


def _row(of):
    """mean: of NEES at the drives' ends, which are independent; low, high: the ends of its 95 % interval; median,
    within: of all poses.
    """
    last, every = [r['nees'][-1] for r in of], [value for r in of for value in r['nees']]
    low, high = interval(len(PLANAR_POSE), len(of))
    return {
        'runs': len(of),
        'mean': float(np.mean(last)),
        'low': low,
        'high': high,
        'median': float(np.median(every)),
        'within': float(np.mean(np.array(every) <= QUANTILE)),
    }


def _summary(results):
    figures, lines = {}, []
    for kind in dict.fromkeys(result['kind'] for result in results):
        for name in (*MAPS, 'all'):
            of = [r for r in results if r['kind'] == kind and name in (r['map'], 'all') and r['nees']]
            if not of:
                continue
            figures[f'{kind}_{name}'] = row = _row(of)
            lines.append(
                f'{kind:32} {name:7} mean {row["mean"]:7.2f} of {row["runs"]:3}, its 95 % interval {row["low"]:.2f} to '
                f'{row["high"]:.2f}; of all poses median {row["median"]:.2f}, {row["within"]:.1%} within the 95 % '
                'quantile'
            )
    return lines, figures


def _verdict(figures):
    found, row = [], figures[f'{RIGHT}_all']
    if not row['low'] <= row['mean'] <= row['high']:
        found.append(f'{RIGHT}: mean NEES {row["mean"]:.2f}, allowed are {row["low"]:.2f} to {row["high"]:.2f}')
    for kind in NOT_TOO_SURE:
        row = figures[f'{kind}_all']
        if row['mean'] > row['high']:
            found.append(f'{kind}: mean NEES {row["mean"]:.2f}, allowed is up to {row["high"]:.2f}')
        if row['within'] < CONSISTENT:
            found.append(f'{kind}: {row["within"]:.1%} of the poses are as right as they claim, 95% are asked for')
    return found
