"""Work that is shared out among processes of this machine. What comes of it depends neither on how many there are, nor
on which is ready first.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from sara_lab.workers.cluster import Cluster
from sara_lab.workers.repeating import until_done

Item, Result = TypeVar('Item'), TypeVar('Result')
IN_VAIN = 3
"""Times that processes may be killed one after another without any work done between."""

_shared: tuple[Callable, Mapping[int, object]] = (lambda item: item, {})


class WorkersError(Exception):
    """The processes are killed again and again."""


def cores() -> int:
    """How many processes can run at once."""
    return len(os.sched_getaffinity(0))


def each(work: Callable[[Item], Result], items: Sequence[Item], where: int | Cluster) -> Iterator[tuple[Item, Result]]:
    """Yield (item, work(item)) of every item, as they are ready. `where`: how many processes, or a Cluster. With one
    process the work is done here, in order; with more by copies of this process (fork), so that `work` need not be
    pickled, but results are. A Cluster needs a `work` of a module.

    What a process was at that was killed (out of memory, say) is done again. Raises what `work` raises, WorkersError,
    ClusterError.
    """
    if isinstance(where, Cluster):
        yield from where.each(work, items)
        return
    if where == 1:
        yield from ((item, work(item)) for item in items)
        return
    yield from until_done(items, lambda left: _until_broken(work, left, where), _broken)


def _broken(_left, in_vain):
    if in_vain == IN_VAIN:
        raise WorkersError(f'the processes were killed {IN_VAIN} times in a row; is there enough memory?')


def _until_broken(work, items, processes):
    """(index, result) of those of {index: item} that are done before a process is killed."""
    global _shared
    _shared = work, items  # copied to the processes as these begin
    with ProcessPoolExecutor(processes, multiprocessing.get_context('fork')) as pool:
        futures = {pool.submit(_one, index): index for index in items}
        try:
            for future in as_completed(futures):
                try:
                    result = future.result()
                except BrokenProcessPool:
                    continue  # so are all that are not ready
                yield futures[future], result
        finally:
            pool.shutdown(cancel_futures=True)


def _one(index):
    work, items = _shared
    return work(items[index])
