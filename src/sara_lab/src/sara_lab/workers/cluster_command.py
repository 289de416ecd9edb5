"""`cluster`: the scheduler and the workers that `campaign --cluster ADDRESS` and `experiment --cluster ADDRESS` ask.

On one machine: `cluster scheduler` and `cluster worker tcp://127.0.0.1:8786`. On several: `cluster keys FOLDER` makes a
certificate and a key, which every machine gets a copy of (who has them may run anything there); `cluster scheduler
--tls FOLDER --host 192.168.1.5` and, everywhere, `cluster worker tls://192.168.1.5:8786 --tls FOLDER`. Workers drive
with the robot and the sources that they have when they begin. Results go to who asks; what cases keep besides (gains,
maps, recorded drives) stays in out/campaign of the worker's folder.
"""

from __future__ import annotations

import argparse
import asyncio
import datetime
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from sara_common import platforms
from sara_lab.workers.cluster import Cluster, ClusterError, check, security
from sara_lab.workers.processes import cores
from sara_lab.workers.sources import folder_of

PORT = 8786
RETRY_S = 1.0


def key() -> str:
    """Which drives this process makes: robot and sources."""
    return folder_of(Path()).name


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options --cluster and --tls of who asks."""
    parser.add_argument('--cluster', metavar='ADDRESS', help='let the workers of `cluster scheduler` there do the work')
    parser.add_argument('--tls', type=Path, metavar='FOLDER', help='with --cluster tls://...: of `cluster keys`')


def asked(parser: argparse.ArgumentParser, arguments: argparse.Namespace, processes: int) -> int | Cluster:
    """Where the work is to be done: the Cluster that is asked for, else so many processes."""
    if arguments.cluster is None:
        if arguments.tls is not None:
            parser.error('--tls goes with --cluster')
        return processes
    try:
        return Cluster(arguments.cluster, key(), arguments.tls)
    except ClusterError as error:
        parser.error(str(error))


def main(argv: Sequence[str] | None = None) -> None:
    """Runs until it is ended. Exit status 2 where an address is refused."""
    arguments = _parser().parse_args(argv)
    try:
        asyncio.run(arguments.run(arguments))
    except ClusterError as error:
        print(f'cluster: {error}', file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)


def _parser():
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog='cluster', description=__doc__, formatter_class=form)
    names = parser.add_subparsers(required=True, metavar='keys, scheduler, worker')
    keys = names.add_parser('keys', help='makes certificate and key in a folder')
    keys.add_argument('folder', type=Path)
    keys.set_defaults(run=_keys)
    scheduler = names.add_parser('scheduler', help='shares work out')
    scheduler.add_argument('--host', default='127.0.0.1', help='address of this machine (default: %(default)s)')
    scheduler.add_argument('--port', type=int, default=PORT, help='(default: %(default)s)')
    scheduler.set_defaults(run=_scheduler)
    worker = names.add_parser('worker', help='does work')
    worker.add_argument('address', help='of the scheduler')
    worker.add_argument('--processes', type=int, default=cores(), help='(default: as there are cores, %(default)s)')
    worker.add_argument('--host', help='address of this machine, where it has several')
    platforms.add_option(worker)
    worker.set_defaults(run=_workers)
    for one in (scheduler, worker):
        one.add_argument('--tls', type=Path, metavar='FOLDER', help='of `cluster keys`')
    return parser


async def _keys(arguments):
    from sara_hmi.web import certificate  # names and fields as the touch screen's

    certificate.kept(arguments.folder, ['cluster'], datetime.datetime.now(datetime.UTC))
    print(f'{arguments.folder}: certificate and key')


async def _scheduler(arguments):
    """Share out until it is ended."""
    from distributed import Scheduler

    kind = 'tcp' if arguments.tls is None else 'tls'
    address = f'{kind}://{arguments.host}:{arguments.port}'
    check(address, arguments.tls)
    async with Scheduler(
        host=arguments.host,
        port=arguments.port,
        protocol=kind,
        security=security(arguments.tls),
        dashboard_address='127.0.0.1:0',
    ) as scheduler:
        print(f'{scheduler.address} is ready', flush=True)
        await scheduler.finished()


async def _workers(arguments):
    """Processes that work, each begun again when it is killed, or has lost the scheduler."""
    check(arguments.address, arguments.tls)
    mine = key()
    print(f'{arguments.processes} processes of {mine} for {arguments.address}', flush=True)
    with tempfile.TemporaryDirectory(prefix='sara_cluster_') as folder:
        await asyncio.gather(*(_worker(arguments, mine, folder) for _ in range(arguments.processes)))


async def _worker(arguments, mine, folder):
    from distributed import Nanny

    host = arguments.host or ('127.0.0.1' if arguments.tls is None else None)
    while True:
        try:
            async with Nanny(
                arguments.address,
                nthreads=1,
                host=host,
                resources={mine: 1},
                memory_limit=0,
                local_directory=folder,
                security=security(arguments.tls),
                dashboard_address='127.0.0.1:0',
            ) as nanny:
                await nanny.finished()
        except (OSError, RuntimeError) as error:  # no scheduler there, or it went while the process began
            print(f'{arguments.address}: {error}', file=sys.stderr, flush=True)
        await asyncio.sleep(RETRY_S)
