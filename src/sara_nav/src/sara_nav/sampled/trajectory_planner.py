"""base_local_planner/TrajectoryPlannerROS: trajectory rollout for a robot with differential drive.

Every cycle vx_samples x vtheta_samples speeds and vtheta_samples turns in place are rolled out and scored together
(rollout.py); the cheapest is driven. Turns in place are preferred where they look nearer to the goal; a turn begun is
not turned back before the robot has moved on; when nothing is possible the robot backs out slowly (escape_vel).
Method: Gerkey and Konolige, "Planning and control in unstructured terrain" (2008); parameters and their values in force
are those of the C++ peer.
"""

import math
from typing import NamedTuple

import numpy as np

from sara_common.planar import wrap
from sara_nav.grids.polygon import footprint_cells
from sara_nav.planners.local_command import LOCAL_PLANNERS
from sara_nav.sampled import rollout
from sara_nav.sampled.goal_stage import GoalLimits
from sara_nav.sampled.plan_section import towards_plan
from sara_nav.sampled.published import cost_cloud, to_global
from sara_nav.sampled.sampling_planner import FACING, TRIES, SamplingPlanner
from sara_nav.sampled.scene import Choice
from sara_nav.sampled.speed_samples import rollout_samples
from sara_nav.sampled.trajectory import State, towards
from sara_nav.sampled.trajectory_planner_config import TrajectoryPlannerConfig

STOPPED = 0.01
"""Speed (m/s, rad/s) below which the robot stands, fixed as in the peer."""


class Scored(NamedTuple):
    """Samples (n, 2), of which the first ``forward`` drive forward and the last stands still; their costs (n,) and the
    poses (n, 3) that they end at.
    """

    samples: np.ndarray
    forward: int
    cost: np.ndarray
    ends: np.ndarray


