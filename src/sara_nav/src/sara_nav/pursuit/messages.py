"""What a robot says while it drives: what it is doing, how fast, and why it is slow, in sentences that do not
flicker.
"""

import math

from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.speed_plan import AHEAD, BEND, BLOCKED, END, FREE, NARROW, SLOW, Pace

HELD = 1.0
"""Seconds for which figures in a sentence stay, and the reason why it was slow after it came last."""

WHY = {
    FREE: '',
    BEND: ': a bend',
    NARROW: ': narrow, {size:.2f} m at the {where}',
    AHEAD: ': {size:.2f} m free ahead',
    END: ': {then}',
    BLOCKED: ': something in the way {size:.2f} m further on',
    SLOW: ': a slow place',
}
"""What is said of a speed_plan.Cause."""


class Words:
    """Says a sentence; one with the same ``key`` stays as it is for HELD seconds."""

    def __init__(self):
        self._key, self._text, self._since, self._last = (), '', -math.inf, -math.inf

    def say(self, t: float, key: tuple | str, text: str, lesser: bool = False) -> str:
        """Return ``text``, or what was said under the same key less than HELD seconds before t (s).

        lesser: also what was last said less than HELD seconds before, where its key begins in the same way.
        """
        if lesser and key != self._key and self._key[:1] == key[:1] and 0.0 <= t - self._last < HELD:
            return self._text
        if key != self._key or not 0.0 <= t - self._since < HELD:
            self._key, self._text, self._since = key, text, t
        self._last = t
        return self._text


def following(leg: Leg, pace: Pace, then: str) -> tuple[tuple, str, bool]:
    """Return (key, sentence, whether nothing slows) for a leg that is followed at a Pace, as Words.say takes them;
    ``then``: what comes at the end of the leg.

    At a speed that is capped nothing slows in every other cycle: it would say so in turns.
    """
    cause = pace.cause
    way = 'follows the path in reverse' if leg.backward else 'follows the path'
    why = WHY[cause.kind].format(size=cause.size, where=cause.where, then=then)
    speed = pace.speed if cause.kind in (END, BLOCKED) else pace.cap
    key = (way, cause.kind, cause.where, then if cause.kind == END else '')
    return key, f'{way}, {speed:.2f} m/s{why}', cause.kind == FREE


def turning(angle: float, what: str) -> tuple[tuple, str]:
    """Return (key, sentence) for a turn in place by angle (rad, still to go) onto ``what``."""
    side = 'left' if angle > 0.0 else 'right'
    return ('turn', side, what), f'turns {side} in place to {what}, {abs(math.degrees(angle)):.0f} deg to go'
