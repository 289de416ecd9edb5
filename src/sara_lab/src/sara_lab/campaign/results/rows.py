"""One row for each drive: its figures and where it comes from, in a Parquet file for each part of the campaign and each
experiment.

Columns: `platform`, `sources` (the key of the sources, parameters and maps), `commit`, `part`, `case`, `seed` (of the
chair), then every figure of the result by its name; a figure inside another is called by both (`judgement.gap_min`).
Lists of texts and of things that happened (faults, contacts) are counted, lists of numbers are left out.
"""

from __future__ import annotations

import math
import re
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sara_common.files import write_whole

SUFFIX = '.parquet'
Row = dict[str, Any]
"""{column: a number, a text, a bool, or None where the drive has no such figure}"""
_NUMBERS = object()  # in the place of a list of numbers


@dataclass(frozen=True)
class Origin:
    """Where drives come from: the robot, the key of the sources, the commit ("unknown" outside git)."""

    platform: str
    sources: str
    commit: str


def commit() -> str:
    """The commit of these sources, "-dirty" behind it where files are not as in it; "unknown" outside git."""
    found = subprocess.run(
        ['git', '-C', str(Path(__file__).resolve().parent), 'describe', '--always', '--dirty', '--exclude', '*'],
        capture_output=True,
        text=True,
        check=False,
    )
    return found.stdout.strip() or 'unknown'


def rows(origin: Origin, part: str, results: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """A Row for each of {case: result}, all with the same columns. A result's own `commit` comes before the Origin's;
    the seed is its `seed` or `number`, else the number that ends its case's name.
    """
    found = [dict(_figures(result)) for result in results.values()]
    dropped = {name for one in found for name, value in one.items() if value is _NUMBERS}
    made = [
        {
            'platform': origin.platform,
            'sources': origin.sources,
            'commit': one.get('commit', origin.commit),
            'part': part,
            'case': case,
            'seed': _seed(case, one),
            **{name: value for name, value in one.items() if name not in {'commit', 'seed', *dropped}},
        }
        for case, one in zip(results, found)
    ]
    columns = list(dict.fromkeys(name for row in made for name in row))
    return [{name: row.get(name) for name in columns} for row in made]


def _figures(tree: Mapping, prefix: str = '') -> Iterator[tuple[str, Any]]:
    """(name, figure) of a result's figures, _NUMBERS for what is a list of numbers."""
    for key, value in tree.items():
        name = f'{prefix}{key}'
        value = value.tolist() if hasattr(value, 'tolist') else value  # numpy's
        if isinstance(value, Mapping):
            yield from _figures(value, f'{name}.')
        elif isinstance(value, (list, tuple)):
            yield name, len(value) if all(isinstance(entry, (str, Mapping)) for entry in value) else _NUMBERS
        elif isinstance(value, (bool, int, str)):
            yield name, value
        else:
            yield name, value if isinstance(value, float) and not math.isnan(value) else None


def _seed(case: str, figures: Mapping) -> int | None:
    for name in ('seed', 'number'):
        if isinstance(figures.get(name), int):
            return figures[name]
    ends = re.search(r'_(\d+)$', case)
    return int(ends[1]) if ends else None


def write(path: Path, rows: Sequence[Row]) -> None:
    """Write Rows (one or more, of the same columns) as Parquet; without pyarrow, which no robot needs, say so.
    Columns without any value are left out. Raises OSError.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError:
        print(f'{path} is not written: pyarrow is not installed', file=sys.stderr)
        return

    columns = {name: _column([row[name] for row in rows]) for name in rows[0]}
    table = pa.table({name: column for name, column in columns.items() if column is not None})
    buffer = pa.BufferOutputStream()
    pq.write_table(table, buffer, compression='zstd')
    write_whole(path, buffer.getvalue().to_pybytes())


def _column(values: Iterable[Any]):
    """The values as an Arrow array of the one kind that holds them all; None where there is none."""
    import pyarrow as pa

    kinds = {type(value) for value in values if value is not None}
    if not kinds:
        return None
    if kinds <= {bool} or kinds <= {int}:
        return pa.array(values)
    if str not in kinds:
        return pa.array([None if value is None else float(value) for value in values])
    return pa.array([None if value is None else str(value) for value in values])


def tables(folders: Iterable[Path]) -> list[Path]:
    """The Parquet files in the folders of `folders`, the newest first."""
    found = {path for folder in folders for path in Path(folder).glob(f'*/*{SUFFIX}')}
    return sorted(found, key=lambda path: (-path.stat().st_mtime_ns, path))
