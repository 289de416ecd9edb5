"""`bench`: every figure of speed in one table, each with the yardstick before and after it and the C++ peer beside it.

    rosrun sara_lab bench [--only NAME ...] [--check] [--save-baseline] [--out out]

Each bench runs in a process of its own, so that its memory is its own and nothing is warm that would not be. `--check`
names what got slower than docs/bench.json says and ends with status 1 if anything did; `--save-baseline` writes
docs/bench.json, docs/bench.md and its figure.
"""

import argparse
import contextlib
import importlib
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from sara_bringup.paths import share
from sara_lab.benches import baseline, growth_plot, page, table, yardstick
from sara_lab.benches.timed import PEERS_YARDSTICK_MS, Row, Timed

BENCHES = {
    'frames': 'sara_lab.benches.filters:frames',
    'bus': 'sara_lab.ros.benches.bench_live:bus',
    'odometry': 'sara_lab.ros.benches.bench_live:odometry',
    'filter_core': 'sara_lab.benches.filters:filter_core',
    'filter_nodes': 'sara_lab.ros.benches.bench_live:filter_nodes',
    'amcl': 'sara_lab.benches.amcl:update',
    'offline': 'sara_lab.ros.benches.bench_offline:bags',
    'costmaps': 'sara_lab.benches.navigation:costmaps',
    'global_planners': 'sara_lab.benches.navigation:global_planners',
    'local_planners': 'sara_lab.benches.navigation:local_planners',
    'shared_control': 'sara_lab.benches.shared_control:law',
    'move_base': 'sara_lab.ros.benches.bench_live:move_base',
    'slam_gmapping': 'sara_lab.ros.benches.bench_live:slam_gmapping',
    'lockstep': 'sara_lab.benches.lockstep:square',
    'results': 'sara_lab.benches.results:question',
    'stack': 'sara_lab.ros.benches.bench_stack:stack',
    'hmi': 'sara_lab.ros.benches.bench_hmi:touch_screen',
    'hmi_browser': 'sara_lab.ros.benches.bench_hmi_browser:touch_screen',
    'planning_growth': 'sara_lab.benches.growth:planning',
    'filtering_growth': 'sara_lab.benches.growth:filtering',
    'costmap_growth': 'sara_lab.benches.growth:windows',
    'amcl_growth': 'sara_lab.benches.amcl:growth',
}
"""Where each generator of Timed is, or of lists of Timed that were measured at the same time."""
OTHERS = ('bus', 'odometry', 'filter_nodes', 'move_base', 'slam_gmapping', 'stack', 'hmi', 'hmi_browser')
"""Benches of other processes: how much memory this one holds says nothing."""


PATIENCE_S = 300.0  # for one bench


def rows(name: str, benches: dict[str, str] | None = None) -> Iterator[Row]:
    """Yield the Rows of a bench, each with the yardstick before and after it; what a bench raises becomes a Row that
    says so.
    """
    module, _, function = (benches or BENCHES)[name].partition(':')
    figures, before = None, yardstick.measure()
    while True:
        try:
            figures = figures or iter(getattr(importlib.import_module(module), function)())
            together = next(figures)
        except StopIteration:
            return
        except Exception as error:  # whatever a bench meets, the others are to be measured
            yield Row.of(Timed(name, text=f'failed: {type(error).__name__}: {error}'), name, before, before)
            return
        after = yardstick.measure()
        for figure in together if isinstance(together, list) else [together]:
            if figure.memory is None and not figure.skipped and name not in OTHERS:
                figure = replace(figure, memory=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)
            yield Row.of(figure, name, before, after)
        before = after


def child(name: str, path: Path | str, benches: dict[str, str] | None = None) -> None:
    """Run one bench in this process; rows are printed as they come, and written to a file as JSON."""
    found = []
    for row in rows(name, benches):
        print(table.line(row), flush=True)
        found.append(row.to_json())
    Path(path).write_text(json.dumps(found))


def _end(process):
    """End a bench, and the nodes that it started, if it still runs."""
    for how in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        if process.poll() is not None:
            return
        os.killpg(process.pid, how)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(20.0)


