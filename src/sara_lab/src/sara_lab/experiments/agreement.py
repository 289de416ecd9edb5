"""Whether drives over ROS and in lockstep, of the same descriptions, come to the same: figures of each, and how far
apart they are.

A run over ROS is not the lockstep run to the digit: nodes wait for each other. It agrees where each of its figures is
within LIMIT times the spread over the chairs (standard deviation) of the lockstep's mean; where all of those are the
same, it must be that too. Drives are compared with drives in lockstep that have the timing of nodes (as_nodes.py), of
CHAIRS chairs.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sara_lab.experiments.core import rounded, table

if TYPE_CHECKING:
    from sara_lab.experiments.core import Case, Experiment, Report, Results

LIMIT = 3.0
CHAIRS = 50  # a spread over ten is itself known to a quarter, and does not hold what happens to one chair in twenty
AS_NODES = 'as nodes'  # begins the key of a drive in lockstep with the timing of nodes


def every_case(_key: tuple) -> bool:
    """Experiment.over_ros where every case is run over ROS."""
    return True


@dataclass(frozen=True)
class Figure:
    """One that is compared: its name with the unit, and the decimals that are shown."""

    name: str
    digits: int


Values = dict[tuple, dict[Figure, float]]
"""{(*set-up, seed): {Figure: value}}."""

REACHED, OFF, YAW, STRAIGHT = (
    Figure('goals reached', 0),
    Figure('truly off the goals, m', 3),
    Figure('truly off in yaw, deg', 2),
    Figure('off the straight line, p95, m', 3),
)
HEADING, TURNED, SECONDS, CONTACTS = (
    Figure('heading wrong by, at most, deg', 2),
    Figure("wheels' turn / true turn", 3),
    Figure('time, s', 1),
    Figure('contacts', 0),
)


def of_drive(result: dict) -> dict[Figure, float]:
    """{Figure: value} of a result of drive_data.figures; what it has not got is left out."""
    true, turned = result['true'], result['turned']
    found = {
        REACHED: true['reached'],
        OFF: np.mean(true['position']),
        YAW: np.mean(np.abs(true['yaw'])),
        STRAIGHT: true['cross_track_p95'],
        HEADING: result['fused_yaw_error'],
        TURNED: turned['wheels'][-1] / turned['true'][-1] if abs(turned['true'][-1]) > 45.0 else None,
        SECONDS: result['seconds'],
        CONTACTS: result['contacts'],
    }
    return {figure: float(value) for figure, value in found.items() if value is not None and math.isfinite(value)}


@dataclass(frozen=True)
class Compared:
    """A figure of a set-up: `lockstep`, `ros`: values by chair."""

    lockstep: tuple
    ros: tuple

    @property
    def mean(self) -> float:
        """Of the lockstep runs."""
        return float(np.mean(self.lockstep))

    @property
    def deviation(self) -> float:
        """The lockstep's spread over the chairs; not a number for one chair."""
        return float(np.std(self.lockstep, ddof=1)) if len(self.lockstep) > 1 else math.nan

    @property
    def apart(self) -> float:
        """The furthest run over ROS from the lockstep's mean, in deviations."""
        off = max(abs(value - self.mean) for value in self.ros)
        return 0.0 if off < 1e-9 else off / self.deviation if self.deviation > 0.0 else math.inf

    @property
    def agrees(self) -> bool | None:
        """None where one chair alone tells nothing of the spread."""
        return None if math.isnan(self.deviation) else self.apart <= LIMIT


def references(experiment: Experiment, ros: Values) -> list[Case]:
    """The Cases in lockstep with which an Experiment's drives over ROS, {(*set-up, seed): ...}, are compared; their
    keys begin with AS_NODES.
    """
    from sara_lab.experiments import as_nodes, drives

    set_ups = {key[:-1] for key in ros}
    return [
        replace(case, key=(AS_NODES, *case.key), options={**case.options, 'trace': False, 'kind': as_nodes.AsNodes})
        for case in experiment.cases(CHAIRS)
        if case.key[:-1] in set_ups and case.function is drives.course_driven
    ]


def side(experiment: Experiment, cases: Sequence[Case], results: Results) -> Values:
    """{(*set-up, seed): {Figure: value}} with which runs over ROS are compared: of the references among the `results`
    where a set-up has any, of its own Cases else.
    """
    found = {key[1:]: result for key, result in results.items() if key[0] == AS_NODES and key[1] == experiment.name}
    has = {key[:-1] for key in found}
    found.update({case.key: results[case.key] for case in cases if case.key[:-1] not in has})
    return {key: experiment.figures(result) for key, result in found.items()}


def compare(lockstep: Values, ros: Values) -> dict[tuple, dict[Figure, Compared]]:
    """{set-up: {Figure: Compared}} of {(*set-up, seed): {Figure: value}} both."""
    found = {}
    for set_up in dict.fromkeys(key[:-1] for key in ros):
        sides = [[figures for key, figures in sorted(side.items()) if key[:-1] == set_up] for side in (lockstep, ros)]
        names = [name for name in sides[1][0] if all(name in figures for side in sides for figures in side)]
        if all(sides):
            found[set_up] = {
                name: Compared(*(tuple(figures[name] for figures in side) for side in sides)) for name in names
            }
    return found


