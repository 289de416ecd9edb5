"""A rider steers up to a table or a bed until the chair stands, and backs out again: how near does it come?"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.platforms import chosen
from sara_lab.journeys.tight_places import block
from sara_lab.rides.ride import drive, gap_along, prepare
from sara_sim.riders.driving import BlindDriver, Manner

RIDES = 20
ROOM = 6.0, 4.0  # m
DOCKS = (3.6, 1.2, 4.6, 2.8), (3.6, 1.55, 5.6, 2.45)  # m; a table, and a bed's foot
AWAY, OFF = 1.2, math.radians(3.0)  # m before it, and off its heading at most: the start
PUSHES = 0.5, 1.0  # of full deflection
STOOD_S = 3.0  # who does not get on for so long is there


class DockRide(NamedTuple):
    """gap: m, the least between body and furniture. aside: m from before its middle, where the chair was farthest on.
    out: whether it came back. contacts: number of.
    """

    gap: float
    aside: float
    out: bool
    contacts: int


def dock(number: int) -> DockRide:
    """Ride `number`, on the chair of that number: furniture, headings and deflections are spread evenly."""
    thing, push, share = DOCKS[number % 2], PUSHES[number // 2 % 2], number // 4 / (RIDES // 4 - 1)
    front = 0.5 * chosen().size[0]
    there = thing[0] - front, 0.5 * ROOM[1]
    start = there[0] - AWAY, there[1], OFF * (2.0 * share - 1.0)
    lockstep = Lockstep(block(ROOM, ((0.0, 0.0, *ROOM),), (thing,)), start, number, localization='fake')
    manner = Manner(cruise=push, stuck=STOOD_S, let_go=0.0, back=math.inf)  # who does not get on backs off for good
    person = BlindDriver(((0.5 * (thing[0] + thing[2]), there[1]),), manner=manner)
    log, touched, passed = drive(lockstep, person, (there, start[:2]), prepare(lockstep, 'assisted'))
    rows = np.array(log.poses)
    aside = abs(rows[rows[:, 1].argmax(), 2] - there[1])
    return DockRide(float(gap_along(lockstep, rows).min()), float(aside), passed == 2, len(touched.contacts))
