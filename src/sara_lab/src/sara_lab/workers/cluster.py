"""Work that is shared out among workers on many machines, by Dask's scheduler (`cluster scheduler`, `cluster worker`).

Only names travel: of the function, and plain data. What is done comes back to the client, which alone writes it. What a
killed worker was at is done again; a scheduler that is killed is waited for, and what it held is given to the next; a
client that is killed is started again. A task goes only to workers of the client's key (robot and sources), so that the
others are never asked. Whoever reaches a scheduler may run anything on its workers: it is reached on this machine only,
or by TLS with a key that all share.
"""

from __future__ import annotations

import asyncio
import ipaddress
import math
import queue
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

from sara_lab.workers.repeating import until_done

if TYPE_CHECKING:
    from distributed import Client, Future
    from distributed.security import Security

Item, Result = TypeVar('Item'), TypeVar('Result')
CERTIFICATE, KEY = 'certificate.pem', 'key.pem'  # in the folder that all parties have
MAX_BATCHES = 1000  # that a scheduler is given at once: it keeps some kB of each
WAIT_S = 120.0  # for a scheduler, for a worker
CONNECT_S = 5.0  # for the first try of it; each other one may last twice as long: TLS takes slow machines a while
IN_VAIN = 5  # losses one after another without any work done between
_POLL_S = 0.5


class ClusterError(Exception):
    """An address that is refused, or a cluster that does no work; the sentence says why."""


@dataclass(frozen=True)
class Cluster:
    """Workers behind a scheduler. `address`: tcp://HOST:PORT of this machine or tls://HOST:PORT. `key`: whose workers
    are asked. `tls`: the folder with certificate and key, of tls:// alone. Raises ClusterError.
    """

    address: str
    key: str
    tls: Path | None = None

    def __post_init__(self) -> None:
        check(self.address, self.tls)

    def each(self, work: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result]]:
        """Yield (item, work(item)) of every item once, as they are ready. `work` and items are pickled: a function of a
        module, or a partial of one. Raises what `work` raises, ClusterError.
        """
        return until_done(items, lambda left: self._until_lost(work, left), self._lost)

    def _lost(self, left, in_vain):
        if in_vain == IN_VAIN:
            raise ClusterError(f'{self.address} was lost {IN_VAIN} times in a row, and no work was done')
        print(f'{self.address} was lost; {len(left)} are left', file=sys.stderr, flush=True)

    def _until_lost(self, work, left):
        """(index, result) of what is done before scheduler, or workers again and again, are lost."""
        client = self._client()
        try:
            self._wait_for_worker(client)
            size = math.ceil(len(left) / MAX_BATCHES)
            indices, ready = list(left), queue.SimpleQueue()
            futures = {}
            for begin in range(0, len(indices), size):
                batch = {index: left[index] for index in indices[begin : begin + size]}
                future = client.submit(_batch, work, batch, pure=False, resources={self.key: 1})
                future.add_done_callback(ready.put)
                futures[future.key] = future
            while futures:
                found = _next(ready, client)
                if found is None:
                    return
                yield from _results(futures.pop(found.key), client)
        finally:
            client.close(timeout=5.0)

    def _client(self) -> Client:
        """A client of the scheduler, which is waited for. Raises ClusterError."""
        from distributed import Client

        end, limit = time.monotonic() + WAIT_S, CONNECT_S
        while True:
            try:
                return Client(self.address, timeout=limit, security=security(self.tls), set_as_default=False)
            except OSError as error:  # TimeoutError too
                if time.monotonic() > end:
                    raise ClusterError(f'no scheduler answers at {self.address}: {error}') from error
                limit *= 2.0
                time.sleep(_POLL_S)

    def _wait_for_worker(self, client):
        """Raises ClusterError where there is no worker of this key, with what there is."""
        end = time.monotonic() + WAIT_S
        while True:
            keys = [key for held in client.scheduler_info()['workers'].values() for key in held['resources']]
            if self.key in keys:
                refused = sorted({key for key in keys if key != self.key})
                if refused:
                    print(
                        f'refused: workers of {", ".join(refused)}; these are {self.key}', file=sys.stderr, flush=True
                    )
                return
            if time.monotonic() > end or client.status != 'running':
                others = ', '.join(sorted(set(keys))) or 'none'
                raise ClusterError(
                    f'{self.address} has no worker of {self.key} (robot and sources); there are: {others}'
                )
            time.sleep(_POLL_S)


def check(address: str, tls: Path | None = None) -> None:
    """Raise ClusterError where an address is none, or not safe."""
    parts = urlsplit(address)
    try:
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if parts.scheme not in ('tcp', 'tls') or not host or not port:
        raise ClusterError(f'{address} is no address: tcp://127.0.0.1:PORT or tls://HOST:PORT')
    if parts.scheme == 'tls':
        missing = [name for name in (CERTIFICATE, KEY) if tls is None or not (tls / name).is_file()]
        if missing:
            raise ClusterError(f'tls:// needs --tls FOLDER with {" and ".join(missing)} (`cluster keys FOLDER`)')
    elif tls is not None:
        raise ClusterError(f'--tls goes with tls://, and {address} is not encrypted')
    elif not _is_this_machine(host):
        raise ClusterError(
            f'{address} is refused: who reaches it can run anything on the workers; use tls:// for other machines'
        )


def _is_this_machine(host):
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == 'localhost'


def security(tls: Path | None) -> Security | None:
    """The keys of a folder for client, scheduler or worker: who has them is trusted. None without a folder."""
    if tls is None:
        return None
    from distributed.security import Security

    certificate, key = str(tls / CERTIFICATE), str(tls / KEY)
    own = {}
    for party in ('client', 'scheduler', 'worker'):
        own |= {f'tls_{party}_cert': certificate, f'tls_{party}_key': key}
    return Security(tls_ca_file=certificate, require_encryption=True, **own)


def _batch(work, batch: dict[int, Any]) -> list[tuple[int, Any]]:
    """What a worker is asked for."""
    return [(index, work(item)) for index, item in batch.items()]


def _next(ready: queue.SimpleQueue, client: Client) -> Future | None:
    """The next Future that is done; None where the scheduler is lost."""
    while client.status == 'running':
        try:
            return ready.get(timeout=_POLL_S)
        except queue.Empty:
            continue
    return None


def _results(future, client):
    """What a batch gave; nothing where it was lost. Raises what its work raised."""
    from distributed import KilledWorker

    if future.status == 'cancelled' or client.status != 'running':
        return []
    try:
        return future.result(timeout=30.0)
    except (KilledWorker, CancelledError, asyncio.CancelledError, OSError):  # the scheduler went meanwhile
        return []
