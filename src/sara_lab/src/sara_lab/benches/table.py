"""The one table of `make bench`: as text while it is measured, and as Markdown."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sara_lab.benches.timed import Row

COLUMNS = ('', 'median', 'p99', 'runs', 'yardstick ms', "at the peers' speed", 'peer', 'ratio', 'wanted', 'met', 'MB')


def number(value: float | None) -> str:
    """Three figures of it."""
    if value is None:
        return ''
    return f'{value:.0f}' if abs(value) >= 100.0 else f'{value:.3g}'


def wanted(row: Row) -> str:
    """The limit in words."""
    if row.limit is None:
        return ''
    sign = '≥' if row.rate and row.limit.of == 'median' else '≤'
    unit = {'ratio': '', 'memory': ' MB'}.get(row.limit.of, f' {row.unit}')
    what = {'ratio': 'ratio ', 'p99': 'p99 '}.get(row.limit.of, '')
    return f'{what}{sign} {row.limit.bound:g}{unit}'


def verdict(row: Row) -> str:
    """yes, NO, or nothing."""
    return {True: 'yes', False: 'NO', None: ''}[row.met]


def cells(row: Row) -> tuple[str, ...]:
    """A row's columns as text."""
    if row.skipped:
        return (row.name, '', '', '', '', '', '', '', wanted(row), '', '')
    unit = f' {row.unit}' if row.unit else ''
    return (
        row.name,
        number(row.median) + unit,
        number(row.p99),
        str(row.runs),
        f'{row.before:.0f}, {row.after:.0f}',
        number(row.at_peers_speed(row.median)) if row.scaled else '-',
        number(row.peer),
        number(row.ratio),
        wanted(row),
        verdict(row),
        number(row.memory),
    )


def line(row: Row) -> str:
    """The row on a terminal."""
    if row.skipped:
        return f'  {row.name}: not measured: {row.text}'
    name, median, p99, runs, yardsticks, scaled, peer, ratio, limit, met, memory = cells(row)
    parts = [
        f'p99 {p99}' if p99 else '',
        f'{runs} runs',
        f'yardstick {yardsticks}',
        f"{scaled} at the peers' speed" if row.scaled else '',
        f'peer {peer}' if peer else '',
        f'ratio {ratio}' if ratio else '',
        f'{limit}: {met or "?"}' if limit else '',
        f'{memory} MB' if memory else '',
        row.text,
    ]
    return f'  {name}: {median}; ' + ', '.join(part for part in parts if part)


def markdown(rows: Iterable[Row]) -> str:
    """The table; notes stand below it."""
    lines = ['| ' + ' | '.join(COLUMNS) + ' |', '|' + ' --- |' * len(COLUMNS)]
    lines += ['| ' + ' | '.join(cells(row)) + ' |' for row in rows if not row.skipped]
    notes = [f'- {row.name}: {"not measured: " if row.skipped else ""}{row.text}' for row in rows if row.text]
    return '\n'.join(lines + ['', *notes]) + '\n'
