"""What the two planners that sample velocities share: their plan, frames, goal and checks; the sampling is theirs.

As base_local_planner and dwa_local_planner do: the plan is cut to what lies within the local costmap, what is left
behind is dropped (prune_plan), and near the goal sampling gives way to stop-and-rotate (goal_stage.py).
"""

import math

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.grids import outline
from sara_nav.grids.free_motions import Ways
from sara_nav.planners.local_command import BLOCKED, DRIVING, FAILED, OFF_PATH, REACHED, LocalCommand
from sara_nav.sampled import map_grid, rollout
from sara_nav.sampled.goal_stage import DONE, GoalStage
from sara_nav.sampled.in_place_turn import InPlaceTurn
from sara_nav.sampled.published import to_global
from sara_nav.sampled.turn_gain import TurnGain

PRUNE_DISTANCE = 1.0
"""Metres from the robot at which prune_plan keeps the plan behind it, the peers' value."""
PROGRESS_WINDOW = 2.0
"""Metres of plan ahead among which the point nearest to the robot is looked for."""
GRACE = 0.4
"""Seconds a robot that touches something (so the costmap says) may take to come off it; it must not touch more
meanwhile.
"""
FACING = 0.2
"""Radians off the plan's direction within which turning in place is no help."""
STUCK_TIME, STUCK_WAY = 4.0, 0.1
"""A robot that has not got on by so many metres in so many seconds turns to its plan first."""
TRIES = 12
"""How many of the cheapest samples are asked whether the robot could stop from them, until one could."""
ANSWER_TIME = 0.25
"""Seconds within which the base is taken to answer: the speed it is on its way to is at most that many seconds of
acceleration from the one measured."""


