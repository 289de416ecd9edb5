"""Shared control: the rider leads, and the robot helps where room is short.

What the stick asks for is an arc, then straight on. Where that is not free, a short way is searched that leads on where
it points to (way_search.py), and followed by pure pursuit, slower where room is short; who steers into a wall is led
along it. Where no way leads on, the wish itself is driven as far as it is free. Nearest to the wish among what is free:
Devigne, Narayanan, Pasteau and Babel (2016, "Low complex sensor-based shared control for power wheelchair navigation").

It never goes faster than asked nor the other way, stands in the cycle in which the wish is zero, and is the wish where
nothing is near. What stops the robot is the safety gate behind it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from sara_common.planar import advanced
from sara_control.assist import docking, rollouts, way_search
from sara_control.assist.assist_config import AssistConfig
from sara_control.assist.correction import Correction
from sara_control.assist.insistence import Insistence
from sara_control.assist.local_grid import LocalGrid, field_of, gap, outline_of
from sara_control.assist.rollouts import Wish
from sara_control.assist.veering import SLOW, Veering
from sara_control.assist.way_search import Weights

AHEAD = 0.1  # s: a time may be this far in the future
SPACING = 0.15  # m between points of the outline
SHARPEST = 3.0  # 1/m of curvature; a wish for more turns in place as well
CALM = 0.15  # 1/m; a curve that bends otherwise by less is the wish's own
OWN_LOOK = 1.3  # m of the rider's own way that are looked at
NO_WALL = 0.0, 0.0  # m off walls on the left and right
CRUISING = 0.5  # of max_linear: from there on a wall is followed as far off as `beside` says
AWAY = 0.02  # m by which a wish must lead away from what the robot is led along, for it to be driven again
SPARE = 0.03  # m more than the margin that a wish keeps which is left as it is
TURN_LOOK = 0.7  # rad of a turn in place that are looked at
TURN_BRAKING, TURN_SPARE = 0.6, 0.03  # rad/s2 before what such a turn would meet, and rad before it
LOOKAHEAD = 0.45  # m, of pure pursuit along the way found
EFFORT, LOST = 0.3, 3.0  # see way_search.Weights
ROOM = 4.0  # of lacking room, with full help
TREMBLES = 4.0  # of what is wished for on average: where room is short, more than that, or the other way, is a tremble
NARROW_SPEED = 0.15  # m/s at the margin; what is allowed beside an obstacle grows from there
PIVOT_RATE, LEAST_WAY = 0.6, 0.3  # of max_angular; m that a way must lead on

LEFT, RIGHT = Correction.LEFT, Correction.RIGHT
AGAINST = {LEFT: 1.0, RIGHT: -1.0, Correction.STOPS: 0.0}  # see Insistence; what is slower only is not


class Assisted(NamedTuple):
    """v (m/s) and w (rad/s) to be driven; correction: what of it the rider did not ask for, or None."""

    v: float
    w: float
    correction: Correction | None


class SharedControl:
    """config: AssistConfig. Times in s on one clock; poses (x, y, yaw), m, rad, in the grid's frame."""

    def __init__(self, config: AssistConfig) -> None:
        rollouts.warm()
        way_search.warm()
        docking.warm()
        self._outline = outline_of(config.length, config.width, SPACING)
        self._driven = {  # with what is kept free ahead, or astern
            sense: outline_of(config.length, config.width, SPACING, sense * config.ahead) for sense in (1.0, -1.0)
        }
        self._field, self._stamp = None, -math.inf
        self._insistence, self._veering, self._docked = Insistence(config), Veering(), docking.Docked()
        self._take(config)
        self._last, self._steady, self._then, self._led = 0.0, None, None, False
        self._grid: LocalGrid | None = None

    def on_grid(self, grid: LocalGrid, stamp: float) -> None:
        """What is blocked, as of `stamp`. Raises GridError, and keeps what was known, where it makes no sense."""
        self._field, self._stamp = (
            field_of(grid, self._driven[1.0].radius + max(self.config.clear, self.config.margin)),
            stamp,
        )
        self._grid = grid

    def use(self, config: AssistConfig) -> None:
        """Another rider's config, of the same body, for commands from now on."""
        self._take(config)
        if self._grid is not None:
            self.on_grid(self._grid, self._stamp)  # the room that counts may reach farther
        self._rest()

    def _take(self, config):
        self.config = self._insistence.config = config
        self._weights = Weights(config.margin, config.clear, NO_WALL, ROOM * config.help, EFFORT, LOST)

    def override(self, t: float, on: bool = True) -> None:
        """The rider's button: no help for override_time from t on, or help again."""
        self._insistence.override(t, on)

    def override_left(self, t: float) -> float:
        """s that the rider's override still lasts at t; 0 where there is none."""
        return self._insistence.override_left(t)

    def step(
        self, t: float, wish: Sequence[float], pose: Sequence[float] | None, driven: Sequence[float] = (0.0, 0.0)
    ) -> Assisted:
        """The Assisted command for a wish (v m/s, w rad/s) at t. pose: of base_link; None: not known. driven: v (m/s)
        and w (rad/s) as measured.
        """
        v, w = wish
        if not (math.isfinite(v) and math.isfinite(w)) or v == w == 0.0:
            self._rest()
            return Assisted(0.0, 0.0, None)
        if not self.config.enabled:
            return Assisted(v, w, Correction.OFF)
        if self._insistence.alone(t, v, w):
            self._rest(keep=True)
            return Assisted(v, w, Correction.OVERRIDE if self.override_left(t) > 0.0 else Correction.INSISTED)
        if not (pose is not None and all(map(math.isfinite, (*pose, *driven))) and self._knows(t)):
            self._rest()
            return Assisted(v, w, Correction.UNKNOWN)
        pose = advanced(*map(float, pose), *map(float, driven), self.config.latency)
        self._docked.see(t, pose)
        near = gap(self._field, self._outline, *pose) < self.config.clear
        veered = self._veering.wish(t, v, w, self.config.veer_time)
        if near:
            v, w = veered
        asked, steady = (v, w), self._averaged(t, v, w)
        if near:
            v, w = 0.0 if self._turns(steady) else _calmed(v, steady[0]), _calmed(w, steady[1])
        elif v * steady[0] < 0.0:
            steady = v, w  # it turns round
        turns = self._turns(steady) or asked[0] == 0.0
        if v == 0.0 and (w == 0.0 or not turns):
            result = Assisted(0.0, 0.0, None)
        elif turns:
            self._last = 0.0
            result = self._turn(v, w, pose)
        else:
            result = self._drive(t, (v, w), steady, pose)
        if result.correction is None and (v, w) != tuple(wish):
            result = result._replace(correction=Correction.CALMER if asked == tuple(wish) else Correction.VEERS)
        self._insistence.corrected(AGAINST.get(result.correction))
        self._then = t
        return result

    def let_go(self) -> None:
        """The rider commands no more, or somebody else does."""
        self._rest()

    def _rest(self, keep=False):
        self._last, self._steady, self._then, self._led = 0.0, None, None, False
        self._veering.stop()
        if not keep:
            self._insistence.let_go()

    def _knows(self, t):
        return self._field is not None and -AHEAD <= t - self._stamp <= self.config.grid_timeout

    def _turns(self, wish):
        """Whether a wish (m/s, rad/s) is to turn in place, or nearly."""
        return abs(wish[0]) < SLOW or abs(wish[1]) / self.config.turn_slip > SHARPEST * abs(wish[0])

    def _turn(self, v, w, pose):
        """Less of a command where there is no room to turn; or to drive, where the rider just begins to."""
        c = self.config
        if not self._turns((v, w)):
            wish = Wish(math.copysign(1.0, v), w / abs(v) / c.turn_slip, OWN_LOOK)
            return self._slower(v, w, pose, wish)
        free = rollouts.free_turn(self._field, self._outline, pose, math.copysign(TURN_LOOK, w), c.margin)
        rate = math.sqrt(2.0 * TURN_BRAKING * max(free - TURN_SPARE, 0.0))
        if free >= TURN_LOOK - 1e-6 or rate >= abs(w):
            return Assisted(v, w, None)
        if rate < SLOW:
            return Assisted(0.0, 0.0, Correction.STOPS)
        return Assisted(v * rate / abs(w), math.copysign(rate, w), Correction.SLOWER)

    def _drive(self, t, command, steady, pose):
        """A wish to drive: on a way about it that keeps clear. command, steady: (v m/s, w rad/s) as it is, and
        averaged.
        """
        v, w = command
        c, sense = self.config, math.copysign(1.0, v)
        asked = steady[1] / abs(steady[0]) / c.turn_slip
        wish = Wish(sense, asked, self._look(steady[0]))
        ahead = wish._replace(look=min(wish.look, OWN_LOOK))
        weights = self._weights._replace(beside=self._beside(steady[0], asked))
        own = rollouts.follow(self._field, self._driven[sense], pose, ahead, c.margin, weights.beside)
        begin, end = own.too_near
        leads_away = end <= max(AWAY, begin - AWAY)
        keeps_clear = own.free >= ahead.look - 1e-6 and own.nearest >= c.margin + SPARE
        if keeps_clear and (leads_away or not self._led):
            self._last, self._led = asked, False
            return Assisted(v, w, None)
        if not self._docked.again and self._docks(pose, ahead):
            self._docked.brings_up(t, pose)
            self._led = False
            return self._slower(v, w, pose, ahead)
        way = self._way(pose, wish, weights)
        self._led = way is not None
        if way is None:
            return self._slower(v, w, pose, ahead)
        if way.moves[0, 0] == 0.0:
            self._last = 0.0
            side = math.copysign(1.0, way.moves[0, 1])
            asked = abs(w) + c.turn_slip * abs(v) / self._outline.radius  # moves a corner as fast as the wish
            rate = min(PIVOT_RATE * c.max_angular, asked)
            return Assisted(0.0, side * rate, LEFT if side > 0.0 else RIGHT)
        curvature = self._last = self._pursued(way, pose, sense)
        speed = min(abs(v), self._allowed(way))
        turn = curvature * c.turn_slip * speed
        if abs(turn) > max(c.max_angular, abs(w)):
            speed *= max(c.max_angular, abs(w)) / abs(turn)
            turn = curvature * c.turn_slip * speed
        if abs(curvature - asked) > CALM:
            return Assisted(sense * speed, turn, LEFT if curvature > asked else RIGHT)
        return Assisted(sense * speed, turn, Correction.SLOWER if speed < 0.99 * abs(v) else None)

    def _docks(self, pose, wish):
        """Whether a Wish that is not free leads squarely up to something broad."""
        size = self.config.length, self.config.width
        return abs(wish.curvature) < docking.STRAIGHT and docking.faces(self._field, size, pose, wish.sense, OWN_LOOK)

    def _beside(self, v, curvature):
        """(m on the left, on the right) that are kept to a wall that the rider steers into, at v (m/s): less where they
        are slow, none astern, for so one parks beside a bed or a table.
        """
        c = self.config
        kept = c.beside * min(max(v / (CRUISING * c.max_linear), 0.0), 1.0)
        return kept if curvature > CALM else 0.0, kept if curvature < -CALM else 0.0

    def _way(self, pose, wish, weights):
        """A Way that keeps `ahead` free, or else one that does not; None where neither leads on."""
        driven = self._driven[wish.sense]
        is_clear = gap(self._field, driven, *pose) >= self.config.margin
        for outline in (driven, self._outline) if is_clear else (self._outline,):
            way = way_search.search(self._field, outline, pose, wish, self._last, weights)
            if len(way.moves) > 0 and way.progress >= LEAST_WAY:
                return way
        return None

    def _slower(self, v, w, pose, wish):
        """The command of a Wish itself, as fast as what is free of it allows."""
        own = rollouts.follow(self._field, self._outline, pose, wish, self.config.margin, NO_WALL)
        speed = math.sqrt(2.0 * self.config.braking * max(own.free - SPARE, 0.0))
        if speed < SLOW:
            return Assisted(0.0, 0.0, Correction.STOPS)
        share = min(1.0, speed / abs(v))
        return Assisted(v * share, w * share, Correction.SLOWER if share < 1.0 else None)

    def _pursued(self, way, pose, sense):
        """The curvature (1/m) to the point of a Way that is LOOKAHEAD on: pure pursuit (Coulter 1992); that of the
        Way's own beginning where the other is not free, as it cuts corners.
        """
        x, y, yaw = way.poses[0]
        k, done = 1, abs(way.moves[0, 0])
        while k < len(way.moves) and way.moves[k, 0] != 0.0 and done < LOOKAHEAD:
            done += abs(way.moves[k, 0])
            k += 1
        dx, dy = way.poses[k, 0] - x, way.poses[k, 1] - y
        aside = sense * (math.cos(yaw) * dy - math.sin(yaw) * dx)
        curvature = 2.0 * aside / max(dx * dx + dy * dy, 1e-6)
        cut = rollouts.follow(
            self._field, self._outline, pose, Wish(sense, curvature, LOOKAHEAD), self.config.margin, NO_WALL
        )
        return curvature if cut.free >= LOOKAHEAD - 1e-6 else way.moves[0, 1] / abs(way.moves[0, 0])

    def _averaged(self, t, v, w):
        """What is wished for (m/s, rad/s), averaged over steady_time."""
        before = self._steady
        if before is None or self._then is None or self.config.steady_time == 0.0:
            self._steady = v, w
        else:
            share = 1.0 - math.exp(-max(t - self._then, 0.0) / self.config.steady_time)
            self._steady = before[0] + share * (v - before[0]), before[1] + share * (w - before[1])
        return self._steady

    def _look(self, v):
        c = self.config
        return min(max(abs(v) * c.horizon, c.nearest_look), c.farthest_look)

    def _allowed(self, way):
        """m/s, by how far a Way leads on before it ends or turns in place, and by the room about its beginning."""
        c, free, nearest = self.config, 0.0, math.inf
        for k, (length, _) in enumerate(way.moves):
            if length == 0.0:
                break
            free += abs(length)
            if free <= 2.0 * LOOKAHEAD:
                nearest = min(nearest, gap(self._field, self._outline, *way.poses[k + 1]))
        share = min(max((nearest - c.margin) / (c.clear - c.margin), 0.0), 1.0)
        beside = NARROW_SPEED + (c.max_linear - NARROW_SPEED) * min(2.0 * share, 1.0)
        return min(math.sqrt(2.0 * c.braking * free), beside if share < 0.5 else math.inf)


def _calmed(now, mean):
    """A wish without what trembles about its average."""
    return math.copysign(min(abs(now), TREMBLES * abs(mean)), now) if (now > 0.0) == (mean > 0.0) else 0.0
