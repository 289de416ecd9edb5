"""`make arm64`: sets up, builds and tests SARA on an arm64 Debian 12, emulated by QEMU; writes the tables of
docs/arm64.md.

    tools/arm64.py [--cache FOLDER] [--workers N] [--packages NAME ...] [STEP ...]

Steps: root setup build units square memory page; without one, all.

Needs root, debootstrap and qemu-user-static, and proot where the kernel has no binfmt_misc. It takes hours: the root
and every result are kept in the cache folder, and what is there and fresh is not made again.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import arm64_memory
import arm64_results
from arm64_root import ROOT, Machine, copy_tree, isolate, machine, say, tracked

CACHE = Path(os.environ.get('XDG_CACHE_HOME', Path.home() / '.cache')) / 'sara' / 'arm64'
PAGE = ROOT / 'docs' / 'arm64.md'
UNIT_LIMIT_S = 7200  # of one file of tests
UNIT = (
    'source devel/setup.bash; PYTHONPATH="$PWD/tools:$PYTHONPATH" timeout {limit} .venv/bin/python3 -m pytest '
    '-p hide_ros -p steady --import-mode=importlib -q -p no:cacheprovider --junit-xml={junit} {file}'
)
SQUARE = 'source devel/setup.bash; rosrun sara_lab experiment square --seed 3 --json'


def setup(arm: Machine) -> None:
    """Copy the working tree into the root, and install there what it needs, as on any Debian 12."""
    copy_tree(arm.tree)
    arm.run(f'apt-get update; apt-get {arm.apt_options} install git make')
    arm.run('make setup')


def build(arm: Machine) -> None:
    """Build the workspace in the root."""
    copy_tree(arm.tree)
    arm.run('make build')


def units(arm: Machine, workers: int, packages: list[str]) -> None:
    """Run the files of unit tests of packages (none: of all) that have no fresh result, the smallest packages first."""
    copy_tree(arm.tree)
    known, found = arm64_results.keys(ROOT, tracked()), arm64_results.unit_files(ROOT)
    files = [(package, file) for package in found for file in found[package] if package in (packages or found)]
    waiting = [(package, file) for package, file in files if not is_fresh(arm, file, known[package])]
    say(f'{len(waiting)} of {len(files)} files of unit tests to run')
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(lambda job: run_unit(arm, job[1], known[job[0]]), waiting))


def result_of(arm: Machine, file: str) -> Path:
    """Where the result of a file of tests is kept."""
    return arm.cache / 'units' / Path(file).with_suffix('.json')


def is_fresh(arm: Machine, file: str, key: str) -> bool:
    """Whether a file of tests has a result with this key."""
    path = result_of(arm, file)
    return path.exists() and json.loads(path.read_text(encoding='utf-8'))['key'] == key


def run_unit(arm: Machine, file: str, key: str) -> None:
    """Run one file of tests in the root and keep its result: .json, .xml (JUnit) and .log."""
    path = result_of(arm, file)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    junit = Path('tmp') / f'{file.replace("/", "_")}.xml'
    (arm.root / junit).unlink(missing_ok=True)
    began = time.monotonic()
    script = UNIT.format(limit=UNIT_LIMIT_S, junit=f'/{junit}', file=file)
    with open(path.with_suffix('.log'), 'wb') as log:
        status = subprocess.run(
            arm.command(script), stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT
        ).returncode
    took = time.monotonic() - began
    path.with_suffix('.xml').unlink(missing_ok=True)
    if (arm.root / junit).exists():
        shutil.move(arm.root / junit, path.with_suffix('.xml'))
    end = f'not finished in {UNIT_LIMIT_S} s' if status == 124 else f'pytest ended with status {status}'
    told = {'file': file, 'key': key, 'seconds': round(took, 1), 'end': end}
    path.write_text(json.dumps(told), encoding='utf-8')
    say(f'{"passed" if status == 0 else "FAILED"} {file} in {took:.0f} s')


def square(arm: Machine) -> None:
    """Drive the lockstep square in the root and here; keep both JSON values."""
    for name, command in {'arm64': arm.command(SQUARE), 'here': ['bash', '-ec', SQUARE]}.items():
        with open(arm.log, 'ab') as log:
            done = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log)
        if done.returncode:
            arm.fail('experiment square')
        (arm.cache / f'square_{name}.json').write_bytes(done.stdout)


def page(arm: Machine) -> None:
    """Write what is there so far into the page."""
    known, counts = arm64_results.keys(ROOT, tracked()), {}
    for package, files in arm64_results.unit_files(ROOT).items():
        counts[package] = count = arm64_results.Count()
        for file in files:
            if is_fresh(arm, file, known[package]):
                count.add(result_of(arm, file))
            else:
                count.waiting.append(file)
    parts = {'Unit tests': arm64_results.units_table(counts), 'The square': ['Not run.'], 'Memory': ['Not measured.']}
    squares = [arm.cache / f'square_{name}.json' for name in ('arm64', 'here')]
    if all(path.exists() for path in squares):
        parts['The square'] = arm64_results.square_lines(*(json.loads(path.read_text()) for path in squares))
    if (arm.cache / 'memory.json').exists():
        parts['Memory'] = arm64_memory.table(json.loads((arm.cache / 'memory.json').read_text()))
    PAGE.write_text(arm64_results.write_page(PAGE.read_text(encoding='utf-8'), parts), encoding='utf-8')
    say(f'{PAGE.relative_to(ROOT)} is written')


def main(arguments: list[str] | None = None) -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description='SARA on an emulated arm64 Debian 12')
    parser.add_argument('steps', nargs='*', metavar='STEP', help='root setup build units square memory page')
    parser.add_argument('--cache', type=Path, default=CACHE, help='where the root and the results are kept')
    parser.add_argument('--workers', type=int, default=os.cpu_count(), help='how many files of tests at a time')
    parser.add_argument('--packages', nargs='+', default=[], help='whose unit tests are run; default: all')
    options = parser.parse_args(arguments)
    steps: dict[str, Callable[[Machine], None]] = {
        'root': Machine.make,
        'setup': setup,
        'build': build,
        'units': lambda arm: units(arm, options.workers, options.packages),
        'square': square,
        'memory': arm64_memory.measure,
        'page': page,
    }
    if unknown := [step for step in options.steps if step not in steps]:
        parser.error(f'no such step: {", ".join(unknown)}; there are {", ".join(steps)}')
    isolate()
    arm = machine(options.cache.resolve())
    for name in options.steps or steps:
        say(name)
        steps[name](arm)
    return 0


if __name__ == '__main__':
    sys.exit(main())