class SamplingPlanner:
    """Base of TrajectoryPlannerROS and DWAPlannerROS; a subclass gives ``_limits`` and ``_sample``.

    local_plan: poses (n, 3) of the trajectory chosen last, global frame, None when there is none.
    """

    def __init__(self, config):
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(faults))
        self.config = config
        self.goal = None
        self.local_plan = None
        self._stage = GoalStage()
        self._gain = TurnGain()
        self._turn = InPlaceTurn()
        self._facing, self._got_to = False, None
        self._plan = np.empty((0, 3))
        self._dense, self._reached = None, 0
        self._last = (0.0, 0.0)
        self._scene = None
        self._waves = map_grid.Waves()

    @property
    def phase(self):
        """Name of the stage: follow path, face goal, approach goal, stop, turn to goal, done."""
        return self._stage.phase

    def reconfigure(self, config):
        """Go on with another configuration (dynamic_reconfigure); raises ValueError when it is faulty."""
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(faults))
        self.config = config

    def start(self, plan):
        """Begin a new goal: plan (n, 3) in the global frame, its last row the goal."""
        self._stage.begin()
        self._facing, self._got_to = False, None
        self._take(plan)

    def replan(self, plan):
        """Take a better plan; when it leads to the same goal, what was reached (and latched) stays reached."""
        before = self.goal
        self._take(plan)
        if before is None or before.distance(self.goal) > 1e-6 or abs(before.yaw - self.goal.yaw) > 1e-6:
            self._stage.begin()

    def _take(self, plan):
        self._plan = np.asarray(plan, float).reshape(-1, 3)
        self.goal = Pose2D(*(float(v) for v in self._plan[-1]))
        self._dense = None

    def stop(self):
        """Forget the last command, because the robot was told to stop at once."""
        self._last = (0.0, 0.0)
        self.local_plan = None

    def update(self, t, dt, pose, velocity, pose_age, world):
        """Return the LocalCommand for time t (s).

        dt: since the last command (s). pose: Pose2D in the global frame as it was pose_age seconds ago. velocity:
        measured (v, w). world: LocalWorld (costmap, footprint, to_local, offset, worsens).
        """
        now = pose.advance(velocity[0], velocity[1], pose_age)
        self._gain.update(dt, self._last[1], velocity[1])
        limits = self._limits(2.0 * world.costmap.geometry.resolution)
        c, ways = self.config, Ways(world)
        command = self._stage.update(t, dt, now, velocity, self._last, self.goal, limits, ways)
        failed = self._stage.failed(now, self.goal)
        if failed:
            return self._stand(FAILED, failed)
        if self.phase == DONE:
            return self._stand(REACHED)
        if command is not None:
            self.local_plan = None
            if command != (0.0, 0.0) and not ways.stop_is_free(now, *command, c.acc_lim_x, c.acc_lim_theta):
                return self._stand(BLOCKED, f'an obstacle is in the way of the footprint while it is to {self.phase}')
            self._last = command
            return LocalCommand(*command)
        plan = self._plan_near(now, world)
        if plan is None:
            return self._stand(
                OFF_PATH,
                'the plan is nowhere within %s of the robot'
                % (f'{PRUNE_DISTANCE:.1f} m (prune_plan)' if c.prune_plan else 'half the local costmap'),
            )
        cells = map_grid.plan_cells(plan, world.costmap)
        if len(cells) == 0:
            return self._stand(OFF_PATH, 'no point of the plan lies in known cells of the local costmap')
        local = Pose2D(*(float(v) for v in world.to_local(np.array([[now.x, now.y, now.yaw]]))[0]))
        turn = self._face_plan(t, dt, now, local, velocity, plan, limits, ways)
        if turn is not None:
            self._last, self.local_plan = turn, None
            return LocalCommand(*turn)
        command, poses, text = self._choose(
            dt,
            local,
            self._answering(velocity),
            plan,
            cells,
            world,
            lambda v, w: ways.stop_is_free(now, *self._driven_one(v, w), c.acc_lim_x, c.acc_lim_theta),
        )
        if command is None:
            return self._stand(
                *((DRIVING, '') if self._stage.take_over(now, self.goal, limits, ways) else (BLOCKED, text))
            )
        self.local_plan = to_global(poses, world)
        if self._grace(world, local) and world.worsens(self.local_plan):
            return self._stand(BLOCKED, 'the footprint touches an obstacle, and would touch more of it')
        command, slower = self._able_to_stop(dt, command, velocity, now, ways)
        text = slower or text
        self._last = command
        return LocalCommand(*command, text=text)

    # -- inside ------------------------------------------------------------------------------------------------

    def _stand(self, state, text=''):
        self._last = (0.0, 0.0)
        self.local_plan = None
        return LocalCommand(0.0, 0.0, state, text)

    def _face_plan(self, t, dt, now, local, velocity, plan, limits, ways):
        """Return the command (0, w) that turns a robot to its plan that swings about without getting on, else None.

        Distances in cells count a way askew as longer, so that with the plan behind no turn of sim_time may look better
        than none, and samples are chosen now to one side, now to the other.
        """
        if self._got_to is None or now.distance(self._got_to[0]) > STUCK_WAY:
            self._got_to = now, t
            self._facing = False
        off = wrap(towards_plan(plan, local) - local.yaw)
        if not self._facing:
            if t - self._got_to[1] < STUCK_TIME or abs(off) <= 2.0 * FACING or abs(velocity[0]) > limits.crawl:
                return None
            self._facing = True
            self._turn.begin()
        rate = self._turn.rate(t, dt, off, velocity[1], self._last[1], limits.turn, FACING)
        if rate is None or (rate and not ways.stop_is_free(now, 0.0, rate, limits.acc_lim_x, limits.acc_lim_theta)):
            self._facing, self._got_to = False, None
            return None
        return 0.0, rate

    def _able_to_stop(self, dt, command, velocity, now, ways):
        """Return the command, or a slower one and why: the base does not follow its samples to the letter, so whatever
        they promise, it must be able to stop from what it does now.
        """
        c, (v, w) = self.config, command
        if v * velocity[0] > 1e-4 and not ways.stop_is_free(now, *velocity, c.acc_lim_x, c.acc_lim_theta):
            v = rollout.towards(0.0, self._last[0], c.acc_lim_x, dt)
        if w * velocity[1] > 1e-3 and not ways.stop_is_free(now, 0.0, velocity[1], c.acc_lim_x, c.acc_lim_theta):
            w = rollout.towards(0.0, self._last[1], c.acc_lim_theta, dt)
        return (v, w), '' if (v, w) == command else 'slower: an obstacle is within the way to stop'

    def _choose(self, dt, pose, velocity, plan, cells, world, can_stop):
        """Return what ``_sample`` finds, looking less far ahead where nothing is possible that far: in a tight place
        the robot then still moves by inches. Failing that, what ``_last_resort`` has.
        """
        first = None
        for share in (1.0, 0.5, 0.25):
            command, poses, text = self._sample(
                dt, pose, velocity, plan, cells, world, share * self.config.sim_time, can_stop
            )
            if command is not None:
                return command, poses, text
            first = first or text
        return self._last_resort(pose, velocity, world, first)

    def _last_resort(self, pose, velocity, world, why):
        """Return the command, its poses and a text when no sample is possible, for the reason ``why``."""
        return None, None, why

    def _answering(self, velocity):
        """Return the speed (v, w), as commanded, that the base is on its way to: the last command, as far as it can
        have answered; a turn rate measured is ``self._gain`` of what was commanded.
        """
        seen_as_commanded = velocity[0], velocity[1] / self._gain.value
        return tuple(
            seen + min(max(last - seen, -a * ANSWER_TIME), a * ANSWER_TIME)
            for seen, last, a in zip(seen_as_commanded, self._last, (self.config.acc_lim_x, self.config.acc_lim_theta))
        )

    def _driven(self, samples):
        """Return what the base makes of commands (n, 2) of v, w: it turns ``self._gain`` of the rate."""
        return samples * np.array((1.0, self._gain.value))

    def _driven_one(self, v, w):
        """Return what the base makes of one command."""
        return float(v), float(w * self._gain.value)

    def _plan_near(self, now, world):
        """Return the plan (n, 3) around the robot in the costmap's frame; None when it is nowhere near.

        It reaches from the plan's point nearest to the robot as far as half the local costmap goes, ahead and, without
        prune_plan, behind. The peer begins with the first point of all that lies within: where the way comes near to an
        earlier part of itself, that leads back.
        """
        g = world.costmap.geometry
        if self._dense is None:
            self._dense, self._reached = map_grid.adjust_plan_resolution(self._plan, g.resolution), 0
        distance = np.hypot(*(self._dense[:, :2] - (now.x, now.y)).T)
        ahead = self._reached + math.ceil(PROGRESS_WINDOW / g.resolution)
        self._reached += int(distance[self._reached : ahead].argmin())
        if distance[self._reached] >= PRUNE_DISTANCE:
            self._reached = int(distance.argmin())
        near = distance <= 0.5 * g.resolution * max(g.width, g.height)
        behind = distance < PRUNE_DISTANCE if self.config.prune_plan else near
        if not behind[self._reached]:
            return None
        before = ~behind[self._reached :: -1]
        first = self._reached - (int(before.argmax()) - 1 if before.any() else self._reached)
        later = ~near[self._reached :]
        end = self._reached + (int(later.argmax()) + 1 if later.any() else len(later))
        return world.to_local(self._dense[first:end])

    def _ceiling(self, world, pose, reach, scale=1.0):
        """Return outline.cost_ceiling around the pose as far as ``reach`` (m) for the footprint times ``scale``."""
        g = world.costmap.geometry
        column, row = g.to_cell_unbounded(pose.x, pose.y)
        radius = scale * world.radius
        return outline.cost_ceiling(
            world.costmap.costs, column, row, math.ceil(reach / g.resolution) + 1, math.ceil(radius / g.resolution) + 1
        )

    def _window(self, world, state, samples, sim_time, ahead):
        """Return the cells x0, y0, xn, yn that trajectories may come to, and the points ``ahead`` (m) of them; see
        rollout.room_of.
        """
        g = world.costmap.geometry
        low_x, low_y, high_x, high_y = rollout.room_of(state, samples, sim_time, ahead)
        (x0, y0), (xn, yn) = g.to_cell_unbounded(low_x, low_y), g.to_cell_unbounded(high_x, high_y)
        return x0 - 1, y0 - 1, xn + 2, yn + 2

    def _grace(self, world, pose):
        """Return GRACE when the footprint touches something at a Pose2D of the costmap's frame, else 0."""
        return (
            GRACE
            if world.footprint_cost(pose.x, pose.y, pose.yaw) in (outline.HIT_LETHAL, outline.HIT_UNKNOWN)
            else 0.0
        )


def towards_plan(plan, pose):
    """Return the bearing (rad) of the plan's point half a metre from a Pose2D, ahead of the one nearest to it."""
    distance = np.hypot(*(plan[:, :2] - (pose.x, pose.y)).T)
    nearest = int(distance.argmin())
    far = distance[nearest:] >= 0.5
    x, y = plan[nearest + int(far.argmax()) if far.any() else -1, :2]
    return math.atan2(y - pose.y, x - pose.x)
