"""The end of a drive: approach the goal once more where it was missed, then turn to its heading."""

import math

from sara_common.planar import Pose2D, wrap
from sara_nav.planners.local_command import DRIVING, FAILED, OFF_PATH, REACHED, LocalCommand
from sara_nav.pursuit.cycle import Cycle
from sara_nav.pursuit.driving_progress import DONE, FINAL_TURN, Progress
from sara_nav.pursuit.messages import Words
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_command import SmoothCommand
from sara_nav.pursuit.turning_in_place import TurningInPlace

OVERSHOT = 0.5
"""Share of yaw_goal_tolerance by which the turn at the goal may go too far and still be over: a pose that comes from a
slow IMU swings by so much while a turn ends, and who follows it turns to and fro. What is off once the robot stands
counts.
"""
LONGEST_REPAIR = 0.3
"""A goal missed by less than this (m) may be approached in reverse."""


MAX_APPROACHES = 4
"""A goal missed so often is given up."""


class GoalApproach:
    """Approaches the goal where it was missed, and turns to its heading."""

    def __init__(self, config: RotateThenPursueConfig, turning: TurningInPlace, command: SmoothCommand, words: Words):
        self._config, self._turning, self._command, self._words = config, turning, command, words

    def settled(self, p: Progress, goal: Pose2D, pose: Pose2D) -> LocalCommand | None:
        """Standing still at the end of the last leg: go on to the turn, or approach once more. Returns a LocalCommand
        when that has failed.
        """
        c = self._config
        distance = pose.distance(goal)
        if distance <= c.xy_goal_tolerance:
            p.phase, p.holding = FINAL_TURN, False
            return None
        p.approaches += 1
        if p.approaches > MAX_APPROACHES:
            text = (
                f'the goal cannot be approached to within xy_goal_tolerance ({distance:.3f} m off after '
                f'{p.approaches} tries)'
            )
            return LocalCommand(0.0, 0.0, FAILED, text)
        bearing = wrap(math.atan2(goal.y - pose.y, goal.x - pose.x) - pose.yaw)
        backward = abs(bearing) > 0.5 * math.pi and distance < LONGEST_REPAIR
        p.drive_to(((pose.x, pose.y), (goal.x, goal.y)), backward)
        return None

    def turn(self, p: Progress, goal: Pose2D, cycle: Cycle) -> LocalCommand:
        """One cycle of the turn to the goal's heading, or of what comes before and after it."""
        error = wrap(goal.yaw - cycle.now.yaw)
        if not self._turning.under_way:
            other = self._before_turn(p, goal, cycle, error)
            if other is not None:
                return other
        command = self._turning.step(cycle, error, "the goal's heading")
        if command is not None:
            return command
        p.holding, p.still_since = True, None
        return self._hold(cycle)

    def _before_turn(self, p, goal, cycle, error):
        """Return what is to be done instead of turning; None where the turn has begun."""
        c = self._config
        off = cycle.pose.distance(goal)
        if p.is_lost(off):
            return LocalCommand(0.0, 0.0, OFF_PATH, f'the robot is {off:.2f} m off the goal that it had reached')
        if not cycle.still and p.holding:
            return self._hold(cycle)
        if abs(wrap(goal.yaw - cycle.pose.yaw)) <= c.yaw_goal_tolerance and (cycle.still or p.holding):
            p.phase = DONE
            return LocalCommand(0.0, 0.0, REACHED)
        if cycle.drives(c):
            return self._command.come_to_rest(cycle, 'comes to rest')
        planned = p.final_angle if abs(p.final_angle) > c.yaw_goal_tolerance else 0.0
        spare, enough = c.yaw_goal_tolerance, OVERSHOT * c.yaw_goal_tolerance
        blocked = self._turning.begin(cycle, error, planned, spare, enough)
        if not blocked:
            p.holding, p.final_angle = False, 0.0
        return blocked

    def _hold(self, cycle):
        return LocalCommand(0.0, 0.0, DRIVING, self._words.say(cycle.t, 'hold', 'stands at the goal'))
