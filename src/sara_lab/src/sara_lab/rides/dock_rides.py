"""A rider steers up to a table or a bed until the chair stands, and backs out again: how near does it come?"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.platforms import chosen
from sara_lab.journeys.tight_places import block
from sara_lab.judge import gaps
from sara_lab.rides.ride import GAP_STEP_S, drive, prepare
from sara_sim.riders.driving import BlindDriver, Manner
from sara_sim.riders.stick import Stick

RIDES = 20
ROOM = 6.0, 4.0  # m
DOCKS = (3.6, 1.2, 4.6, 2.8), (3.6, 1.55, 5.6, 2.45)  # m; a table, and a bed's foot
AWAY, OFF = 1.2, math.radians(3.0)  # m before it, and off its heading at most: the start
PUSHES = 0.5, 1.0  # of full deflection
STOOD_S, MOVED_M = 3.0, 0.01  # who has not moved for so long is there
BACK = -0.5


class DockRide(NamedTuple):
    """gap: m between body and furniture where the chair stood. out: whether it came back. contacts: number of."""

    gap: float
    out: bool
    contacts: int


class _InAndOut:
    """Heads for a place (x, y; m) behind the furniture's edge until the chair stands, and then backs off. push: of full
    deflection.
    """

    arrived = False

    def __init__(self, place: tuple[float, float], push: float) -> None:
        self._ahead = BlindDriver((place,), manner=Manner(cruise=push, stuck=math.inf))
        self._since, self._stood, self._backs = 0.0, None, False

    def stick(self, t: float, pose: Sequence[float]) -> Stick:
        """See Rider."""
        if self._stood is None or math.dist(pose[:2], self._stood) > MOVED_M:
            self._since, self._stood = t, tuple(pose[:2])
        self._backs = self._backs or t - self._since > STOOD_S
        return Stick(0.0, BACK) if self._backs else self._ahead.stick(t, pose)


def dock(number: int) -> DockRide:
    """Ride `number`, on the chair of that number: furniture, headings and deflections are spread evenly."""
    thing, push, share = DOCKS[number % 2], PUSHES[number // 2 % 2], number // 4 / (RIDES // 4 - 1)
    front = 0.5 * chosen().size[0]
    there = thing[0] - front, 0.5 * ROOM[1]
    start = there[0] - AWAY, there[1], OFF * (2.0 * share - 1.0)
    lockstep = Lockstep(block(ROOM, ((0.0, 0.0, *ROOM),), (thing,)), start, number, localization='fake')
    person = _InAndOut((0.5 * (thing[0] + thing[2]), there[1]), push)
    log, touched, passed = drive(lockstep, person, (there, start[:2]), prepare(lockstep, 'assisted'))
    rows = np.array(log.poses)
    gap = gaps.along(lockstep.chair.drive.world, rows[:, 0], rows[:, 1:], chosen().size, GAP_STEP_S)
    return DockRide(float(gap.min()), passed == 2, len(touched.contacts))
