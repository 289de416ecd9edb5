"""Drives of the chair that does not know where on the map it started: whether range_localization finds its place by the
ultrasonic sensors, and whether it is right when it says so. Beside it the same drives with a start that is told.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from canserial.reader.readings import FIELD_OF_VIEW
from sara_bringup.lockstep.corrected import range_map, settings
from sara_bringup.lockstep.ranges import mountings
from sara_common.planar import compose, wrap
from sara_common.platforms import chosen, parameters
from sara_lab.journeys.travel_cases import grid_of
from sara_lab.studies.wandering import Recording
from sara_localization.particles.global_search import Places
from sara_localization.particles.lost import NEAR, TURNED
from sara_localization.particles.range_localizer import RangeLocalizer
from sara_localization.ranges.range_data import RangeData, RangeMap

OTHER_PLACE = NEAR, TURNED
"""m, rad from where the chair is: the pose is of another place."""


class Start(NamedTuple):
    """What came of a start. way: m driven. found: m after which the place was known, None: it was not. off, turned: by
    how much the pose is wrong at the end, m, rad; at_once: the same when it was found, and at_most: from then on the
    greatest; None where it was not found. told: what the localization says at the end, '' where it knows its place.
    """

    way: float
    found: float | None
    off: float
    turned: float
    at_once: tuple[float, float] | None
    at_most: tuple[float, float] | None
    told: str


def start(recording: Recording, map_name: str, since: float = 0.0, further: float = math.inf) -> Start:
    """Let a localization that knows nothing but the map hear a Recording from so many m on, until it has known the
    place for `further` m.
    """
    localizer = RangeLocalizer(settings(chosen()), known_map(map_name))
    localizer.start_anywhere(_places(map_name))
    heard_from = _from(recording, since)
    way, found, at_once, errors, last = 0.0, None, None, (math.nan, math.nan), heard_from[0, 5:7]
    greatest = (0.0, 0.0)
    readings = [reading for reading in readings_of(recording) if reading[0] >= heard_from[0, 0] or not since]
    for truth in heard(localizer, heard_from, readings):
        way, last = way + math.dist(truth[:2], last), truth[:2]
        if not localizer.searching:
            errors = errors_of(localizer.correction.pose, truth)
            if found is None:
                found, at_once = way, errors
            greatest = max(greatest[0], errors[0]), max(greatest[1], errors[1])
        if found is not None and way > found + further:
            break
    return Start(way, found, *errors, at_once, None if found is None else greatest, localizer.told)


class Told(NamedTuple):
    """By how much the pose is wrong at the end of a drive whose start is told, m, rad: corrected by the ranges, and as
    the dead reckoning has it.
    """

    off: float
    turned: float
    reckoned_off: float
    reckoned_turned: float


def told(recording: Recording, map_name: str) -> Told:
    """Let a localization that was told where the chair starts hear a Recording."""
    localizer = RangeLocalizer(settings(chosen()), known_map(map_name))
    poses = laid(recording)
    for _ in heard(localizer, poses, readings_of(recording)):
        pass
    truth = poses[-1, 5:8].tolist()
    return Told(*errors_of(localizer.correction.pose, truth), *errors_of(poses[-1, 2:5].tolist(), truth))


def laid(recording: Recording) -> np.ndarray:
    """(n, 8) A Recording's poses, with the dead reckoning's frame laid where the chair starts."""
    poses, start = recording.poses.copy(), recording.poses[0, 5:8].tolist()
    poses[:, 2:5] = [compose(start, pose) for pose in poses[:, 2:5].tolist()]
    return poses


def heard(
    localizer: RangeLocalizer, poses: np.ndarray, readings: Iterable[tuple[float, RangeData]]
) -> Iterator[list[float]]:
    """Let a localizer hear a Recording's poses and, as they come, its readings; the true pose after each pose."""
    coming = iter(readings)
    came, reading = next(coming)
    for now, stamp, *both in poses.tolist():
        while came <= now:
            localizer.on_range(reading)
            came, reading = next(coming, (math.inf, None))
        localizer.on_pose(stamp, tuple(both[:3]))
        yield both[3:]


def _from(recording, since):
    """The poses from so many m on."""
    ways = np.cumsum(np.hypot(*np.diff(recording.poses[:, 5:7], axis=0, prepend=recording.poses[:1, 5:7]).T))
    return recording.poses[np.searchsorted(ways, since) :]


@cache
def _places(name) -> Places:
    return Places(known_map(name), settings(chosen()).search_clearance)


@cache
def known_map(name: str) -> RangeMap:
    """What the localization knows of a map."""
    return range_map(grid_of(name), settings(chosen()).map_occupied_above)


def readings_of(recording: Recording) -> list[tuple[float, RangeData]]:
    """[(when it came, s; RangeData)]."""
    places, reader = mountings(chosen()), parameters('canserial', 'read.yaml')
    limits = reader['range_min'], reader['range_max']
    names = recording.sensors
    return [
        (came, RangeData(names[int(k)], stamp, places[names[int(k)]], distance, *limits, FIELD_OF_VIEW))
        for came, stamp, k, distance in recording.ranges.tolist()
    ]


def errors_of(pose: Sequence[float], truth: Sequence[float]) -> tuple[float, float]:
    """(m, rad) between two poses."""
    return math.dist(pose[:2], truth[:2]), abs(float(wrap(pose[2] - truth[2])))
