"""Travel: SARA as it is set up by default drives from random poses to random poses on three maps, in lockstep, sensors
and safety gate as on the chair.

Ways of making it harder (MODES): the pose is the true one, or fused; five boxes that the map does not know; pedestrians
who see the chair (crowd.py; fused pose); two people who walk about and stop for nobody; the same people, whom the
safety gate was told to expect. What came of a journey is judged by `judge`; who touched whom is told by
contact_watch.py.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep, LockstepError
from sara_common.planar import Pose2D, wrap
from sara_lab.journeys.crowd import crowd
from sara_lab.journeys.judged import Judged
from sara_lab.journeys.travel_cases import boxes, map_file, pairs, people
from sara_lab.judge.contact_watch import ContactWatch
from sara_lab.judge.encounters import Encounters
from sara_lab.judge.judge import judge
from sara_lab.judge.judgement import Goal, Track
from sara_lab.judge.time_split import StepRecorder, split
from sara_nav.goals.move_base_config import ACTIVE, SUCCEEDED
from sara_nav.maps.map_io import GridMap
from sara_sim.chair import STEP_S
from sara_sim.world.world import World

WALKERS = ('people', 'expected')  # who stop for nobody
AMONG_PEOPLE = ('pedestrians', *WALKERS)
FUSED = ('fused', 'pedestrians')
POSES = ('true', 'fused')
MODES = (*POSES, 'boxes', *AMONG_PEOPLE)
PACE, PATIENCE_S = 0.10, 120.0  # a journey may take its way at so many m/s, and so long besides;
SLOW_PACE, MUCH_PATIENCE_S = (
    0.015,
    600.0,
)  # where people walk about it has to creep and to stand, and to turn about for another way
SETTLE_S = 1.0
SAMPLE_STEPS = 2  # 50 Hz
POSITION_M, YAW_DEG = (
    {'true': 0.10, 'fused': 0.30},
    {'true': 4.0, 'fused': 7.0},
)  # farther off than that, a goal is not reached, whatever move_base says


@dataclass(frozen=True)
class Outcome(Judged):
    """What came of a journey. `way`: m, the shortest. `reached`: by move_base's word and by the true pose. `late`:
    whether its time ran out.
    `contacts`: [Contact]. `judgement`: Judgement, or None where the chair did not start.
    """

    map: str
    mode: str
    number: int
    start: tuple
    goal: tuple
    way: float
    reached: bool
    late: bool
    text: str
    seconds: float
    position_error: float
    yaw_error_deg: float
    recoveries: int
    contacts: tuple
    judgement: object

    @property
    def faults(self) -> list[str]:
        """What must not be on any journey, one sentence each."""
        found = [f'contact: {contact}' for contact in self.contacts if not contact.blameless]
        return found + ([f'neither reached nor ended in words: {self.text}'] if self.late else [])

    def with_ideal(self, seconds: float) -> Outcome:
        """The Outcome whose Judgement knows the ideal time (s)."""
        if self.judgement is None:
            return self
        return replace(
            self, judgement=replace(self.judgement, ideal=seconds, time_ratio=self.judgement.seconds / seconds)
        )

    def to_json(self) -> dict[str, Any]:
        """All as plain data."""
        return {
            **super().to_json(),
            'position_error': None if math.isnan(self.position_error) else self.position_error,
            'yaw_error_deg': None if math.isnan(self.yaw_error_deg) else self.yaw_error_deg,
        }


class Recorder:
    """Keeps of a Lockstep what a Track needs. `watch`: called with the Lockstep after each step; `touched`: the
    ContactWatch; `encounters`: the Encounters.
    """

    def __init__(self, lockstep: Lockstep, watch: Callable[[Lockstep], None] | None = None) -> None:
        self.lockstep, self.touched, self.encounters, self._watch = lockstep, ContactWatch(), Encounters(), watch
        self.steps = StepRecorder()  # with a goal
        self.t, self.pose, self.commanded, self.plans, self.recoveries = [], [], [], [], 0
        self._known = None

    def step(self) -> None:
        """Step, watch, and keep."""
        lockstep, chair = self.lockstep, self.lockstep.chair
        self.touched.before(chair)
        lockstep.step()
        self.touched.after(chair)
        self.encounters.after(lockstep)
        if self._watch is not None:
            self._watch(lockstep)
        newest = lockstep.newest
        if newest is not None and newest is not self._known:
            self._known = newest
            if newest.plan is not None:
                self.plans.append((lockstep.time, np.array(newest.plan)))
            self.recoveries += newest.recovery is not None
        if lockstep.tick % SAMPLE_STEPS == 0:
            self.t.append(lockstep.time)
            self.pose.append(chair.pose)
            self.commanded.append(
                newest.command if newest is not None and newest.status == ACTIVE else (math.nan, math.nan)
            )

    def track(self, goals: Sequence[Goal]) -> Track:
        """The Track of what was kept; without a split where nothing was driven by `reach`."""
        steps = self.steps.steps(STEP_S)
        return Track(
            np.array(self.t),
            np.array(self.pose),
            'true',
            tuple(goals),
            tuple(self.plans),
            np.array(self.commanded, float),
            len(self.touched.contacts),
            split(steps, self.lockstep.wheels.guard.rider) if len(steps.moved) else None,
            self.encounters.meetings,
        )


def reach(recorder: Recorder, pose: tuple[float, float, float], seconds: float) -> tuple[Goal, bool]:
    """Give a goal (x, y, yaw) and step until it ends, or for so long, and a second more; returns (Goal without a
    shortest way, whether it was late).
    """
    lockstep = recorder.lockstep
    lockstep.result, given, late = None, lockstep.time, False
    lockstep.move_base.set_goal(Pose2D(*pose), given)
    while lockstep.result is None:
        if not late and lockstep.time > given + seconds:
            late = True
            lockstep.move_base.cancel(lockstep.time, f'not there after {seconds:.0f} s')
        recorder.step()
        recorder.steps.add(lockstep)
    ended, end = lockstep.time, lockstep.result
    for _ in range(round(SETTLE_S / 0.01)):
        recorder.step()
    return Goal(tuple(pose), given, ended, end.status == SUCCEEDED, end.text, lockstep.time), late


def localization_of(mode: str) -> str:
    """Lockstep's `localization` in one of the MODES."""
    return 'ekf' if mode in FUSED else 'fake'


