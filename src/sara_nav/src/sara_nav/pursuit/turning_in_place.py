"""One turn in place after the other, each cycle as a LocalCommand: begun when there is room, slower beside obstacles,
stopped when something is met.
"""

import math

from sara_common.planar import wrap
from sara_nav.grids.clearance import room
from sara_nav.planners.local_command import BLOCKED, DRIVING, LocalCommand
from sara_nav.pursuit.messages import turning
from sara_nav.pursuit.smooth_turn import SmoothTurn, planned_way, turn_poses, way_round
from sara_nav.pursuit.speed_plan import gap_speed
from sara_nav.pursuit.stopping_path import blocked_where, stopping_turn

LOOK = 0.4
"""Angle (rad) of a turn whose gaps set its rate: the farthest corner sweeps past them no faster than the robot would
drive past them.
"""


class TurningInPlace:
    """config: RotateThenPursueConfig. words: Words."""

    def __init__(self, config, words):
        self.config, self._words = config, words
        self._turn = None

    @property
    def under_way(self):
        """True between ``begin`` and the end of a turn."""
        return self._turn is not None

    def drop(self):
        """Forget the turn under way; what is left of it begins anew."""
        self._turn = None

    def tight(self, now, angle, world):
        """True when something comes nearer than ahead_stop_distance in a turn by ``angle`` (rad) from a Pose2D, so that
        it is better not made.
        """
        c = self.config
        return bool(
            room(world, turn_poses(now, angle), False, c.ahead_angle, c.wide_gap).gap.min() < c.ahead_stop_distance
        )

    def begin(self, now, error, world, planned=0.0, spare=0.0, enough=0.0):
        """Begin to turn by ``error`` (rad, wrapped) from a Pose2D; return None, or the LocalCommand that says why not.

        planned: by how much a plan turns there (rad, with its sense), which is kept to; 0.0: none does. spare (rad):
        the turn is begun although so much of it is not free. enough (rad): it is over when it went too far by no more
        than this.
        """
        angle, free = way_round(world, now, planned_way(error, planned) if planned else error, bool(planned))
        if abs(angle) - free > spare:
            return LocalCommand(
                0.0,
                0.0,
                BLOCKED,
                'no room to turn {} by {:.0f} deg: the {} would touch something'.format(
                    'left' if angle > 0.0 else 'right',
                    abs(math.degrees(angle)),
                    blocked_where(world, turn_poses(now, angle)),
                ),
            )
        self._turn = SmoothTurn(angle, enough)
        return None

    def step(self, t, dt, now, error, last, gain, world, what):
        """Return the LocalCommand of a cycle of the turn, None when it is done.

        error: heading wanted less heading of the Pose2D now (rad). last: turn rate last commanded (rad/s). gain: rate
        driven over commanded.
        what: the turn is onto, in words.
        """
        c, turn = self.config, self._turn
        turn.left += wrap(error - turn.left)
        seen = room(world, turn_poses(now, max(min(turn.left, LOOK), -LOOK)), False, c.ahead_angle, c.wide_gap)
        corner = gap_speed(seen.gap.min(), c) / world.radius
        highest = min(c.max_vel_theta, corner / gain)
        rate = turn.rate(error, last, gain, highest, c, dt)
        if rate == 0.0 and last == 0.0:
            self._turn = None
            return None
        if rate and world.worsens(stopping_turn(now, rate * gain, c)):
            where = blocked_where(world, stopping_turn(now, rate * gain, c))
            return LocalCommand(
                0.0,
                0.0,
                BLOCKED,
                'turning {}, the {} would touch something'.format('left' if rate > 0.0 else 'right', where),
            )
        return LocalCommand(0.0, rate, DRIVING, self._words.say(t, *turning(turn.left, what)))
