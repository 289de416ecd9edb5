"""dwa_local_planner/DWAPlannerROS: the dynamic window approach for a robot with differential drive.

Every cycle the speeds that can be reached within one period are rolled out at constant speed and judged by seven
critics (critics.py); the cheapest is driven. Method: Fox, Burgard and Thrun, "The dynamic window approach to collision
avoidance" (1997); parameters, their defaults and the critics are those of the C++ peer.
"""

import math

import numpy as np

from sara_nav.planners.local_command import LOCAL_PLANNERS
from sara_nav.sampled import critics, map_grid
from sara_nav.sampled.critics import OscillationFlags
from sara_nav.sampled.dwa_planner_config import DWAPlannerConfig
from sara_nav.sampled.goal_stage import GoalLimits
from sara_nav.sampled.published import cost_cloud
from sara_nav.sampled.sampling_planner import TRIES, SamplingPlanner
from sara_nav.sampled.scene import Choice
from sara_nav.sampled.speed_samples import window_samples

NONE = np.empty((0, 2), np.int64)
"""No cells."""


@LOCAL_PLANNERS.register('dwa_local_planner/DWAPlannerROS')
class DWAPlanner(SamplingPlanner):
    """Drives a plan by the dynamic window; see the module. One object drives one goal after the other."""

    config_class = DWAPlannerConfig

    def __init__(self, config: DWAPlannerConfig = DWAPlannerConfig()):
        super().__init__(config)
        self._flags = OscillationFlags()
        self._judged = None

    def start(self, plan: np.ndarray) -> None:
        """Begin a new goal: plan (n, 3) in the global frame, its last row the goal."""
        super().start(plan)
        self._flags = OscillationFlags()

    @property
    def _fastest(self):
        c = self.config
        return min(c.max_vel_x, c.max_vel_trans) if c.max_vel_trans >= 0.0 else c.max_vel_x

    def _limits(self, blind):
        c = self.config
        fast = self._fastest
        return GoalLimits(
            c.xy_goal_tolerance,
            c.yaw_goal_tolerance,
            c.latch_xy_goal_tolerance,
            fast,
            c.max_vel_theta,
            max(c.min_vel_theta, 0.01),
            c.acc_lim_x,
            c.acc_lim_theta,
            c.trans_stopped_vel,
            c.theta_stopped_vel,
            fast * c.sim_time + c.xy_goal_tolerance,
            blind,
            min(max(c.min_vel_trans, 0.03), fast),
        )

    # -- one cycle ---------------------------------------------------------------------------------------------

    def _sample(self, scene, sim_time):
        """Return the Choice among the samples; sim_time (s): how far to look."""
        c, resolution = self.config, scene.world.costmap.geometry.resolution
        state, simulation = self._state(scene), self._simulation(sim_time)
        samples = self._driven(self._speeds(scene.velocity, scene.left))
        weights = self._weights(resolution, scene.left)
        raw, driven = self._judge(scene, state, samples, simulation)
        raw[self._flags.barred(driven), critics.OSCILLATION] = critics.TURNS_BACK
        cost = critics.total(raw, weights)
        self._cloud = scene.world, scene.cells, (weights[critics.PATH], weights[critics.GOAL], c.occdist_scale), NONE
        self._judged = state, samples, simulation, cost
        possible = cost >= 0.0
        if not possible.any():
            self._flags = OscillationFlags()  # to be barred from the only way out is worse than to swing
            return Choice(None, None, _why_none(cost))
        cheapest = np.flatnonzero(possible)[np.argsort(cost[possible], kind='stable')]
        for best in cheapest[:TRIES]:
            v, w = float(driven[best, 0]), float(driven[best, 1]) / self._gain.value
            if scene.can_stop(v, w):
                moved = c.oscillation_reset_dist, c.oscillation_reset_angle
                self._flags.update(scene.pose, v, w, c.min_vel_trans, *moved)
                return Choice((v, w), critics.drive(state, tuple(samples[best]), simulation, not c.use_dwa))
        return Choice(None, None, 'the footprint would touch an obstacle before the robot could stop')

    def _judge(self, scene, state, samples, simulation):
        """Return what critics.judge does."""
        c = self.config
        terrain = self._terrain(scene, state, samples, simulation.time, 1.0 + c.max_scaling_factor)
        window = self._window(scene.world, state, samples, simulation.time, c.forward_point_distance)
        self._waves.over(terrain.costs)
        ends = scene.cells, scene.cells[-1:], self._front_cell(scene)
        distances = critics.Distances(*(self._waves.spread(seeds, NONE, window) for seeds in ends))
        rules = critics.Rules(
            c.scaling_speed,
            max(self._fastest, 1e-3, c.scaling_speed),
            c.max_scaling_factor,
            c.forward_point_distance,
            not c.use_dwa,
            c.sum_scores,
        )
        return critics.judge(terrain, distances, state, samples, simulation, rules)

    def _front_cell(self, scene):
        """Return the local goal's cell (1, 2) for the point ahead: beyond the goal, away from the robot."""
        pose, plan, cells, costmap = scene.pose, scene.plan, scene.cells, scene.world.costmap
        end = map_grid.plan_cells(plan[-1:], costmap)
        if len(end) == 0 or (end[-1] != cells[-1]).any():
            return cells[-1:]  # the plan leaves the map before
        ahead = math.atan2(plan[-1, 1] - pose.y, plan[-1, 0] - pose.x)
        beyond = plan[-1, :2] + self.config.forward_point_distance * np.array([math.cos(ahead), math.sin(ahead)])
        return map_grid.plan_cells([plan[-1, :2], beyond], costmap)[-1:]

    def _weights(self, resolution, left):
        """Return the weights (7,) of the critics; alignment has no say near the goal (cheat_factor)."""
        c = self.config
        path, goal = resolution * c.path_distance_bias, resolution * c.goal_distance_bias
        aligned = left * left > c.forward_point_distance**2 * c.cheat_factor
        return np.array([1.0, c.occdist_scale, goal, path if aligned else 0.0, path, goal, c.twirling_scale])

    def _speeds(self, velocity, left):
        """Return the samples (n, 2) of v, w: a grid over the window, without those slower than both minimums.

        Where the window is too small to reach min_vel_trans or min_vel_theta from rest, those are sampled too: slower
        speeds are not driven, so nothing else could begin.
        """
        c = self.config
        reach = 1.0 / c.controller_frequency if c.use_dwa else c.sim_time
        fast = self._fastest if c.use_dwa else max(min(self._fastest, left / c.sim_time), c.min_vel_x)
        v_high = max(min(fast, velocity[0] + c.acc_lim_x * reach), c.min_vel_x)
        v_low = min(max(c.min_vel_x, velocity[0] - c.acc_lim_x * reach), v_high)
        w_high = max(min(c.max_vel_theta, velocity[1] + c.acc_lim_theta * reach), -c.max_vel_theta)
        w_low = min(max(-c.max_vel_theta, velocity[1] - c.acc_lim_theta * reach), w_high)
        return window_samples(
            (float(v_low), float(v_high)),
            (float(w_low), float(w_high)),
            (c.vx_samples, c.vth_samples),
            (float(c.min_vel_trans), float(c.min_vel_theta)),
            float(self._fastest),
        )

    # -- for publishing ----------------------------------------------------------------------------------------

    @property
    def cost_cloud(self) -> np.ndarray | None:
        """Points (n, 7) as TrajectoryPlanner.cost_cloud has them; the shell publishes it with publish_cost_grid_pc."""
        return None if self._cloud is None else cost_cloud(*self._cloud)

    @property
    def trajectory_cloud(self) -> np.ndarray | None:
        """Points (n, 5) x, y, z (m, costmap's frame), yaw (rad), cost of all samples of the last cycle that were not
        discarded; None before. The shell publishes it with publish_traj_pc."""
        if self._judged is None:
            return None
        state, samples, simulation, cost = self._judged
        clouds = [np.empty((0, 5))]
        for sample, value in zip(samples, cost):
            if value >= 0.0:
                poses = critics.drive(state, tuple(sample), simulation, not self.config.use_dwa)
                clouds.append(
                    np.column_stack([poses[:, :2], np.zeros(len(poses)), poses[:, 2], np.full(len(poses), value)])
                )
        return np.vstack(clouds)


def _why_none(cost):
    """Return in words why all samples, with these costs, were discarded."""
    reasons = {
        critics.TOUCHES: 'the footprint would touch an obstacle',
        critics.LEAVES_MAP: 'it leaves the map',
        critics.IN_OBSTACLE: 'the centre would come too near to an obstacle',
        critics.UNREACHABLE: 'no way leads to the goal',
        critics.LOOKS_OFF_MAP: 'the point ahead leaves the map',
        critics.TURNS_BACK: 'it turns back (oscillation)',
    }
    if len(cost) == 0:
        return 'no speed can be sampled within the limits'
    codes, counts = np.unique(cost, return_counts=True)
    return (
        f'all {len(cost)} trajectories are discarded: '
        f'{", ".join(f"{n} because {reasons[code]}" for code, n in zip(codes, counts))}'
    )