@LOCAL_PLANNERS.register('base_local_planner/TrajectoryPlannerROS')
class TrajectoryPlanner(SamplingPlanner):
    """Drives a plan by trajectory rollout; see the module. One object drives one goal after the other."""

    config_class = TrajectoryPlannerConfig

    def __init__(self, config: TrajectoryPlannerConfig = TrajectoryPlannerConfig()):
        super().__init__(config)
        self._forget()

    def start(self, plan: np.ndarray) -> None:
        """Begin a new goal: plan (n, 3) in the global frame, its last row the goal."""
        super().start(plan)
        self._forget()

    def _forget(self):
        self._turned = {-1: False, 1: False}
        self._only = {-1: False, 1: False}
        self._turned_at = None
        self._escape_from = None

    def _limits(self, blind):
        c = self.config
        return GoalLimits(
            c.xy_goal_tolerance,
            c.yaw_goal_tolerance,
            c.latch_xy_goal_tolerance,
            c.max_vel_x,
            min(c.max_vel_theta, max(-c.min_vel_theta, c.min_in_place_vel_theta)),
            c.min_in_place_vel_theta,
            c.acc_lim_x,
            c.acc_lim_theta,
            STOPPED,
            STOPPED,
            c.max_vel_x * c.sim_time + c.xy_goal_tolerance,
            blind,
        )

    # -- one cycle ---------------------------------------------------------------------------------------------

    def _sample(self, scene, sim_time):
        """Return the Choice among the samples; sim_time (s): how far to look."""
        c, pose = self.config, scene.pose
        state, simulation = self._state(scene), self._simulation(sim_time)
        samples, forward = self._speeds(scene)
        if self._escape_from is not None:
            samples, forward = samples[forward:], 0
        cost, ends, goal = self._score(scene, state, self._driven(samples), simulation)
        self._update_escape(pose)
        bearing = towards_plan(scene.plan, pose)
        for _ in range(TRIES):
            best = self._best(Scored(samples, forward, cost, ends), goal, scene.world.costmap.geometry, bearing)
            if best is None:
                return Choice(None, None, _why_none(cost))
            sample = tuple(float(v) for v in samples[best])
            command = self._within_reach(sample, scene.velocity, scene.dt)
            if scene.can_stop(*command):
                self._remember_turn(sample, pose)
                poses = rollout.roll(state, self._driven_one(*sample), simulation, c.heading_scoring)
                return Choice(command, poses)
            cost[best] = rollout.COLLIDES
        return Choice(None, None, 'the footprint would touch an obstacle before the robot could stop')

    def _score(self, scene, state, samples, simulation):
        """Return (cost (n,), end pose (n, 3), distances to the local goal) of samples (n, 2) as they are driven."""
        c, g = self.config, scene.world.costmap.geometry
        cells, under = scene.cells, footprint_cells(scene.pose, scene.world.footprint, g, True)
        scale = g.resolution if c.meter_scoring else 1.0
        weights = (scale * c.path_distance_bias, scale * c.goal_distance_bias, c.occdist_scale)
        self._cloud = scene.world, cells, weights, under
        terrain = self._terrain(scene, state, samples, simulation.time)
        window = self._window(scene.world, state, samples, simulation.time, c.heading_lookahead)
        self._waves.over(terrain.costs)
        path, goal = self._waves.spread(cells, under, window), self._waves.spread(cells[-1:], under[:0], window)
        scoring = rollout.Scoring(
            *weights,
            c.simple_attractor,
            (float(scene.plan[-1, 0]), float(scene.plan[-1, 1])),
            c.heading_scoring,
            c.heading_scoring_timestep,
        )
        distances = rollout.Distances(path, goal, cells)
        cost, ends = rollout.score(terrain, distances, state, samples, simulation, scoring)
        return cost, ends, goal

    def _speeds(self, scene):
        """Return what speed_samples.rollout_samples does."""
        c, velocity = self.config, scene.velocity
        ahead = min(c.max_vel_x, scene.left / c.sim_time)
        reach = 1.0 / c.controller_frequency if c.dwa else c.sim_time
        fast = max(min(ahead, velocity[0] + c.acc_lim_x * reach), c.min_vel_x)
        slow = min(max(c.min_vel_x, velocity[0] - c.acc_lim_x * reach), fast)
        left = min(c.max_vel_theta, velocity[1] + c.acc_lim_theta * reach)
        right = min(max(c.min_vel_theta, velocity[1] - c.acc_lim_theta * reach), left)
        return rollout_samples(
            (float(slow), float(fast)),
            (float(right), float(left)),
            (c.vx_samples, c.vtheta_samples),
            float(c.min_in_place_vel_theta),
        )

    def _best(self, scored, goal, geometry, bearing):
        """Return the index of the sample to drive, None when none is worth it; the last sample is standing still.

        Among forward samples the cheapest; a turn in place that costs no more and is not barred is preferred, the one
        after which the point heading_lookahead ahead is nearest to the goal. Where nothing forward is cheaper than
        standing, the turn that comes nearest to facing the plan (bearing, rad), at any cost: beside a wall turns cost
        more than standing, and cells count a way askew as longer. A robot that faces its plan already drives on, at
        whatever cost: where the plan bends away, every way may for a moment cost more than standing.
        """
        samples, forward, cost, ends = scored
        possible = cost[:forward] >= 0.0
        best = int(np.where(possible, cost[:forward], np.inf).argmin()) if possible.any() else None
        turns = [
            i
            for i in range(forward, len(samples) - 1)
            if cost[i] >= 0.0 and not self._only[-1 if samples[i, 1] > 0.0 else 1]
        ]
        if best is not None and not 0.0 <= cost[-1] <= cost[best]:
            turns = [i for i in turns if cost[i] <= cost[best]]
            ahead = [self._ahead(ends[i], goal, geometry) for i in turns]
            return turns[int(np.argmin(ahead))] if turns and np.isfinite(min(ahead)) else best
        off = wrap(bearing - ends[-1, 2])
        if abs(off) <= FACING:
            return best
        left = {
            i: abs(off - wrap(ends[i, 2] - ends[-1, 2])) if samples[i, 1] * off > 0.0 else math.pi + abs(samples[i, 1])
            for i in turns
        }
        return min(left, key=left.get) if left else None

    def _ahead(self, pose, goal, geometry):
        """Return the distance to the goal (cells) of the point heading_lookahead ahead of pose (3,); infinite off the
        map.
        """
        cell = geometry.to_cell(
            pose[0] + self.config.heading_lookahead * math.cos(pose[2]),
            pose[1] + self.config.heading_lookahead * math.sin(pose[2]),
        )
        return np.inf if cell is None else goal[cell[1], cell[0]]

    def _within_reach(self, sample, velocity, dt):
        """Return the command (v, w) that begins a sample as it was rolled out: no faster than the accelerations allow,
        but a turn in place no slower than its minimum."""
        c = self.config
        v = towards(sample[0], float(velocity[0]), c.acc_lim_x, dt)
        w = towards(sample[1], float(velocity[1]), c.acc_lim_theta, dt)
        if sample[0] == 0.0 and w * sample[1] >= 0.0 and abs(w) < c.min_in_place_vel_theta:
            w = math.copysign(c.min_in_place_vel_theta, sample[1])
        return v, w

    def _remember_turn(self, sample, pose):
        """Bar turning back after two cycles of turning to one side, until the robot has moved on."""
        if sample[0] <= 0.0 and sample[1] != 0.0:
            side = 1 if sample[1] > 0.0 else -1
            self._only[side] |= self._turned[side]
            self._turned[side] = True
            self._turned_at = pose
        if self._turned_at is not None and pose.distance(self._turned_at) > self.config.oscillation_reset_dist:
            self._turned = {-1: False, 1: False}
            self._only = {-1: False, 1: False}

    def _update_escape(self, pose):
        if self._escape_from is not None and (
            pose.distance(self._escape_from) > self.config.escape_reset_dist
            or abs(wrap(pose.yaw - self._escape_from.yaw)) > self.config.escape_reset_theta
        ):
            self._escape_from = None

    def _last_resort(self, scene, why):
        """Back out slowly, once the robot stands, where that touches nothing that is not touched already.

        Only when trajectories are blocked: not when standing still is best or no way leads to the goal.
        """
        c, pose, velocity = self.config, scene.pose, scene.velocity
        if 'footprint' not in why or velocity[0] > abs(c.escape_vel):
            return Choice(None, None, why)
        state = State(pose.x, pose.y, pose.yaw, float(velocity[0]), float(velocity[1]))
        poses = rollout.roll(state, (c.escape_vel, 0.0), self._simulation(c.sim_time), False)
        if scene.world.worsens(to_global(poses, scene.world)):
            return Choice(None, None, why)
        if self._escape_from is None:
            self._escape_from = pose
        text = 'backing out with escape_vel: every other trajectory is blocked'
        return Choice((c.escape_vel, 0.0), poses, text)

    # -- for publishing ----------------------------------------------------------------------------------------

    @property
    def cost_cloud(self) -> np.ndarray | None:
        """Points (n, 7) x, y, z (m, costmap's frame), path, goal, occupancy and total cost of the cells that can be
        driven to, from the last cycle that sampled; None before. Worked out when asked for."""
        return None if self._cloud is None else cost_cloud(*self._cloud)


def _why_none(cost):
    """Return in words why no sample, of these costs, is worth driving; the last one is standing still."""
    if cost[-1] == rollout.NO_WAY:
        return 'no way leads from here to where the plan leaves the local costmap'
    if (cost[:-1] < 0.0).all():
        return 'the footprint would touch an obstacle on every trajectory'
    return 'standing still costs no more than any trajectory'
