"""Recorded drives of a chair without a scanner, heard by a localization whose pose is put elsewhere on the way, or
whose map shows boxes that are gone: what the readings say of the pose, and whether it is wrong.

KINDS: `right`; `changed`, a map with PHANTOMS boxes more; `shifted` by a small way, `far` by a large one with any
heading; `changed far`, both. The chair drives alone, among boxes that the map does not show, or among pedestrians
(wandering.py).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sara_bringup.lockstep.corrected import settings
from sara_common.planar import compose
from sara_common.platforms import chosen
from sara_lab.journeys.travel_cases import MAPS, random_of
from sara_lab.studies.global_start import errors_of, heard, known_map, laid, readings_of
from sara_lab.studies.wandering import ABOUT, kept
from sara_localization.particles.lost import Agreement
from sara_localization.particles.range_localizer import RangeLocalizer
from sara_localization.particles.range_lost import NEAR, TURNED
from sara_localization.ranges import map_echo
from sara_localization.ranges.range_data import RangeMap

KINDS = 'right', 'changed', 'shifted', 'far', 'changed far'
SHIFTED, SHIFTED_TURN = (0.4, 1.2), 0.3  # m, and rad at most
FAR = 1.5, 4.0  # m
PUT = 1.0, 8.0  # m driven until then
TOLD = np.diag(np.square((0.05, 0.05, 0.02)))  # m, rad: what the localization believes of where it is put
PHANTOMS, HALF, OFF_WAY, NO_NEARER = 4, (0.15, 0.35), (0.6, 1.6), 0.4  # how many; m: half a side; from the way


class Case(NamedTuple):
    """A drive on a map, with one of ABOUT about it, of one of KINDS."""

    map: str
    number: int
    about: str
    kind: str


class Step(NamedTuple):
    """After a step that was judged. way: m driven. wrong: the pose is. agreement: what was heard. probability: as the
    localization says.
    """

    way: float
    wrong: bool
    agreement: Agreement
    probability: float


def cases(numbers: Sequence[int]) -> list[Case]:
    """All drives of these numbers."""
    return [Case(*case) for case in product(MAPS, numbers, ABOUT, KINDS)]


def steps(case: Case, folder: Path) -> list[Step]:
    """A drive, recorded once and kept in a folder."""
    recording = kept(case.map, case.number, folder, case.about)
    random = random_of(case.map, 'misplaced', case.number, ABOUT.index(case.about), KINDS.index(case.kind))
    map_ = known_map(case.map)
    if 'changed' in case.kind:
        map_ = _with_phantoms(map_, recording.poses[::50, 5:7], random)
    localizer = RangeLocalizer(replace(settings(chosen()), lost_recovery=False), map_)
    return list(_judged(localizer, recording, _displacement(case.kind, random), float(random.uniform(*PUT))))


def _judged(localizer, recording, displacement, put):
    way, last, judged, correction = 0.0, recording.poses[0, 5:7], None, localizer.correction
    for truth in heard(localizer, laid(recording), readings_of(recording)):
        way, last = way + math.dist(truth[:2], last), truth[:2]
        if displacement is not None and way >= put:
            correction.start_at(compose(correction.pose, displacement), TOLD)
            displacement = None
        lost = localizer.lost
        if lost.agreement is not None and lost.agreement is not judged:
            judged, (off, turned) = lost.agreement, errors_of(correction.pose, truth)
            yield Step(way, off > NEAR or turned > TURNED, judged, lost.probability)


def _displacement(kind, random):
    """(x, y, yaw) in the robot's frame by which the pose is put elsewhere; None where it is not."""
    if kind in ('right', 'changed'):
        return None
    near = kind == 'shifted'
    way, towards = random.uniform(*(SHIFTED if near else FAR)), random.uniform(-math.pi, math.pi)
    turn = random.uniform(-SHIFTED_TURN, SHIFTED_TURN) if near else random.uniform(-math.pi, math.pi)
    return float(way * math.cos(towards)), float(way * math.sin(towards)), float(turn)


def _with_phantoms(map_, way, random):
    """The map with boxes beside a way (n, 2), none on it."""
    cells, (x, y, _) = map_.cells.copy(), map_.origin
    made = 0
    while made < PHANTOMS:
        towards, half = random.uniform(-math.pi, math.pi), random.uniform(*HALF, 2)
        place = way[random.integers(len(way))] + random.uniform(*OFF_WAY) * np.array(
            (math.cos(towards), math.sin(towards))
        )
        nearest = np.hypot(*np.maximum(np.abs(way - place) - half, 0.0).T).min()
        low, high = (np.floor((place + side - (x, y)) / map_.resolution).astype(int) for side in (-half, half))
        if nearest < NO_NEARER or low.min() < 0:
            continue
        cells[low[1] : high[1], low[0] : high[0]] = map_echo.OCCUPIED
        made += 1
    return RangeMap(cells, map_.resolution, map_.origin)
