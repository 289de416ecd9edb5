"""The campaign's part `assisted_bus`: somebody drives by the chair's own joystick with the PC's help, and something
happens, at a moment, a speed and a curve drawn from the seed: how soon the chair stands, whether a command comes
afterwards, and how it goes on. On the whole stack in lockstep, in the hall.

The rider holds the stick as it was while PC, bus, joystick or switch fail, as who does not notice. `grabbed`: another
hand pulls it back, then it springs to its centre; `grabbed_on_goal`: the same while the PC drives by itself, whose
commands go on all the time. `let_go_unheard`: by the PC. `let_go_not_heeded`: the PC repeats its last frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_common.platforms import parameters
from sara_control.gate.gate_config import SafetyConfig
from sara_lab.campaign.hazards import AT_REST, HALL_START, HARD_BRAKING, MOVED_M, STEPS_PER_S, too_late
from sara_lab.campaign.part import Part
from sara_lab.rides.ride import prepare
from sara_lowlevel.config import JoystickConfig

CENTRED = (512, 512)
DEFLECTIONS, CURVES = (150, 511), (-60, 60)  # of 512 counts, forward and to the side
AFTER_S, GRAB_S = (2.5, 5.0), (0.3, 3.0)  # s until it happens, and that the other hand holds on
GOAL_SPEEDS, GOAL_CURVE = (0.2, 0.6), 0.1  # m/s, rad/s at most, of a PC that drives by itself
LASTS_S = 4.0  # a bus is cut for so long
WATCHED_S = 7.0
EASE_S = 1.0  # until an acceleration is undone: braking over jerk of the rider's profile
SETTLES_S = 0.3  # of the wheels, below AT_REST
FRESH_S, PUSH_S, GOES_M = 1.5, 3.0, 0.1  # let go for so long, then pushed: that is to move it
ROUNDING_S = 0.25  # of the wheels' lag, as in docs/safety.md
STANDS, MANUAL, HELPED = (0.0, 0.0), 1, 2


@dataclass(frozen=True)
class Event:
    """`make`: called with the _Chair and a Generator. `time`: s until braking begins; `gently`: within the rider's
    profile, hard otherwise. `mode`: modoPC when the stick was let go and pushed again, `pushes` times. `pc_runs`:
    afterwards. `on_goal`: the PC drives by itself before.
    """

    make: Callable
    time: float
    gently: bool = False
    mode: int = HELPED
    pc_runs: bool = True
    on_goal: bool = False
    pushes: int = 1


def _kill(_driven, _luck):
    """Nothing: the PC is not stepped any more."""


def _cut(driven, _luck):
    driven.chair.faults.add('adapter_unplugged', duration=LASTS_S)


def _let_go(driven, _luck):
    driven.chair.joystick = CENTRED


def _grab(driven, luck):
    driven.chair.joystick = _stick(luck, -1)
    driven.run(luck.uniform(*GRAB_S))
    driven.chair.joystick = CENTRED


def _lose_joystick(driven, _luck):
    driven.chair.faults.add('node_silent', node='joystick', duration=LASTS_S)


def _let_go_unheard(driven, _luck):
    driven.chair.faults.add('frames_dropped', ids=['JOYSTICK'], duration=LASTS_S)
    driven.chair.joystick = CENTRED


def _let_go_not_heeded(driven, _luck):
    wheels = driven.lockstep.wheels
    frame = wheels.step(driven.chair.time)
    wheels.step = lambda now: frame
    driven.chair.joystick = CENTRED


def _turn(driven, _luck):
    driven.chair.assisted = False


EVENTS = {
    'pc_killed': Event(_kill, 0.25, mode=MANUAL, pc_runs=False),
    'bus_cut': Event(_cut, 0.25),
    'let_go': Event(_let_go, 0.15, gently=True),
    'grabbed': Event(_grab, 0.15 + EASE_S, gently=True),
    'grabbed_on_goal': Event(_grab, 0.15 + EASE_S, gently=True, on_goal=True),
    'switch_turned': Event(_turn, 0.05, mode=MANUAL),
    'joystick_lost': Event(_lose_joystick, 0.55),
    'let_go_unheard': Event(_let_go_unheard, 0.65, gently=True),
    'let_go_not_heeded': Event(_let_go_not_heeded, 3.15, mode=MANUAL, pushes=2),
}


def _stick(luck, sense):
    """(x, y) raw axes: forward or back, on a curve."""
    return 512 + round(luck.uniform(*CURVES)), 512 + sense * round(luck.uniform(*DEFLECTIONS))


@dataclass(frozen=True)
class Outcome:
    """`before`, `speed`: m/s when it happened, and when the braking was due. `fastest`: m/s forward from then on.
    `stopped_after`: s until it stands and no wheel is commanded, for good; `allowed`: s. `commands`: steps in which a
    wheel was commanded after that, `drifted`: m. `goes_on`: whether a stick that was let go and pushed moved it, at
    `mode`.
    """

    event: str
    seed: int
    before: float
    speed: float
    fastest: float
    stopped_after: float
    allowed: float
    commands: int
    drifted: float
    goes_on: bool
    mode: int
    contacts: int

    @property
    def faults(self) -> list[str]:
        """What does not hold, a sentence each."""
        found = too_late(self.stopped_after, self.speed, self.allowed)
        if self.fastest > self.before + AT_REST:
            found.append(f'{self.fastest:.2f} m/s, {self.before:.2f} before')
        if self.commands or self.drifted > MOVED_M:
            found.append(f'{self.commands} commands and {self.drifted:.3f} m at rest')
        if not self.goes_on or self.mode != EVENTS[self.event].mode:
            found.append(f'after letting go the mode is {self.mode}, and it goes on: {self.goes_on}')
        if self.contacts:
            found.append(f'{self.contacts} contacts')
        return found


class _Chair:
    """A Lockstep whose PC may be dead (`pc_runs`). `fastest`: m/s forward, so far."""

    def __init__(self, seed):
        self.lockstep = Lockstep(
            share() / 'maps' / 'hall.yaml', HALL_START, seed, localization='fake', dbc='sara_assisted'
        )
        self.chair, self.pc_runs, self.fastest = self.lockstep.chair, True, 0.0
        self.chair.assisted = True
        prepare(self.lockstep, 'assisted')
        self.lockstep.start_up()
        self.run(0.5)

    def step(self):
        (self.lockstep if self.pc_runs else self.chair).step()
        self.fastest = max(self.fastest, self.chair.velocity[0])

    def run(self, seconds):
        for _ in range(round(seconds * STEPS_PER_S)):
            self.step()

    @property
    def speed(self):
        return abs(self.chair.velocity[0])


def happen(name: str, seed: int) -> Outcome:
    """Let the event `name` of EVENTS happen to the chair `seed`."""
    event, driven, luck = EVENTS[name], _Chair(seed), np.random.default_rng((seed, *map(ord, name)))
    if event.on_goal:
        v, w = luck.uniform(*GOAL_SPEEDS), luck.uniform(-GOAL_CURVE, GOAL_CURVE)
        driven.lockstep.pilot = lambda now: (v, w)
    else:
        driven.chair.joystick = _stick(luck, 1)
    driven.run(luck.uniform(*AFTER_S))
    before = driven.fastest = driven.speed
    event.make(driven, luck)
    driven.pc_runs, speed = event.pc_runs, driven.speed
    stopped, allowed, commands, drifted = _judged(event, speed, _watch(driven))
    fastest, goes_on = driven.fastest, any(_goes_on(driven) for _ in range(event.pushes))
    mode, contacts = driven.chair.motor.mode, driven.chair.contacts
    return Outcome(name, seed, before, speed, fastest, stopped, allowed, commands, drifted, goes_on, mode, contacts)


def _gentle(speed):
    """s that the rider's profile brakes from a speed (m/s), without turning."""
    config = SafetyConfig.from_params(parameters('sara_control', 'safety.yaml'))
    profile = config.profiles[config.profile]
    ease = profile.braking / profile.jerk
    return speed / profile.braking + ease if speed > ease * profile.braking else 2.0 * math.sqrt(speed / profile.jerk)


