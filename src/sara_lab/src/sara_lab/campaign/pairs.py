"""The campaign's part `pairs`: two to four faults at once on fused journeys.

A seed draws the chair, the journey, and the faults with their arguments, one shortly after the other. Whatever they do
to each other: nothing raises, the goal ends in words in time, nothing is touched, and a chair that the safety gate
holds stays where it came to rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.planar import wrap
from sara_common.platforms import chosen
from sara_control.gate.reasons import State
from sara_lab.campaign.part import Part, lines_of
from sara_lab.journeys.travel import PACE, PATIENCE_S, Recorder, map_file, reach
from sara_lab.journeys.travel_cases import PAIRS, pairs

MAPS = ('flat', 'school')
STREAM = 21  # of the seed's random numbers, so that the faults' luck is not the chair's
FAULTS_AT_ONCE = (2, 4)
FIRST_S, APART_S = (1.0, 15.0), 3.0  # s after the goal was given; and so much later at most the others begin
LASTS_S, ON_THE_BUS = (0.3, 6.0), 5.0  # what happens to frames lasts so many times longer
WATCHED_S = 5.0  # after the goal's end and the last fault's
AT_REST = 0.01  # m/s of the fastest corner; once slower, a held chair has come to rest
MOVED_M = 0.02  # less than this is no motion
HELD = (State.HELD, State.WAITING)


def _bus(random):
    """Of a FrameFault: up to four frames in ten."""
    return {
        'probability': float(random.uniform(0.05, 0.4)),
        'direction': str(random.choice(('to_pc', 'from_pc', 'both'))),
    }


DRAWS: dict[str, Callable[[np.random.Generator], dict[str, Any]]] = {
    'frames_dropped': _bus,
    'frames_delayed': lambda random: {**_bus(random), 'delay': float(random.uniform(0.02, 0.3))},
    'frames_duplicated': _bus,
    'frames_corrupted': lambda random: {**_bus(random), 'bits': int(random.integers(1, 9))},
    'adapter_unplugged': lambda random: {},
    'sonar_stuck': lambda random: {
        'sensor': str(random.choice(sorted(chosen().sonars))),
        'range': float(random.uniform(0.0, 3.0)),
    },
    'sonar_noisy': lambda random: {
        'sensor': str(random.choice(sorted(chosen().sonars))),
        'sigma': float(random.uniform(0.05, 1.0)),
    },
    'sonar_silent': lambda random: {'sensor': str(random.choice(sorted(chosen().sonars)))},
    'imu_stuck': lambda random: {},
    'imu_noisy': lambda random: {'gyro_sigma': float(random.uniform(1.0, 20.0))},
    'imu_silent': lambda random: {},
    'encoder_frozen': lambda random: {'wheel': str(random.choice(('right', 'left', 'both')))},
    'encoder_noisy': lambda random: {'wheel': str(random.choice(('right', 'left', 'both')))},
    'node_silent': lambda random: {'node': str(random.choice(('sensor', 'motor', 'joystick')))},
    'wheel_slip': lambda random: {'factor': float(random.uniform(0.5, 1.0))},
    'push': lambda random: {
        'left': float(random.uniform(-0.3, 0.3)),
        'turn': float(random.uniform(-0.3, 0.3)),
        'duration': 0.3,
    },
    'battery_low': lambda random: {'voltage': float(random.uniform(19.0, 23.0)), 'ramp': 1.0},
    'joystick_grabbed': lambda random: {'x': int(random.integers(500, 525)), 'y': int(random.integers(460, 565))},
}
"""Every kind of fault of the simulator but its scanner's, and how its arguments are drawn; the rider does not drive
into a wall.
"""


class Planned(NamedTuple):
    """A fault: s after the goal was given when it begins, its name, its arguments."""

    at: float
    name: str
    arguments: dict[str, Any]


def draw(seed: int) -> list[Planned]:
    """The faults of a seed, in the order in which they begin."""
    random = np.random.default_rng((seed, STREAM))
    low, high = FAULTS_AT_ONCE
    names = random.choice(sorted(DRAWS), int(random.integers(low, high + 1)), replace=False)
    first, planned = random.uniform(*FIRST_S), []
    for name in names.tolist():
        at = float(first + (random.uniform(0.0, APART_S) if planned else 0.0))
        duration = float(random.uniform(*LASTS_S)) * (ON_THE_BUS if name.startswith('frames') else 1.0)
        planned.append(Planned(at, name, {'duration': duration, **DRAWS[name](random)}))
    return sorted(planned, key=lambda fault: fault.at)


class HeldWatch:
    """How far a corner of the body moves, at most, while the safety gate holds the chair. `moved`: m. Who pushes or
    drives it by hand moves it, the gate does not.
    """

    def __init__(self) -> None:
        self.moved = 0.0
        self._rest = None

    def step(self, lockstep: Lockstep) -> None:
        """After each step of the Lockstep."""
        chair, decision = lockstep.chair, lockstep.wheels.decision
        by_hand = chair.drive.drift.active or chair.motor.mode == 1
        corner = 0.5 * math.hypot(*chair.platform.size)  # from the axle's middle to a corner of the body
        if decision is None or decision.state not in HELD or by_hand:
            self._rest = None
            return
        x, y, yaw = chair.pose
        if self._rest is None:
            speed, turn = chair.velocity
            if abs(speed) + abs(turn) * corner < AT_REST:
                self._rest = x, y, yaw
            return
        there_x, there_y, there_yaw = self._rest
        moved = math.hypot(x - there_x, y - there_y) + abs(wrap(yaw - there_yaw)) * corner
        self.moved = max(self.moved, moved)


class FaultMaker:
    """Lets the planned faults happen to a Lockstep, from its first step after the goal was given."""

    def __init__(self, planned: list[Planned]) -> None:
        self._left, self._given, self._over = list(planned), None, -math.inf

    def step(self, lockstep: Lockstep) -> None:
        """After each step."""
        if self._given is None:
            self._given = lockstep.time
        while self._left and lockstep.time >= self._given + self._left[0].at:
            fault = self._left.pop(0)
            lockstep.chair.faults.add(fault.name, **fault.arguments)
            self._over = max(self._over, lockstep.time + fault.arguments['duration'])

    def quiet(self, now: float) -> bool:
        """Whether all that has begun has been over for WATCHED_S."""
        return now >= self._over + WATCHED_S


def drive(seed: int) -> dict[str, Any]:
    """The journey of a seed with its faults, as plain data; `faults`: what does not hold, a sentence each."""
    name, planned = MAPS[seed % len(MAPS)], draw(seed)
    pair = pairs(name)[seed // len(MAPS) % PAIRS]
    lockstep = Lockstep(map_file(name), pair.start, seed)
    lockstep.start_up()
    maker, held = FaultMaker(planned), HeldWatch()

    def watch(stepped):
        maker.step(stepped)
        held.step(stepped)

    recorder = Recorder(lockstep, watch)
    goal, late = reach(recorder, pair.goal, PATIENCE_S + pair.way / PACE)
    ended = lockstep.time
    while lockstep.time < ended + WATCHED_S or not maker.quiet(lockstep.time):
        recorder.step()
    contacts = [str(contact) for contact in recorder.touched.contacts]
    faults = [f'contact: {contact}' for contact in contacts]
    if held.moved > MOVED_M:
        faults.append(f'moved {held.moved:.3f} m while it was held')
    if late or not goal.text:
        faults.append(f'the goal did not end in words in time: {goal.text!r}')
    return {
        'seed': seed,
        'map': name,
        'with': [fault._asdict() for fault in planned],
        'reached': goal.reached,
        'text': goal.text,
        'seconds': goal.ended - goal.given,
        'held_moved': held.moved,
        'contacts': contacts,
        'faults': faults,
    }


def fault_pairs(seeds: int, _folder: Path) -> Part:
    """Two to four faults at once, on journeys in a flat and a school."""
    return Part({f'pairs_{seed}': partial(drive, seed) for seed in range(seeds)}, _summary)


def _summary(results):
    figures = {
        'reached': sum(result['reached'] for result in results),
        'contacts': sum(len(result['contacts']) for result in results),
        'held_moved_m': max(result['held_moved'] for result in results),
    }
    return lines_of(figures), figures
