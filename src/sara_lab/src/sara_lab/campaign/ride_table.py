"""`ride_table`: the campaign's parts `assisted` and `assisted_doors` as tables in Markdown, from its JSON.

Three figures in a cell are of the same rider on the same circuit alone (free), with the gate, and with shared control.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from sara_lab.campaign.assisted import DOOR_RIDERS, DOOR_WAYS
from sara_lab.campaign.part import Figures
from sara_lab.rides.circuits import circuits
from sara_lab.rides.ride import LIMIT_S, WAYS
from sara_sim.riders.riders import RIDERS

COLUMNS = {
    'completed': '{completed}',
    'rides with contact': '{collided}',
    'time s': '{seconds:.0f}',
    'reversals/min': '{reversals_per_min:.1f}',
    'stops': '{stops:.1f}',
    'least gap m': '{gap_min_m:.2f}',
}


def riders_table(figures: Figures) -> list[str]:
    """Lines of the table of the part `assisted`, a line a rider: over the circuits sums, but the mean of reversals,
    stops and changes, and the least gap.
    """
    lines = _head(('rider', *COLUMNS, 'changed'))
    for rider in RIDERS:
        rows = [figures[f'{circuit}_{rider}'] for circuit in circuits() if f'{circuit}_{rider}' in figures]
        if rows:
            over = {way: _over([row[way] for row in rows]) for way in WAYS}
            lines.append(_row((rider, *_beside(over, '/'))))
    return lines


def _over(rows):
    """Figures of one rider in one way over the circuits."""
    held = {key: [row[key] for row in rows] for key in rows[0]}
    means = {key: float(np.mean(held[key])) for key in ('reversals_per_min', 'stops', 'changed')}
    sums = {key: sum(held[key]) for key in ('completed', 'collided', 'seconds')}
    return {**sums, **means, 'gap_min_m': min(held['gap_min_m'])}


def rides_table(figures: Figures) -> list[str]:
    """Lines of the table of the part `assisted`, a line a rider and circuit."""
    lines = _head(('circuit', 'rider', *COLUMNS, 'changed'))
    for circuit in circuits():
        for rider in RIDERS:
            ways = figures.get(f'{circuit}_{rider}')
            if ways:
                lines.append(_row((circuit, rider, *_beside(ways, ' / '))))
    return lines


def _beside(ways, between):
    """The cells of COLUMNS with the WAYS beside each other, and how much of the wish is changed."""
    cells = [between.join(cell.format(**ways[way]) for way in WAYS) for cell in COLUMNS.values()]
    return [*cells, f'{ways["assisted"]["changed"]:.1%}']


def doors_table(figures: Figures) -> list[str]:
    """Lines of the table of the part `assisted_doors`."""
    cells = {
        'passed': '{passed}',
        'without stopping': '{without_stopping}',
        'contacts': '{contacts}',
        'time s': '{seconds:.0f}',
    }
    lines = _head(('rider', *cells))
    for rider in DOOR_RIDERS:
        rows = [figures[f'{rider}_{way}'] for way in DOOR_WAYS]
        lines.append(_row((rider, *('/'.join(cell.format(**row) for row in rows) for cell in cells.values()))))
    return lines


def _head(names):
    return [_row(names), '|' + '---|' * len(names)]


def _row(cells):
    return f'| {" | ".join(cells)} |'


def main(words: list[str] | None = None) -> None:
    """Entry point of nodes/ride_table."""
    parser = argparse.ArgumentParser(prog='ride_table', description=__doc__)
    parser.add_argument('file', type=Path, help='written by `campaign --json`')
    parser.add_argument('--circuits', action='store_true', help='a line a rider and circuit, not a rider')
    arguments = parser.parse_args(words)
    figures = json.loads(arguments.file.read_text())
    if 'assisted' not in figures and 'assisted_doors' not in figures:
        parser.error('the file holds neither of the parts assisted and assisted_doors')
    if 'assisted' in figures:
        seeds = figures['assisted']['seeds']
        late = f'who does not complete takes {LIMIT_S:.0f} s'
        print(f'{seeds} rides each; free / gate / assisted; medians, but means of stops; {late}.\n')
        print('\n'.join((rides_table if arguments.circuits else riders_table)(figures['assisted'])))
    if 'assisted_doors' in figures:
        print('\nA door of 0.80 m from 20 angles up to 45 degrees; gate / assisted.\n')
        print('\n'.join(doors_table(figures['assisted_doors'])))
