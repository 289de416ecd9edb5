"""A file that grows with the graph of poses, so that a map goes on after the program was killed or the power failed.

Every key scan, loop and optimisation is a record, written at once: what is lost is at most the record that was being
written. A record is MARK, the length of what follows (uint32), its CRC-32 (uint32) and an .npz of arrays; all are
little-endian. A file whose end is damaged is cut off there when it is opened.
"""

from __future__ import annotations

import errno
import fcntl
import io
import os
import struct
import time
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sara_slam.graph.pose_graph import Edge, Pose
from sara_slam.mapping.key_scan import KeyScan

MARK = b'SLM1'
HEAD = struct.Struct('<4sII')
LONGEST = 1 << 26
"""Bytes that a record may have."""
SYNC_S = 2.0
"""s between two times that the file is forced onto the disk, where records come."""
POSES_EVERY = 20
"""Optimisations from one whose poses are kept to the next; those between are done again."""
LEAVES_S = 5.0
"""s that another program has to let go of the file: of two nodes of one name the older is told to end."""


class JournalError(OSError):
    """A journal cannot be read or written; the message says which file and why."""


class Record(NamedTuple):
    """kind: scan, loop or optimised; of slam_sonar: heard."""

    kind: str
    arrays: dict[str, np.ndarray]


class Journal:
    """Of a path. `clock`: s, steady."""

    def __init__(self, path: str | Path, clock: Callable[[], float] = time.monotonic) -> None:
        """Opens or begins the file. Raises JournalError."""
        self.path, self._clock, self._synced, self._optimised = Path(path), clock, clock(), 0
        self.cut = 0
        """Bytes that were damaged and are cut off."""
        try:
            self._file = open(self.path, 'a+b', buffering=0)  # noqa: SIM115 - stays open
            self._own()
            content = self._read()
        except JournalError:
            raise
        except OSError as error:
            raise JournalError(f'{self.path} cannot be opened: {error.strerror or error}') from error
        if content and not content.startswith(MARK[: len(content)]):
            self._file.close()
            raise JournalError(f'{self.path} holds something else than the state of a map')
        found = list(_parsed(content))
        self.records = [record for record, _ in found]
        """What it held when it was opened; whoever takes them up clears the list."""
        self._good = sum(length for _, length in found)  # bytes up to the end of the last whole record
        self.cut = len(content) - self._good
        if self.cut:
            os.ftruncate(self._file.fileno(), self._good)

    def _own(self):
        """Two programs that write into one file would make a map of neither. Where the file system knows no locks, it
        is believed. Raises JournalError.
        """
        until = time.monotonic() + LEAVES_S
        while True:
            try:
                fcntl.lockf(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                if error.errno not in (errno.EACCES, errno.EAGAIN):
                    return
                if time.monotonic() > until:
                    self._file.close()
                    raise JournalError(f'{self.path} is in use: another program makes a map into it') from error
                time.sleep(0.1)
            else:
                return

    def _read(self):
        self._file.seek(0)
        return self._file.read()

    def scan(self, key: KeyScan, pose: Pose, edge: Edge | None) -> None:
        """A key scan has become a node at a pose; edge: that joins it, None for the first."""
        arrays: dict[str, Any] = {'pose': pose, 'ends': key.ends, 'echo': key.echo}
        arrays |= {'stamp': key.stamp, 'odometry': key.odometry, 'origin': key.origin}
        self.append('scan', arrays if edge is None else arrays | _of_edge(edge))

    def loop(self, edge: Edge) -> None:
        """A loop has been closed."""
        self.append('loop', _of_edge(edge))

    def optimised(self, dropped: list[int], poses: list[Pose]) -> None:
        """The poses are optimised. dropped: which edges were found false and taken out."""
        self._optimised += 1
        whole = not self._optimised % POSES_EVERY or bool(dropped)
        self.append('optimised', {'dropped': np.array(dropped, int), 'poses': poses if whole else np.empty((0, 3))})

    def append(self, kind: str, arrays: dict[str, Any]) -> None:
        """Write a record, whole or not at all. Raises JournalError."""
        held = io.BytesIO()
        np.savez(held, kind=kind, **arrays)
        body = held.getvalue()
        try:
            if len(body) > LONGEST:
                raise OSError(f'a record of {len(body)} bytes, allowed are {LONGEST}')
            record = HEAD.pack(MARK, len(body), zlib.crc32(body)) + body
            if self._file.write(record) < len(record):
                raise OSError('there was room for a part of a record alone')
            if self._clock() - self._synced >= SYNC_S:
                os.fsync(self._file.fileno())
                self._synced = self._clock()
        except OSError as error:
            with suppress(OSError):  # what stays is cut off when the file is opened
                os.ftruncate(self._file.fileno(), self._good)
            raise JournalError(f'{self.path} cannot be written: {error.strerror or error}') from error
        self._good += len(record)


def _of_edge(edge):
    return {
        'first': edge.first,
        'second': edge.second,
        'relation': edge.relation,
        'covariance': edge.covariance,
        'length': edge.length,
    }


def _parsed(content: bytes) -> Iterator[tuple[Record, int]]:
    """(record, its bytes in the file) up to where something is damaged."""
    at = 0
    while at + HEAD.size <= len(content):
        mark, length, check = HEAD.unpack_from(content, at)
        body = content[at + HEAD.size : at + HEAD.size + length]
        if mark != MARK or length > LONGEST or len(body) < length or zlib.crc32(body) != check:
            return
        try:
            with np.load(io.BytesIO(body), allow_pickle=False) as held:
                arrays = {name: held[name] for name in held.files}
        except (ValueError, OSError, zipfile.BadZipFile, KeyError):
            return
        yield Record(str(arrays.pop('kind')), arrays), HEAD.size + length
        at += HEAD.size + length


def edge_of(record: Record) -> Edge:
    """The edge of a scan or loop."""
    a, loop = record.arrays, record.kind == 'loop'
    relation = tuple(a['relation'].tolist())
    return Edge(int(a['first']), int(a['second']), relation, a['covariance'], loop, float(a['length']))


def key_scan_of(record: Record) -> KeyScan:
    """The key scan of a scan."""
    a = record.arrays
    odometry, origin = tuple(a['odometry'].tolist()), tuple(a['origin'].tolist())
    return KeyScan(float(a['stamp']), odometry, origin, a['ends'], a['echo'])
