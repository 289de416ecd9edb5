"""The motor node: wheel commands in, encoder frames out, and who may drive.

It decides between the joystick and the PC (the `modoPC` handshake), watches that commands keep coming, and reports the
encoders, the mode and the battery. Wheel speed itself is closed around `target` below it (`wheel_drive` on the chair,
the simulator's motors there). The frames and the handshake are SARA's own; the README of this package describes them.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from canserial.dbc.bus import BusDescription, BusError
from canserial.frame import Frame
from sara_lowlevel.config import MotorConfig
from sara_lowlevel.motor.command_guard import CommandGuard
from sara_lowlevel.schedule import TIME_TOLERANCE_S, Every

MODE_OFF, MODE_MANUAL, MODE_PC = 0, 1, 3
CLOSED_LOOP, STOP = ord('C'), ord('A')
_UINT32 = 0xFFFFFFFF


@dataclass(frozen=True)
class Joystick:
    """What the joystick node last said: raw axes 0..1023, its mode, its own wheel commands in rad/s."""

    x: int = 512
    y: int = 512
    mode: int = MODE_MANUAL
    right: float = 0.0
    left: float = 0.0


class MotorNode:
    """Drives two wheels from the PC or the joystick.

    `target`: (right, left) wheel speeds in rad/s to be held now, forward positive. `mode`: the modoPC it announces.
    `counts`: what was dropped, by reason.
    """

    def __init__(self, bus: BusDescription, config: MotorConfig = MotorConfig()) -> None:
        """`bus`: canserial.dbc.bus.BusDescription."""
        self.config = config
        self.mode = MODE_MANUAL
        self.target = (0.0, 0.0)
        self.counts: Counter = Counter()
        self._bus = bus
        self._joystick: Joystick | None = None
        self._joystick_time = 0.0
        self._command = (0.0, 0.0)
        self._command_time: float | None = None
        self._guard = CommandGuard(config, bus.resolution('WHEEL_COMMAND', 'right'))
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
            # What no signal uses is always zero.
            if self._bus.encode(name, **values).data == frame.data:
                self._on_command(values, t)
            else:
                self._damaged('damaged command', t)
        elif name == 'JOYSTICK':
            self._on_joystick(
                Joystick(int(values['joyx']), int(values['joyy']), int(values['modo']), values['velD'], values['velI']),
                t,
            )

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

        `t`: s, this node's clock. `right_steps`, `left_steps`: encoder edges, 64000 per wheel turn, any integer (sent
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
        mode = int(values['mode'])
        if mode not in (CLOSED_LOOP, STOP):
            self._damaged('unknown command mode', t)
            return
        wheels = (values['right'], values['left'])
        if mode == CLOSED_LOOP and self.mode == MODE_PC and not self._guard.believes(wheels, t):
            self.counts['jump of a command'] += 1  # not of the PC: the watchdog does not count it
            return
        self._command_time = t
        if mode == STOP:
            self._command = (0.0, 0.0)
            self._guard.stop(t)
            if self.mode != MODE_PC and wheels == (0, 0) and self._joystick_allows_pc(t):
                self.mode = MODE_PC
        elif self.mode == MODE_PC:
            self._command = self._limited(wheels)
        else:
            self.counts['command without control'] += 1

    def _damaged(self, what: str, t: float) -> None:
        self.counts[what] += 1
        self._guard.damaged(t)

    def _on_joystick(self, joystick: Joystick, t: float) -> None:
        self._joystick, self._joystick_time = joystick, t
        # The user always wins, and at once: not only at the next turn of the loop.
        if joystick.mode == MODE_OFF:
            self._take_from_pc(MODE_OFF)
        elif not self._centred(joystick):
            self._take_from_pc(MODE_MANUAL)
        elif self.mode == MODE_OFF:
            self.mode = MODE_MANUAL

    def _limited(self, wheels: tuple[float, float]) -> tuple[float, ...]:
        (right, left), limit = wheels, self.config.max_wheel_speed
        return min(max(right, -limit), limit), min(max(left, -limit), limit)

    def _take_from_pc(self, mode: int) -> None:
        self.mode = mode
        self._command = (0.0, 0.0)
        self._guard.forget()

    def _centred(self, joystick: Joystick) -> bool:
        band, centre = self.config.joystick_dead_band, self.config.joystick_centre
        return abs(joystick.x - centre) <= band and abs(joystick.y - centre) <= band

    def _joystick_fresh(self, t: float) -> bool:
        return self._joystick is not None and t - self._joystick_time <= self.config.joystick_timeout + TIME_TOLERANCE_S

    def _joystick_allows_pc(self, t: float) -> bool:
        return self._joystick_fresh(t) and self._joystick.mode != MODE_OFF and self._centred(self._joystick)

    def _decide(self, t: float) -> None:
        if not self._joystick_fresh(t):
            # Without the joystick the user could not take over: no command drives the wheels.
            if self.mode == MODE_PC:
                self.counts['joystick lost'] += 1
                self._take_from_pc(MODE_MANUAL)
            self.target = (0.0, 0.0)
        elif self.mode == MODE_PC:
            silent = (
                self._command_time is None or t - self._command_time > self.config.command_timeout + TIME_TOLERANCE_S
            )
            if silent:
                if self._command != (0.0, 0.0):
                    self.counts['commands stopped'] += 1
                self._command = (0.0, 0.0)
            self.target = self._command
        elif self.mode == MODE_MANUAL and not self._centred(self._joystick):
            self.target = self._limited((self._joystick.right, self._joystick.left))
        else:
            self.target = (0.0, 0.0)
