"""A rider heads for a door of 0.80 m from 20 angles, up to 45 degrees off the straight one, and on through it: does the
chair pass it without stopping?
"""

from __future__ import annotations

import math

from sara_bringup.paths import share
from sara_lab.journeys.doors import BEYOND, DOOR
from sara_lab.rides.circuits import Circuit
from sara_lab.rides.ride import Ride, ride_through
from sara_nav.maps import map_io
from sara_sim.riders.riders import Task
from sara_sim.riders.way import rounded

APPROACHES = 20
WIDEST = math.radians(45.0)  # of the approach's bearing, off the straight one
AWAY = 2.5  # m from the door's middle: the start
ROUND = 0.6  # m before the door's middle at which the rider begins to turn into it


def approach(number: int) -> Circuit:
    """The Circuit of approach `number`: bearings spread evenly from side to side, from either room; the chair heads for
    the door's middle.
    """
    bearing = WIDEST * (2.0 * number / (APPROACHES - 1) - 1.0)
    side = 1.0 if number % 2 else -1.0  # from the room on the right, or the left one
    start = DOOR[0] + side * AWAY * math.cos(bearing), DOOR[1] + AWAY * math.sin(bearing)
    end = DOOR[0] - side * BEYOND, DOOR[1]
    heading = math.atan2(DOOR[1] - start[1], DOOR[0] - start[0])
    task = Task(rounded((start, DOOR, end), ROUND), (end,), (DOOR,))
    return Circuit(map_io.load_map(str(share() / 'maps' / 'doorway.yaml')), (*start, heading), task, (end,))


def through(number: int, rider: str, way: str) -> Ride:
    """Ride approach `number` on the chair of that number, whose rider's luck is drawn from it too."""
    return ride_through(approach(number), (f'approach_{number}', rider, way, number))[0]


def passed(made: Ride) -> bool:
    """Whether a Ride went through the door without a stop, and without touching it."""
    return made.completed and not made.stops and not made.contacts
