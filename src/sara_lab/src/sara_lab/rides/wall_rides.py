"""A rider drives along a wall and steers into it all the time: how far off does shared control lead along it?"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_lab.journeys.tight_places import block
from sara_lab.rides.ride import drive, gap_along, prepare
from sara_sim.riders.manoeuvres import Holder
from sara_sim.riders.stick import Stick

RIDES = 20
HALL = 14.0, 4.0  # m; the wall is its side at y = 0
STARTS, INTO = (0.6, 1.5), (0.2, 0.5)  # m from the wall to the chair's middle; of the stick's deflection, to the right
FOLLOWED = 6.0, 11.0  # m of the hall that are judged
END = 12.0, 0.6


class WallRide(NamedTuple):
    """gap: (n,) m between body and wall, where it is judged. contacts: number of."""

    gap: np.ndarray
    contacts: int


def along(number: int) -> WallRide:
    """Ride `number`, on the chair of that number: starts and deflections are spread evenly."""
    across, into = number % 5 / 4.0, number // 5 / 3.0
    start = 1.0, STARTS[0] + across * (STARTS[1] - STARTS[0]), 0.0
    lockstep = Lockstep(block(HALL, ((0.0, 0.0, *HALL),)), start, number, localization='fake')
    left = -INTO[0] - into * (INTO[1] - INTO[0])
    person = Holder(Stick(left, math.sqrt(1.0 - left * left)))
    log, touched, _ = drive(lockstep, person, (END,), prepare(lockstep, 'assisted'))
    rows = np.array(log.poses)
    rows = rows[(rows[:, 1] > FOLLOWED[0]) & (rows[:, 1] < FOLLOWED[1])]
    gap = gap_along(lockstep, rows) if len(rows) else np.empty(0)
    return WallRide(np.asarray(gap), len(touched.contacts))
