"""`again CASE`: a drive made again from its row, from nothing but the row: are all figures the same?

CASE is the row's `case` (`results "school, fused by case"`). Nothing that the first drive left behind is used, except
to compare. A row of other sources is refused: another commit's drive is made again by that commit.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow.compute as pc
import pyarrow.parquet as pq

from sara_common import platforms
from sara_common.config import ConfigError
from sara_lab.campaign.parts import PARTS, part_of
from sara_lab.campaign.results import rows
from sara_lab.campaign.results.command import add_folders
from sara_lab.campaign.results.recorded import Recording, RecordingError, recorded
from sara_lab.experiments import runner
from sara_lab.experiments.registry import EXPERIMENTS
from sara_lab.journeys.worlds.foreign import ForeignError
from sara_lab.workers.sources import fingerprint


class AgainError(ValueError):
    """A drive that cannot be made again; the sentence says why."""


class Found(NamedTuple):
    """A Row, and the file that it stands in."""

    row: rows.Row
    path: Path

    @property
    def kept(self) -> str | None:
        """What its case's file holds, without the commit, as JSON; None where there is no such file."""
        path = self.path.with_name(f'{self.row["case"]}.json')
        if not path.is_file():
            return None
        held = json.loads(path.read_text())
        held.pop('commit', None)
        return json.dumps(held)


def find(case: str, paths: Iterable[Path], sources: str, platform: str | None = None) -> Found:
    """The row of a case whose sources are `sources`, the newest. Raises AgainError where there is none, or only those
    of other sources.
    """
    others = []
    for path in paths:
        table = pq.read_table(path)
        held = table.filter(pc.equal(table.column('case'), case)).to_pylist()
        for row in held:
            if platform in (None, row['platform']) and row['sources'] == sources:
                return Found(row, path)
            others.append(f'sources {row["sources"]} (commit {row["commit"]}) on {row["platform"]}')
    if not others:
        raise AgainError(f'no row is called {case}')
    raise AgainError(
        f'{case} is of {", of ".join(dict.fromkeys(others))}; these are sources {sources} (commit {rows.commit()})'
    )


def drive_of(row: Mapping[str, Any], folder: Path, maps: Path | None = None) -> Callable[[], dict]:
    """What makes a row's drive. folder: for what cases keep. maps: of the part `worlds`. Raises AgainError."""
    part, case = row['part'], row['case']
    if part in PARTS:
        made = part_of(part, row['seeds'], folder, {'maps': maps} if part == 'worlds' else {})
        if case not in made.cases:
            raise AgainError(f'{part} has no case {case}' + (': it is of --maps' if part == 'worlds' else ''))
        return made.cases[case]
    for experiment in EXPERIMENTS.values():
        for one in experiment.cases(row['seed'] + 1):
            if ' '.join(map(str, one.key)) == case:
                return lambda: {**one.options, **runner.run([one], 1)[one.key], 'seed': one.seed}
    raise AgainError(f'there is no part and no experiment {part} with a case {case}')


def differences(found: Found, result: Mapping[str, Any]) -> list[str]:
    """A sentence for each figure of the result that is not the row's, and where its file holds something else."""
    row = found.row
    origin = rows.Origin(row['platform'], row['sources'], row['commit'])
    told = {**result, 'commit': row['commit'], 'seeds': row.get('seeds')}
    new = rows.rows(origin, row['part'], {row['case']: told})[0]
    said = [
        f'{name} was {old!r}, and is {new.get(name)!r}' for name, old in row.items() if not _same(old, new.get(name))
    ]
    if found.kept is not None and found.kept != json.dumps(result):
        said.append(f'{row["case"]}.json holds something else')
    return said


def _same(old, new):
    """Whether a row's figure is that of a result; where a column holds texts too, a row has its numbers as such."""
    return old == (str(new) if isinstance(old, str) and new is not None else new)


def main(argv: Sequence[str] | None = None) -> None:
    """Exit status 1 where a figure differs, 2 where the drive cannot be made again."""
    arguments = _arguments(argv)
    sources = fingerprint()
    try:
        found = find(arguments.case, rows.tables(arguments.folders), sources, arguments.platform)
        if platforms.chosen().name != found.row['platform']:  # one in a folder elsewhere is chosen by that
            platforms.choose(found.row['platform'])
        with tempfile.TemporaryDirectory(prefix='sara_again_') as folder:
            result, recording = recorded(drive_of(found.row, Path(folder), arguments.maps))
        _show(arguments, recording)
    except (AgainError, ConfigError, ForeignError, RecordingError, OSError) as error:
        print(f'again: {error}', file=sys.stderr)
        sys.exit(2)
    differ = differences(found, result)
    for sentence in differ:
        print(f'DIFFERS: {sentence}')
    if differ:
        sys.exit(1)
    file = '' if found.kept is None else ' and the file'
    print(f'{arguments.case}: {sum(value is not None for value in found.row.values())} figures{file} are the same')


def _arguments(argv):
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='again', description=__doc__, formatter_class=form)
    parser.add_argument('case', metavar='CASE', help="a row's case")
    add_folders(parser)
    parser.add_argument('--platform', help='of the row, where there are several of that name')
    parser.add_argument('--maps', type=Path, metavar='FOLDER', help='of the part worlds, as `campaign` was told')
    parser.add_argument('--figure', type=Path, metavar='F.png', help='its path on the map')
    parser.add_argument('--bag', type=Path, metavar='F.bag', help='poses, commands, goals and map, for judge and RViz')
    parser.add_argument('--mcap', type=Path, metavar='F.mcap', help='the same for Foxglove')
    return parser.parse_args(argv)


def _show(arguments: argparse.Namespace, recording: Recording | None) -> None:
    """Write the files that are asked for. Raises RecordingError, OSError."""
    if not (arguments.figure or arguments.bag or arguments.mcap):
        return
    if recording is None or not recording.samples:
        raise RecordingError(f'{arguments.case} is no drive of the whole stack in lockstep: there is nothing to show')
    if arguments.figure:
        recording.draw(arguments.figure, arguments.case)
    if arguments.bag or arguments.mcap:
        from sara_lab.ros.studies import drive_bag

        if arguments.bag:
            drive_bag.write_bag(arguments.bag, recording)
        if arguments.mcap:
            drive_bag.write_mcap(arguments.mcap, recording)
