#!/usr/bin/env python3
"""Mutation testing: each small change of a module must make a unit test fail. `tools/mutants.py [NAME ...]`

The modules are the safety gate, the motor node's mode ASSISTED, and the touch screen's freshness and sessions. Works on
copies in build/mutants, so that no mutant is ever in the sources. First every line and branch must be covered; then
cosmic-ray changes one operator or number at a time. A survivor is accepted only if docs/mutants.md of its package lists
it (the line before and the line after) as one that changes no behaviour, or if it changes the `|` of a type hint, which
nobody evaluates. Ends with status 1 if another is left. An interrupted run goes on where it was.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Target:
    """What is mutated: a module of a package, below src/PACKAGE. judged_by: modules that a result depends on. tests,
    files: what else is copied, from the package's folder.
    """

    package: str
    module: str
    judged_by: tuple[str, ...]
    tests: tuple[str, ...]
    files: tuple[str, ...] = ()

    @property
    def folder(self) -> Path:
        """The package's."""
        return ROOT / 'src' / self.package

    @property
    def work(self) -> Path:
        """Where the copy is."""
        return ROOT / 'build' / 'mutants' / f'{self.package}_{Path(self.module).name}'

    @property
    def path(self) -> str:
        """The module's, from the copy."""
        return f'src/{self.package}/{self.module}.py'

    @property
    def pytest(self) -> list[str]:
        """The command that judges."""
        return [sys.executable, '-m', 'pytest', '-x', '-q', '-p', 'no:cacheprovider', '-p', 'stable', *self.tests]


TARGETS = {
    'gate': Target(
        'sara_control',
        'gate/safety',
        (
            'gate/reasons',
            'gate/comfort',
            'zones/zones',
            'zones/caution',
            'zones/approach_detector',
            'gate/guard',
            'gate/gate_config',
            'gate/safety',
        ),
        ('test/unit/test_safety.py', 'test/unit/test_caution.py', 'test/unit/test_backlog.py'),
        ('config/safety.yaml', 'test/unit/test_guard.py'),
    ),
    'backlog': Target(
        'sara_control',
        'gate/backlog',
        ('gate/backlog', 'gate/guard', 'gate/safety'),
        ('test/unit/test_backlog.py',),
        ('config/safety.yaml', 'test/unit/test_guard.py'),
    ),
    'assistance': Target(
        'sara_lowlevel',
        'motor/assistance',
        ('config', 'motor/motor_node', 'motor/command_guard', 'motor/assistance', 'joystick/joystick_node'),
        ('test/unit/test_assistance.py',),
    ),
    'freshness': Target(
        'sara_hmi', 'freshness/freshness', ('config/config', 'freshness/freshness'), ('test/unit/test_freshness.py',)
    ),
    'sessions': Target(
        'sara_hmi', 'sessions/sessions', ('config/config', 'sessions/sessions'), ('test/unit/test_sessions.py',)
    ),
}
STABLE = """import hypothesis
hypothesis.settings.register_profile('stable', deadline=None, derandomize=True, database=None, max_examples=20)
hypothesis.settings.load_profile('stable')
"""


def sources(target):
    """A digest of all that the result depends on."""
    modules = (target.folder / 'src' / target.package / f'{name}.py' for name in target.judged_by)
    files = [*modules, *(target.folder / path for path in (*target.tests, *target.files))]
    return hashlib.sha256(b''.join([sys.executable.encode(), *(path.read_bytes() for path in files)])).hexdigest()


