"""What an experiment is, and what is reported of it: plain data that pages.py writes and runner.py fills."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

CONFIRMED, PARTLY, CONTRADICTED = 'confirmed', 'confirmed in part', 'contradicted, and explained'
Results = dict[tuple, dict]  # {Case.key: what its function gave}
Finding = tuple[str, str, str]  # what the thesis finds, what we find, verdict


@dataclass(frozen=True)
class Case:
    """One run: `function(seed, **options)` gives a dict of plain data. `key`: names it among an experiment's. `gain`:
    whether the function takes the chair's own gyro gain as `gain`. `function` is a module's own, for it is sent to
    another process.
    """

    key: tuple
    function: object
    seed: int
    options: dict = field(default_factory=dict)
    gain: bool = False


@dataclass(frozen=True)
class Row:
    """A line of the table: `what`, the thesis's figure, ours, and what explains the difference. Texts."""

    what: str
    thesis: str
    ours: str
    why: str = ''


@dataclass(frozen=True)
class Figure:
    """A PNG: `name` without its ending (fig_4_17), `caption`, and `draw(path)`."""

    name: str
    caption: str
    draw: object


@dataclass(frozen=True)
class Report:
    """What came of an experiment. `short`: a sentence for the summary. `findings`: ((what the thesis found, what we
    find, verdict), ...). `rows`: of Row. `sections`: ((heading, markdown), ...).
    `figures`: of Figure. `data`: plain data for the JSON. `faults`: sentences; what must hold and does not, empty when
    all is well.
    """

    findings: tuple
    rows: tuple
    figures: tuple = ()
    sections: tuple = ()
    data: dict = field(default_factory=dict)
    faults: tuple = ()
    short: str = ''

    @property
    def verdict(self) -> str:
        """Of all findings together."""
        verdicts = {verdict for _, _, verdict in self.findings}
        if verdicts == {CONFIRMED}:
            return CONFIRMED
        return CONTRADICTED if verdicts == {CONTRADICTED} else PARTLY


@dataclass(frozen=True)
class Experiment:
    """`setting`: what the thesis did and what we do, markdown. `seeds`: how many chairs by default. `cases(seeds)`: the
    Cases. `report(results)`: the Report of {key: dict}. `over_ros`: which of its cases `--ros` runs over ROS if nobody
    chooses, a function of a key. `figures`: {agreement.Figure: value} of a result, which over ROS and in lockstep are
    compared.
    """

    name: str
    title: str
    setting: str
    seeds: int
    cases: object
    report: object
    over_ros: object = None
    figures: object = None


def results_of(results: Results, *key: str) -> list[dict]:
    """The results whose keys begin with `key`, by chair."""
    return [result for held, result in sorted(results.items()) if held[: len(key)] == key]


def spread(values: Iterable[float | None]) -> dict[str, Any]:
    """A mean with its 95 % interval (bootstrap, 2000 draws of a fixed seed), median, 5th and 95th percentile, number;
    plain data.
    """
    values = np.asarray([value for value in values if value is not None and np.isfinite(value)], float)
    if not len(values):
        return {'n': 0, 'mean': None, 'low': None, 'high': None, 'median': None, 'p5': None, 'p95': None, 'max': None}
    draws = np.random.default_rng(1).integers(len(values), size=(2000, len(values)))
    low, high = np.percentile(values[draws].mean(axis=1), (2.5, 97.5))
    return {
        'n': len(values),
        'mean': float(values.mean()),
        'low': float(low),
        'high': float(high),
        'median': float(np.median(values)),
        'p5': float(np.percentile(values, 5)),
        'p95': float(np.percentile(values, 95)),
        'max': float(values.max()),
    }


def interval(found: dict[str, Any], digits: int = 3, unit: str = '') -> str:
    """A spread as text: mean [95 % interval]."""
    if not found['n']:
        return '-'
    mean, low, high = (round(found[name], digits) + 0.0 for name in ('mean', 'low', 'high'))
    return f'{mean:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]' + (f' {unit}' if unit else '')


def mean(found: dict[str, Any], digits: int = 3, unit: str = '') -> str:
    """A spread's mean as text."""
    if not found['n']:
        return '-'
    return f'{round(found["mean"], digits) + 0.0:.{digits}f}' + (f' {unit}' if unit else '')


def rounded(value: Any, digits: int = 6) -> Any:
    """Plain data with its floats rounded, NaN as None: what a file may hold."""
    if isinstance(value, dict):
        return {str(key): rounded(entry, digits) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [rounded(entry, digits) for entry in value]
    if isinstance(value, np.ndarray):
        return rounded(value.tolist(), digits)
    if isinstance(value, (float, np.floating)):
        return round(float(value), digits) + 0.0 if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else bool(value) if isinstance(value, np.bool_) else value


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A markdown table of texts."""
    return '\n'.join(
        [
            '| ' + ' | '.join(head) + ' |',
            '|' + '---|' * len(head),
            *('| ' + ' | '.join(cell.replace('|', '\\|') for cell in row) + ' |' for row in rows),
        ]
    )
