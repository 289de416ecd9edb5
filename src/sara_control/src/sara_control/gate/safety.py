"""The safety gate: the last check of a command before the wheels. It passes a command on, slows it, or stops the chair.

A state machine without ROS and without a clock: step(t, command, inputs) returns what the wheels are to do. It trusts
neither planner nor map. Every loss or fault stops the chair. After that, commands are ignored until the chair stands,
the fault is gone, and the command has been zero or has paused for a while: a stream of commands that merely continues
never moves the chair again. The emergency stop is latched: only reset() releases it, at rest.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from sara_control.gate.comfort import Comfort
from sara_control.gate.gate_config import GateConfig
from sara_control.gate.reasons import Reason, State
from sara_control.zones.zones import Zones

AHEAD = 0.1  # s: a stamp may be this far in the future
LONGEST_STEP = 0.1  # s: after a longer pause speeds change as if it had been this long
LET_GO = 1.0  # s for which a command that was made slower is then taken up on its curve
LATE = frozenset(
    {Reason.BUS, Reason.ENCODERS, Reason.IMU, Reason.RANGES, Reason.LOCALIZATION, Reason.COMMANDS}
)  # something did not come in time
GIVE_UP_PERIOD = 1.0  # s between two requests to give up, to a source that goes on commanding


@dataclass(frozen=True)
class Command:
    """v (m/s), w (rad/s), both finite, given at stamp (s)."""

    v: float
    w: float
    stamp: float


class Inputs(NamedTuple):
    """The gate's inputs in one step.

    bus, encoders, imu, ranges, localization: stamp of the newest valid reading, s; of several sensors, of the one whose
    newest is oldest. fault: Reason of an implausible reading, or None. impact: whether the chair is hit now. pc_drives:
    whether the chair obeys commands, None while unknown. source: name of the commanding source, '' if unknown. speed:
    measured, m/s, NaN if unknown. imu_frozen: whether the IMU stands still, and is silent therefore.
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
    imu_frozen: bool = False

    def renewed(self, t: float) -> 'Inputs':
        """The same, as if every input that has ever come had come again at t."""
        names = ('bus', 'encoders', 'imu', 'ranges', 'localization')
        return self._replace(**{name: t for name in names if getattr(self, name) > -math.inf})


class Decision(NamedTuple):
    """v (m/s) and w (rad/s) for the wheels; state and reason of it.

    give_up: goals should be cancelled, the chair will not reach them without a new command. waits: the chair is slower
    than commanded, or stands, while a pedestrian moves nearby; standing is no reason for a recovery then.
    """

    v: float
    w: float
    state: State
    reason: Reason
    give_up: bool
    waits: bool = False


