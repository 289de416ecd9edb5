#!/usr/bin/env python3
"""Mutation testing of the safety gate: each small change of safety.py must make a unit test fail.

Works on a copy in build/mutants, so that no mutant is ever in the sources. First every line and branch must be covered;
then cosmic-ray changes one operator or number at a time. A survivor is accepted only if docs/mutants.md of
sara_control lists it (the line before and the line after) as one that changes no behaviour. Ends with status 1 if
another is left. An interrupted run goes on where it was.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / 'build' / 'mutants'
PACKAGE = ROOT / 'src' / 'sara_control'
MODULE = 'src/sara_control/gate/safety.py'
JUDGED_BY = (
    'gate/reasons',
    'gate/comfort',
    'zones/zones',
    'zones/caution',
    'zones/approach_detector',
    'gate/guard',
    'gate/gate_config',
    'gate/safety',
)  # what a result depends on
TESTS = ('test/unit/test_safety.py', 'test/unit/test_caution.py')
CONFIG = 'config/safety.yaml'
PYTEST = [sys.executable, '-m', 'pytest', '-x', '-q', '-p', 'no:cacheprovider', '-p', 'stable', *TESTS]
STABLE = """import hypothesis
hypothesis.settings.register_profile('stable', derandomize=True, database=None, max_examples=20)
hypothesis.settings.load_profile('stable')
"""


def sources():
    """A digest of all that the result depends on."""
    modules = (PACKAGE / 'src' / 'sara_control' / f'{name}.py' for name in JUDGED_BY)
    files = [*modules, *(PACKAGE / path for path in (*TESTS, CONFIG))]
    return hashlib.sha256(b''.join([sys.executable.encode(), *(path.read_bytes() for path in files)])).hexdigest()


def prepare():
    """A copy of the package, and a session; those of an interrupted run if nothing has changed since."""
    if (WORK / 'digest').exists() and (WORK / 'digest').read_text() == sources():
        return
    shutil.rmtree(WORK, ignore_errors=True)
    shutil.copytree(
        PACKAGE / 'src' / 'sara_control',
        WORK / 'src' / 'sara_control',
        ignore=shutil.ignore_patterns('ros', '__pycache__'),
    )
    for path in (*TESTS, CONFIG):
        (WORK / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(PACKAGE / path, WORK / path)
    (WORK / 'stable.py').write_text(STABLE)
    command = ' '.join(PYTEST)
    (WORK / 'config.toml').write_text(
        f'[cosmic-ray]\nmodule-path = "{MODULE}"\ntimeout = 60.0\nexcluded-modules = []\ntest-command = "{command}"\n\n'
        '[cosmic-ray.distributor]\nname = "local"\n'
    )
    print('== mutants: lines and branches', flush=True)
    run([sys.executable, '-m', 'coverage', 'run', '--branch', f'--include={MODULE}', *PYTEST[1:]])
    run([sys.executable, '-m', 'coverage', 'report', '-m', '--fail-under=100'])
    run([tool('cosmic-ray'), 'init', 'config.toml', 'session.sqlite'])
    (WORK / 'digest').write_text(sources())


def tool(name):
    """A command beside this interpreter."""
    return str(Path(sys.executable).parent / name)


def run(command, **more):
    """A command in the copy, by its code and no other; ends the program where it fails."""
    path = os.pathsep.join([str(WORK / 'src'), str(WORK), os.environ.get('PYTHONPATH', '')])
    environment = {**os.environ, 'PYTHONPATH': path, 'PYTHONDONTWRITEBYTECODE': '1'}
    done = subprocess.run(command, cwd=WORK, env=environment, check=False, **more)
    if done.returncode:
        sys.exit(f'{" ".join(command)} failed')
    return done


def results():
    """(operator, line before, line after, outcome) of each mutant, outcome 'killed', 'survived' or ..."""
    rows = []
    for line in run([tool('cosmic-ray'), 'dump', 'session.sqlite'], capture_output=True, text=True).stdout.splitlines():
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


def main():
    """Run; prints the survivors."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    prepare()
    print('== mutants: one change at a time', flush=True)
    run([tool('cosmic-ray'), 'exec', 'config.toml', 'session.sqlite'])
    rows = results()
    known = (PACKAGE / 'docs' / 'mutants.md').read_text()
    alive = [row for row in rows if 'killed' not in row[3].lower()]
    new = [row for row in alive if f'`{row[1]}`' not in known or f'`{row[2]}`' not in known]
    for operator, before, after, outcome in new:
        print(f'{outcome}: {operator}\n  - {before}\n  + {after}')
    print(
        f'{len(rows)} mutants: {len(rows) - len(alive)} killed, {len(alive) - len(new)} known to change nothing, '
        f'{len(new)} survived'
    )
    sys.exit(1 if new or not rows else 0)


if __name__ == '__main__':
    main()
