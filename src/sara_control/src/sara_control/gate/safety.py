"""The safety gate: the last word before the wheels. It passes a command on, slows it, or stops the chair.

A state machine without ROS and without a clock: step(t, command, inputs) gives what the wheels are to do. It trusts
neither planner nor map. Whatever is lost or wrong stops the chair, and from then on commands count for nothing until
the chair stands, all is well, and the command has been zero, or silent for a while: a stream of commands that merely
goes on never moves it again.
The emergency stop is latched: only reset() releases it, at rest.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sara_control.gate.reasons import Reason, State

AHEAD = 0.1  # s: a stamp may be this far in the future
LONGEST_STEP = 0.1  # s: after a longer pause speeds change as if it had been this long
GIVE_UP_PERIOD = 1.0  # s between two words to a commander that is not listened to


@dataclass(frozen=True)
class Command:
    """v (m/s), w (rad/s), both finite, given at stamp (s)."""

    v: float
    w: float
    stamp: float


class Inputs(NamedTuple):
    """What the gate is told in a step.

    bus, encoders, imu, ranges, localization: when the newest good reading came, s; of several sensors, that of the one
    that has been silent longest. fault: Reason of what is implausible, or None. impact: now. pc_drives: whether the
    chair obeys commands, None while that is unknown. source: who commands, '' if unknown. speed: measured, m/s, NaN if
    unknown.
    """

    bus: float = -math.inf
    encoders: float = -math.inf
    imu: float = -math.inf
    ranges: float = -math.inf
    localization: float = -math.inf
    fault: Reason = None
    impact: bool = False
    pc_drives: bool = None
    source: str = ''
    speed: float = math.nan


class Decision(NamedTuple):
    """v (m/s) and w (rad/s) for the wheels; give_up: commanders should drop their goals, they will not be reached by
    themselves.
    waits: it goes more slowly than told, or stands, while somebody moves near by, so that standing is no reason to try
    something else.
    """

    v: float
    w: float
    state: State
    reason: Reason
    give_up: bool
    waits: bool = False


class SafetyGate:
    """config: GateConfig. comfort: Comfort. zones: Zones."""

    def __init__(self, config, comfort, zones):
        self.config = config
        self.comfort = comfort
        self.zones = zones
        # In the order of Inputs.
        self._watched = (
            (Reason.BUS, config.bus_timeout),
            (Reason.ENCODERS, config.encoder_timeout),
            (Reason.IMU, config.imu_timeout),
            (Reason.RANGES, config.range_timeout),
        )
        self._pressed = self._latched = False
        self._armed = self._firm = False
        self._cause = Reason.START
        self._last = self._gave_up = self._armed_at = None
        self._held_up = 0.0  # s

    @property
    def latched(self):
        """Whether the emergency stop is on."""
        return self._latched

    def emergency_stop(self, pressed):
        """The emergency stop's button; letting go of it does not release the stop."""
        self._pressed = pressed
        self._latched = self._latched or pressed

    def reset(self, command, inputs):
        """Release the emergency stop, if the chair stands and nobody wants it to move. Returns (done, why in a
        sentence).
        """
        if not self._latched:
            return True, 'The emergency stop is not on.'
        if self._pressed:
            return False, 'The emergency stop is still pressed.'
        if self.comfort.moving or not abs(inputs.speed) < self.config.rest_speed:
            return False, 'The emergency stop is released only when the chair stands still.'
        if _wants(command):
            return False, 'The emergency stop is released only when no command to move is given.'
        self._latched = False
        return True, 'The emergency stop is released.'

    def step(self, t, command, inputs):
        """The Decision at t (s). command: the newest Command there is, None before the first."""
        if self._last is None or t < self._last:
            self._gave_up = t
        elapsed, self._last = t - (t if self._last is None else self._last), t
        dt = min(max(elapsed, 0.0), LONGEST_STEP)
        if self._armed and command is not None and command.stamp < self._armed_at:
            command = None  # it was void when the chair became ready, and stays so
        problem = Reason.CLOCK if elapsed < 0.0 else self._problem(t, command, inputs)
        if problem is None and self._armed:
            return self._drive(t, dt, command)
        give_up = self._lose(t, command, problem)
        if problem in (Reason.JOYSTICK, Reason.UNKNOWN_DRIVER):
            self.comfort.rest()
            return self._decision(State.MANUAL, problem, give_up)
        if self.comfort.moving:
            self.comfort.brake(dt, self.config.emergency_braking, self.config.emergency_turn_braking)
            return self._decision(State.BRAKING, self._cause, give_up)
        if problem is not None:
            return self._decision(State.HELD, problem, give_up)
        if self._may_start(t, command):
            self._armed, self._armed_at = True, t
            return self._decision(State.IDLE, None, False)
        return self._decision(State.WAITING, self._cause, give_up)

    def _problem(self, t, command, inputs):
        """The gravest Reason not to drive, or None."""
        if inputs.pc_drives is None:
            return Reason.UNKNOWN_DRIVER
        if not inputs.pc_drives:
            return Reason.JOYSTICK
        if self._latched:
            return Reason.EMERGENCY_STOP
        if inputs.impact:
            return Reason.IMPACT
        for (reason, timeout), stamp in zip(self._watched, inputs):
            if timeout and not -AHEAD <= t - stamp <= timeout:
                return reason
        if inputs.fault is not None:
            return inputs.fault
        where = self.config.localization_timeout
        if where and inputs.source in self.config.localization_for and not _recent(t, inputs.localization, where):
            return Reason.LOCALIZATION
        if self._armed and _wants(command) and not _recent(t, command.stamp, self.config.command_hard_timeout):
            return Reason.COMMANDS
        return None

    def _lose(self, t, command, problem):
        """Listen to nobody; returns whether it is time to tell the commanders so."""
        was_armed, self._armed = self._armed, False
        if problem is not None:
            self._cause = problem
        nagging = _wants(command) and _recent(t, command.stamp, self.config.command_hard_timeout)
        if was_armed or (nagging and t - self._gave_up >= GIVE_UP_PERIOD):
            self._gave_up = t
            return True
        return False

    def _may_start(self, t, command):
        """Whether a command that comes now is a fresh one."""
        return not _wants(command) or not _recent(t, command.stamp, self.config.fresh_silence)

    def _drive(self, t, dt, command):
        """All is well: the command as gently and as slowly as it must be."""
        comfort, zones = self.comfort, self.zones
        late = _wants(command) and not _recent(t, command.stamp, self.config.command_timeout)
        v, w = comfort.profile.shape(command.v, command.w) if _wants(command) and not late else (0.0, 0.0)
        # Where braking gently would not do any more it brakes hard, and goes on until braking gently would have done.
        asked, at = zones.scale(comfort.v, comfort.w, gentle=self._firm)
        self._firm = asked < 1.0
        if self._firm:
            comfort.brake(dt, self.config.emergency_braking, self.config.emergency_turn_braking)
            return self._decision(State.BRAKING, self._side(at), False, zones.somebody_moves)
        factor, near = zones.scale(v, w)
        slowly = zones.slowly(v, w)
        if slowly < factor:
            factor, near = slowly, ''
        comfort.step(v * factor, w * factor, dt)
        waits = factor < 1.0 and zones.somebody_moves
        if late:
            return self._decision(State.FADING, Reason.COMMANDS, False)
        if self._tired(dt, waits and not comfort.moving, _wants(command)):
            return self._decision(State.BLOCKED, Reason.CROWD, True, waits)
        if near:
            return self._decision(State.SLOWED if factor > 0.0 else State.BLOCKED, self._side(near), False, waits)
        if slowly < 1.0:
            return self._decision(State.SLOWED, Reason.PEOPLE if zones.people(t) else Reason.EXPECTED, False, waits)
        return self._decision(State.DRIVING if comfort.moving or _wants(command) else State.IDLE, None, False)

    def _tired(self, dt, held_up, wanted):
        """Whether people in its way have held the chair up for so long that its commanders are told to give up; time in
        which nobody wants it to move makes up for that.
        """
        patience = self.zones.caution.config.patience
        if held_up:
            self._held_up += dt
        elif not wanted:
            self._held_up = max(self._held_up - dt, 0.0)
        if not 0.0 < patience <= self._held_up:
            return False
        self._held_up = 0.0
        return True

    def _side(self, sensor):
        return Reason[self.zones.sensors[sensor].side.upper()]

    def _decision(self, state, reason, give_up, waits=False):
        return Decision(self.comfort.v, self.comfort.w, state, reason, give_up, waits)


def _wants(command):
    """Whether somebody wants the chair to move."""
    return command is not None and (command.v != 0.0 or command.w != 0.0)


def _recent(t, stamp, timeout):
    """Whether stamp (s) is at most timeout before t; one from the future is of another clock."""
    return -AHEAD <= t - stamp <= timeout
