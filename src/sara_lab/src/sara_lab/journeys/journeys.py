"""Journeys: each local planner drives from ten starts to ten goals on each map, in lockstep, localized by the true
pose.

So planners are judged apart from localization. SARA's own drives as it does on the chair. For the classic planners the
range layer is off, whose cones of 60 degrees close doors of 0.80 m to them, and so are the safety gate's distance
zones, which stop a chair for good that enters a door aslant. The chair is to come to the goal within the planner's own
tolerances, and to touch nothing. Starts and goals are drawn once for a map, the same for every planner.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from sara_bringup.lockstep.lockstep import Lockstep, LockstepError
from sara_bringup.paths import share
from sara_common.files import merged
from sara_common.planar import Pose2D, wrap
from sara_common.platforms import parameters
from sara_lab.journeys.travel import Recorder, reach
from sara_lab.judge.judge import judge
from sara_lab.judge.motion import Motion
from sara_nav.costmaps.costmap import InflationConfig, build
from sara_nav.maps import map_io
from sara_nav.planners.navfn import NavfnROS
from sara_nav.planners.planning import PlanError, distances_along

MAPS = {'school': 8.0, 'flat': 3.0, 'hall': 8.0}  # name: m, the shortest way from a start to its goal that is drawn
PAIRS = 10
TURNING_RADIUS = 0.76  # m: nearer to a wall, the safety gate does not let the chair turn in place (docs/safety.md)
CLEARANCE = 0.05  # m, more than that at a start and at a goal
RUN_UP = (
    1.0  # m of the way before a goal and after a start where the chair can still turn: nobody asks it to stop in a door
)
INSCRIBED_RADIUS = 0.30  # m, of the footprint with its padding
PACE, PATIENCE_S = 0.15, 60.0  # a journey may take its way at so many m/s, and so long besides


@dataclass(frozen=True)
class Planner:
    """A local planner as a launch file would set it up: `file` of config/, laid over sara_nav.yaml; "": that alone.
    `short`: its section there.
    `sonars`: whether it is driven with the range layer and the safety gate's distance zones. `over`: a tree laid over
    the file's.
    """

    short: str
    file: str
    sonars: bool = False
    over: dict = None

    @property
    def navigation(self) -> dict:
        """The tree of parameters that is laid over sara_nav.yaml's."""
        own = merged(parameters('sara_bringup', self.file) if self.file else {}, self.over or {})
        return own if self.sonars else merged(own, NO_RANGES)

    def prepare(self, lockstep: Lockstep) -> None:
        """Take the distance zones, and the caution that goes by the same sonars, off a Lockstep that is to drive
        without them.
        """
        if not self.sonars:
            take_zones_off(lockstep)

    @property
    def tolerances(self) -> tuple[float, float]:
        """(xy_goal_tolerance m, yaw_goal_tolerance rad), as they are set."""
        own = {**parameters('sara_nav', 'sara_nav.yaml').get(self.short, {}), **self.navigation.get(self.short, {})}
        return own['xy_goal_tolerance'], own['yaw_goal_tolerance']


def take_zones_off(lockstep: Lockstep) -> None:
    """The safety gate lets a Lockstep's commands pass whatever the sonars hear."""
    zones = lockstep.wheels.guard.zones
    zones.scale = lambda *_command, **_how: (1.0, '')
    zones.caution_factor = lambda *_command: 1.0


NO_RANGES = {layers: {'ultrasonic': {'enabled': False}} for layers in ('global_costmap', 'local_costmap')}
PLANNERS = {
    'default': Planner('RotateThenPursue', '', sonars=True),
    **{
        planner.short: planner
        for planner in (
            Planner('RotateThenPursue', 'rotate_then_pursue.yaml', sonars=True),
            Planner('TrajectoryPlannerROS', 'trajectory_planner.yaml'),
            Planner('DWAPlannerROS', 'dwa_planner.yaml'),
        )
    },
}