def drive(
    name: str,
    mode: str,
    number: int,
    gain: float | None = None,
    navigation: dict | None = None,
    watch: Callable[[Lockstep], None] | None = None,
    scan: bool = False,
    known: GridMap | None = None,
) -> Outcome:
    """Journey `number` of a map in one of the MODES; the chair is drawn by the number. Returns the Outcome.

    `gain`: of that chair's gyro (fused). `navigation`: a tree laid over sara_nav.yaml. `watch`: called with the
    Lockstep after each step. `scan`: whether the chair has the laser scanner. `known`: the map that it drives by, in
    the true one's frame; None: the true one.
    """
    pair = pairs(name)[number]
    lockstep = Lockstep(
        map_file(name),
        pair.start,
        number,
        gain=gain,
        localization=localization_of(mode),
        navigation=navigation,
        scan=scan,
        known=known,
    )
    world = World.from_yaml(map_file(name))
    for obstacle in _about(name, mode, number):
        lockstep.chair.world.obstacles.add(obstacle)
        world.obstacles.add(obstacle)
    lockstep.wheels.guard.zones.caution.expect(mode == 'expected')
    recorder = Recorder(lockstep, watch)
    try:
        lockstep.start_up()
    except LockstepError as error:
        return _not_started(name, mode, number, str(error))
    pace, besides = (SLOW_PACE, MUCH_PATIENCE_S) if mode in AMONG_PEOPLE else (PACE, PATIENCE_S)
    goal, late = reach(recorder, pair.goal, besides + pair.way / pace)
    goal = replace(goal, shortest=pair.way)
    return _outcome(name, mode, number, recorder, (goal, late), judge(recorder.track([goal]), world))


def _about(name, mode, number):
    """What the map does not show."""
    if mode == 'boxes':
        return boxes(name)
    if mode == 'pedestrians':
        return crowd(name, number)
    return people(name, number) if mode in WALKERS else ()


def _not_started(name, mode, number, why):
    """The Outcome of a chair that did not come up."""
    pair = pairs(name)[number]
    place = (pair.start, pair.goal, pair.way)
    return Outcome(name, mode, number, *place, False, False, why, 0.0, math.nan, math.nan, 0, (), None)


def _outcome(name, mode, number, recorder, end, judgement):
    """The Outcome; `end`: the Goal, and whether it was late."""
    pair, (goal, late), last = pairs(name)[number], end, recorder.lockstep.chair.pose
    off, turned = math.dist(last[:2], pair.goal[:2]), math.degrees(wrap(last[2] - pair.goal[2]))
    kind = 'fused' if mode in FUSED else 'true'
    there = off <= POSITION_M[kind] and abs(turned) <= YAW_DEG[kind]
    text = goal.text if there or not goal.reached else f'{goal.text} But it is {off:.3f} m and {turned:+.1f} deg off.'
    return Outcome(
        name,
        mode,
        number,
        pair.start,
        pair.goal,
        pair.way,
        goal.reached and there,
        late,
        text,
        goal.ended - goal.given,
        off,
        turned,
        recorder.recoveries,
        tuple(recorder.touched.contacts),
        judgement,
    )
