"""From commands to the wheels in one object, as the nodes chain it: cmd_vel_mux, safety_gate, diff_drive_controller,
the CAN base.

`/cmd_vel/navigation` and the joystick go in, wheel command frames come out; what the gate watches goes to it on the
way. Gate and controller each run 50 times a second, on timers whose phases nobody sets: a command waits half a period
for each on average. Here the wheels go by what the gate said a period before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from canserial.dbc.modes import PC_DRIVES
from canserial.reader.readings import (
    EncoderReading,
    ImpactReading,
    ImuReading,
    JoystickReading,
    ModeReading,
    RangeReading,
)
from sara_common.platforms import parameters
from sara_control.gate.gate_config import SafetyConfig
from sara_control.gate.guard import Guard
from sara_control.gate.reasons import State, sentence
from sara_control.mux.joystick import Joystick, JoystickConfig
from sara_control.mux.mux import Mux, MuxConfig
from sara_control.wheels.can_base import CanBase
from sara_control.wheels.config import ControllerConfig
from sara_control.wheels.controller import DiffDriveController

if TYPE_CHECKING:
    from canserial.dbc.bus import BusDescription
    from sara_common.platforms import Platform
    from sara_control.wheels.odometry import OdometryState


class CommandChain:
    """Made of the nodes' own configuration. `decision`: the gate's newest; `positions`: the wheels' newest;
    `controller`, `guard`, `mux`: the parts. `assist`: None, or what stands between multiplexer and gate (assisted.py):
    called with a SelectedCommand and the time, gives (v, w).
    """

    def __init__(self, bus: BusDescription, platform: Platform, scan: bool = False) -> None:
        """`platform`: the robot. `scan`: whether the gate is told of a laser scanner."""
        control, mux = (
            ControllerConfig.from_params(parameters('sara_control', 'diff_drive_controller.yaml', platform)),
            parameters('sara_control', 'mux.yaml'),
        )
        self.base, self.controller = CanBase.from_config(bus, control, True), DiffDriveController(control)
        self.mux, self.joystick = Mux(MuxConfig.from_params(mux)), Joystick(JoystickConfig.from_params(mux['joystick']))
        safety = parameters('sara_control', 'safety.yaml', platform)
        safety['scan']['enabled'] = scan
        self.guard = Guard(SafetyConfig.from_params(safety))
        self.decision = self.positions = None
        self.assist = None
        self.abort = self.cancel = ''  # why goals are to be given up; whoever does it empties them
        self._handlers = {
            EncoderReading: self._encoder,
            ModeReading: self._mode,
            ImuReading: self._imu,
            RangeReading: self._range,
            ImpactReading: self._impact,
            JoystickReading: self._joystick,
        }

    @property
    def ready(self) -> bool:
        """Whether a command would move the chair."""
        return self.decision is not None and self.decision.state is State.IDLE

    def on_reading(self, reading: NamedTuple, now: float) -> OdometryState | None:
        """What read.py published. Returns the odometry's state where it moved on, else None."""
        handle = self._handlers.get(type(reading))
        return handle(reading, now) if handle else None

    def on_navigation(self, v: float, w: float, now: float) -> None:
        """A command of move_base (m/s, rad/s)."""
        self.on_command('navigation', v, w, now)

    def on_command(self, source: str, v: float, w: float, now: float) -> None:
        """A command of one of the multiplexer's sources."""
        self._pass_on(self.mux.on_command(now, source, v, w), now)

    def step(self, now: float) -> Any:
        """The frame for the wheels, 50 times a second."""
        if self.decision is not None:
            self.controller.on_command(self.decision.v, self.decision.w, now)
        frame = self.base.command(*self.controller.update(now, self.base.may_drive))
        self._pass_on(self.mux.update(now), now)
        decision = self.decision = self.guard.step(now)
        if decision.give_up:
            self.abort = sentence(decision.state, decision.reason)
        return frame

    def _pass_on(self, selected, now):
        self.guard.on_source(self.mux.driver)
        if 'navigation' in self.mux.take_preempted():
            self.cancel = 'The user has taken over.'
        if selected is not None:
            v, w = (selected.v, selected.w) if self.assist is None else self.assist(selected, now)
            self.guard.on_command(now, v, w)

    def _encoder(self, reading, _now):
        self.guard.on_encoder(reading.stamp, reading.wheel, reading.steps, reading.time_100us)
        wheels = self.base.on_encoder(reading)
        if wheels is None:
            return None
        self.positions = wheels
        return self.controller.on_wheels(*wheels)

    def _mode(self, reading, now):
        self.base.on_mode(reading.mode)
        self.guard.on_mode(now, reading.mode)
        self._pass_on(self.mux.on_robot(now, reading.mode not in PC_DRIVES), now)

    def _imu(self, reading, _now):
        self.guard.on_imu(reading.stamp, reading.angular_velocity, reading.frozen)

    def _range(self, reading, _now):
        self.guard.on_raw_range(reading.stamp, reading.name, reading.raw)
        self.guard.on_range(reading.stamp, reading.name, reading.range)

    def _impact(self, reading, now):
        self.guard.on_impact(now, reading.impact)

    def _joystick(self, reading, now):
        self.base.on_switch(reading.mode)
        command = self.joystick.on_axes(
            (reading.left, reading.forward, reading.right_wheel, reading.left_wheel), (reading.mode,)
        )
        if command is not None:
            self.on_command('joystick', *command, now)
