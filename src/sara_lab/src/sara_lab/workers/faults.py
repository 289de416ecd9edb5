"""`cluster_faults --count 10`: worker, scheduler and client of a cluster of this machine are killed (SIGKILL) ten times
each while short work is shared out: what is written must be that of an undisturbed run, byte by byte, each once.

Then the overhead against the same work done here, two workers against one, and the scheduler's greatest memory over
--short tasks.
"""

from __future__ import annotations

import argparse
import functools
import hashlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from sara_common.files import write_whole
from sara_lab.workers.cluster import Cluster
from sara_lab.workers.cluster_command import key
from sara_lab.workers.cost import cpu_seconds, descendants, peak_memory_mb
from sara_lab.workers.processes import each

VICTIMS = ('worker', 'scheduler', 'client')
WAIT_S = 300.0
COMMAND = 'from sara_lab.workers.cluster_command import main; main()'
CLIENT = 'from sara_lab.workers.faults import client; client()'


def work(rounds: int, item: int) -> str:
    """What is done for an item: so many hashes, one of the other."""
    found = str(item).encode()
    for _ in range(rounds):
        found = hashlib.sha256(found).digest()
    return found.hex()


def client(argv: Sequence[str] | None = None) -> None:
    """A process that lets a cluster do what has no file yet: ADDRESS FOLDER ITEMS ROUNDS. Each item adds a line to
    FOLDER/log.
    """
    address, folder, items, rounds = sys.argv[1:] if argv is None else argv
    missing = [item for item in range(int(items)) if not (Path(folder) / f'{item}.txt').exists()]
    for item, text in each(functools.partial(work, int(rounds)), missing, Cluster(address, key())):
        write_whole(Path(folder) / f'{item}.txt', text)
        with (Path(folder) / 'log').open('a') as log:
            log.write(f'{item}\n')


