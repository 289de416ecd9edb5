"""What the two planners that sample velocities share: their plan, frames, goal and checks; the sampling is theirs.

As base_local_planner and dwa_local_planner do: the plan is cut to what lies within the local costmap, what is left
behind is dropped (prune_plan), and near the goal sampling gives way to stop-and-rotate (goal_stage.py).
"""

import math
from typing import Any

import numpy as np

from sara_common.planar import Pose2D, wrap
from sara_nav.grids import outline
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.free_motions import Ways
from sara_nav.planners.local_command import BLOCKED, DRIVING, FAILED, OFF_PATH, REACHED, LocalCommand
from sara_nav.sampled import map_grid
from sara_nav.sampled.goal_stage import DONE, Cycle, GoalStage
from sara_nav.sampled.in_place_turn import InPlaceTurn
from sara_nav.sampled.plan_section import PRUNE_DISTANCE, PlanSection, towards_plan
from sara_nav.sampled.published import to_global
from sara_nav.sampled.scene import Choice, Scene
from sara_nav.sampled.trajectory import Simulation, State, Terrain, room_of, towards
from sara_nav.sampled.turn_gain import TurnGain

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

    def __init__(self, config: Any):
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
        self._plan = None
        self._last = (0.0, 0.0)
        self._cloud = None
        self._waves = map_grid.Waves()

    @property
    def phase(self) -> str:
        """Name of the stage: follow path, face goal, approach goal, stop, turn to goal, done."""
        return self._stage.phase

    def reconfigure(self, config: Any) -> None:
        """Go on with another configuration (dynamic_reconfigure); raises ValueError when it is faulty."""
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(faults))
        self.config = config

    def start(self, plan: np.ndarray) -> None:
        """Begin a new goal: plan (n, 3) in the global frame, its last row the goal."""
        self._stage.begin()
        self._facing, self._got_to = False, None
        self._take(plan)

    def replan(self, plan: np.ndarray) -> None:
        """Take a better plan; when it leads to the same goal, what was reached (and latched) stays reached."""
        before = self.goal
        self._take(plan)
        if before is None or before.distance(self.goal) > 1e-6 or abs(before.yaw - self.goal.yaw) > 1e-6:
            self._stage.begin()

    def _take(self, plan):
        plan = np.asarray(plan, float).reshape(-1, 3)
        self.goal = Pose2D(*(float(v) for v in plan[-1]))
        self._plan = PlanSection(plan)

    def stop(self) -> None:
        """Forget the last command, because the robot was told to stop at once."""
        self._last = (0.0, 0.0)
        self.local_plan = None

    def update(
        self, t: float, dt: float, pose: Pose2D, velocity: tuple[float, float], pose_age: float, world: LocalWorld
    ) -> LocalCommand:
        """Return the LocalCommand for time t (s).

        dt: since the last command (s). pose: Pose2D in the global frame as it was pose_age seconds ago. velocity:
        measured (v, w). world: LocalWorld (costmap, footprint, to_local, offset, worsens).
        """
        now = pose.advance(velocity[0], velocity[1], pose_age)
        self._gain.update(dt, self._last[1], velocity[1])
        limits = self._limits(2.0 * world.costmap.geometry.resolution)
        cycle = Cycle(t, dt, now, velocity, self._last, self.goal, limits, Ways(world))
        command = self._at_goal(cycle)
        if command is not None:
            return command
        plan = self._plan.near(now, world, self.config.prune_plan)
        if plan is None:
            within = f'{PRUNE_DISTANCE:.1f} m (prune_plan)' if self.config.prune_plan else 'half the local costmap'
            return self._stand(OFF_PATH, f'the plan is nowhere within {within} of the robot')
        cells = map_grid.plan_cells(plan, world.costmap)
        if len(cells) == 0:
            return self._stand(OFF_PATH, 'no point of the plan lies in known cells of the local costmap')
        local = Pose2D(*(float(v) for v in world.to_local(np.array([[now.x, now.y, now.yaw]]))[0]))
        turn = self._face_plan(cycle, local, plan)
        if turn is not None:
            self._last, self.local_plan = turn, None
            return LocalCommand(*turn)
        scene = Scene(
            dt,
            local,
            self._answering(velocity),
            plan,
            cells,
            world,
            lambda v, w: self._stops_freely(cycle, *self._driven_one(v, w)),
        )
        return self._drive_on(cycle, scene)

    # -- inside ------------------------------------------------------------------------------------------------

    def _stand(self, state, text=''):
        self._last = (0.0, 0.0)
        self.local_plan = None
        return LocalCommand(0.0, 0.0, state, text)

    def _stops_freely(self, cycle, v, w):
        """Whether the robot could stop from a speed (m/s, rad/s) without touching anything."""
        return cycle.ways.stop_is_free(cycle.pose, v, w, self.config.acc_lim_x, self.config.acc_lim_theta)

    def _at_goal(self, cycle):
        """Return the LocalCommand of the end of a drive, None while the path is to be followed."""
        command = self._stage.update(cycle)
        failed = self._stage.failed(cycle.pose, cycle.goal)
        if failed:
            return self._stand(FAILED, failed)
        if self.phase == DONE:
            return self._stand(REACHED)
        if command is None:
            return None
        self.local_plan = None
        if command != (0.0, 0.0) and not self._stops_freely(cycle, *command):
            return self._stand(BLOCKED, f'an obstacle is in the way of the footprint while it is to {self.phase}')
        self._last = command
        return LocalCommand(*command)

    def _drive_on(self, cycle, scene):
        """Return the LocalCommand of what is chosen among the samples."""
        choice = self._choose(scene)
        if choice.command is None:
            return self._stand(*((DRIVING, '') if self._stage.take_over(cycle) else (BLOCKED, choice.text)))
        self.local_plan = to_global(choice.poses, scene.world)
        if self._grace(scene.world, scene.pose) and scene.world.worsens(self.local_plan):
            return self._stand(BLOCKED, 'the footprint touches an obstacle, and would touch more of it')
        command, slower = self._able_to_stop(cycle, choice.command)
        self._last = command
        return LocalCommand(*command, text=slower or choice.text)

    def _face_plan(self, cycle, local, plan):
        """Return the command (0, w) that turns a robot to its plan that swings about without getting on, else None.

        Distances in cells count a way askew as longer, so that with the plan behind no turn of sim_time may look better
        than none, and samples are chosen now to one side, now to the other.
        """
        t, now, limits = cycle.t, cycle.pose, cycle.limits
        if self._got_to is None or now.distance(self._got_to[0]) > STUCK_WAY:
            self._got_to = now, t
            self._facing = False
        off = wrap(towards_plan(plan, local) - local.yaw)
        if not self._facing:
            drives = abs(cycle.velocity[0]) > limits.crawl
            if t - self._got_to[1] < STUCK_TIME or abs(off) <= 2.0 * FACING or drives:
                return None
            self._facing = True
            self._turn.begin()
        rate = self._turn.rate(t, cycle.dt, off, cycle.rates, limits.turn, FACING)
        if rate is None or (rate and not self._stops_freely(cycle, 0.0, rate)):
            self._facing, self._got_to = False, None
            return None
        return 0.0, rate

    def _able_to_stop(self, cycle, command):
        """Return the command, or a slower one and why: the base does not follow its samples to the letter, so whatever
        they promise, it must be able to stop from what it does now.
        """
        c, (v, w), (driven_v, driven_w) = self.config, command, cycle.velocity
        if v * driven_v > 1e-4 and not self._stops_freely(cycle, driven_v, driven_w):
            v = towards(0.0, cycle.last[0], c.acc_lim_x, cycle.dt)
        if w * driven_w > 1e-3 and not self._stops_freely(cycle, 0.0, driven_w):
            w = towards(0.0, cycle.last[1], c.acc_lim_theta, cycle.dt)
        return (v, w), '' if (v, w) == command else 'slower: an obstacle is within the way to stop'

    def _choose(self, scene):
        """Return the Choice of ``_sample``, looking less far ahead where nothing is possible that far: in a tight place
        the robot then still moves by inches. Failing that, what ``_last_resort`` has.
        """
        first = None
        for share in (1.0, 0.5, 0.25):
            choice = self._sample(scene, share * self.config.sim_time)
            if choice.command is not None:
                return choice
            first = first or choice.text
        return self._last_resort(scene, first)

    def _last_resort(self, _scene, why):
        """Return the Choice when no sample is possible, for the reason ``why``."""
        return Choice(None, None, why)

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

    def _simulation(self, sim_time):
        """Return the Simulation of trajectories over a time (s)."""
        c = self.config
        return Simulation(sim_time, c.sim_granularity, c.angular_sim_granularity, c.acc_lim_x, c.acc_lim_theta)

    def _state(self, scene):
        """Return the State that trajectories begin with."""
        return State(scene.pose.x, scene.pose.y, scene.pose.yaw, *self._driven_one(*scene.velocity))

    def _terrain(self, scene, state, samples, sim_time, scale=1.0):
        """Return the Terrain for samples (n, 2) driven from a State; the footprint grows up to ``scale``."""
        world, g = scene.world, scene.world.costmap.geometry
        reach = sim_time * max(abs(state.v), float(np.abs(samples[:, 0]).max(initial=0.0)))
        column, row = g.to_cell_unbounded(scene.pose.x, scene.pose.y)
        ceiling = outline.cost_ceiling(
            world.costmap.costs,
            column,
            row,
            math.ceil(reach / g.resolution) + 1,
            math.ceil(scale * world.radius / g.resolution) + 1,
        )
        return Terrain(world.costmap.costs, g.grid, world.footprint, ceiling, self._grace(world, scene.pose))

    def _window(self, world, state, samples, sim_time, ahead):
        """Return the cells x0, y0, xn, yn that trajectories may come to, and the points ``ahead`` (m) of them; see
        room_of.
        """
        g = world.costmap.geometry
        low_x, low_y, high_x, high_y = room_of(state, samples, sim_time, ahead)
        (x0, y0), (xn, yn) = g.to_cell_unbounded(low_x, low_y), g.to_cell_unbounded(high_x, high_y)
        return x0 - 1, y0 - 1, xn + 2, yn + 2

    def _grace(self, world, pose):
        """Return GRACE when the footprint touches something at a Pose2D of the costmap's frame, else 0."""
        return (
            GRACE
            if world.footprint_cost(pose.x, pose.y, pose.yaw) in (outline.HIT_LETHAL, outline.HIT_UNKNOWN)
            else 0.0
        )
