"""A box that no map shows stands in the only door to the goal: the chair is to touch nothing, to end the goal in words,
and to drive through once somebody has taken the box away.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_lab.journeys.judged import Judged
from sara_lab.journeys.travel import Recorder, localization_of, reach
from sara_lab.judge.judge import judge
from sara_sim.world.obstacles import Obstacle

FATES = ('stays', 'taken_away')
DOOR, GOAL = (3.0, 5.8), (3.0, 7.4, 0.5 * math.pi)  # of the flat, whose room up there has one door, of 0.80 m
HELP_S = 10.0  # after the chair has asked for help the box is taken away
PATIENCE_S = 400.0


@dataclass(frozen=True)
class Attempt(Judged):
    """What came of it: whether the goal was `reached`, or had to be cancelled because it was `late`, move_base's words,
    how many recoveries began, contacts, Judgement.
    """

    mode: str
    fate: str
    number: int
    reached: bool
    late: bool
    text: str
    recoveries: int
    contacts: tuple
    judgement: object

    @property
    def faults(self) -> list[str]:
        """What does not hold, one sentence each."""
        found = self.contact_faults
        if self.late:
            found.append('the goal does not end')
        elif self.fate == 'taken_away' and not self.reached and not found:
            found.append(f'not reached: {self.text}')
        return found


def placed(number: int) -> tuple[Obstacle, tuple[float, float, float]]:
    """The box of an attempt, 0.1 to 0.6 m wide, and where the chair starts in the corridor."""
    draw = np.random.default_rng([number, 5]).uniform
    size = float(draw(0.1, 0.6)), float(draw(0.1, 0.5))
    at = DOOR[0] + float(draw(-0.15, 0.15)), DOOR[1] + float(draw(-0.15, 0.25))
    start = float(draw(5.0, 6.3)), float(draw(4.7, 5.1)), math.pi
    return Obstacle('box', size=size, at=at, yaw=float(draw(-0.8, 0.8))), start


def attempt(mode: str, fate: str, number: int, gain: float | None = None) -> Attempt:
    """Drive to the goal behind the box on chair `number`. `mode` of travel.POSES, `fate` of FATES: the box's. `gain`:
    of that chair's gyro (fused). Returns the Attempt.
    """
    box, start = placed(number)
    flat = share() / 'maps' / 'flat.yaml'
    lockstep = Lockstep(flat, start, number, gain=gain, localization=localization_of(mode))
    lockstep.chair.world.obstacles.add(box)
    asked = []

    def help_comes(lockstep):
        if not asked and lockstep.newest is not None and lockstep.newest.help:
            asked.append(lockstep.time)
        if asked and lockstep.time > asked[0] + HELP_S and len(lockstep.chair.world.obstacles):
            lockstep.chair.world.obstacles.remove(box.name)

    recorder = Recorder(lockstep, help_comes if fate == 'taken_away' else None)
    lockstep.start_up()
    ended, late = reach(recorder, GOAL, PATIENCE_S)
    found = judge(recorder.track([ended]), lockstep.chair.drive.world)
    contacts = tuple(recorder.touched.contacts)
    return Attempt(mode, fate, number, ended.reached, late, ended.text, recorder.recoveries, contacts, found)
