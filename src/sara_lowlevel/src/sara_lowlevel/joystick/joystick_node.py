"""The joystick node: two 10-bit axes in, frame JOYSTICK out, with the wheel commands the axes ask for."""

from __future__ import annotations

from canserial.dbc.bus import BusDescription, BusError
from canserial.dbc.modes import ASSISTED, MANUAL, OFF, PC
from canserial.frame import Frame
from sara_common.config import ConfigError
from sara_lowlevel.config import JoystickConfig
from sara_lowlevel.schedule import Every


class JoystickNode:
    """Sends its state every period, and at once when it changes."""

    def __init__(self, bus: BusDescription, config: JoystickConfig | None = None) -> None:
        """`bus`: canserial.dbc.bus.BusDescription. `config`: without it, of the chosen platform. Raises ConfigError
        where the frame cannot hold what the stick asks in its corners.
        """
        self.config = config = config or JoystickConfig.of()
        most = 127 * bus.resolution('JOYSTICK', 'velD')
        if config.max_forward + config.max_turn > most:
            raise ConfigError(
                f'max_forward and max_turn are {config.max_forward:g} and {config.max_turn:g} rad/s, allowed are '
                f'{most:.2f} together: the frame JOYSTICK holds no more'
            )
        self._bus = bus
        self._turn = Every(config.period)
        self._pc_drives = False
        self._sent: tuple | None = None

    def receive(self, frame: Frame, t: float) -> None:
        """Listens to the motor node's modoPC, which it shows as its own mode while it is centred."""
        try:
            name, values = self._bus.decode(frame)
        except BusError:
            return
        if name == 'MODO_PC':
            self._pc_drives = int(values['modoPC']) == PC

    def update(self, t: float, x: int = 512, y: int = 512, on: bool = True, assisted: bool = False) -> list:
        """`t`: s. `x` (right positive), `y` (forward positive): 0..1023. `on`: the chair's switch. `assisted`: the one
        by which the PC helps, of a bus that has this mode. Returns the frames to send now.
        """
        state = (x, y, on, assisted, self._pc_drives)
        due = self._turn.due(t)
        if not due and state == self._sent:
            return []
        self._sent = state
        forward = self._axis(y) * self.config.max_forward
        turn = self._axis(x) * self.config.max_turn
        centred = forward == 0.0 and turn == 0.0
        mode = OFF if not on else ASSISTED if assisted else PC if self._pc_drives and centred else MANUAL
        right, left = (forward - turn, forward + turn) if on else (0.0, 0.0)
        # Encoded on the wire in steps of 1/9.5 rad/s: rounded here, so that what is sent is what is meant.
        return [
            self._bus.encode(
                'JOYSTICK', velD=round(right * 9.5) / 9.5, velI=round(left * 9.5) / 9.5, joyx=x, modo=mode, joyy=y
            )
        ]

    def _axis(self, raw: int) -> float:
        """-1..1 with nothing inside the dead band and no jump at its edge."""
        offset = raw - self.config.centre
        beyond = abs(offset) - self.config.dead_band
        if beyond <= 0:
            return 0.0
        fraction = min(beyond / (self.config.full_scale - self.config.dead_band), 1.0)
        return fraction if offset > 0 else -fraction
