"""A rider who drives by four arrow buttons, one held at a time, and sees from the seat how much room there is.

Turning and driving on need room: each is done only as far as the body keeps clear of what stands about. So the rider
does not turn within a door, but drives on through it, or backs out of it where the jamb lies ahead, and turns there.
What the chair does not do, held by its safety gate, is let go after a while, and something else is tried there.
The rider learns how long before its end a turn is to be let go, and how long a tap is that turns a little.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from sara_common.planar import wrap
from sara_lab.journeys.by_hand import Legs, Point

Gap = Callable[[Sequence[float]], float]
"""m from the body at a pose (x, y, yaw) to the nearest obstacle."""

CLEAR, TURNING = 0.04, 0.06  # m, that are kept beside the body driving straight on, and turning
STRAIGHT = 0.04  # rad aside, up to which the rider drives straight on
LITTLE, TAP_S = 0.3, 1.0  # rad aside, up to which it is tapped; at first for so long times the root of the angle
RATE_S = 0.25  # over which the rider sees how fast the chair turns
LET_GO_S, LEARNS = 0.5, 0.5  # before its end a turn is let go, at first; share of what was wrong that is learned
AFTER = 0.08  # rad, that a turn may end too late
RUNS_ON = 0.20  # m, that the chair runs on after it is let go
STEP_M, STEP_RAD = 0.05, 0.04  # between the poses that are looked at
BACK = 0.6  # m, backed up at least
HELD_S = 2.0  # of a press without motion, until the rider lets go
IDLE = 0.1  # share of the turn that was wanted: less is none; two such taps are in vain
HERE = (0.25, 0.2)  # m, rad: so near to a place where the chair did not obey the rider does not try the same again
MOVED = (0.02, 0.03)  # m, rad


class ArrowRider:
    """way: corners of the legs, first where the chair is. gap: what the rider sees."""

    def __init__(self, way: Sequence[Point], gap: Gap) -> None:
        self._legs, self._gap = Legs(way, passed=0.35), gap
        self._looks: list[tuple[float, float]] = []
        self._let_go_s, self._turn = LET_GO_S, 0.0
        self._tap_s, self._tap = TAP_S, (0.0, -math.inf)  # rad wanted, since when
        self._pressed: tuple[float, Sequence[float]] = (-math.inf, (0.0, 0.0, 0.0))  # since when, and where
        self._idle_taps = 0  # on end
        self._in_vain: dict[str, Sequence[float]] = {}  # {button: pose where the chair did not obey it}

    def is_there(self, pose: Sequence[float]) -> bool:
        """Whether the chair, at (x, y, yaw), is where the rider wants to be."""
        return self._legs.is_there(pose)

    def arrow(self, t: float, pose: Sequence[float], held: str | None) -> str | None:
        """The button that the rider holds down now: up, left, right or down; None: the chair is to come to rest.
        `held`: the one that is held, None where the chair rests.
        """
        aside, rate = self._legs.look(pose)[1], self._rate(t, pose[2])
        if held is None:
            self._learn(pose, aside)
            self._pressed = t, tuple(pose)
            return self._begun(t, pose, aside)
        since, before = self._pressed
        if t - since > HELD_S and _near(pose, before, MOVED):
            self._in_vain[held] = tuple(pose)
            self._tap, self._turn = (0.0, -math.inf), 0.0
            return None
        if held in ('up', 'down'):
            return held if self._drives_on(pose, aside, held) else None
        return held if self._turns_on(t, (aside, rate), held) else None

    def _begun(self, t, pose, aside):
        """The button that is pressed at rest."""
        turn = 'left' if aside > 0.0 else 'right'
        ahead = self._obeyed('up', pose) and self._room_along(pose, RUNS_ON + STEP_M)
        turns = self._may_turn(pose, aside)
        if ahead and (abs(aside) < STRAIGHT or not turns):
            return 'up'
        if turns and abs(aside) >= STRAIGHT:
            self._tap = (aside, t) if abs(aside) < LITTLE else (0.0, t)
            return turn
        if self._obeyed('down', pose) and self._room_along(pose, -RUNS_ON):
            return 'down'
        self._in_vain.clear()
        return None

    def _may_turn(self, pose, aside):
        """Whether there is room to turn, as far as the rider knows."""
        return self._obeyed('left' if aside > 0.0 else 'right', pose) and self._room_to_turn(pose, aside)

    def _obeyed(self, button, pose):
        """Whether the chair did not fail to obey that button hereabouts."""
        where = self._in_vain.get(button)
        return where is None or not _near(pose, where, HERE)

    def _drives_on(self, pose, aside, held):
        """Whether the chair is to go on straight."""
        if held == 'down':
            far = math.dist(pose[:2], self._pressed[1][:2]) >= BACK and self._may_turn(pose, aside)
            return self._room_along(pose, -RUNS_ON) and not far
        if not self._room_along(pose, RUNS_ON):
            return False
        return abs(aside) < 1.5 * STRAIGHT or not self._may_turn(pose, aside)

    def _turns_on(self, t, look, held):
        """Whether the turn is to go on. look: (rad aside, rad/s)."""
        aside, rate = look
        sense = 1.0 if held == 'left' else -1.0
        wanted, since = self._tap
        if wanted != 0.0:
            return t - since < self._tap_s * math.sqrt(abs(wanted))
        if sense * aside > max(sense * rate, 0.0) * self._let_go_s:
            return True
        self._turn = rate
        return False

    def _room_along(self, pose, far):
        """Whether the body keeps clear on the next `far` m straight on, or back where that is negative."""
        steps = np.linspace(0.0, far, max(round(abs(far) / STEP_M), 1) + 1)[1:]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        return self._clear(pose, CLEAR, [(pose[0] + d * c, pose[1] + d * s, pose[2]) for d in steps])

    def _room_to_turn(self, pose, angle):
        """Whether the body keeps clear while it turns in place by `angle` (rad, + to the left), and a little more."""
        end = angle + math.copysign(AFTER, angle)
        steps = np.linspace(0.0, end, max(round(abs(end) / STEP_RAD), 1) + 1)[1:]
        return self._clear(pose, TURNING, [(pose[0], pose[1], pose[2] + a) for a in steps])

    def _clear(self, pose, wanted, poses):
        """Whether no pose has less room than wanted (m), or than there is now."""
        enough = min(wanted, self._gap(pose) - 0.002)
        return all(self._gap(one) >= enough for one in poses)

    def _rate(self, t, yaw):
        """rad/s, how fast the chair turns."""
        self._looks = [one for one in self._looks if one[0] > t - RATE_S] + [(t, yaw)]
        since, before = self._looks[0]
        return wrap(yaw - before) / (t - since) if t > since else 0.0

    def _learn(self, pose, aside):
        """How early to let go, and how long to tap, from how far aside (rad) the chair rests after a turn."""
        if (wanted := self._tap[0]) != 0.0:
            turned = 1.0 - aside / wanted  # share of what was wanted
            self._idle_taps = self._idle_taps + 1 if turned < IDLE else 0
            if self._idle_taps > 1:
                self._in_vain['left' if wanted > 0.0 else 'right'] = tuple(pose)
                self._idle_taps = 0
            elif turned >= IDLE:
                self._tap_s /= min(max(math.sqrt(turned), 0.7), 1.4)
            self._tap = (0.0, -math.inf)
        if abs(self._turn) > 0.05:
            self._let_go_s -= LEARNS * aside / self._turn
        self._let_go_s, self._turn = min(max(self._let_go_s, 0.1), 1.5), 0.0


def _near(pose, other, limits):
    """Whether two poses differ by less than limits (m, rad)."""
    return math.dist(pose[:2], other[:2]) < limits[0] and abs(wrap(pose[2] - other[2])) < limits[1]
