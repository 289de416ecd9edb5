"""The simulated chair explores a map with its laser scanner, in lockstep: slam_gmapping draws the map as the chair
drives, `explore` chooses where to, move_base drives there by that map.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from sara_bringup.lockstep.localization import Estimate, Filter
from sara_bringup.lockstep.lockstep import Lockstep
from sara_common.files import merged
from sara_common.planar import Pose2D, compose
from sara_common.platforms import chosen, parameters
from sara_lab.journeys.travel_cases import grid_of, map_file, random_of, roomy_pose
from sara_lab.judge import walls
from sara_lab.studies.kept_arrays import arrays_of, kept_arrays, map_of
from sara_lab.studies.map_drives import Drive
from sara_lab.studies.map_trial import Track, slam_of
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.scan_input import ScanInput
from sara_nav.costmaps.costmap import Costmap, static_costs
from sara_nav.goals.move_base_config import SUCCEEDED
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import OCCUPIED, UNKNOWN, GridMap
from sara_nav.planners.planning import path_length
from sara_sim.chips.scanner import Scan, optics_at, sweep_of
from sara_sim.world.world import World
from sara_slam.exploring.explore_config import ExploreConfig
from sara_slam.exploring.explorer import Explorer
from sara_slam.exploring.orders import Drive as DriveTo
from sara_slam.exploring.orders import State
from sara_slam.mapping.slam import Slam

LONGEST_S = 3600.0
KEPT_S = 2.0
"""s of odometry that scans are placed by."""
Pose = tuple[float, float, float]


class Mapping(Estimate):
    """Localization by the map that is being made, as mapping.launch has it. `reckoned`: the Filter that tells the
    odometry; `slam`: the map builder.
    """

    def __init__(self, reckoned: Filter, slam: Slam) -> None:
        super().__init__()
        self._reckoned, self.slam = reckoned, slam
        self.on_imu, self.on_range, self.on_odometry = reckoned.on_imu, reckoned.on_range, reckoned.on_odometry
        self._poses: list[tuple[float, float, float, float]] = []
        self._waiting: list[Scan] = []
        mount = chosen().scan
        self._optics, self._mount = optics_at(mount), Transform.from_xyz_rpy(mount.x, mount.y, 0.0, yaw=mount.yaw)

    def on_scan(self, scan: Scan) -> None:
        """A sweep that has ended; it is used once the odometry at its last ray is known."""
        self._waiting.append(scan)

    def step(self, now: float) -> bool:
        """See Filter."""
        known = self._reckoned
        if not known.step(now):
            return False
        if not self._poses or known.stamp > self._poses[-1][0]:
            self._poses.append((known.stamp, *known.pose))
        self._use_scans()
        offset = self.slam.map_from_odom
        self.pose, self.velocity, self.stamp = compose(offset, known.pose), known.velocity, known.stamp
        self.map_from_odom = known.map_from_odom and compose(offset, known.map_from_odom)
        return True

    def _use_scans(self):
        newest = self._poses[-1][0]
        self._poses = [row for row in self._poses if row[0] >= newest - KEPT_S]
        while self._waiting:
            sweep = sweep_of(self._waiting[0], self._optics)
            if sweep.stamp + sweep.duration >= newest:
                return
            self._waiting.pop(0)
            ends = Track(np.array(self._poses)).during(sweep.stamp, sweep.duration)
            if ends is not None:
                begun, ended = (Transform.from_xyz_rpy(*pose[:2], 0.0, yaw=pose[2]) for pose in ends)
                self.slam.on_scan(ScanInput('scan', sweep, self._mount, begun, ended))


class Frame(NamedTuple):
    """A moment of an exploration: s since it began, m driven, the map, the way (n, 2) m, the chair's pose, and the
    middles (k, 2) m and cells (c, 2) m of the frontiers.
    """

    seconds: float
    way: float
    grid: GridMap
    trail: np.ndarray
    pose: Pose
    middles: np.ndarray
    cells: np.ndarray


class Explored(NamedTuple):
    """What came of an exploration: its Drive, the map builder, all sentences, the state that it ended in, s that it
    took, m that it ended off from where it began, and Frames.
    """

    drive: Drive
    slam: Slam
    said: list[str]
    state: State
    seconds: float
    off_home: float
    frames: list[Frame]


class Exploration:
    """Exploration `number` on a map: the seed of chair and start. params: of explore, laid over its own."""

    scan = True

    def __init__(self, name: str, number: int, params: dict | None = None) -> None:
        start = roomy_pose(grid_of(name), World.from_yaml(map_file(name)), random_of(name, 'map', number))
        nothing = GridMap(np.full((1, 1), UNKNOWN, np.int8), GridGeometry(1, 1, 0.05, start[0], start[1]))
        self.lockstep = lockstep = Lockstep(
            map_file(name),
            start,
            number,
            localization='fake',
            navigation=self._navigation(),
            scan=self.scan,
            known=nothing,
        )
        self.known = lockstep.localization = self._mapping(
            Filter(start, 'ekf', 'default', lockstep.reader.config.variances)
        )
        self.slam = self.known.slam
        self.start, self.said = start, []
        machine, config = lockstep.move_base, ExploreConfig.from_params(params or {})
        self.explorer = Explorer(
            config,
            machine.global_planner,
            machine.global_costmap.footprint,
            self.said.append,
            self._chooser(config),
        )
        self.grid = nothing
        self.poses, self.stamps, self.ranges, self.frames = [], [], [], []
        self._drawn, self._drawn_at, self._asked_at = 0, -math.inf, -math.inf

    def _navigation(self):
        tree = parameters('sara_bringup', 'mapping_nav.yaml')
        return merged(tree, parameters('sara_bringup', 'scan_mapping_nav.yaml')) if self.scan else tree

    def _mapping(self, reckoned):
        return Mapping(reckoned, slam_of())

    def _chooser(self, _config):
        return None

    def run(self, every: float = math.inf, say: Callable[[str], None] | None = None) -> Explored:
        """Explore to the end. every: s between two Frames; say: called with each sentence."""
        seconds = self.drive(every, say)
        lockstep = self.lockstep
        self.slam.finish()
        self.grid = self.slam.map()
        if every < math.inf:
            self.frames.append(self._frame(seconds))
        chair = lockstep.chair
        way = path_length(np.array(self.poses)[:, 4:6])
        drive = Drive(np.array(self.poses), np.array(self.stamps), np.array(self.ranges), way, 0, chair.contacts)
        return Explored(drive, self.slam, self.said, self.explorer.state, seconds, self.off_home, self.frames)

    @property
    def off_home(self) -> float:
        """m from where it began that the chair is."""
        return math.dist(self.lockstep.chair.pose[:2], self.start[:2])

    def drive(self, every: float = math.inf, say: Callable[[str], None] | None = None) -> float:
        """As `run`, to the end or until it pauses, for nobody resumes it; s that it took."""
        lockstep, told = self.lockstep, 0
        while not lockstep.wheels.ready or lockstep.localization.map_from_odom is None or not self._drawn:
            self._step()
        began, framed = lockstep.time, -math.inf
        while self.explorer.state not in (State.DONE, State.PAUSED) and lockstep.time - began < LONGEST_S:
            self._step()
            self._explore()
            if lockstep.time - framed >= every:
                framed = lockstep.time
                self.frames.append(self._frame(framed - began))
            for sentence in self.said[told:] if say else ():
                say(f'{lockstep.time - began:6.1f} s  {sentence}')
            told = len(self.said)
        return lockstep.time - began

    def _step(self):
        lockstep, known = self.lockstep, self.known
        lockstep.step()
        chair = lockstep.chair
        if self.scan and chair.scanner.scan is not None:
            known.on_scan(chair.scanner.scan)
            self.stamps.append(chair.scanner.scan.stamp)
            self.ranges.append(chair.scanner.scan.ranges.astype(np.float32))
        if known.pose is not None and (not self.poses or known.stamp > self.poses[-1][0]):
            self.poses.append((known.stamp, *known.pose, *chair.pose))
        self._draw()

    def _draw(self):
        lockstep, interval = self.lockstep, self.slam.config.map_update_interval
        if self.slam.counts['used'] > self._drawn and lockstep.time - self._drawn_at >= interval:
            self._drawn, self._drawn_at = self.slam.counts['used'], lockstep.time
            self._take(self.slam.map())

    def _take(self, grid):
        """A new map goes to move_base and to the explorer, as the topic does."""
        self.grid, machine = grid, self.lockstep.move_base
        for costmap in (machine.global_costmap, machine.local_costmap):
            for layer in costmap.map_layers.values():
                layer.set_map(grid)
        machine.replan()
        self.explorer.on_costmap(Costmap(static_costs(grid.data), grid.geometry))

    def _explore(self):
        """What the node explore does: hear how the goal ended, and order."""
        lockstep, explorer = self.lockstep, self.explorer
        if lockstep.result is not None:
            explorer.ended(lockstep.time, lockstep.result.status == SUCCEEDED, lockstep.result.text)
            lockstep.result = None
        elif lockstep.time - self._asked_at < 1.0 / explorer.config.planner_frequency - 1e-9:
            return
        self._asked_at = lockstep.time
        pose = self.known.pose
        order = explorer.step(lockstep.time, None if pose is None else Pose2D(*pose))
        if isinstance(order, DriveTo):
            lockstep.result = None
            lockstep.move_base.set_goal(order.pose, lockstep.time)
        elif order is not None:
            lockstep.move_base.cancel(lockstep.time)
            lockstep.result = None

    def _frame(self, seconds):
        found = self.explorer.found
        empty = np.empty((0, 2))
        return Frame(
            seconds,
            self.explorer.way,
            self.grid,
            np.array(self.poses)[::25, 1:3],
            self.known.pose,
            np.array([frontier.middle for frontier in found]).reshape(-1, 2),
            np.concatenate([empty, *(frontier.points for frontier in found)]),
        )


def explored(name: str, number: int, every: float = math.inf, params: dict | None = None) -> Explored:
    """As Exploration.run."""
    return Exploration(name, number, params).run(every)


def kept_map(name: str, number: int, folder: Path) -> GridMap:
    """The map of exploration `number` on a map, moved to where its walls are nearest to the true ones, as localization
    by walls would have it. The map is made once and kept in a folder.
    """

    def make():
        grid, true = explored(name, number).slam.map(), grid_of(name)
        points, g = walls.occupied_points(grid), grid.geometry
        faces = walls.faces(true.data == OCCUPIED, true.geometry)
        pose = walls.aligned(points, cKDTree(faces), (0.0, 0.0, 0.0))
        x, y = (walls.placed(points, pose) - points).mean(0).tolist()
        return arrays_of(replace(grid, geometry=replace(g, origin_x=g.origin_x + x, origin_y=g.origin_y + y)))

    return map_of(kept_arrays(folder / f'explored_{name}_{number}.npz', make))
