"""One turn in place after the other, each cycle as a LocalCommand: begun when there is room, slower beside obstacles,
stopped when something is met.
"""

import math

from sara_common.planar import wrap
from sara_nav.grids.clearance import room
from sara_nav.planners.local_command import BLOCKED, DRIVING, LocalCommand
from sara_nav.pursuit.cycle import Cycle
from sara_nav.pursuit.messages import Words, turning
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_turn import SmoothTurn, planned_way, turn_poses, way_round
from sara_nav.pursuit.speed_plan import gap_speed
from sara_nav.pursuit.stopping_path import blocked_where, stopping_turn

LOOK = 0.4
"""Angle (rad) of a turn whose gaps set its rate: the farthest corner sweeps past them no faster than the robot would
drive past them.
"""


class TurningInPlace:
    """One turn at a time; see the module."""

    def __init__(self, config: RotateThenPursueConfig, words: Words):
        self.config, self._words = config, words
        self._turn = None

    @property
    def under_way(self) -> bool:
        """True between ``begin`` and the end of a turn."""
        return self._turn is not None

    def drop(self) -> None:
        """Forget the turn under way; what is left of it begins anew."""
        self._turn = None

    def tight(self, cycle: Cycle, angle: float) -> bool:
        """True when something comes nearer than ahead_stop_distance in a turn by ``angle`` (rad), so that it is better
        not made.
        """
        return bool(self._least_gap(cycle, angle) < self.config.ahead_stop_distance)

    def begin(
        self, cycle: Cycle, error: float, planned: float = 0.0, spare: float = 0.0, enough: float = 0.0
    ) -> LocalCommand | None:
        """Begin to turn by ``error`` (rad, wrapped); return None, or the LocalCommand that says why not.

        planned: by how much a plan turns there (rad, with its sense), which is kept to; 0.0: none does. spare (rad):
        the turn is begun although so much of it is not free. enough (rad): it is over when it went too far by no more
        than this.
        """
        world, now = cycle.world, cycle.now
        angle, free = way_round(world, now, planned_way(error, planned) if planned else error, bool(planned))
        if abs(angle) - free > spare:
            where = blocked_where(world, turn_poses(now, angle))
            degrees = abs(math.degrees(angle))
            return _blocked(f'no room to turn {_side(angle)} by {degrees:.0f} deg: the {where} would touch something')
        self._turn = SmoothTurn(angle, enough)
        return None

    def step(self, cycle: Cycle, error: float, what: str) -> LocalCommand | None:
        """Return the LocalCommand of a cycle of the turn, None when it is done.

        error: heading wanted less that of now (rad). what: the turn is onto, in words.
        """
        c, turn, gain, last = self.config, self._turn, cycle.turn_gain, cycle.last[1]
        turn.left += wrap(error - turn.left)
        corner = gap_speed(self._least_gap(cycle, max(min(turn.left, LOOK), -LOOK)), c) / cycle.world.radius
        highest = min(c.max_vel_theta, corner / gain)
        rate = turn.rate(error, last, gain, highest, c, cycle.dt)
        if rate == 0.0 and last == 0.0:
            self._turn = None
            return None
        if rate and cycle.world.worsens(poses := stopping_turn(cycle.now, rate * gain, c)):
            where = blocked_where(cycle.world, poses)
            return _blocked(f'turning {_side(rate)}, the {where} would touch something')
        return LocalCommand(0.0, rate, DRIVING, self._words.say(cycle.t, *turning(turn.left, what)))

    def _least_gap(self, cycle, angle):
        """Return the least gap (m) beside the robot in a turn by an angle (rad)."""
        c = self.config
        return room(cycle.world, turn_poses(cycle.now, angle), False, c.ahead_angle, c.wide_gap).gap.min()


def _blocked(text):
    return LocalCommand(0.0, 0.0, BLOCKED, text)


def _side(angle):
    return 'left' if angle > 0.0 else 'right'
