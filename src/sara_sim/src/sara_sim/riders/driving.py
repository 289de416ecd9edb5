"""Riders without an impairment of the hands: one who knows the way, and one who heads for the goal and sees nothing
else.

Both aim at a place ahead of them: the curvature that leads there is 2 sin(angle) / distance (pure pursuit, R. C.
Coulter, CMU-RI-TR-92-01, 1992). What lies behind is turned to in place. Who does not get on although the stick is
deflected lets go, backs off, and tries again; and where there is no backing off, goes ahead a little the next time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sara_common.planar import wrap
from sara_sim.riders.stick import CENTRED, Delayed, Stick
from sara_sim.riders.way import Way


@dataclass(frozen=True)
class Manner:
    """How somebody drives. m, s, rad, m/s, rad/s.

    cruise: share of full deflection on a free straight; turning: at most, in place. full_speed, full_turn: what the
    chair does at full deflection, as the rider knows it. look: how far ahead they aim. reaction: how old what they see
    is. behind: they stop and turn to what is farther off their heading, until it is within facing. narrow: share of
    cruise near a narrow place, within narrow_near of it; bends slow down by bend_slows (1/rad). arrival: so near the
    end they let go. stuck: so long without getting on they let go for let_go, then back off for back, with
    back_deflection.
    """

    cruise: float = 0.85
    turning: float = 0.8
    full_speed: float = 0.4
    full_turn: float = 0.47
    look: float = 0.8
    reaction: float = 0.2
    behind: float = 1.0
    facing: float = 0.2
    narrow: float = 0.6
    narrow_near: float = 1.1
    bend_slows: float = 0.5
    arrival: float = 0.25
    stuck: float = 3.0
    let_go: float = 1.3
    back: float = 1.6
    back_deflection: float = 0.5


MOVED = 0.05  # m, or rad: who gets on by less is stuck
BEND_LOOK = 1.2  # m ahead whose bends slow down
NEAREST = 0.3  # m: nobody aims at what is nearer
GENTLE = 0.3  # share of turning with which a turn in place ends


class Patience:
    """Notices that the chair does not get on although it is asked to, and says what to do then. manner: Manner."""

    def __init__(self, manner: Manner) -> None:
        self._manner = manner
        self._since = self._pose = self._noticed = None
        self._away = -1.0  # back; 1.0: ahead

    def stick(self, t: float, pose: Sequence[float], wanted: Stick) -> Stick:
        """What is done at t (s), at a pose, by somebody who wants another Stick: that, where the chair gets on."""
        manner = self._manner
        if self._noticed is not None:
            waited = t - self._noticed
            if waited < manner.let_go:
                return CENTRED
            if waited < manner.let_go + manner.back:
                return Stick(0.0, self._away * manner.back_deflection)
            self._away = -1.0 if _apart(pose, self._pose) else -self._away
            self._noticed = self._pose = None
        if wanted == CENTRED or self._pose is None or _apart(pose, self._pose):
            self._since, self._pose = t, tuple(pose)
        elif t - self._since > manner.stuck:
            self._noticed = t
            return CENTRED
        return wanted


def _apart(pose, other):
    """Whether two poses are not the same place."""
    return math.dist(pose[:2], other[:2]) > MOVED or abs(wrap(pose[2] - other[2])) > MOVED


class Driver:
    """Aims at places that a derived class chooses by `_aim`. manner: Manner."""

    def __init__(self, manner: Manner) -> None:
        self.manner, self.arrived = manner, False
        self._seen, self._patience = Delayed(manner.reaction), Patience(manner)
        self._first, self._turning = None, False

    def stick(self, t: float, pose: Sequence[float]) -> Stick:
        """See Rider."""
        self._first = self._first or tuple(pose)
        seen = self._seen.pass_on(t, tuple(pose), until_then=self._first)
        place, share = self._aim(seen)
        if self.arrived:
            return CENTRED
        return self._patience.stick(t, pose, self._towards(seen, place, share))

    def _aim(self, pose):
        """(place (x, y) to aim at, share of cruise) of somebody who sees themselves at a pose."""
        raise NotImplementedError

    def _towards(self, pose, place, share):
        manner = self.manner
        dx, dy = place[0] - pose[0], place[1] - pose[1]
        angle = wrap(math.atan2(dy, dx) - pose[2])
        self._turning = abs(angle) > (manner.facing if self._turning else manner.behind)
        if self._turning:
            return Stick(math.copysign(manner.turning * min(1.0, GENTLE + abs(angle)), angle), 0.0)
        forward = manner.cruise * share
        curvature = 2.0 * math.sin(angle) / max(math.hypot(dx, dy), NEAREST)
        left = curvature * forward * manner.full_speed / manner.full_turn
        if abs(left) > 1.0:  # slower, on the same curve
            left, forward = left / abs(left), forward / abs(left)
        return Stick.within(left, forward)


class WayDriver(Driver):
    """Knows the way: points (x, y), m. narrow: places (x, y) near which the rider goes slowly. manner: Manner."""

    def __init__(
        self,
        points: Sequence[tuple[float, float]],
        narrow: Sequence[tuple[float, float]] = (),
        manner: Manner = Manner(),
    ) -> None:
        super().__init__(manner)
        self.way, self._narrow = Way(points), tuple(narrow)

    def _aim(self, pose):
        manner, way = self.manner, self.way
        way.go_on(*pose[:2])
        self.arrived = self.arrived or (
            way.left <= manner.look and math.dist(pose[:2], way.at(math.inf)) < manner.arrival
        )
        share = 1.0 / (1.0 + manner.bend_slows * way.bend(BEND_LOOK))
        if any(math.dist(pose[:2], place) < manner.narrow_near for place in self._narrow):
            share = min(share, manner.narrow)
        return way.at(manner.look), share


class BlindDriver(Driver):
    """Heads for one goal (x, y; m) after the other, straight from where they are, and sees nothing that is in the way.
    A goal is reached within `near` m, the last within the Manner's arrival.
    """

    def __init__(self, goals: Sequence[tuple[float, float]], near: float = 0.5, manner: Manner = Manner()) -> None:
        super().__init__(manner)
        self._goals, self._near = list(goals), near

    def _aim(self, pose):
        goals = self._goals
        while len(goals) > 1 and math.dist(pose[:2], goals[0]) < self._near:
            goals.pop(0)
        if len(goals) == 1 and math.dist(pose[:2], goals[0]) < self.manner.arrival:
            self.arrived = True
        return goals[0], 1.0