@dataclass(frozen=True)
class Outcome:
    """What came of a journey. `way`: m from start to goal along the plan; `driven`: m; errors of the true pose, m and
    rad; `turned`: rad, all turns added up.
    `judgement`: a Judgement, None where the chair did not come up.
    """

    map: str
    planner: str
    number: int
    start: tuple
    goal: tuple
    way: float
    reached: bool
    text: str
    seconds: float
    driven: float
    turned: float
    position_error: float
    yaw_error: float
    contacts: int
    judgement: object = None

    @property
    def faults(self) -> list[str]:
        """What is not as it should be, one sentence each."""
        xy, yaw = PLANNERS[self.planner].tolerances
        result = [] if self.reached else [f'not reached: {self.text}']
        if self.reached and not self.position_error <= xy:
            result.append(f'{self.position_error:.3f} m from the goal, xy_goal_tolerance is {xy:g}')
        if self.reached and not abs(self.yaw_error) <= yaw:
            result.append(f"{self.yaw_error:+.3f} rad from the goal's yaw, yaw_goal_tolerance is {yaw:g}")
        return result + ([f'{self.contacts} contacts'] if self.contacts else [])

    def to_json(self) -> dict[str, Any]:
        """All as plain data."""
        return {**asdict(self), 'judgement': self.judgement and self.judgement.to_json(), 'faults': self.faults}


def map_file(name: str) -> Path:
    """Path of a map's YAML file."""
    return share() / 'maps' / f'{name}.yaml'


@cache
def journeys(name: str) -> list[tuple[tuple[float, float, float], tuple[float, float, float], float]]:
    """The PAIRS (start, goal, way) of a map: poses (x, y, yaw) about which the chair can turn, m from one to the other
    along navfn's plan.
    """
    grid = map_io.load_map(str(map_file(name)))
    size, random = grid.geometry.resolution, np.random.default_rng([sum(name.encode()), 2026])
    free = size * ndimage.distance_transform_edt(grid.data == map_io.FREE)
    room = np.argwhere(free > TURNING_RADIUS + CLEARANCE)
    costmap = build(grid, INSCRIBED_RADIUS, inflation=InflationConfig(0.75, 4.0))
    planner, found = NavfnROS(), []
    while len(found) < PAIRS:
        start, goal = (
            Pose2D(*grid.geometry.to_world(int(column), int(row)), float(random.uniform(-math.pi, math.pi)))
            for row, column in room[random.integers(len(room), size=2)]
        )
        try:
            plan = planner.plan(costmap, start, goal)
        except PlanError:
            continue
        along = distances_along(plan)
        way = float(along[-1])
        ends = plan[(along < RUN_UP) | (along > way - RUN_UP)]
        cells = [grid.geometry.to_cell(x, y) for x, y, _ in ends.tolist()]
        if way >= MAPS[name] and min(free[row, column] for column, row in cells) > TURNING_RADIUS:
            found.append(((start.x, start.y, start.yaw), (goal.x, goal.y, goal.yaw), way))
    return tuple(found)


def drive(
    name: str,
    planner: str | Planner,
    number: int,
    watch: Callable[[Lockstep], None] | None = None,
    sonars: bool | None = None,
) -> Outcome:
    """Drive journey `number` of a map with a planner (a name of PLANNERS, or a Planner); the chair is drawn by the
    number. Returns the Outcome.

    `watch`, if given, is called with the Lockstep after each step. `sonars`: whether range layer and distance zones
    act,
    None: as it is set for the planner.
    """
    start, goal, way = journeys(name)[number]
    how, planner = (planner, planner.short) if isinstance(planner, Planner) else (PLANNERS[planner], planner)
    how = how if sonars is None else replace(how, sonars=sonars)
    lockstep = Lockstep(map_file(name), start, number, localization='fake', navigation=how.navigation)
    how.prepare(lockstep)
    try:
        lockstep.start_up()
    except LockstepError as error:
        return Outcome(name, planner, number, start, goal, way, False, str(error), 0.0, 0.0, 0.0, math.nan, math.nan, 0)
    recorder = Recorder(lockstep, watch)
    ended, _ = reach(recorder, goal, PATIENCE_S + way / PACE)
    ended = replace(ended, shortest=way)
    track, last = recorder.track([ended]), lockstep.chair.pose
    motion = Motion.of(track.t, track.pose)
    return Outcome(
        name,
        planner,
        number,
        start,
        goal,
        way,
        ended.reached,
        ended.text,
        ended.ended - ended.given,
        float(motion.driven[-1]),
        float(np.abs(np.diff(motion.yaw)).sum()),
        math.dist(last[:2], goal[:2]),
        wrap(last[2] - goal[2]),
        lockstep.chair.contacts,
        judge(track, lockstep.chair.drive.world),
    )
