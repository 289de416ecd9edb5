"""The end of a drive: approach the goal once more where it was missed, then turn to its heading."""

import math

from sara_common.planar import wrap
from sara_nav.planners.local_command import DRIVING, FAILED, OFF_PATH, REACHED, LocalCommand
from sara_nav.pursuit.driving_progress import DONE, FINAL_TURN

OVERSHOT = 0.5
"""Share of yaw_goal_tolerance by which the turn at the goal may go too far and still be over: a pose that comes from a
slow IMU swings by so much while a turn ends, and who follows it turns to and fro. What is off once the robot stands
counts.
"""
LONGEST_REPAIR = 0.3
"""A goal missed by less than this (m) may be approached in reverse."""


class GoalApproach:
    """What RotateThenPursue does at the goal; a part of it."""

    def _settled(self, pose):
        """Standing still at the end of the last leg: go on to the turn, or approach once more. Returns a LocalCommand
        when that has failed.
        """
        p, c = self._p, self.config
        distance = pose.distance(self.goal)
        if distance <= c.xy_goal_tolerance:
            p.phase, p.holding = FINAL_TURN, False
            return None
        p.approaches += 1
        if p.approaches > self.MAX_APPROACHES:
            return LocalCommand(
                0.0,
                0.0,
                FAILED,
                f'the goal cannot be approached to within xy_goal_tolerance ({distance:.3f} m off after '
                f'{p.approaches} tries)',
            )
        bearing = wrap(math.atan2(self.goal.y - pose.y, self.goal.x - pose.x) - pose.yaw)
        backward = abs(bearing) > 0.5 * math.pi and distance < LONGEST_REPAIR
        p.drive_to(((pose.x, pose.y), (self.goal.x, self.goal.y)), backward)
        return None

    def _turn_to_goal(self, t, dt, now, pose, still, velocity, world):
        p, c = self._p, self.config
        if not self._turning.under_way:
            off = pose.distance(self.goal)
            if p.is_lost(off):
                return LocalCommand(0.0, 0.0, OFF_PATH, f'the robot is {off:.2f} m off the goal that it had reached')
            if not still and p.holding:
                return LocalCommand(0.0, 0.0, DRIVING, self._words.say(t, 'hold', 'stands at the goal'))
            if abs(wrap(self.goal.yaw - pose.yaw)) <= c.yaw_goal_tolerance and (still or p.holding):
                p.phase = DONE
                return LocalCommand(0.0, 0.0, REACHED)
            if abs(velocity[0]) > 2.0 * c.trans_stopped_vel or self._last[0] != 0.0:
                return self._braked(t, dt, now, world, 'comes to rest')
            planned = p.final_angle if abs(p.final_angle) > c.yaw_goal_tolerance else 0.0
            blocked = self._turning.begin(
                now,
                wrap(self.goal.yaw - now.yaw),
                world,
                planned,
                c.yaw_goal_tolerance,
                OVERSHOT * c.yaw_goal_tolerance,
            )
            if blocked:
                return blocked
            p.holding, p.final_angle = False, 0.0
        command = self._turned(t, dt, now, wrap(self.goal.yaw - now.yaw), world, "the goal's heading")
        if command is not None:
            return command
        p.holding, p.still_since = True, None
        return LocalCommand(0.0, 0.0, DRIVING, self._words.say(t, 'hold', 'stands at the goal'))