def prepare(target):
    """A copy of the package, and a session; those of an interrupted run if nothing has changed since."""
    work = target.work
    if (work / 'digest').exists() and (work / 'digest').read_text() == sources(target):
        shutil.copy(target.folder / target.path, work / target.path)  # an interrupted run leaves its last mutant there
        return
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(
        target.folder / 'src' / target.package,
        work / 'src' / target.package,
        ignore=shutil.ignore_patterns('ros', '__pycache__'),
    )
    for path in (*target.tests, *target.files):
        (work / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(target.folder / path, work / path)
    (work / 'stable.py').write_text(STABLE)
    command = ' '.join(target.pytest)
    (work / 'config.toml').write_text(
        f'[cosmic-ray]\nmodule-path = "{target.path}"\ntimeout = 60.0\nexcluded-modules = []\n'
        f'test-command = "{command}"\n\n'
        '[cosmic-ray.distributor]\nname = "local"\n'
    )
    print(f'== mutants of {target.path}: lines and branches', flush=True)
    run(target, [sys.executable, '-m', 'coverage', 'run', '--branch', f'--include={target.path}', *target.pytest[1:]])
    run(target, [sys.executable, '-m', 'coverage', 'report', '-m', '--fail-under=100'])
    run(target, [tool('cosmic-ray'), 'init', 'config.toml', 'session.sqlite'])
    (work / 'digest').write_text(sources(target))


def tool(name):
    """A command beside this interpreter."""
    return str(Path(sys.executable).parent / name)


def run(target, command, **more):
    """A command in the copy, by its code and no other; ends the program where it fails."""
    path = os.pathsep.join([str(target.work / 'src'), str(target.work), os.environ.get('PYTHONPATH', '')])
    environment = {**os.environ, 'PYTHONPATH': path, 'PYTHONDONTWRITEBYTECODE': '1'}
    done = subprocess.run(command, cwd=target.work, env=environment, check=False, **more)
    if done.returncode:
        sys.exit(f'{" ".join(command)} failed')
    return done


def results(target):
    """(operator, line before, line after, outcome) of each mutant, outcome 'killed', 'survived' or ..."""
    rows = []
    for line in run(
        target, [tool('cosmic-ray'), 'dump', 'session.sqlite'], capture_output=True, text=True
    ).stdout.splitlines():
        item, result = json.loads(line)
        diff = (result or {}).get('diff') or ''
        before = [text[1:].strip() for text in diff.splitlines() if text.startswith('-') and not text.startswith('---')]
        after = [text[1:].strip() for text in diff.splitlines() if text.startswith('+') and not text.startswith('+++')]
        rows.append(
            (
                item['mutations'][0]['operator_name'],
                ' '.join(before),
                ' '.join(after),
                (result or {}).get('test_outcome') or 'pending',
            )
        )
    return rows


def judge(target):
    """Run; prints the survivors. Whether none is left that is not explained."""
    prepare(target)
    print(f'== mutants of {target.path}: one change at a time', flush=True)
    run(target, [tool('cosmic-ray'), 'exec', 'config.toml', 'session.sqlite'])
    rows = results(target)
    known = (target.folder / 'docs' / 'mutants.md').read_text()
    alive = [row for row in rows if 'killed' not in row[3].lower() and '_BitOr_' not in row[0]]
    hints = sum('killed' not in row[3].lower() for row in rows) - len(alive)
    new = [row for row in alive if f'`{row[1]}`' not in known or f'`{row[2]}`' not in known]
    for operator, before, after, outcome in new:
        print(f'{outcome}: {operator}\n  - {before}\n  + {after}')
    print(
        f'{target.path}: {len(rows)} mutants: {len(rows) - len(alive) - hints} killed, {hints} in type hints, '
        f'{len(alive) - len(new)} known to change '
        f'nothing, {len(new)} survived'
    )
    return bool(rows) and not new


def main():
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('names', nargs='*', metavar='NAME', help=f'of {", ".join(TARGETS)}; without any, all')
    names = parser.parse_args().names
    wrong = [name for name in names if name not in TARGETS]
    if wrong:
        parser.error(f'there is no {wrong[0]}; there are {", ".join(TARGETS)}')
    judged = [judge(TARGETS[name]) for name in names or TARGETS]
    sys.exit(0 if all(judged) else 1)


if __name__ == '__main__':
    main()