def run(names: Sequence[str], out: Path) -> list[Row]:
    """The Rows of these benches, each in a process of its own."""
    found = []
    for number, name in enumerate(names, 1):
        began = time.monotonic()
        print(f'[{number} of {len(names)}] {name}', flush=True)
        with tempfile.TemporaryDirectory(prefix='sara_') as folder:
            path = Path(folder) / 'rows.json'
            process = subprocess.Popen(
                [sys.executable, '-m', 'sara_lab.ros.benches.bench', '--child', name, str(path)],
                start_new_session=True,
                env={**os.environ, 'ROS_LOG_DIR': str(out / 'log')},
            )
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                print(f'  {name} has not ended after {PATIENCE_S:.0f} s: it is given up', flush=True)
            finally:
                _end(process)
            if path.is_file():
                found += [Row.from_json(entry) for entry in json.loads(path.read_text())]
            else:
                found.append(
                    Row.of(
                        Timed(name, text='failed: its process ended without a result'),
                        name,
                        PEERS_YARDSTICK_MS,
                        PEERS_YARDSTICK_MS,
                    )
                )
        print(f'    {time.monotonic() - began:.0f} s', flush=True)
    return found


def docs() -> Path:
    """docs/ of the workspace, or of the working directory where there is none."""
    folder = share().resolve().parents[1] / 'docs'
    return folder if folder.is_dir() else Path('docs')


def load(path: Path | str) -> list[Row]:
    """The Rows of a JSON file."""
    return [Row.from_json(entry) for entry in json.loads(Path(path).read_text())['rows']]


def write(found: Sequence[Row], folder: Path, prefix: str) -> None:
    """PREFIX.json, PREFIX.md and images of Rows into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f'{prefix}.json').write_text(
        json.dumps({'peers_yardstick_ms': PEERS_YARDSTICK_MS, 'rows': [row.to_json() for row in found]}, indent=1)
        + '\n'
    )
    drawn = growth_plot.draw(found, folder / 'images' / f'{prefix}_growth.png')
    (folder / f'{prefix}.md').write_text(page.page(found, f'images/{prefix}_growth.png' if drawn else None))


def check(found: Sequence[Row], known: dict[str, dict], whole: bool, tolerance: float) -> bool:
    """Print what got slower and what is missing; returns whether anything was."""
    slower = baseline.slower(found, known, tolerance)
    for entry in slower:
        print(f'SLOWER: {entry}')
    absent = baseline.missing(found, known) if whole else []
    for name in absent:
        print(f'NOT MEASURED, but in the baseline: {name}')
    print(
        f'{len(slower)} of {sum(not row.skipped for row in found)} figures got worse by more than '
        f'{100 * tolerance:.0f} %'
    )
    return bool(slower or absent)


def main() -> None:
    """Exit status 1 if --check finds anything."""
    parser = argparse.ArgumentParser(prog='bench', description=__doc__.splitlines()[0])
    parser.add_argument('--only', nargs='+', metavar='NAME', choices=BENCHES, help=f'of {", ".join(BENCHES)}')
    parser.add_argument('--check', action='store_true', help='compare with docs/bench.json')
    parser.add_argument(
        '--tolerance', type=float, default=baseline.TOLERANCE, help='share by which a figure may be worse'
    )
    parser.add_argument(
        '--results', type=Path, metavar='FILE.json', help='measure nothing: take the figures of an earlier run'
    )
    parser.add_argument(
        '--save-baseline', action='store_true', help='write docs/bench.json, docs/bench.md and its figure'
    )
    parser.add_argument('--out', type=Path, default=Path('out'), help='folder of bench.json and bench.md')
    parser.add_argument('--child', nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        return child(*arguments.child)
    known = docs() / 'bench.json'
    if arguments.check and not known.is_file():
        parser.error(f'there is no baseline {known}: make one with --save-baseline')
    out = arguments.out.resolve()
    names = arguments.only or list(BENCHES)
    found = load(arguments.results) if arguments.results else run(names, out)
    write(found, out, 'bench')
    print('\n' + table.markdown(found))
    for row in found:
        if row.met is False:
            print(f'NOT MET: {row.name}: {table.wanted(row)}')
    baseline_rows = load(known) if arguments.check else []
    if arguments.save_baseline:
        if arguments.only:
            found = merged(load(known), found) if known.is_file() else found
        write(found, docs(), 'bench')
    status = 0
    if arguments.check:
        status = int(check(found, baseline_rows, not arguments.only, arguments.tolerance))
    sys.exit(status)


def merged(old: list[Row], new: list[Row]) -> list[Row]:
    """The old Rows with those of the benches that were measured anew replaced, in the benches' order."""
    fresh = {row.bench for row in new}
    rows_ = [row for row in old if row.bench not in fresh] + new
    return sorted(rows_, key=lambda row: list(BENCHES).index(row.bench) if row.bench in BENCHES else len(BENCHES))


if __name__ == '__main__':
    main()
