"""`draw_times BEFORE.json [AFTER.json]`: how long journeys take beside the ideal time, before and after a change, as a
table (Markdown, printed) and a picture stacked by where the time went. The files are the campaign's (`--json`).
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sara_bringup.paths import share
from sara_lab.experiments.plotting import figure
from sara_lab.journeys.ideal_times import QUICK, TIMED
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.judge.time_split import SPLIT_NAMES

COLOURS = ('tab:green', 'tab:blue', 'tab:orange', 'tab:red', 'tab:purple', 'tab:gray', 'tab:brown')
NAMES = ('before', 'after')


def table(figures: Sequence[dict[str, Any]]) -> str:
    """A Markdown table of the `travel` figures of one or two campaigns: time / ideal time, mean speed, and the share of
    journeys that take less than twice the ideal time.
    """
    head = '| travel | ideal, s | ' + ' | '.join(
        f'{what}{" " + name if len(figures) > 1 else ""}'
        for what in ('time / ideal', f'under {QUICK:.1f}', 'm/s')
        for name in NAMES[: len(figures)]
    )
    lines = [head + ' |', '| --- ' * (2 + 3 * len(figures)) + '|']
    for group in groups(figures):
        rows = [found[group] for found in figures]
        cells = [f'{row["time_ratio"]:.2f}' for row in rows]
        cells += [f'{row["quick"]:.0%}'.replace('%', ' %') for row in rows]
        cells += [f'{row["total_speed"]:.2f}' for row in rows]
        mode, name = group.split('_')
        lines.append(f'| {TIMED[mode]}, {name} | {rows[-1]["ideal_s"]:.0f} | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines)


def groups(figures: Sequence[dict[str, Any]]) -> list[str]:
    """MODE_MAP of what all have timed; raises ValueError where there is none."""
    wanted = [f'{mode}_{name}' for mode in TIMED for name in (*MAPS, 'all')]
    found = [group for group in wanted if all('time_s' in of.get(group, {}) for of in figures)]
    if not found:
        raise ValueError('no group of journeys was timed in every file; `campaign travel --json FILE` times them')
    return found


def picture(figures: Sequence[dict[str, Any]], path: Path) -> None:
    """Bars of time / ideal time for each group, one for each campaign, stacked by where the time went."""
    shown = groups(figures)
    with figure(path, size=(10, 4.5)) as (_, axis):
        width = 0.8 / len(figures)
        for which, of in enumerate(figures):
            places = [k + (which - 0.5 * (len(figures) - 1)) * width for k in range(len(shown))]
            below = [0.0] * len(shown)
            for (kind, name), colour in zip(SPLIT_NAMES.items(), COLOURS):
                high = [of[group]['split_s'][kind] / of[group]['ideal_s'] for group in shown]
                axis.bar(places, high, 0.92 * width, below, color=colour, label=None if which else name)
                below = [low + more for low, more in zip(below, high)]
        axis.axhline(1.0, color='black', linewidth=1.0)
        axis.axhline(QUICK, color='black', linewidth=1.0, linestyle='--')
        axis.set_xticks(range(len(shown)), ['\n'.join(group.split('_')) for group in shown])
        axis.set_ylabel('time / ideal time' + (', before and after' if len(figures) > 1 else ''))
        axis.legend(ncols=2)


def main(words: list[str] | None = None) -> None:
    """Print the table and write travel_times.png."""
    parser = argparse.ArgumentParser(prog='draw_times', description=__doc__)
    parser.add_argument('files', nargs='+', type=Path, metavar='FILE.json', help='one or two')
    parser.add_argument(
        '--out', type=Path, default=share().parents[1] / 'docs' / 'images', help='folder (default: %(default)s)'
    )
    options = parser.parse_args(words)
    if len(options.files) > 2:
        parser.error(f'{len(options.files)} files were given, allowed are one or two')
    try:
        figures = [json.loads(path.read_text())['travel'] for path in options.files]
        text = table(figures)
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f'draw_times: {error}')
    options.out.mkdir(parents=True, exist_ok=True)
    picture(figures, options.out / 'travel_times.png')
    print(text)
