"""Writes an experiment's page, figures and JSON, and the summary of all; nothing in them tells when or where they were
made.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from sara_lab.experiments.core import rounded

if TYPE_CHECKING:
    from sara_lab.experiments.core import Experiment, Report

SUMMARY = 'README.md'


def write(experiment: Experiment, report: Report, folder: Path, seeds: int) -> list[str]:
    """E1.md, E1.json and the figures into `folder` (a Path). Returns the names written."""
    folder.mkdir(parents=True, exist_ok=True)
    for figure in report.figures:
        figure.draw(folder / f'{figure.name}.png')
    data = {
        'experiment': experiment.name,
        'title': experiment.title,
        'seeds': seeds,
        'verdict': report.verdict,
        'short': report.short,
        'findings': report.findings,
        'rows': [vars(row) for row in report.rows],
        'figures': [figure.name for figure in report.figures],
        'faults': report.faults,
        **report.data,
    }
    (folder / f'{experiment.name}.json').write_text(
        json.dumps(rounded(data), indent=1, ensure_ascii=False) + '\n', encoding='utf-8'
    )
    (folder / f'{experiment.name}.md').write_text(page(experiment, report, seeds), encoding='utf-8')
    return [f'{experiment.name}.md', f'{experiment.name}.json', *(f'{figure.name}.png' for figure in report.figures)]


def page(experiment: Experiment, report: Report, seeds: int) -> str:
    """The page as markdown."""
    lines = [
        f'# {experiment.name}: {experiment.title}',
        '',
        f'Written by `rosrun sara_lab experiment {experiment.name} --seeds {seeds}`.',
        '',
        experiment.setting.strip(),
        '',
        f'## Verdict: {report.verdict}',
        '',
        _findings(report),
        '',
    ]
    if report.rows:
        lines += ['## Figures', '', *_compared(report.rows), '']
    for heading, text in report.sections:
        lines += [f'## {heading}', '', text.strip(), '']
    if report.figures:
        lines += ['## Pictures', '']
    for figure in report.figures:
        lines += [f'![{figure.name}]({figure.name}.png)', '', f'*{figure.caption}*', '']
    if report.faults:
        lines += ['## Not met', '', *(f'- {fault}' for fault in report.faults), '']
    return '\n'.join(lines)


def _compared(rows):
    """Lines of a list: ours, the thesis's figure, and why they differ; what a line above explained is a ditto mark."""
    given = set()
    for row in rows:
        thesis = f'; thesis: {row.thesis}' if row.thesis != '-' else ''
        why = f' ({"″" if row.why in given else row.why})' if row.why else ''
        yield f'- {row.what}: **{row.ours}**{thesis}{why}'
        given |= {row.why}


def _findings(report):
    """The list of the findings; without their verdicts where all are the heading's."""
    alike = all(verdict == report.verdict for _, _, verdict in report.findings)
    lines = [f'- *{thesis}*{"" if alike else f" (**{verdict}**)"}: {ours}' for thesis, ours, verdict in report.findings]
    return '\n'.join(["*The thesis's finding*: ours.", '', *lines])


def summary(experiments: dict[str, Experiment], folder: Path) -> str:
    """The summary page of all experiments whose JSON is in `folder`; written there. Returns its text."""
    lines = []
    for name, experiment in experiments.items():
        path = folder / f'{name}.json'
        if not path.exists():
            lines.append(f'- {name}, {experiment.title}: not run')
            continue
        data = json.loads(path.read_text(encoding='utf-8'))
        verdict = data['verdict'] + (f'; {len(data["faults"])} not met' if data['faults'] else '')
        lines.append(f'- [{name}]({name}.md), {experiment.title} (**{verdict}**): {data["short"]}')
    text = '\n'.join(
        [
            "# The thesis's experiments, repeated",
            '',
            'Written by `make experiments SEEDS=50` ([how](../../src/sara_lab/docs/experiments.md)): as many simulated '
            'chairs in lockstep, whose true pose is known. The thesis measured one chair once.',
            'Brackets hold 95 % intervals of the mean; a single run is that of chair 0. Each page has a JSON file '
            'with all figures.',
            '',
            *lines,
            '',
        ]
    )
    (folder / SUMMARY).write_text(text, encoding='utf-8')
    return text
