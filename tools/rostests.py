"""Runs the rostests named in the packages' CMakeLists.txt side by side; JUnit files and logs go below a folder.

    tools/rostests.py build/test_results [--beside 2] [WORD ...]      WORD: only tests whose name contains one of them

Each test has a ROS_HOME and a folder for temporary files of its own, and rostest gives each a master on a free port.
The longest go first, as they were timed in the last run, or by their time limits.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

ROOT = Path(__file__).resolve().parent.parent
ADDED = re.compile(r'^\s*add_rostest\(([^\s)]+)(?:\s+ARGS\s+([^)]*))?\)', re.MULTILINE)
LIMIT = re.compile(r'time-limit="([0-9.]+)"')


@dataclass(frozen=True)
class RosTest:
    """`package`: its folder. `file`: of the launch file, from there. `arguments`: of the launch, name:=value."""

    package: Path
    file: str
    arguments: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Package, file and arguments, fit for a file's name."""
        words = [Path(self.file).stem, *self.arguments]
        return f'{self.package.name}.{"_".join(words)}'.replace(':=', '_')

    @property
    def limit(self) -> float:
        """The time (s) it may take, of all its parts."""
        return sum(map(float, LIMIT.findall((self.package / self.file).read_text(encoding='utf-8'))))


def find(source: Path) -> list[RosTest]:
    """The rostests of the packages below a folder."""
    found = []
    for path in sorted(source.glob('*/CMakeLists.txt')):
        for file, arguments in ADDED.findall(path.read_text(encoding='utf-8')):
            found.append(RosTest(path.parent, file, tuple(arguments.split())))
    return found


def run(test: RosTest, results: Path) -> tuple[int, float, float]:
    """(exit status, seconds, seconds of a core). A test that leaves no result leaves a failure here."""
    began = time.monotonic()
    folder = results / test.package.name
    folder.mkdir(parents=True, exist_ok=True)
    own = Path(tempfile.mkdtemp(prefix='rostest_'))
    env = {**os.environ, 'ROS_HOME': str(own), 'TMPDIR': str(own), 'XDG_RUNTIME_DIR': str(own)}
    env.pop('ROS_LOG_DIR', None)
    command = ['rostest', f'--pkgdir={test.package}', f'--package={test.package.name}']
    command += [f'--results-filename={test.name}.xml', f'--results-base-dir={results}']
    command += [str(test.package / test.file), *test.arguments]
    with open(folder / f'{test.name}.log', 'wb') as log:
        process = subprocess.Popen(command, env=env, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(process.pid, 0)  # what its nodes used counts
    status = process.returncode = os.waitstatus_to_exitcode(status)
    shutil.rmtree(own, ignore_errors=True)
    if not any(folder.glob(f'*{test.name}.xml')):
        message = quoteattr(f'rostest ended with status {status} and without a result')
        (folder / f'rostest-{test.name}.xml').write_text(
            f'<testsuite><testcase classname={quoteattr(test.name)} name="ran"><failure message={message}/></testcase>'
            '</testsuite>',
            encoding='utf-8',
        )
        status = status or 1
    return status, time.monotonic() - began, used.ru_utime + used.ru_stime


def main(arguments: list[str] | None = None) -> int:
    """Return 0 if every test passed."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').splitlines()[0])
    parser.add_argument('results', type=Path)
    parser.add_argument('words', nargs='*')
    parser.add_argument('--beside', type=int, default=max(2, os.cpu_count() or 1), help='how many at a time')
    options = parser.parse_args(arguments)
    results = options.results.resolve()
    timed = results.parent / 'rostest_seconds.json'
    seconds = json.loads(timed.read_text(encoding='utf-8')) if timed.exists() else {}
    tests = [test for test in find(ROOT / 'src') if not options.words or any(w in test.name for w in options.words)]
    tests.sort(key=lambda test: (-seconds.get(test.name, 0.0), -test.limit))
    lock, failed = threading.Lock(), []

    def one(test: RosTest) -> None:
        status, took, used = run(test, results)
        with lock:
            seconds[test.name] = round(took, 1)
            if status:
                failed.append(test.name)
            print(f'{"FAILED" if status else "passed"} {test.name} in {took:.0f} s, {used:.0f} s of a core', flush=True)

    with ThreadPoolExecutor(options.beside) as pool:
        list(pool.map(one, tests))
    timed.write_text(json.dumps(seconds, indent=1, sort_keys=True), encoding='utf-8')
    return 1 if failed or not tests else 0


if __name__ == '__main__':
    sys.exit(main())
