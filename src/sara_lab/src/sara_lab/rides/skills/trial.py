"""A skill, driven and scored, on the simulated chair with sensors, safety gate and fused pose as delivered; chairs are
not calibrated.

WAYS: `goals`, by navigation; `shared`, by a rider whose hand trembles, with shared control; `hand`, by an expert with
the safety gate alone. Where a skill is a Push, navigation is replaced by commands that go straight on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep, LockstepError
from sara_common.planar import wrap
from sara_lab.journeys.judged import Judged
from sara_lab.journeys.travel import Recorder, reach
from sara_lab.judge.judge import judge
from sara_lab.judge.judgement import Goal
from sara_lab.judge.motion import Motion
from sara_lab.rides.ride import STICK_STEPS, prepare, steer, stick_of
from sara_lab.rides.skills.items import skills
from sara_lab.rides.skills.score import STILL, Score, of_goals, of_push, unsafe
from sara_lab.rides.skills.skill import PATIENT, Skill
from sara_nav.maps.edits import speed_mask
from sara_sim.chair import STEP_S
from sara_sim.riders.driving import Manner, WayDriver
from sara_sim.riders.impairments import Tremor
from sara_sim.riders.manoeuvres import Astern, Holder, InTurn, Turner
from sara_sim.riders.stick import Rider, Stick

WAYS = ('goals', 'shared', 'hand')
RIDE_WAYS = {'goals': 'gate', 'shared': 'assisted', 'hand': 'gate'}  # as ride.py has them
OFF_M, OFF_RAD = 0.05, math.radians(3.0)  # a start is off by so much at most
SHARES = (0.25, 0.6, 1.0)  # of full speed: a Push
PUSH_S, STOOD_S, REST_S = 35.0, 4.0, 1.0  # a Push lasts so long, or until the chair has stood so long; s after the end
CAREFUL = Manner(arrival=0.12)  # lets go late, for the chair is to come to a place


@dataclass(frozen=True)
class Outcome(Judged):
    """What came of a skill. points, why: its Score. faults: what was unsafe. seconds: until its end. texts: what
    navigation said of each goal.
    """

    skill: str
    way: str
    seed: int
    points: int
    why: tuple[str, ...]
    faults: tuple[str, ...]
    seconds: float
    tilt_deg: float
    texts: tuple[str, ...]
    recoveries: int
    contacts: tuple
    judgement: object

    def to_json(self) -> dict[str, Any]:
        """All as plain data."""
        return {**super().to_json(), 'faults': list(self.faults)}


class Tilt:
    """Watches how far the body tilts: `most`, rad. watch: called with the Lockstep, too."""

    def __init__(self, watch: Callable[[Lockstep], None] | None) -> None:
        self.most, self._watch = 0.0, watch

    def __call__(self, lockstep: Lockstep) -> None:
        self.most = max(self.most, math.hypot(*lockstep.chair.attitude))
        if self._watch is not None:
            self._watch(lockstep)


def begin(name: str, seed: int) -> tuple[float, float, float]:
    """Where the chair stands at first, (x, y, yaw), m, rad: a skill's start, off by some luck."""
    off = np.random.default_rng([seed, sum(name.encode())]).uniform(-1.0, 1.0, 3).tolist()
    x, y, yaw = skills()[name].start
    return x + OFF_M * off[0], y + OFF_M * off[1], wrap(yaw + OFF_RAD * off[2])


def drive(name: str, way: str, seed: int, watch: Callable[[Lockstep], None] | None = None) -> Outcome:
    """Drive a skill in one of the WAYS on chair `seed`: the Outcome; of a Push, that of the speed with the fewest
    points. watch: called with the Lockstep after each step.
    """
    if way not in WAYS:
        raise ValueError(f'way is {way!r}, allowed are {", ".join(WAYS)}')
    if skills()[name].push is None:
        return _drive(name, way, seed, watch)
    made = [_drive(name, way, seed, watch, share) for share in SHARES]
    return min(made, key=lambda outcome: outcome.points)


