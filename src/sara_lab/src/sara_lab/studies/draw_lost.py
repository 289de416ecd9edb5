"""`draw_lost`: whether amcl's probability of being lost is what it says, as a reliability diagram, from the results of
`campaign kidnapped`.

Those drives are not the ones that fit_lost takes the law's numbers from.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from sara_bringup.paths import share
from sara_lab.experiments.plotting import figure
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.carried import GROUPS
from sara_lab.studies.consistency import BINS, reliability

LEAST = 5000  # moments
NAMES = {
    ('gyro', False): 'gyro',
    ('gyro', True): 'gyro, among pedestrians',
    ('wheels', False): 'wheels alone',
}
"""{group of the campaign: name in the picture}."""


def results_of(folder: Path) -> list[dict]:
    """What the campaign left in a folder, newest robot and state of the sources."""
    found = sorted(folder.rglob('kidnapped_*.json'), key=lambda path: path.stat().st_mtime)
    return [json.loads(path.read_text()) for path in sorted(found[-1].parent.glob('kidnapped_*.json'))] if found else []


def moments_of(results: Iterable[dict], group: tuple[str, bool] | None = None, name: str | None = None) -> list:
    """[[probability, whether the pose was wrong]] of the drives of a group on a map; None: of all."""
    return [
        moment
        for r in results
        if group in (None, (r['heading'], r['people'])) and name in (None, r['map'])
        for moment in r['moments']
    ]


def table(results: Sequence[dict]) -> list[str]:
    """Lines of Markdown: the expected calibration error of each group on each map and on all."""
    lines = ['| calibration error | ' + ' | '.join((*MAPS, 'all')) + ' |', '| --- ' * (len(MAPS) + 2) + '|']
    for group in (*GROUPS, None):
        cells = [moments_of(results, group, name) for name in (*MAPS, None)]
        errors = [f'{reliability(cell)[1]:.3f}' if cell else '-' for cell in cells]
        lines.append(f'| {NAMES.get(group, "all")} | ' + ' | '.join(errors) + ' |')
    return lines


def picture(results: Sequence[dict], path: Path) -> None:
    """A curve for each group, and below how many moments each bin holds."""
    with figure(path, 2, 1, (6.0, 6.5), sharex=True, height_ratios=(3, 1)) as (_, (curve, counts)):
        curve.plot((0.0, 1.0), (0.0, 1.0), color='grey', lw=1, ls='--', label='as it says')
        for number, (group, name) in enumerate(NAMES.items()):
            moments = moments_of(results, group)
            if not moments:
                continue
            rows, error = reliability(moments)
            said, wrong = [p for _, p, _ in rows], [row[2] for row in rows]
            curve.plot(said, wrong, marker='o', ms=4, label=f'{name}: {len(moments)} moments, error {error:.3f}')
            at = [(min(int(p * BINS), BINS - 1) + (number + 0.5) / len(NAMES)) / BINS for p in said]
            counts.bar(at, [n for n, _, _ in rows], 0.8 / BINS / len(NAMES))
        curve.set(ylabel='share of wrong poses', ylim=(-0.02, 1.02))
        curve.legend(loc='upper left', frameon=False)
        counts.set(xlabel='lost_probability', ylabel='moments', yscale='log', xlim=(0.0, 1.0))


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/draw_lost."""
    parser = argparse.ArgumentParser(prog='draw_lost', description=__doc__)
    parser.add_argument('--results', type=Path, default=Path('out/campaign'), help='folder of the campaign')
    folder = share('sara_localization') / 'docs' / 'images'
    parser.add_argument('--out', type=Path, default=folder, help='folder (default: %(default)s)')
    options = parser.parse_args(words)
    results = results_of(options.results)
    count = len(moments_of(results))
    if count < LEAST:
        sys.exit(f'{options.results} holds {count} moments, at least {LEAST} are needed: run campaign kidnapped first')
    print('\n'.join(table(results)))
    rows, error = reliability(moments_of(results))
    print('\n'.join(f'{n:6} moments: probability {p:.3f}, wrong {wrong:.3f}' for n, p, wrong in rows))
    print(f'{len(results)} drives, {count} moments: calibration error {error:.3f}')
    options.out.mkdir(parents=True, exist_ok=True)
    picture(results, options.out / 'lost_reliability.png')
