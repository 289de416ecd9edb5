"""What is said on the way to a place, and a patrol over several: no ROS, no clock, so that the words can be tested."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sara_common.planar import wrap

if TYPE_CHECKING:
    from sara_nav.maps.places import Place

NEAR_M = 0.10  # nearer than this, what is left is the turn
STANDS_M, STANDS_RAD = 0.02, 0.03  # less than this since the last report is standing


class Progress:
    """Sentences about the way to a Place, one every `period` s."""

    def __init__(self, place: str, period: float = 2.0) -> None:
        self.place, self.period = place, period
        self._last = self._reported = None  # (t, x, y, yaw) of the last report; the time it was made

    def at(self, t: float, x: float, y: float, yaw: float, why: str = '') -> str | None:
        """The chair is there at t (s; m, m, rad, map frame); `why`: what the safety gate says. Returns a sentence, or
        None when none is due.
        """
        if self._reported is not None and 0.0 <= t - self._reported < self.period:
            return None
        before, self._last, self._reported = self._last, (t, x, y, yaw), t
        away, turn = math.hypot(self.place.x - x, self.place.y - y), math.degrees(wrap(self.place.yaw - yaw))
        left = (
            f'{away:.2f} m away'
            if away > NEAR_M
            else f'there; {abs(turn):.0f} deg left to turn to the {"left" if turn > 0.0 else "right"}'
        )
        text = f'{left}, at ({x:.2f}, {y:.2f}) facing {math.degrees(yaw) % 360.0:.0f} deg'
        if before is not None and t > before[0]:
            moved, turned = math.hypot(x - before[1], y - before[2]), abs(wrap(yaw - before[3]))
            if moved < STANDS_M and turned < STANDS_RAD:
                text += f', standing. {why}'.rstrip() if why else ', standing'
            else:
                text += f', {moved / (t - before[0]):.2f} m/s'
        return text


def ended(place: Place, reached: bool, text: str, seconds: float) -> str:
    """The last sentence about a goal: `text` is move_base's own, `seconds` since it was given."""
    if reached:
        return f'reached {place} after {seconds:.0f} s'
    return f'did NOT reach {place} within {seconds:.0f} s: {text or "move_base did not say why"}'


@dataclass(frozen=True)
class Visit:
    """One stop of a patrol. `round`, `number` count from 1."""

    place: object
    round: int
    number: int
    first: bool

    def __str__(self):
        return f'round {self.round}, stop {self.number}: {self.place}'


class Patrol:
    """Which place comes next: `places` in their order, `loops` times, 0 for ever. `stop_on_failure`: a place that is
    not reached ends it.

    A round in which no place was reached ends it anyhow: nobody is helped by a chair that goes on trying for ever.
    `done`: why there is no next place, "" while there is. `log`: the newest (Visit, reached, text).
    """

    def __init__(self, places: Sequence[Place], loops: int = 1, stop_on_failure: bool = False) -> None:
        if not places:
            raise ValueError('a patrol needs one place or more')
        if loops < 0:
            raise ValueError(f'loops is {loops}, allowed are 0 (for ever) and more')
        self.places, self.loops, self.stop_on_failure = tuple(places), loops, stop_on_failure
        self.done, self.log = '', deque(maxlen=1000)
        self._next, self._reached_this_round = 0, 0
        self._reached, self._missed = Counter(), Counter()

    @property
    def visit(self) -> Visit | None:
        """The Visit that is due, None when `done`."""
        if self.done:
            return None
        round_, number = divmod(self._next, len(self.places))
        return Visit(self.places[number], round_ + 1, number + 1, self._next == 0)

    def ended(self, reached: bool, text: str = '') -> None:
        """The Visit that was due has ended so; whether there is a next one is said by `done`."""
        visit = self.visit
        self.log.append((visit, reached, text))
        (self._reached if reached else self._missed)[visit.place] += 1
        self._reached_this_round += reached
        self._next += 1
        if not reached and self.stop_on_failure:
            self.done = f'stopped: {visit.place} was not reached'
        elif visit.number == len(self.places):
            if not self._reached_this_round:
                self.done = f'stopped: no place was reached in round {visit.round}'
            elif visit.round == self.loops:
                self.done = 'finished'
            self._reached_this_round = 0

    @property
    def all_reached(self) -> bool:
        """Whether every place that was driven to was reached."""
        return bool(self._reached) and not self._missed

    def summary(self) -> str:
        """What came of it, a line a place."""
        lines = [
            (
                f'patrol {self.done or "interrupted"}: {sum(self._reached.values())} of '
                f'{sum(self._reached.values()) + sum(self._missed.values())} stops reached'
            )
        ]
        for place in dict.fromkeys(self.places):
            lines.append(f'  {place}: reached {self._reached[place]}, missed {self._missed[place]}')
        return '\n'.join(lines)