def _drive(name, way, seed, watch, share=1.0):
    skill = skills()[name]
    lockstep = Lockstep(skill.world(seed), begin(name, seed), seed, known=skill.grid)
    for layer in lockstep.move_base.local_costmap.speed_layers.values():
        layer.set_mask(speed_mask(skill.grid, skill.edits))
    assisted = prepare(lockstep, RIDE_WAYS[way])
    tilt = Tilt(watch)
    recorder = Recorder(lockstep, tilt)
    try:
        lockstep.start_up()
    except LockstepError as error:
        return Outcome(name, way, seed, 0, (str(error),), (), 0.0, 0.0, (), 0, (), None)
    since = lockstep.time
    if way == 'goals':
        goals = _commanded(recorder, skill, share) if skill.push else _by_goals(recorder, skill)
    else:
        goals = _ridden(recorder, skill, person(skill, way, seed, share), assisted)
    seconds = goals[-1].ended - since
    track = recorder.track(goals)
    score = _scored(skill, Motion.of(track.t, track.pose), recorder, tilt.most, seconds)
    return Outcome(
        name,
        way,
        seed,
        score.points,
        score.why,
        score.unsafe,
        seconds,
        math.degrees(tilt.most),
        tuple(goal.text for goal in goals),
        recorder.recoveries,
        tuple(recorder.touched.contacts),
        judge(track, lockstep.chair.world),
    )


def _scored(skill, motion, recorder, tilt, seconds):
    dangers = tuple(unsafe(motion, recorder.lockstep.wheels.guard.rider, recorder.touched.contacts, tilt))
    if dangers:
        return Score(0, dangers, dangers)
    return of_push(motion, skill.push) if skill.push else of_goals(motion, skill.goals, seconds, skill.criteria)


def _by_goals(recorder, skill):
    """The Goals, as far as it came."""
    goals = []
    for pose in skill.goals:
        goals.append(reach(recorder, pose, PATIENT * skill.criteria.seconds)[0])
        if not goals[-1].reached:
            break
    return goals


def _commanded(recorder, skill, share):
    """Commands that mind nothing, on navigation's source."""
    lockstep, push = recorder.lockstep, skill.push
    profile, slip = lockstep.wheels.guard.rider, lockstep.platform.parameters('safety_gate')['turn_slip']
    fastest = profile.max_forward if push.forward >= 0.0 else profile.max_reverse
    command = share * push.forward * fastest, share * push.left * profile.max_turn * slip
    lockstep.pilot = lambda _now: command
    return [_pushed(recorder, lambda: None)]


def _pushed(recorder, command):
    """Call `command` before each step, until the chair stands or time is up; the Goal, where the chair is then."""
    lockstep = recorder.lockstep
    given = moved = lockstep.time
    while lockstep.time - given < PUSH_S and lockstep.time - moved < STOOD_S:
        command()
        recorder.step()
        if max(map(abs, lockstep.chair.velocity)) > STILL:
            moved = lockstep.time
    return Goal(lockstep.chair.pose, given, lockstep.time, True)


def person(skill: Skill, way: str, seed: int, share: float = 1.0) -> Rider:
    """Who drives a Skill by a stick. share: of full deflection, of a Push."""
    if skill.push is not None:
        made = Holder(Stick(share * skill.push.left, share * skill.push.forward))
    else:
        riders, place = [], skill.start[:2]
        for move in skill.moves:
            if move.way:
                along = WayDriver((place, *move.way), move.way[-1:], CAREFUL)
                riders.append(Astern(along) if move.astern else along)
                place = move.way[-1]
            if move.yaw is not None:
                riders.append(Turner(move.yaw, CAREFUL))
        made = InTurn(riders)
    return Tremor(made, seed) if way == 'shared' else made


def _ridden(recorder, skill, rider, assisted):
    """Step until the rider has arrived, or gives up, and a second more; of a Push until the chair stands."""
    lockstep, joystick, given = recorder.lockstep, stick_of(), recorder.lockstep.time

    def command():
        if lockstep.tick % STICK_STEPS == 0:
            steer(lockstep, rider, joystick, assisted)

    if skill.push:
        return [_pushed(recorder, command)]
    while not rider.arrived and lockstep.time - given < PATIENT * skill.criteria.seconds:
        command()
        recorder.step()
    ended = lockstep.time
    for _ in range(round(REST_S / STEP_S)):
        recorder.step()
    return [Goal(lockstep.chair.pose, given, ended, rider.arrived)]
