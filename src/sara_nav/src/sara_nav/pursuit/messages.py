"""What a robot says while it drives: what it is doing, how fast, and why it is slow, in sentences that do not
flicker.
"""

import math
from collections.abc import Hashable

from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.speed_plan import AHEAD, BEND, BLOCKED, END, FREE, NARROW, SLOW, Pace

HELD = 1.0
"""Seconds for which figures in a sentence stay."""

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
        self._key, self._text, self._since = None, '', -math.inf

    def say(self, t: float, key: Hashable, text: str) -> str:
        """Return ``text``, or what was said under the same key less than HELD seconds before t (s)."""
        if key != self._key or not 0.0 <= t - self._since < HELD:
            self._key, self._text, self._since = key, text, t
        return self._text


def following(leg: Leg, pace: Pace, then: str) -> tuple[tuple, str]:
    """Return (key, sentence) for a leg that is followed at a Pace; ``then``: what comes at the end of the leg."""
    cause = pace.cause
    way = 'follows the path in reverse' if leg.backward else 'follows the path'
    why = WHY[cause.kind].format(size=cause.size, where=cause.where, then=then)
    speed = pace.speed if cause.kind in (END, BLOCKED) else pace.cap
    return (way, cause.kind, cause.where, then if cause.kind == END else ''), f'{way}, {speed:.2f} m/s{why}'


def turning(angle: float, what: str) -> tuple[tuple, str]:
    """Return (key, sentence) for a turn in place by angle (rad, still to go) onto ``what``."""
    side = 'left' if angle > 0.0 else 'right'
    return ('turn', side, what), f'turns {side} in place to {what}, {abs(math.degrees(angle)):.0f} deg to go'
