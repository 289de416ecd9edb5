"""The campaign's part `skills`: what the Wheelchair Skills Test and others ask of somebody in a powered chair, by
navigation, by a trembling hand with shared control, and by an expert's hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sara_lab.campaign.part import Figures, Part
from sara_lab.rides.skills.items import skills as all_skills
from sara_lab.rides.skills.trial import WAYS, drive

MOST = 2  # points
ASKED = {'goals': 0.95, 'shared': 0.98}  # share of the points
LINE = '{:22} {:7} {points:4}/{most:<4} {unsafe:6} {seconds:7.1f} {gap_min_m:6.3f}'
HEAD = f'{"skill":22} {"way":7} {"points":>9} {"unsafe":>6} {"time s":>7} {"gap m":>6}'


def skills(seeds: int, _folder: Path) -> Part:
    """Every skill in every way, on as many chairs as seeds."""
    return Part(
        {
            f'skills_{name}_{way}_{seed}': lambda name=name, way=way, seed=seed: drive(name, way, seed).to_json()
            for seed in range(seeds)
            for name in all_skills()
            for way in WAYS
        },
        _summary,
        _verdict,
    )


def _summary(results):
    lines, figures = [HEAD], {}
    for way in WAYS:
        for name in (*all_skills(), 'all'):
            of = [found for found in results if found['way'] == way and name in (found['skill'], 'all')]
            row = figures[f'{name}_{way}'] = skill_row(of)
            lines.append(LINE.format(name, way, **row))
    lines += [
        f'{found["points"]} points: {found["skill"]} {found["way"]} {found["seed"]}: {"; ".join(found["why"])}'
        + ''.join(f' [{text}]' for text in found['texts'] if found['points'] == 0 and text)
        for found in results
        if found['points'] < MOST
    ]
    return lines, figures


def skill_row(results: Sequence[dict]) -> Figures:
    """Figures of the drives (plain data) of a skill, or all, in one way."""
    gaps = [found['judgement']['gap_min'] for found in results if found['judgement']]
    return {
        'points': sum(found['points'] for found in results),
        'most': MOST * len(results),
        'unsafe': sum(bool(found['faults']) for found in results),
        'seconds': float(np.median([found['seconds'] for found in results])),
        'gap_min_m': min(gaps, default=float('nan')),
    }


def _verdict(figures):
    found = []
    for way, share in ASKED.items():
        row = figures[f'all_{way}']
        if row['points'] < share * row['most']:
            found.append(f'{way}: {row["points"]} of {row["most"]} points, {share:.0%} are asked for')
    return found
