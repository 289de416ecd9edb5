"""Recorded laser logs: CARMEN text logs, gmapping's text logs, and JSON tables of scans; plain or gzip.

Formats:

- CARMEN: `FLASER n r1 .. rn x y yaw odom_x odom_y odom_yaw stamp host logger_stamp` and `ODOM x y yaw tv rv a stamp
  host logger_stamp`, m and rad.
- gmapping's logs (those with NEFF lines) are CARMEN's, but each FLASER line holds the pose that gmapping gave the scan,
  and the ODOM lines go on from there. From one FLASER to the next they are the recorded odometry; the jumps at FLASER
  lines are gmapping's corrections. `read_log` takes these jumps out, so that what remains is the recorded odometry.
- JSON: `{"map": {stamp: {"range": [...], "x", "y", "theta"}}}`.
"""

from __future__ import annotations

import gzip
import json
import math
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sara_common.planar import compose, inverse

DIGITS = 6
"""Of the stamps in gmapping's logs."""


class LogError(ValueError):
    """A file that is no log of scans; the text says where and why."""


class Record(NamedTuple):
    """One line of a log: stamp (s); pose (x, y, yaw) by the odometry, m and rad; ranges (n,), m, or None where the line
    holds odometry alone.
    """

    stamp: float
    pose: tuple[float, float, float]
    ranges: np.ndarray | None


def read_log(path: str | Path, corrected: bool = False) -> list[Record]:
    """The records of a log in the order of the file; JSON tables in the order of time.

    corrected: keep gmapping's corrections instead of taking them out. Raises LogError, OSError.
    """
    text = _text(path)
    return _json(text, path) if text.lstrip()[:1] == '{' else _carmen(text, path, corrected)


def _text(path):
    with open(path, 'rb') as stream:
        data = stream.read()
    try:
        return (gzip.decompress(data) if data[:2] == b'\x1f\x8b' else data).decode()
    except (OSError, EOFError, UnicodeDecodeError, zlib.error) as error:
        raise LogError(f'{path} is neither text nor gzip: {error}') from None


def _json(text, path):
    try:
        table = json.loads(text)['map']
        records = [
            Record(float(stamp), (float(row['x']), float(row['y']), float(row['theta'])), np.array(row['range'], float))
            for stamp, row in table.items()
        ]
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise LogError(f'{path} is no table of scans: {error!r}') from None
    return _checked(sorted(records, key=lambda record: record.stamp), path)


def _carmen(text, path, corrected):
    records = []
    lines = text.splitlines()
    of_gmapping = any(line.startswith('NEFF') for line in lines)
    for number, line in enumerate(lines, 1):
        words = line.split()
        try:
            if words and words[0] == 'FLASER':
                records.append(_flaser(words, of_gmapping))
            elif words and words[0] == 'ODOM':
                records.append(Record(float(words[7]), tuple(map(float, words[1:4])), None))
        except (ValueError, IndexError) as error:
            raise LogError(f'{path}, line {number}: {error}') from None
    if of_gmapping:
        records = _without_repetitions(_checked(records, path))
        records = records if corrected else list(_uncorrected(records))
        records = spread([record for record in records if record.stamp > 0.0])
    return _checked(records, path)


def _without_repetitions(records):
    """gmapping repeats a scan's pose in an ODOM line, whose stamp is 0 or by chance anything."""
    before = [None, *records]
    return [
        record
        for last, record in zip(before, records)
        if last is None or last.ranges is None or record.ranges is not None or record.pose != last.pose
    ]


def _flaser(words, of_gmapping):
    count = int(words[1])
    ranges, rest = np.array(words[2 : 2 + count], float), words[2 + count :]
    pose = rest[:3] if of_gmapping else rest[3:6]
    return Record(float(rest[6]), tuple(map(float, pose)), ranges)


def _uncorrected(records: Iterable[Record]) -> Iterable[Record]:
    """The records with the jumps of the pose at scans taken out."""
    turned = (0.0, 0.0, 0.0)  # the odometry's frame in the corrected one
    last = None
    for record in records:
        if record.ranges is not None and last is not None:
            turned = compose(record.pose, inverse(compose(inverse(turned), last)))
        last = record.pose
        yield record._replace(pose=compose(inverse(turned), record.pose))


def spread(records: list[Record]) -> list[Record]:
    """Records whose equal stamps are spread evenly, in their order, over what a stamp of six digits may stand for.

    gmapping writes stamps with six digits, so that scans that were logged within 10 ms have one stamp.
    """
    groups: dict[float, list[int]] = {}
    for number, record in enumerate(records):
        groups.setdefault(record.stamp, []).append(number)
    result = list(records)
    for stamp, numbers in groups.items():
        distinct = _readings([records[number] for number in numbers])
        unit = 10.0 ** (math.floor(math.log10(stamp)) - DIGITS + 1) if stamp > 0.0 else 0.0
        count = distinct[-1] + 1
        for number, position in zip(numbers, distinct if count > 1 else ()):
            result[number] = records[number]._replace(stamp=stamp + unit * ((position + 0.5) / count - 0.5))
    return result


def _readings(records):
    """Which reading of one stamp each record is, from 0: a scan's line and the odometry's before it are one."""
    positions = [0]
    for before, record in zip(records, records[1:]):
        positions.append(positions[-1] + (record.ranges is None or before.ranges is not None))
    return positions


def _checked(records, path):
    if not any(record.ranges is not None for record in records):
        raise LogError(f'{path} holds no scan')
    for record in records:
        if not all(map(math.isfinite, (record.stamp, *record.pose))):
            raise LogError(f'{path}: a pose or a stamp is no number at {record.stamp} s')
    return records