def _watch(driven):
    """Rows (s, speed m/s, whether a wheel is commanded, x, y) of WATCHED_S."""
    chair, began, rows = driven.chair, driven.chair.time, []
    while chair.time < began + WATCHED_S:
        driven.step()
        rows.append((chair.time - began, driven.speed, chair.motor.target != STANDS, *chair.pose[:2]))
    return rows


def _judged(event, speed, rows):
    """(s until it stands for good, s allowed, steps with a command after that, m moved after that)."""
    peak = max(row[1] for row in rows)
    allowed = event.time + (_gentle(peak) if event.gently else speed / HARD_BRAKING) + ROUNDING_S
    busy = [t for t, now, commanded, *_ in rows if now >= AT_REST or commanded]
    stopped = busy[-1] if busy else 0.0
    late = [row for row in rows if row[0] > allowed + SETTLES_S]
    return stopped, allowed, sum(row[2] for row in late), max(math.dist(row[3:], late[0][3:]) for row in late)


def _goes_on(driven):
    """Whether the stick, let go and pushed, moves the chair."""
    chair = driven.chair
    chair.joystick = CENTRED
    driven.run(FRESH_S)
    before, full = chair.pose, JoystickConfig.of()
    chair.joystick = 512, 512 + (full.full_scale + full.dead_band) // 2
    driven.run(PUSH_S)
    return math.dist(chair.pose[:2], before[:2]) > GOES_M


def assisted_bus(seeds: int, _folder: Path) -> Part:
    """Every event, on each chair."""

    def case(name, seed):
        outcome = happen(name, seed)
        return {**vars(outcome), 'faults': outcome.faults}

    return Part(
        {
            f'assisted_bus_{name}_{seed}': lambda name=name, seed=seed: case(name, seed)
            for name in EVENTS
            for seed in range(seeds)
        },
        _summary,
    )


def _summary(results):
    lines, figures = [f'{"event":16} {"cases":>5} {"worst s":>8} {"of allowed":>11} {"commands after":>15}'], {}
    for name in EVENTS:
        of = [result for result in results if result['event'] == name]
        worst = max(of, key=lambda result: result['stopped_after'] / result['allowed'])
        row = figures[name] = {
            'cases': len(of),
            'worst_s': worst['stopped_after'],
            'share': worst['stopped_after'] / worst['allowed'],
            'commands': sum(result['commands'] for result in of),
        }
        lines.append('{:16} {cases:5} {worst_s:8.2f} {share:11.0%} {commands:15}'.format(name, **row))
    return lines, figures
