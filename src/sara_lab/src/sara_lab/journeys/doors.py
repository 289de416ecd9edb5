"""A door of 0.80 m in the wall between two rooms: the chair crosses it from different angles, its body as wide as the
robot's, sensors and safety gate on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_lab.journeys.judged import Judged
from sara_lab.journeys.travel import PATIENCE_S, Recorder, reach
from sara_lab.judge.judge import judge

APPROACHES = 20
WIDEST = math.radians(70.0)  # of the approach's bearing, off the straight one
AWAY, BEYOND = 2.5, 2.0  # m from the door's middle: start and goal
SIDEWAYS = 0.6  # m, how far to the side of the straight line a goal may be
DOOR = (6.05, 4.0)  # its middle, on doorway.yaml


@dataclass(frozen=True)
class Crossing(Judged):
    """One approach: poses (x, y, yaw), whether it was `reached`, move_base's `text`, contacts, and the Judgement."""

    number: int
    start: tuple
    goal: tuple
    reached: bool
    late: bool
    text: str
    contacts: tuple
    judgement: object

    @property
    def faults(self) -> list[str]:
        """What does not hold, one sentence each."""
        return ([] if self.reached else [f'not reached: {self.text}']) + self.contact_faults


def approach(number: int) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """(start, goal) of approach `number`: bearings spread evenly from side to side, from either room, the heading at
    the start and the goal's place drawn.
    """
    random = np.random.default_rng([number, 80])
    bearing = WIDEST * (2.0 * number / (APPROACHES - 1) - 1.0)
    side = 1.0 if number % 2 else -1.0  # from the room on the right, or the left one
    start = (
        DOOR[0] + side * AWAY * math.cos(bearing),
        DOOR[1] + AWAY * math.sin(bearing),
        float(random.uniform(-math.pi, math.pi)),
    )
    goal = (
        DOOR[0] - side * BEYOND,
        DOOR[1] + float(random.uniform(-SIDEWAYS, SIDEWAYS)),
        0.0 if side < 0.0 else -math.pi,
    )
    return start, goal


def cross(number: int, navigation: dict | None = None) -> Crossing:
    """Drive approach `number` on the chair of that number, localized by the true pose; returns the Crossing."""
    start, goal = approach(number)
    lockstep = Lockstep(share() / 'maps' / 'doorway.yaml', start, number, localization='fake', navigation=navigation)
    recorder = Recorder(lockstep)
    lockstep.start_up()
    ended, late = reach(recorder, goal, PATIENCE_S)
    way = math.dist(start[:2], DOOR) + math.dist(DOOR, goal[:2])
    found = judge(recorder.track([replace(ended, shortest=way)]), lockstep.chair.drive.world)
    return Crossing(number, start, goal, ended.reached, late, ended.text, tuple(recorder.touched.contacts), found)
