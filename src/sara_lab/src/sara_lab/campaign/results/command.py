"""`results "school, fused, contacts by seed"`: questions about the drives of `campaign` and `experiment --keep`.

Before `by`, separated by commas: values that some column must have (words of the same column are alternatives;
column=value for numbers), and columns of numbers, of which count, sum, mean, least and greatest are shown. After `by`:
the columns that drives are grouped by. Without a question: the columns there are, and the values of texts. Of each part
the rows that were written last are asked, with --all those of other sources too.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from sara_lab.campaign.results.question import SHOWN_VALUES, Drives, QuestionError, answer, origins, parsed
from sara_lab.campaign.results.rows import tables

FOLDERS = (Path('out/campaign'), Path('out/experiments_kept'))


def main(argv: Sequence[str] | None = None) -> None:
    """Exit status 2, and what there is instead, where the question cannot be answered."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='results', description=__doc__, formatter_class=form)
    parser.add_argument('question', nargs='*', metavar='WORD', help='"FILTER, FIGURE by COLUMN"')
    add_folders(parser)
    parser.add_argument('--all', action='store_true', help='rows of all sources, not the newest of each part')
    how = parser.add_mutually_exclusive_group()
    how.add_argument('--csv', action='store_true', help='CSV on stdout instead of the table')
    how.add_argument('--json', action='store_true', help='JSON on stdout instead of the table')
    arguments = parser.parse_args(argv)
    try:
        drives = Drives(tables(arguments.folders), arguments.all)
        text = ' '.join(arguments.question)
        if not text:
            print('\n'.join(_what_there_is(drives)))
            return
        question = parsed(text, drives)
        found, whence = answer(question, drives), origins(question, drives)
    except QuestionError as error:
        print(f'results: {error}', file=sys.stderr)
        sys.exit(2)
    if arguments.json:
        print(json.dumps(found.to_pylist()))
    elif arguments.csv:
        csv.writer(sys.stdout).writerows([found.column_names, *_lines(found)])
    else:
        print('\n'.join(_table(found)))
    whence = ['{part} on {platform}: {drives} drives of sources {sources}, commit {commit}'.format(**o) for o in whence]
    print('\n'.join(whence) or 'no drive is so', file=sys.stderr)


def add_folders(parser: argparse.ArgumentParser) -> None:
    """The option --in, as `folders`: where rows are looked for."""
    text = ', '.join(map(str, FOLDERS))
    parser.add_argument(
        '--in', dest='folders', nargs='+', type=Path, default=FOLDERS, metavar='FOLDER', help=f'(default: {text})'
    )


def _what_there_is(drives):
    values = drives.values()
    lines = [
        f'{name}: {", ".join(sorted(held))}' if len(held) <= SHOWN_VALUES else f'{name}: {len(held)} texts'
        for name, held in values.items()
    ]
    return lines + ['figures: ' + ', '.join(name for name in drives.columns if name not in values)]


def _lines(table):
    return zip(*(column.to_pylist() for column in table.columns))


def _table(table):
    """The lines of a table with its columns side by side."""
    cells = [table.column_names, *([_cell(value) for value in line] for line in _lines(table))]
    widths = [max(map(len, column)) for column in zip(*cells)]
    return ['  '.join(cell.rjust(width) for cell, width in zip(line, widths)) for line in cells]


def _cell(value):
    if value is None:
        return '-'
    return f'{value:.6g}' if isinstance(value, float) else str(value)
