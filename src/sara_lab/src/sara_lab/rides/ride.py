"""A ride: a simulated rider steers the simulated chair through a circuit, by a stick on the multiplexer's source
`joystick`, in lockstep, localized by the true pose.

Three ways to drive are compared: `free`, within the rider's profile alone; `gate`, with the safety gate; `assisted`,
with shared control before the gate. A ride is over when the last checkpoint is passed, when its time is up, or when the
rider has not come nearer to the next checkpoint for GIVES_UP_S.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from sara_bringup.lockstep.assisted import Assisted
from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.platforms import chosen, parameters
from sara_control.assist.assist_config import AssistConfig
from sara_control.assist.help_profiles import HelpProfiles
from sara_control.assist.shared_control import SharedControl
from sara_control.gate.gate_config import SafetyConfig
from sara_control.mux.joystick import Joystick, JoystickConfig
from sara_lab.judge import gaps
from sara_lab.judge.contact_watch import ContactWatch
from sara_lab.judge.judge import GAP_STEP_S
from sara_lab.judge.runs import runs
from sara_lab.rides.circuits import Circuit, circuits
from sara_lab.rides.steering import reversal_rate, sign_changes
from sara_lab.rides.ungated import Ungated
from sara_nav.planners.planning import path_length
from sara_sim.chair import STEP_S
from sara_sim.riders.riders import Place
from sara_sim.riders.riders import rider as rider_of
from sara_sim.riders.stick import Rider

WAYS = ('free', 'gate', 'assisted')
SOURCE = 'joystick'
STICK_STEPS = 5  # 20 Hz: the stick is read
LIMIT_S = 300.0
GIVES_UP_S, NEARER_M = 60.0, 0.10
CHECKED_M, ARRIVED_M = 0.8, 0.4  # within so much of a checkpoint it is passed; of the last one
STANDING = 0.02  # m/s, rad/s: slower than both is standing,
STOP_S = 0.5  # and so long is a stop


@dataclass(frozen=True)
class Ride:
    """What came of a ride. completed: all checkpoints were `passed`. seconds: until its end. length: m driven.
    reversals_per_m: sign changes of the stick's turning; reversals_per_min: steering reversals (steering.py). changed:
    mean |command - wish| over mean |wish|, of shared control alone. stops: how often the chair came to stand on the
    way. gap: least, m. corrections: {name: share of the time}. contacts: list of Contact as plain data.
    """

    circuit: str
    rider: str
    way: str
    seed: int
    completed: bool
    passed: int
    seconds: float
    length: float
    reversals_per_m: float
    reversals_per_min: float
    changed: float
    stops: int
    gap: float
    corrections: dict[str, float]
    contacts: tuple

    def to_json(self) -> dict[str, Any]:
        """All as plain data."""
        return asdict(self)


class Reading(NamedTuple):
    """The stick, read once. left: of full deflection. wish, command: (v m/s, w rad/s) before and after shared control.
    correction: its name, or None.
    """

    left: float
    wish: tuple[float, float]
    command: tuple[float, float]
    correction: str | None


class Log:
    """What is kept of a ride, step by step. poses: (t, x, y, yaw). speeds: (v, w), true. readings: (number of the step,
    Reading).
    """

    def __init__(self) -> None:
        self.poses, self.speeds, self.readings = [], [], []


def prepare(lockstep: Lockstep, way: str, config: AssistConfig | None = None) -> Assisted | None:
    """Make a Lockstep ready for one of the WAYS; returns what assists it. config: the profile at start where none is
    given. Raises ValueError.
    """
    if way not in WAYS:
        raise ValueError(f'way is {way!r}, allowed are {", ".join(WAYS)}')
    if way == 'free':
        lockstep.wheels.guard = Ungated(SafetyConfig.from_params(parameters('sara_control', 'safety.yaml')))
    if way != 'assisted':
        return None
    return Assisted(lockstep, SharedControl(config or assist_config()))


def assist_config(rider: str = '') -> AssistConfig:
    """The profile that a rider chooses: `switches` who has those, else the one at start."""
    profiles = HelpProfiles.from_params(parameters('sara_control', 'assist.yaml'))
    return profiles.configs['switches'] if rider == 'four_directions' else profiles.config


def ride(circuit: str, rider: str, way: str, seed: int, config: AssistConfig | None = None) -> Ride:
    """Drive a circuit (a name of circuits()) on the chair `seed`, whose rider's luck is drawn from it too. rider: of
    sara_sim's RIDERS; way: of WAYS. config: of shared control; None: the profile that the rider chooses.
    """
    return logged_ride(circuit, rider, way, seed, config)[0]


def logged_ride(circuit: str, rider: str, way: str, seed: int, config: AssistConfig | None = None) -> tuple[Ride, Log]:
    """As `ride`, and what was kept on the way."""
    return ride_through(circuits()[circuit], (circuit, rider, way, seed), config)


def ride_through(
    course: Circuit, names: tuple[str, str, str, int], config: AssistConfig | None = None
) -> tuple[Ride, Log]:
    """As `logged_ride`, through any Circuit. names: (its name, rider, way, seed)."""
    _, rider, way, seed = names
    lockstep = Lockstep(course.grid, course.start, seed, localization='fake')
    assisted = prepare(lockstep, way, config or assist_config(rider))
    log, touched, passed = drive(lockstep, rider_of(rider, course.task, seed), course.checkpoints, assisted)
    return _judged(names, course, lockstep, log, (touched, passed)), log


def drive(
    lockstep: Lockstep, person: Rider, places: Sequence[Place], assisted: Assisted | None
) -> tuple[Log, ContactWatch, int]:
    """Step until the ride past places (x, y; m) is over: (Log, ContactWatch, how many of them were passed)."""
    joystick = stick_of()
    log, touched, goals = Log(), ContactWatch(), _Goals(places)
    lockstep.start_up()
    begin = lockstep.time
    while not goals.over(lockstep.time, lockstep.chair.pose) and lockstep.time - begin < LIMIT_S:
        if lockstep.tick % STICK_STEPS == 0:
            log.readings.append((len(log.poses), steer(lockstep, person, joystick, assisted)))
        touched.before(lockstep.chair)
        lockstep.step()
        touched.after(lockstep.chair)
        log.poses.append((lockstep.time, *lockstep.chair.pose))
        log.speeds.append(lockstep.chair.velocity)
    return log, touched, goals.passed


def stick_of() -> Joystick:
    """What makes commands of a rider's stick, as cmd_vel_mux is set up."""
    return Joystick(JoystickConfig.from_params(parameters('sara_control', 'mux.yaml')['joystick']))


