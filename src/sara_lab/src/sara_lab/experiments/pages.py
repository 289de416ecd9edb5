"""Writes an experiment's page, figures and JSON, and the summary of all; nothing in them tells when or where they were
made.
"""

import json

from sara_lab.experiments.core import rounded, table

SUMMARY = 'README.md'


def write(experiment, report, folder, seeds):
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


def page(experiment, report, seeds):
    """The page as markdown."""
    lines = [
        f'# {experiment.name}: {experiment.title}',
        '',
        f'`rosrun sara_lab experiment {experiment.name} --seeds {seeds}` writes this page; {_chairs(seeds)}.',
        '',
        experiment.setting.strip(),
        '',
        f'## Verdict: {report.verdict}',
        '',
        table(
            ('the thesis finds', 'we find', 'verdict'),
            [(theirs, ours, verdict) for theirs, ours, verdict in report.findings],
        ),
        '',
        '## Thesis / ours / what explains the difference',
        '',
        table(
            ('', 'thesis', 'ours', 'what explains the difference'),
            [(row.what, row.thesis, row.ours, row.why) for row in report.rows],
        ),
        '',
    ]
    for heading, text in report.sections:
        lines += [f'## {heading}', '', text.strip(), '']
    if report.figures:
        lines += ['## Figures', '']
    for figure in report.figures:
        lines += [f'![{figure.name}]({figure.name}.png)', '', f'*{figure.caption}*', '']
    if report.faults:
        lines += ['## Not met', '', *(f'- {fault}' for fault in report.faults), '']
    return '\n'.join(lines)


def _chairs(seeds):
    return f'{seeds} chairs, drawn by the seeds 0 to {seeds - 1}' if seeds > 1 else 'one chair, drawn by the seed 0'


def summary(experiments, folder):
    """The summary page of all experiments whose JSON is in `folder`; written there. Returns its text."""
    rows = []
    for name, experiment in experiments.items():
        path = folder / f'{name}.json'
        if not path.exists():
            rows.append((name, experiment.title, 'not run', '', ''))
            continue
        data = json.loads(path.read_text(encoding='utf-8'))
        rows.append(
            (
                f'[{name}]({name}.md)',
                experiment.title,
                data['verdict'] + (f'; {len(data["faults"])} not met' if data['faults'] else ''),
                str(data['seeds']),
                data['short'],
            )
        )
    text = '\n'.join(
        [
            "# The thesis's experiments, repeated",
            '',
            '`make experiments SEEDS=50` runs all of them in lockstep, on chairs drawn by seeds, and writes these pages; `rosrun sara_lab experiment E4` one of them.',
            'The thesis measured one chair once; what it could not know, the true pose, decides here.',
            '',
            table(('', 'what', 'verdict', 'chairs', 'in short'), rows),
            '',
        ]
    )
    (folder / SUMMARY).write_text(text, encoding='utf-8')
    return text
