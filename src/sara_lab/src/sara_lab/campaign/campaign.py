"""`make campaign`: everything that is judged over many chairs, in lockstep; resumable, with a table for each part and a
JSON of all figures.

A part is a set of cases, each with a file of its own in a subfolder of --out, which is another one once the robot, a
source, a parameter or a map is; a case that has its file is not run again. `results` answers
questions about the rows that are made of them. Cases run in as many processes as there are cores; what a process was at
that was killed is run again. Neither changes a figure.
"""

import argparse
import functools
import json
import sys
from pathlib import Path

from tqdm import tqdm

from sara_common import platforms
from sara_common.files import write_whole
from sara_lab.campaign.parts import DEFAULT_FOLDER, PARTS, part_of, text_by_name, text_of
from sara_lab.campaign.results import rows
from sara_lab.journeys.worlds.foreign import ForeignError
from sara_lab.rides.circuits import circuits
from sara_lab.workers import cluster_command
from sara_lab.workers.cluster import Cluster, ClusterError
from sara_lab.workers.processes import cores, each
from sara_lab.workers.sources import folder_of
from sara_sim.riders.riders import RIDERS

CHOICES = {'riders': tuple(RIDERS), 'circuits': tuple(circuits())}  # of the part `assisted`


def main() -> None:
    """Exit status 0 if every case meets its acceptance."""
    arguments = _arguments()
    folder = folder_of(arguments.out)
    folder.mkdir(parents=True, exist_ok=True)
    origin = rows.Origin(platforms.chosen().name, folder.name.rsplit('_', 1)[-1], rows.commit())
    figures_of, failed = {}, []
    for name in arguments.parts or PARTS:
        try:
            part = part_of(name, arguments.seeds, folder, _options_of(name, arguments))
            figures, bad = _run(name, part, folder, arguments, origin)
        except (ClusterError, ForeignError) as error:
            sys.exit(f'campaign: {error}')
        figures_of[name] = {'commit': origin.commit, 'seeds': arguments.seeds, **figures}
        failed += bad
    if arguments.json:
        _write(arguments.json, figures_of)
    sys.exit(1 if failed else 0)


def _arguments():
    parser = argparse.ArgumentParser(prog='campaign', description=__doc__)
    parser.add_argument('parts', nargs='*', metavar='PART', help=f'of {", ".join(PARTS)}; all without it')
    parser.add_argument('--seeds', type=int, default=50)
    parser.add_argument(
        '--out', type=Path, default=DEFAULT_FOLDER, help='resumed if it holds results of an earlier call'
    )
    parser.add_argument(
        '--json', type=Path, help='where the figures go, each part with its commit; parts that are not run keep theirs'
    )
    parser.add_argument(
        '--workers', type=int, default=cores(), metavar='N', help='processes (default: as there are cores, %(default)s)'
    )
    for choice, known in CHOICES.items():
        parser.add_argument(
            f'--{choice}', nargs='+', choices=known, metavar='NAME', help=f'of the part assisted: {", ".join(known)}'
        )
    parser.add_argument(
        '--maps', type=Path, metavar='FOLDER', help='of the part worlds: worlds of others, named by its worlds.yaml'
    )
    platforms.add_option(parser)
    cluster_command.add_options(parser)
    arguments = parser.parse_args()
    if arguments.maps and arguments.parts != ['worlds']:
        parser.error('--maps goes with the part worlds alone')
    if _chosen(arguments) and arguments.parts != ['assisted']:
        parser.error(f'--{" and --".join(_chosen(arguments))} go with the part assisted alone')
    unknown = [name for name in arguments.parts if name not in PARTS]
    if unknown:
        parser.error(f'there is no part {", ".join(unknown)}; there are {", ".join(PARTS)}')
    for name in ('seeds', 'workers'):
        if getattr(arguments, name) < 1:
            parser.error(f'--{name} is {getattr(arguments, name)}, allowed are whole numbers of 1 or more')
    arguments.where = cluster_command.asked(parser, arguments, arguments.workers)
    return arguments


def _options_of(name, arguments):
    """What a part takes beside seeds and folder."""
    return {'assisted': _chosen(arguments), 'worlds': {'maps': arguments.maps}}.get(name, {})


def _chosen(arguments):
    """{choice of `assisted`: names} that are given."""
    return {choice: names for choice in CHOICES if (names := getattr(arguments, choice))}


def _run(name, part, folder, arguments, origin):
    """Run a part's cases and print what came of them: (figures, [(case, faults) that failed])."""
    paths = {case: folder / f'{case}.json' for case in part.cases}
    missing = [case for case, path in paths.items() if not path.exists()]
    make = functools.partial(text_of, part, origin.commit)
    if isinstance(arguments.where, Cluster):
        make = functools.partial(text_by_name, name, arguments.seeds, _options_of(name, arguments), origin.commit)
    for case, text in tqdm(
        each(make, missing, arguments.where),
        desc=name,
        unit='case',
        total=len(paths),
        initial=len(paths) - len(missing),
    ):
        write_whole(paths[case], text)
    results = [json.loads(path.read_text()) for path in paths.values()]
    told = {case: {**result, 'seeds': arguments.seeds} for case, result in zip(part.cases, results)}
    rows.write(folder / f'{name}{rows.SUFFIX}', rows.rows(origin, name, told))
    lines, figures = part.summary(results)
    bad = [(case, result['faults']) for case, result in zip(part.cases, results) if result['faults']]
    bad += [(name, [sentence]) for sentence in part.verdict(figures)]
    print(f'\n{name}: {len(results) - sum(bool(result["faults"]) for result in results)} of {len(results)} passed')
    print('\n'.join(lines + [f'NOT MET: {case}: {"; ".join(faults)}' for case, faults in bad]), flush=True)
    return {'cases': len(results), 'failed': [case for case, _ in bad], **figures}, bad


def _write(path, figures_of):
    """Write the figures; parts that were not run keep theirs."""
    before = json.loads(path.read_text()) if path.exists() else {}
    kept = {name: figures_of.get(name, before.get(name)) for name in PARTS if name in figures_of or name in before}
    write_whole(path, json.dumps(kept, indent=1) + '\n')