def steer(lockstep: Lockstep, person: Rider, joystick: Joystick, assisted: Assisted | None) -> Reading:
    """Read the stick once and send what it says; the Reading."""
    stick = person.stick(lockstep.time, lockstep.chair.pose)
    wish = joystick.on_axes(stick, ())
    if wish is None:
        return Reading(stick.left, (0.0, 0.0), (0.0, 0.0), None)
    lockstep.wheels.on_command(SOURCE, *wish, lockstep.time)
    if assisted is None or assisted.command is None:
        return Reading(stick.left, wish, wish, None)
    made = assisted.command
    return Reading(stick.left, wish, (made.v, made.w), made.correction and made.correction.name)


def gap_along(lockstep: Lockstep, rows: np.ndarray) -> np.ndarray:
    """The gap (m) between the body and what is nearest, every GAP_STEP_S of a Log's poses: (n, 4), n > 0."""
    return gaps.along(lockstep.chair.drive.world, rows[:, 0], rows[:, 1:], chosen().size, GAP_STEP_S)


class _Goals:
    """Checkpoints one after the other; `passed`: how many. The rider gives up who does not come nearer to the next."""

    def __init__(self, places):
        self._places, self.passed = places, 0
        self._nearest, self._since = math.inf, None

    def over(self, t, pose):
        """Whether all are passed, or it is given up, at t (s)."""
        if self._since is None:
            self._since = t
        last = self.passed == len(self._places) - 1
        away = math.dist(pose[:2], self._places[self.passed])
        if away < (ARRIVED_M if last else CHECKED_M):
            self.passed, self._nearest, self._since = self.passed + 1, math.inf, t
            return last
        if away < self._nearest - NEARER_M:
            self._nearest, self._since = away, t
        return t - self._since > GIVES_UP_S


def _judged(names, course, lockstep, log, end):
    touched, passed = end
    rows, speeds = np.array(log.poses), np.array(log.speeds)
    t, poses = rows[:, 0], rows[:, 1:]
    readings = [reading for _, reading in log.readings]
    left = np.array([reading.left for reading in readings])
    length = path_length(poses)
    return Ride(
        *names,
        completed=passed == len(course.checkpoints),
        passed=passed,
        seconds=float(t[-1] - t[0]),
        length=length,
        reversals_per_m=sign_changes(left) / max(length, 1e-9),
        reversals_per_min=reversal_rate(left, STEP_S * STICK_STEPS),
        changed=_changed(readings),
        stops=_stops(speeds),
        gap=float(gap_along(lockstep, rows).min()),
        corrections=_shares([reading.correction for reading in readings]),
        contacts=tuple(contact.to_json() for contact in touched.contacts),
    )


def _changed(readings):
    """Mean |command - wish| over mean |wish|, each axis in shares of its greatest wish; 0 where nothing was wished."""
    full = JoystickConfig.from_params(parameters('sara_control', 'mux.yaml')['joystick'])
    size = full.max_linear, full.max_angular
    wish = np.array([reading.wish for reading in readings], float) / size
    command = np.array([reading.command for reading in readings], float) / size
    wished = np.hypot(*wish.T).sum()
    return float(np.hypot(*(command - wish).T).sum() / wished) if wished > 0.0 else 0.0


def _shares(names):
    """{name of a correction: share of the readings of the stick}."""
    return {name: names.count(name) / len(names) for name in sorted({name for name in names if name})}


def _stops(speeds):
    """How often a chair that had moved stood for STOP_S, and moved again."""
    stands = (np.abs(speeds) < STANDING).all(axis=1)
    between = [(first, end) for first, end in runs(stands) if first > 0 and end < len(stands)]
    return sum(end - first >= round(STOP_S / STEP_S) for first, end in between)
