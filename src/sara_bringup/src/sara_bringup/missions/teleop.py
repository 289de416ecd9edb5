"""Keys to commands for driving from a terminal, with the keys of teleop_twist_keyboard; no ROS, no terminal, no clock.

Unlike there, a key is a dead man's switch: the chair stops when keys cease. A terminal does not tell of a key's
release, but repeats a key that is held, the first time after half a second or so: one stroke is good for
`first_timeout`, each repeat for `repeat_timeout`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sara_common.config import range_faults

MOVES = {
    'i': (1, 0),
    'o': (1, -1),
    'j': (0, 1),
    'l': (0, -1),
    'u': (1, 1),
    ',': (-1, 0),
    '.': (-1, 1),
    'm': (-1, -1),
    'up': (1, 0),
    'left': (0, 1),
    'right': (0, -1),
    'down': (-1, 0),
}  # forward, to the left
SPEEDS = {
    'q': (1.1, 1.1),
    'z': (0.9, 0.9),
    'w': (1.1, 1.0),
    'x': (0.9, 1.0),
    'e': (1.0, 1.1),
    'c': (1.0, 0.9),
}  # factors on speed, turn
SIDEWAYS = 'OIJLUM<>'  # with shift, the peer's holonomic robots move sideways
QUIT = ('\x03', '\x04')  # Ctrl-C where the terminal passes it on, Ctrl-D
ARROWS = {'A': 'up', 'B': 'down', 'C': 'right', 'D': 'left'}

HELP = """Drive with the keys held down; let go and the chair stops.
   u    i    o        forward: left, straight, right (arrow keys too)
   j    k    l        turn left, STOP, turn right
   m    ,    .        backward: left, straight, right
 q/z  faster, slower by a tenth    w/x  speed alone    e/c  turning alone
 Any other key stops, and ends what navigation drives. Ctrl-C quits."""


@dataclass(frozen=True)
class TeleopConfig:
    """speed, speed_limit: m/s; turn, turn_limit: rad/s; repeat_rate: Hz, of the commands; timeouts: s."""

    speed: float = 0.3
    turn: float = 0.4
    speed_limit: float = 0.8
    turn_limit: float = 1.0
    repeat_rate: float = 20.0
    first_timeout: float = 0.7
    repeat_timeout: float = 0.25

    def faults(self) -> list[str]:
        """What is not allowed, a sentence each."""
        found = range_faults(
            self,
            {
                'speed': (0.01, self.speed_limit),
                'turn': (0.01, self.turn_limit),
                'speed_limit': (0.01, 2.0),
                'turn_limit': (0.01, 3.0),
                'repeat_rate': (5.0, 100.0),
                'first_timeout': (0.1, 2.0),
                'repeat_timeout': (0.1, 2.0),
            },
        )
        return list(found)


class Decoder:
    """Bytes of a terminal to keys: characters, and "up", "down", "left", "right" for the arrows (ESC [ A, ESC O A)."""

    def __init__(self) -> None:
        self._begun = ''

    def feed(self, text: str) -> list[str]:
        """The keys in it. A sequence may be cut by the end of a read."""
        keys = []
        for character in text:
            self._begun += character
            if self._begun[0] != '\x1b':
                keys.append(self._begun)
                self._begun = ''
            elif len(self._begun) == 2 and character not in '[O':
                keys.extend(self._begun)
                self._begun = ''
            elif len(self._begun) > 2 and (
                '@' <= character <= '~'
            ):  # the last of a sequence: digits and ; may come before it
                keys.append(ARROWS.get(character, '\x1b') if len(self._begun) == 3 else '\x1b')
                self._begun = ''
        return keys

    def flush(self) -> list[str]:
        """Nothing has followed for a while: an ESC that was begun is a key, whatever was to come."""
        keys, self._begun = ['\x1b'] if self._begun else [], ''
        return keys


class Teleop:
    """`config`: TeleopConfig. `speed`, `turn`: as they are now. `said`: a sentence for the terminal, or "". `quit`:
    whether to end.
    """

    def __init__(self, config: TeleopConfig) -> None:
        self.config = config
        self.speed, self.turn = config.speed, config.turn
        self.said, self.quit = '', False
        self._move, self._until, self._key = None, -math.inf, None
        self._stop = 0  # commands of zero that are still to be given

    def on_key(self, key: str, t: float) -> None:
        """A key at t (s, of a clock that never goes back)."""
        self.said = ''
        if key in QUIT:
            self.quit = True
            self._halt()
        elif key in MOVES:
            held = self._move is not None and key == self._key and t <= self._until
            self._move, self._key = MOVES[key], key
            self._until = t + (self.config.repeat_timeout if held else self.config.first_timeout)
        elif key in SPEEDS:
            faster, sharper = SPEEDS[key]
            self.speed = min(self.speed * faster, self.config.speed_limit)
            self.turn = min(self.turn * sharper, self.config.turn_limit)
            full = [
                name
                for name, now, most in (
                    ('speed', self.speed, self.config.speed_limit),
                    ('turning', self.turn, self.config.turn_limit),
                )
                if now >= most
            ]
            self.said = f'speed {self.speed:.2f} m/s, turning {self.turn:.2f} rad/s' + (
                f' ({" and ".join(full)} at the limit)' if full else ''
            )
        else:
            if key in SIDEWAYS:
                self.said = f'a wheelchair does not move sideways ({key}); shift off?'
            self._halt()

    def command(self, t: float) -> tuple[float, float] | None:
        """(v m/s, w rad/s) to publish at t (s), None for nothing: silence lets others drive. A stop is said three
        times, as messages get lost.
        """
        if self._move is not None and t > self._until:
            self._halt()
        if self._move is not None:
            forward, left = self._move
            return forward * self.speed, left * self.turn
        if self._stop:
            self._stop -= 1
            return 0.0, 0.0
        return None

    def _halt(self):
        self._move, self._key, self._stop = None, None, 3
