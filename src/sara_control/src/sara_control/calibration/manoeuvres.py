"""The drive that calibrates odometry: UMBmark's square in both directions and turns on the spot, with rests to cut it
at.

It steers by the odometry that is to be calibrated: how square the square is does not matter, only that every move
begins and ends at rest. Speeds rise and fall with the acceleration given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sara_common.config import ConfigError, fault, filled, is_whole, number_faults


@dataclass(frozen=True)
class ManoeuvreConfig:
    """side: m. turns: full turns on the spot each way. rounds: squares each way. Speeds in m/s, rad/s and their changes
    per s.

    rest: s between moves; pause: s between squares, and before and after the whole.
    """

    side: float = 2.0
    rounds: int = 1
    turns: int = 2
    speed: float = 0.4
    turn_rate: float = 0.6
    acceleration: float = 0.4
    turn_acceleration: float = 0.6
    rest: float = 1.5
    pause: float = 4.0

    def __post_init__(self):
        faults = []
        for name in self.__dataclass_fields__:
            if name not in ('rounds', 'turns'):
                faults += number_faults(self, above_0=[name])
            elif not is_whole(getattr(self, name), low=1):
                faults.append(fault(self, name, 'are whole numbers of 1 or more'))
        if faults:
            raise ConfigError(faults)

    @classmethod
    def from_params(cls, params: object) -> ManoeuvreConfig:
        """From a dictionary. Raises ConfigError with every fault."""
        return filled(cls, params)


def plan(config: ManoeuvreConfig = ManoeuvreConfig()) -> list:
    """[(kind, amount)]: ('rest', s), ('straight', m), ('turn', rad)."""
    moves = [('rest', config.pause)]
    for sign in (1.0, -1.0):
        for _ in range(config.rounds):
            for _ in range(4):
                moves += [
                    ('straight', config.side),
                    ('rest', config.rest),
                    ('turn', sign * 0.5 * math.pi),
                    ('rest', config.rest),
                ]
            moves.append(('rest', config.pause))
    for sign in (1.0, -1.0):
        for _ in range(2 * config.turns):
            moves += [('turn', sign * math.pi), ('rest', config.rest)]
        moves.append(('rest', config.pause))
    return moves


class Manoeuvres:
    """Steps through `plan`. `number`: the move under way, from 0; `done`: all are over."""

    def __init__(self, config: ManoeuvreConfig = ManoeuvreConfig(), moves: list | None = None) -> None:
        self.config = config
        self.moves = plan(config) if moves is None else moves
        self.number = 0
        self._began = None
        self._last = None
        self._speed = 0.0

    @property
    def done(self) -> bool:
        """Whether the last move is over."""
        return self.number >= len(self.moves)

    def step(self, t: float, x: float, y: float, heading: float) -> tuple[float, float]:
        """(v, w) to command at time t (s) with this odometry (m, rad, not wrapped)."""
        dt = 0.0 if self._last is None else max(0.0, t - self._last)
        self._last = t
        if self.done:
            return 0.0, 0.0
        kind, amount = self.moves[self.number]
        if self._began is None:
            self._began = t, x, y, heading
        start, x0, y0, heading0 = self._began
        if kind == 'rest':
            if t - start >= amount:
                self._next()
            return 0.0, 0.0
        gone = math.hypot(x - x0, y - y0) if kind == 'straight' else abs(heading - heading0)
        left = abs(amount) - gone
        if left <= 0.0:
            self._next()
            return 0.0, 0.0
        config = self.config
        fastest, rate = (
            (config.speed, config.acceleration) if kind == 'straight' else (config.turn_rate, config.turn_acceleration)
        )
        slowest = 0.15 * fastest  # so that it arrives at all
        self._speed = max(slowest, min(self._speed + rate * dt, fastest, math.sqrt(2.0 * rate * left)))
        value = math.copysign(self._speed, amount)
        return (value, 0.0) if kind == 'straight' else (0.0, value)

    def _next(self):
        self.number += 1
        self._began = None
        self._speed = 0.0