def file_of(name: str, folder: Path) -> Path:
    """Where an experiment's figures over ROS are kept."""
    return folder / f'{name}_ros.json'


def store(name: str, folder: Path, ros: Values, speed: float) -> None:
    """Put {(*set-up, seed): {Figure: value}} beside an experiment's page, in place of those of the same set-ups and
    chairs. `speed`: times real time.
    """
    path = file_of(name, folder)
    kept = {**(load(name, folder) if path.exists() else {}), **ros}
    drives = [
        {
            'set_up': list(key[:-1]),
            'chair': key[-1],
            'figures': [[figure.name, figure.digits, value] for figure, value in figures.items()],
        }
        for key, figures in sorted(kept.items())
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        json.dumps(rounded({'experiment': name, 'speed': speed, 'runs': drives}), indent=1, ensure_ascii=False) + '\n',
        encoding='utf-8',
    )


def load(name: str, folder: Path) -> Values:
    """What `store` has put there; empty where there is nothing."""
    path = file_of(name, folder)
    if not path.exists():
        return {}
    return {
        (*run['set_up'], run['chair']): {Figure(figure, digits): value for figure, digits, value in run['figures']}
        for run in json.loads(path.read_text(encoding='utf-8'))['runs']
    }


def with_ros(report: Report, name: str, lockstep: Values, ros: Values) -> Report:
    """The Report with a section on what came over ROS, its data, and a fault for each set-up that disagrees. Nothing is
    added where nothing was run.
    """
    compared = compare(lockstep, ros)
    if not compared:
        return report
    known = [(set_up, figure, of) for set_up, figures in compared.items() for figure, of in figures.items()]
    out = [(set_up, figure, of) for set_up, figure, of in known if of.agrees is False]
    faults = tuple(
        f'over ROS, {_called(set_up)}: {figure.name} {_values(figure, of)} instead of {of.mean:.{figure.digits}f} ± '
        f'{of.deviation:.{figure.digits}f}{_range(figure, of)}'
        for set_up, figure, of in out
    )
    return replace(
        report,
        sections=(*report.sections, ('Over ROS', _text(name, ros, known, out) + _table(compared, known))),
        data={**report.data, **_data(compared)},
        faults=(*report.faults, *faults),
    )


def _text(name, ros, known, out):
    """What was run, and how much of it agrees."""
    chairs = sorted({key[-1] for key in ros})
    verdict = (
        f'{len(known) - len(out)} of {len(known)} figures agree'
        if all(of.agrees is not None for _, _, of in known)
        else 'One chair in lockstep tells nothing of the spread: more `--seeds` do'
    )
    return (
        f'`rosrun sara_lab experiment {name} --ros`: the same descriptions through the launch files, the simulated '
        f'chair behind its adapter under all nodes; chair{"s" * (len(chairs) > 1)} {", ".join(map(str, chairs))}. '
        'Each cell: over ROS, chair by chair; in lockstep, mean ± standard deviation over '
        f'{max(len(of.lockstep) for _, _, of in known)} chairs (drives with the timing of nodes). Bold: more than '
        f"{LIMIT:g} deviations from lockstep's mean, with lockstep's least and greatest. {verdict}.\n\n"
    )


def _table(compared, known):
    """A row for each set-up; of one set-up, a row for each figure."""
    names = list(dict.fromkeys(figure for _, figure, _ in known))
    if len(compared) > 1:
        head, rows = (
            ('', *(figure.name for figure in names)),
            [
                (_called(set_up), *(_cell(figure, figures[figure]) if figure in figures else '' for figure in names))
                for set_up, figures in compared.items()
            ],
        )
    else:
        head, rows = ('', *map(_called, compared)), [(figure.name, _cell(figure, of)) for _, figure, of in known]
    return table(head, rows)


def _data(compared):
    return {
        'over_ros': {
            ' / '.join(map(str, set_up)): {
                figure.name: {
                    'ros': of.ros,
                    'lockstep_mean': of.mean,
                    'lockstep_deviation': of.deviation,
                    'apart': of.apart,
                    'agrees': of.agrees,
                }
                for figure, of in figures.items()
            }
            for set_up, figures in compared.items()
        }
    }


def _called(set_up):
    return ', '.join(map(str, set_up[1:])) or 'the chair on the bench'


def _values(figure, of):
    return ', '.join(f'{value:.{figure.digits}f}' for value in of.ros)


def _cell(figure, of):
    spread = '' if math.isnan(of.deviation) else f' ± {of.deviation:.{figure.digits}f}'
    text = f'{_values(figure, of)}; {of.mean:.{figure.digits}f}{spread}'
    return f'**{text}**{_range(figure, of)}' if of.agrees is False else text


def _range(figure, of):
    """What the chairs do in lockstep: where one in ten is lost, three deviations say little."""
    return f' ({min(of.lockstep):.{figure.digits}f} to {max(of.lockstep):.{figure.digits}f})'