class SafetyGate:
    """config: GateConfig. comfort: Comfort. zones: Zones."""

    def __init__(self, config: GateConfig, comfort: Comfort, zones: Zones) -> None:
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
        self._scaled_at = -math.inf  # s: when distance zones last made a command slower, or braked
        self._cause = Reason.START
        self._last = self._gave_up = self._armed_at = None
        self._blocked_for = 0.0  # s

    @property
    def latched(self) -> bool:
        """Whether the emergency stop is on."""
        return self._latched

    def emergency_stop(self, pressed: bool) -> None:
        """The emergency stop's button; letting go of it does not release the stop."""
        self._pressed = pressed
        self._latched = self._latched or pressed

    def reset(self, command: Command | None, inputs: Inputs) -> tuple[bool, str]:
        """Release the emergency stop, if the chair stands and no motion is commanded. Returns (done, a sentence)."""
        if not self._latched:
            return True, 'The emergency stop is not on.'
        if self._pressed:
            return False, 'The emergency stop is still pressed.'
        if self.comfort.moving or self.config.encoder_timeout and not abs(inputs.speed) < self.config.rest_speed:
            return False, 'The emergency stop is released only when the chair stands still.'
        if self._last is None or not self._may_start(self._last, command):
            return False, 'The emergency stop is released only when no command to move is given.'
        self._latched = False
        return True, 'The emergency stop is released.'

    def late(self, t: float, command: Command | None, inputs: Inputs) -> bool:
        """Whether step at t (s) would stop the chair because something did not come in time."""
        return self._problem(t, command, inputs) in LATE

    def step(self, t: float, command: Command | None, inputs: Inputs, backlog: bool = False) -> Decision:
        """The Decision at t (s). command: the newest Command there is, None before the first. backlog: what has come
        since is not handled yet, so that everything counts as if it had come again at t.
        """
        if self._last is None or t < self._last:
            self._gave_up = t
        elapsed, self._last = t - (t if self._last is None else self._last), t
        dt = min(max(elapsed, 0.0), LONGEST_STEP)
        if elapsed > self.config.wheels_timeout > 0.0:
            self._brake(elapsed - self.config.wheels_timeout)
        if self._armed and command is not None and command.stamp < self._armed_at:
            command = None  # it was void when the chair became ready, and stays so
        if backlog:
            inputs, command = inputs.renewed(t), command and Command(command.v, command.w, t)
        problem = Reason.CLOCK if elapsed < 0.0 else self._problem(t, command, inputs)
        if problem is None and self._armed:
            return self._drive(t, dt, command)
        give_up = self._disarm(t, command, problem)
        if problem in (Reason.JOYSTICK, Reason.UNKNOWN_DRIVER):
            self.comfort.rest()
            return self._decision(State.MANUAL, problem, give_up)
        if self.comfort.moving:
            self._brake(dt)
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
                return Reason.IMU_FROZEN if reason is Reason.IMU and inputs.imu_frozen else reason
        if inputs.fault is not None:
            return inputs.fault
        where = self.config.localization_timeout
        if where and inputs.source in self.config.localization_for and not _recent(t, inputs.localization, where):
            return Reason.LOCALIZATION
        if self._armed and _moves(command) and not _recent(t, command.stamp, self.config.command_hard_timeout):
            return Reason.COMMANDS
        return None

    def _disarm(self, t, command, problem):
        """Ignore commands from now on. Returns whether it is time to have goals cancelled."""
        was_armed, self._armed = self._armed, False
        if problem is not None:
            self._cause = problem
        commanded = _moves(command) and _recent(t, command.stamp, self.config.command_hard_timeout)
        if was_armed or (commanded and t - self._gave_up >= GIVE_UP_PERIOD):
            self._gave_up = t
            return True
        return False

    def _may_start(self, t, command):
        """Whether a command that comes now is a fresh one: the last was zero or is long ago."""
        return not _moves(command) or not _recent(t, command.stamp, self.config.fresh_silence)

    def _drive(self, t, dt, command):
        """No fault: the command, as gently and as slowly as it must be."""
        comfort, zones = self.comfort, self.zones
        late = _moves(command) and not _recent(t, command.stamp, self.config.command_timeout)
        v, w = comfort.profile.shape(command.v, command.w) if _moves(command) and not late else (0.0, 0.0)
        # Where the gentle brake is too late it brakes hard, until the gentle one would have been in time.
        asked, at = zones.scale(comfort.v, comfort.w, gentle=self._firm)
        self._firm = asked < 1.0
        if self._firm:
            self._scaled_at = t
            comfort.brake(dt, self.config.emergency_braking, self.config.emergency_turn_braking)
            return self._decision(State.BRAKING, self._side(at), False, zones.pedestrian_moving)
        factor, near = zones.scale(v, w)
        if factor < 1.0:
            self._scaled_at = t
        cautious = zones.caution_factor(v, w)
        if cautious < factor:
            factor, near = cautious, ''
        if factor == 0.0 and zones.scale(comfort.v, comfort.w)[0] == 0.0:
            # It creeps, for the hard brake is not at work. To end that within the jerk limit would take 3 cm more.
            comfort.brake(dt, comfort.profile.braking, comfort.profile.turn_acceleration)
        else:
            comfort.step(v * factor, w * factor, dt, together=_recent(t, self._scaled_at, LET_GO))
        waits = factor < 1.0 and zones.pedestrian_moving
        if late:
            return self._decision(State.FADING, Reason.COMMANDS, False)
        if self._out_of_patience(dt, waits and not comfort.moving, _moves(command)):
            return self._decision(State.BLOCKED, Reason.CROWD, True, waits)
        if near:
            return self._decision(State.SLOWED if factor > 0.0 else State.BLOCKED, self._side(near), False, waits)
        if cautious < 1.0:
            # Heard last at the newest reading: they may be forgotten by now, and are not expected therefore.
            only_expected = zones.caution.expected and not zones.pedestrians_nearby(t)
            return self._decision(State.SLOWED, Reason.EXPECTED if only_expected else Reason.PEOPLE, False, waits)
        return self._decision(State.DRIVING if comfort.moving or _moves(command) else State.IDLE, None, False)

    def _out_of_patience(self, dt, blocked, commanded):
        """Whether pedestrians have blocked the chair for so long that goals are to be given up. Time without a command
        counts back.
        """
        patience = self.zones.caution.config.patience
        if blocked:
            self._blocked_for += dt
        elif not commanded:
            self._blocked_for = max(self._blocked_for - dt, 0.0)
        if not 0.0 < patience <= self._blocked_for:
            return False
        self._blocked_for = 0.0
        return True

    def _brake(self, dt):
        """Hard, for dt (s)."""
        self.comfort.brake(dt, self.config.emergency_braking, self.config.emergency_turn_braking)

    def _side(self, sensor):
        return Reason[self.zones.side(sensor).upper()]

    def _decision(self, state, reason, give_up, waits=False):
        return Decision(self.comfort.v, self.comfort.w, state, reason, give_up, waits)


def _moves(command):
    """Whether a command asks for motion."""
    return command is not None and (command.v != 0.0 or command.w != 0.0)


def _recent(t, stamp, timeout):
    """Whether stamp (s) is at most timeout before t; one from the future is of another clock."""
    return -AHEAD <= t - stamp <= timeout
