"""`same_drive --count 200`: one drive in lockstep again and again, each time in a process of its own: is it the same to
the last bit, whatever lies in memory and however busy the machine is?

Each process has its freed and fresh memory filled with a byte of its own (glibc's MALLOC_PERTURB_) and its own order of
hashes (PYTHONHASHSEED); up to two processes keep the machine busy beside each.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from tqdm import tqdm

from sara_lab.campaign.fingerprints import DRIVES, Fingerprint, read
from sara_lab.workers.processes import cores

DRIVE = 'square left fused 0'
FINGERPRINTS = 'from sara_lab.campaign.fingerprints import main; main()'
BUSY = 'while True: pass'


def alone(name: str, environment: dict[str, str], busy: int) -> Fingerprint:
    """The Fingerprint of a drive of DRIVES in a process of its own, which has `environment` besides, while `busy`
    processes compute. Raises CalledProcessError.
    """
    with tempfile.TemporaryDirectory(prefix='sara_same_drive_') as folder, _busy(busy):
        out = Path(folder) / 'found.json'
        subprocess.run(
            [sys.executable, '-c', FINGERPRINTS, name, '--processes', '1', '--out', str(out)],
            env={**os.environ, **environment},
            check=True,
            capture_output=True,
        )
        return read(out)[name]


@contextmanager
def _busy(count: int) -> Iterator[None]:
    """So many processes compute meanwhile."""
    processes = [subprocess.Popen([sys.executable, '-c', BUSY]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def again(
    name: str, count: int, seed: int, run: Callable[[str, dict[str, str], int], Fingerprint] = alone
) -> Counter[Fingerprint]:
    """How often each Fingerprint was found in `count` runs of a drive, with progress on stderr. What the processes are
    like is drawn by `seed`. run: as `alone`.
    """
    drawn = random.Random(seed)
    ways = [
        (
            {'MALLOC_PERTURB_': str(drawn.randint(1, 255)), 'PYTHONHASHSEED': str(drawn.randint(0, 2**32 - 1))},
            drawn.randint(0, 2),
        )
        for _ in range(count)
    ]
    with ThreadPoolExecutor(cores()) as pool:
        found = pool.map(lambda way: run(name, *way), ways)
        return Counter(tqdm(found, total=count, unit='drive', file=sys.stderr))


def main(argv: list[str] | None = None) -> None:
    """Exit status 1 where two runs differ."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='same_drive', description=__doc__, formatter_class=form)
    names = [drive.name for drive in DRIVES]
    parser.add_argument(
        'drive', nargs='?', default=DRIVE, choices=names, metavar='DRIVE', help='a name of `fingerprints`'
    )
    parser.add_argument('--count', type=int, default=200, help='processes (default: %(default)s)')
    parser.add_argument('--seed', type=int, default=0, help='of what they are like (default: %(default)s)')
    arguments = parser.parse_args(argv)
    if arguments.count < 2:
        parser.error(f'--count is {arguments.count}, allowed are whole numbers of 2 or more')
    found = again(arguments.drive, arguments.count, arguments.seed)
    for one, times in found.most_common():
        print(f'{arguments.drive}: {one.hash}, {one.steps} steps, in {times} of {arguments.count} processes')
    sys.exit(0 if len(found) == 1 else 1)
