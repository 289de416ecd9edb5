"""The motor node: wheel commands in, encoder frames out, and who may drive.

It decides between the joystick and the PC (the `modoPC` handshake), watches that commands keep coming, and reports the
encoders, the mode and the battery. On a bus with the mode ASSISTED the PC may help who drives by the joystick
(`assistance`). Wheel speed itself is closed around `target` below it (`wheel_drive` on the chair,
the simulator's motors there). The frames and the handshake are SARA's own; the README of this package describes them.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from canserial.dbc.bus import BusDescription, BusError
from canserial.dbc.modes import ASSISTED, DRIVE, HELP, MANUAL, OFF, PC, PC_DRIVES, STOP, has_assisted, modes_of
from canserial.frame import Frame
from sara_lowlevel.config import MotorConfig
from sara_lowlevel.motor.assistance import Assistance, Stick
from sara_lowlevel.motor.command_guard import CommandGuard
from sara_lowlevel.schedule import TIME_TOLERANCE_S, Every

_UINT32 = 0xFFFFFFFF


@dataclass(frozen=True)
class Joystick:
    """What the joystick node last said: raw axes 0..1023, its mode, its own wheel commands in rad/s."""

    x: int = 512
    y: int = 512
    mode: int = MANUAL
    right: float = 0.0
    left: float = 0.0


class MotorNode:
    """Drives two wheels from the PC or the joystick.

    `target`: (right, left) wheel speeds in rad/s to be held now, forward positive. `mode`: the modoPC it announces.
    `counts`: what was dropped, by reason.
    """

    def __init__(self, bus: BusDescription, config: MotorConfig | None = None) -> None:
        """`bus`: canserial.dbc.bus.BusDescription. `config`: without it, of the chosen platform."""
        self.config = config = config or MotorConfig.of()
        self.mode = MANUAL
        self.target = (0.0, 0.0)
        self.counts: Counter = Counter()
        self._bus, self._modes = bus, modes_of(bus)
        self._joystick: Joystick | None = None
        self._joystick_time = 0.0
        self._let_go = False  # whether it was centred since the start, its last silence and the switch's last OFF
        self._command = (0.0, 0.0)
        self._command_time: float | None = None
        resolution = bus.resolution('WHEEL_COMMAND', 'right')
        self._guard = CommandGuard(config, resolution)
        self._assistance = Assistance(config, resolution) if has_assisted(bus) else None
        self._announced: int | None = None
        self._measured_at: float | None = None
        self._encoders = Every(config.encoder_period)
        self._mode_turn = Every(config.mode_period)
        self._battery = Every(config.battery_period)

    def receive(self, frame: Frame, t: float) -> None:
        """A frame received on the bus at `t` (s, this node's clock). Bad frames are counted in `counts` and change
        nothing.
        """
        try:
            name, values = self._bus.decode(frame)
        except BusError as error:
            self.counts[type(error).__name__] += 1
            return
        if name == 'WHEEL_COMMAND':
            if self._is_whole(frame, name, values):
                self._on_command(values, t)
            else:
                self._damaged('damaged command', t)
        elif name == 'JOYSTICK':
            x, y, mode = (int(values[signal]) for signal in ('joyx', 'joyy', 'modo'))
            highest = self.config.joystick_max
            if self._is_whole(frame, name, values) and 0 <= x <= highest and 0 <= y <= highest and mode in self._modes:
                self._on_joystick(Joystick(x, y, mode, values['velD'], values['velI']), t)
            else:
                self.counts['damaged joystick'] += 1

    def update(
        self,
        t: float,
        right_steps: int | None,
        left_steps: int | None,
        joystick: Joystick | None = None,
        battery: float | None = None,
        measured_at: float | None = None,
    ) -> list:
        """One turn of the main loop (every 10 ms).

        `t`: s, this node's clock. `right_steps`, `left_steps`: encoder edges, any integer (sent
        modulo 2^32); None where they could not be read: then no encoder frame goes out. `joystick`: when it is wired to
        this node; otherwise its frames come through `receive`. `battery`: V. `measured_at`: when the steps were read,
        now if None; what was sent is not sent again. Returns the frames to send now and sets `target`.
        """
        if joystick is not None:
            self._on_joystick(joystick, t)
        self._decide(t)
        frames = []
        if self._encoders.due(t):
            frames += self._encoder_frames(t if measured_at is None else measured_at, right_steps, left_steps)
        if self._mode_turn.due(t) or self.mode != self._announced:
            frames.append(self._bus.encode('MODO_PC', modoPC=self.mode))
            self._announced = self.mode
        if battery is not None and self._battery.due(t):
            frames.append(self._bus.encode('BATTERY', voltage=round(max(battery, 0.0), 3)))
        return frames

    def _encoder_frames(self, when: float, right_steps: int | None, left_steps: int | None) -> list:
        if right_steps is None or left_steps is None or when == self._measured_at:
            self.counts['encoders not read'] += 1
            return []
        self._measured_at = when
        clock = round(when * 1e4) & _UINT32
        return [
            self._bus.encode('ENCODER_RIGHT', steps=right_steps & _UINT32, time=clock),
            self._bus.encode('ENCODER_LEFT', steps=left_steps & _UINT32, time=clock),
        ]

    def _on_command(self, values: dict, t: float) -> None:
        mode, wheels = int(values['mode']), (values['right'], values['left'])
        if mode not in (DRIVE, STOP) and (mode != HELP or wheels != (0, 0) or self._assistance is None):
            self._damaged('unknown command mode', t)
        elif mode != DRIVE:
            self._on_stop(wheels, t, helps=mode == HELP)
        elif self.mode not in PC_DRIVES:
            self._command_time = t
            self.counts['command without control'] += 1
        elif not self._guard.believes(wheels, t):
            self.counts['jump of a command'] += 1  # not of the PC: the watchdog does not count it
        elif self.mode == ASSISTED and not self._assistance.agrees(wheels, t):
            self.counts['command against the joystick'] += 1
            self._take_from_pc(OFF)
        else:
            self._command_time = t
            self._command = self._limited(wheels)

    def _on_stop(self, wheels: tuple[float, float], t: float, helps: bool) -> None:
        """A stop, with zero speeds a request for control too. `helps`: the PC can help the joystick; from one that
        cannot, a stop is no sign of life while it is to help.
        """
        if helps or self.mode != ASSISTED:
            self._command_time = t
        self._command = (0.0, 0.0)
        self._guard.stop(t)
        if self.mode not in PC_DRIVES and wheels == (0, 0) and self._joystick_allows_pc(t, helps):
            self.mode = ASSISTED if helps else PC
            if helps:
                self._assistance.begin()

    def _is_whole(self, frame: Frame, name: str, values: dict) -> bool:
        """Whether the bits that no signal uses are zero, as they always are."""
        return self._bus.encode(name, **values).data == frame.data

    def _damaged(self, what: str, t: float) -> None:
        self.counts[what] += 1
        self._guard.damaged(t)

    def _on_joystick(self, joystick: Joystick, t: float) -> None:
        known = self._let_go and self._joystick_fresh(t)
        self._let_go = joystick.mode != OFF and (known or self._centred(joystick))
        self._joystick, self._joystick_time = joystick, t
        # The user always wins, and at once: not only at the next turn of the loop.
        ruled = None if self._assistance is None else self._assistance.on_stick(t, self.mode, self._stick(joystick))
        if joystick.mode == OFF:
            self._take_from_pc(OFF)
        elif ruled is not None:
            if ruled == OFF:
                self._take_from_pc(OFF)
            self.mode = ruled
        elif not self._centred(joystick):
            self._take_from_pc(MANUAL)
        elif self.mode == OFF:
            self.mode = MANUAL

    def _limited(self, wheels: tuple[float, float]) -> tuple[float, float]:
        """Both wheels slowed alike, until the faster one keeps the limit: the chair stays on its curve."""
        (right, left), limit = wheels, self.config.max_wheel_speed
        fastest = max(abs(right), abs(left), limit)
        return limit * (right / fastest), limit * (left / fastest)

    def _on_silence(self) -> None:
        """The wheels stop until the next command; where the PC was to help, until it has asked for control anew."""
        if self._command != (0.0, 0.0):
            self.counts['commands stopped'] += 1
        self._command = (0.0, 0.0)
        if self.mode == ASSISTED:
            self._take_from_pc(OFF)

    def _take_from_pc(self, mode: int) -> None:
        self.mode = mode
        self._command = (0.0, 0.0)
        self._guard.forget()

    def _stick(self, joystick: Joystick) -> Stick:
        forward, config = joystick.y - self.config.joystick_centre, self.config
        sense = 0 if abs(forward) <= config.joystick_dead_band else 1 if forward > 0 else -1
        return Stick(joystick.mode, sense, not self._centred(joystick))

    def _centred(self, joystick: Joystick) -> bool:
        band, centre = self.config.joystick_dead_band, self.config.joystick_centre
        return abs(joystick.x - centre) <= band and abs(joystick.y - centre) <= band

    def _joystick_fresh(self, t: float) -> bool:
        return self._joystick is not None and t - self._joystick_time <= self.config.joystick_timeout + TIME_TOLERANCE_S

    def _joystick_allows_pc(self, t: float, helps: bool) -> bool:
        """Whether it may drive; where the switch says that it is to help, one that helps, and no other."""
        joystick, wanted = self._joystick, self._assistance is not None and self._assistance.switched
        return self._joystick_fresh(t) and joystick.mode != OFF and self._centred(joystick) and helps == wanted

    def _decide(self, t: float) -> None:
        if not self._joystick_fresh(t):
            # Without the joystick the user could not take over: no command drives the wheels.
            if self.mode in PC_DRIVES:
                self.counts['joystick lost'] += 1
                self._take_from_pc(OFF if self.mode == ASSISTED else MANUAL)
            self.target = (0.0, 0.0)
        elif self.mode in PC_DRIVES:
            silent = (
                self._command_time is None or t - self._command_time > self.config.command_timeout + TIME_TOLERANCE_S
            )
            if silent:
                self._on_silence()
            self.target = self._command
        elif self.mode == MANUAL and self._let_go and not self._centred(self._joystick):
            self.target = self._limited((self._joystick.right, self._joystick.left))
        else:
            self.target = (0.0, 0.0)