class Parties:
    """Scheduler and workers of a cluster on a free port of this machine, as processes that begin in a folder; `tls`: as
    Cluster has it.
    """

    def __init__(self, folder: Path, processes: int, tls: Path | None = None) -> None:
        with socket.socket() as free:
            free.bind(('127.0.0.1', 0))
            self.port = free.getsockname()[1]
        self.address = f'{"tls" if tls else "tcp"}://127.0.0.1:{self.port}'
        self._folder, self._tls = folder, ('--tls', str(tls)) if tls else ()
        self.scheduler = self._scheduler()
        self.workers = self._begin('worker', self.address, '--processes', str(processes))

    def __enter__(self) -> Parties:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (self.workers, self.scheduler):
            process.terminate()
        for process in (self.workers, self.scheduler):
            try:
                process.wait(10.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def kill_scheduler(self) -> None:
        """SIGKILL, and a new one at the same address."""
        self.scheduler.kill()
        self.scheduler.wait()
        self.scheduler = self._scheduler()

    def kill_worker(self) -> None:
        """SIGKILL to a process that works; its nanny begins another."""
        _until(self._working, None)
        os.kill(self._working()[0], signal.SIGKILL)

    def _working(self):
        return [pid for pid in descendants(self.workers.pid) if 'spawn_main' in _words(pid)]

    def cpu(self) -> float:
        """s of CPU that scheduler and workers have used."""
        return sum(map(cpu_seconds, (self.scheduler.pid, *descendants(self.workers.pid))))

    def scheduler_peak_mb(self) -> float:
        """The greatest resident memory that the scheduler had."""
        return peak_memory_mb(self.scheduler.pid)

    def _scheduler(self):
        return self._begin('scheduler', '--port', str(self.port))

    def _begin(self, *words):
        with (self._folder / f'{words[0]}.log').open('a') as log:
            return subprocess.Popen(
                [sys.executable, '-c', COMMAND, *words, *self._tls], stdout=log, stderr=log, cwd=self._folder
            )


def _words(pid):
    try:
        return Path(f'/proc/{pid}/cmdline').read_text()
    except OSError:
        return ''


def disturbed(victim: str, count: int, items: int, rounds: int, folder: Path) -> list[str]:
    """Kill a party `count` times while a client writes `items` files; sentences about what is not as undisturbed."""
    folder.mkdir()
    with Parties(folder, 2) as parties:
        words = [sys.executable, '-c', CLIENT, parties.address, str(folder), str(items), str(rounds)]
        with (folder / 'client.log').open('a') as log:
            asking = subprocess.Popen(words, stderr=log)
            for number in range(1, count + 1):
                _until(lambda number=number: _files(folder) >= number * items // (count + 1), asking)
                if victim == 'client':
                    asking.kill()
                    asking.wait()
                    asking = subprocess.Popen(words, stderr=log)
                else:
                    getattr(parties, f'kill_{victim}')()
            _until(lambda: asking.poll() is not None, None)
    return faults(folder, items, rounds, count if victim == 'client' else 0)


def faults(folder: Path, items: int, rounds: int, clients: int) -> list[str]:
    """What is not as an undisturbed run would have written it. A client that is killed between file and log may leave
    a line out: `clients` of them.
    """
    wrong = [item for item in range(items) if _text(folder / f'{item}.txt') != work(rounds, item)]
    found = [f'{len(wrong)} of {items} are missing or other, {wrong[0]} first'] if wrong else []
    lines = (folder / 'log').read_text().split()
    if len(lines) != len(set(lines)):
        found.append(f'{len(lines) - len(set(lines))} were written twice')
    if len(lines) < items - clients:
        found.append(f'{items - len(lines)} are not in the log')
    return found


def _text(path):
    return path.read_text() if path.exists() else None


def _files(folder):
    return sum(1 for _ in folder.glob('[0-9]*.txt'))


def _until(holds: Callable[[], bool], asking: subprocess.Popen | None) -> None:
    """Raises RuntimeError where it does not come to hold, or the client ends before."""
    end = time.monotonic() + WAIT_S
    while not holds():
        if time.monotonic() > end or (asking is not None and asking.poll() is not None):
            raise RuntimeError('the client did not do its work')
        time.sleep(0.02)


def costs(short: int, rounds: int, items: int, folder: Path) -> list[str]:
    """Lines about the scheduler's memory, the overhead, and two workers against one."""
    asked = functools.partial(work, rounds)
    alone, took = _spent(lambda: list(each(asked, range(items), 1)), lambda: 0.0), {}
    for processes in (1, 2):
        with Parties(folder, processes) as parties:
            cluster = Cluster(parties.address, key())
            list(each(functools.partial(work, 10), range(items), cluster))  # all have begun
            took[processes] = _spent(lambda cluster=cluster: list(each(asked, range(items), cluster)), parties.cpu)
            if processes == 2:
                list(each(functools.partial(work, 10), range(short), cluster))
                peak = parties.scheduler_peak_mb()
    overhead = [100.0 * (cluster / here - 1.0) for cluster, here in zip(took[1], alone)]
    return [
        f'scheduler: at most {peak:.0f} MB after {short} tasks',
        f'one worker: {overhead[0]:+.1f} % of {alone[0]:.1f} s, {overhead[1]:+.1f} % of {alone[1]:.1f} s CPU',
        f'two workers: {took[1][0] / took[2][0]:.2f} times one',
    ]


def _spent(do: Callable[[], object], others: Callable[[], float]) -> tuple[float, float]:
    """(s, s of CPU) that something takes, with the CPU that other processes have used meanwhile."""
    began, used = time.perf_counter(), time.process_time() + others()
    do()
    return time.perf_counter() - began, time.process_time() + others() - used


def main(argv: Sequence[str] | None = None) -> None:
    """Exit status 1 where something was lost, doubled or other."""
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='cluster_faults', description=__doc__, formatter_class=form)
    parser.add_argument('--count', type=int, default=10, help='kills of each (default: %(default)s)')
    parser.add_argument('--victims', nargs='+', choices=VICTIMS, default=VICTIMS, metavar='PARTY')
    parser.add_argument('--items', type=int, default=400, help='work that is shared out (default: %(default)s)')
    parser.add_argument('--rounds', type=int, default=100_000, help='hashes of each (default: %(default)s)')
    parser.add_argument('--short', type=int, default=10_000, help='tasks for the memory; 0: no costs')
    arguments = parser.parse_args(argv)
    failed = False
    with tempfile.TemporaryDirectory(prefix='sara_cluster_faults_') as folder:
        for victim in arguments.victims:
            found = disturbed(victim, arguments.count, arguments.items, arguments.rounds, Path(folder) / victim)
            failed |= bool(found)
            print(f'{victim} killed {arguments.count} times: {"; ".join(found) or "as undisturbed"}', flush=True)
        if arguments.short:
            print('\n'.join(costs(arguments.short, arguments.rounds, arguments.items, Path(folder))))
    sys.exit(1 if failed else 0)
