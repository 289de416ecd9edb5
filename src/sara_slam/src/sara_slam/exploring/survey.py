"""From where range sensors with wide cones would hear what is not known yet: the next place to drive to is that where,
with a straight way there, most is expected for the time that it takes.

What is expected is the border of free space on the unknown, in m, if a wall stands at it or soon beyond, and the
sensors face that squarely from there. Each time that they have faced a piece of it and the map still does not know it,
half as much is expected of that piece.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np
from scipy.ndimage import binary_dilation, maximum_filter

from sara_common.planar import Pose2D, is_apart
from sara_nav.costmaps.costmap import Costmap, freed
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.grid import INSCRIBED, UNKNOWN
from sara_nav.planners.planning import PlanError
from sara_slam.exploring.choice import Choice, Planner
from sara_slam.exploring.cones import FREE_CELL, UNKNOWN_CELL, WALL_CELL, heard_from, warm
from sara_slam.exploring.frontiers import Frontier, cells_of, frontier_at
from sara_slam.exploring.gains import Gains, Listening
from sara_slam.exploring.ground import filled, large_patches, paste, with_obstacles
from sara_slam.exploring.pace import Pace
from sara_slam.exploring.passed import Passed
from sara_slam.exploring.tried_places import TriedPlaces
from sara_slam.exploring.viewpoints import Surroundings
from sara_slam.exploring.wall_normals import with_normals
from sara_slam.sonar.free_space import without_slits

EVERY, HEADINGS = 4, 16
"""Cells between places where the robot may stand, and its headings there."""
ROOM = 0.12
"""m from walls that the body keeps where it stands."""
AGAIN = 0.5
"""What is still expected of a piece that has been faced once more."""
MOVED_M, MOVED_RAD = 0.05, 0.1
"""Between two poses from which something is heard."""
LEAST, LITTLE = 0.5, 0.25
"""m of border for which a place is driven to; and where there is none that offers so much, before it is the end."""
PACE = Pace(0.17, 0.35, 4.0)
"""What SARA takes while it maps. By a faster one it leaves a room before it is done with, and comes back."""
THERE = 0.1
"""m up to which a place is where the robot is."""
GIVEN_UP = 0.1
"""Share of a frontier's cells down to which something is expected of it."""
KNOWN = 0.9
"""Share of what is in sight of a place and near that has been passed, from which on nothing new begins there."""
FARTHER = 0.15
"""What is expected of a border that has not been passed, against one that has: those are finished first."""
LEFT = 0.2
"""Share of what was expected from a place down to which it is driven to."""
ROUNDS = 3
"""How often what could not be reached is tried again while nothing is reached."""
BESIDE = 3
"""Cells up to which what is beside a frontier is of it."""
LOOKS = 1
"""How often frontiers that are left in the end are looked at as if they had not been faced."""
COMPARED, TRIES = 200, 4
"""Places of which it is counted exactly what they are worth, and those that are planned to, the best first."""
GAP = 0.3
"""m: half as wide as gaps between what is known, which are taken for free: beside fans, and in corners."""
PATCH = 0.2
"""m: unknown patches smaller than a square of this are none."""
MISFITS = 3
"""Looks in a row at which the robot does not fit in a place until that is left: walls are drawn on for a moment."""


class Survey:
    """The Chooser for a robot with range sensors alone. reach: m up to which they count; add_sensor tells of each.
    free_margin: m about what is known free that move_base takes for free, too (StaticLayerConfig).

    `obstacles`: the Costmap that move_base plans by, None where it is not known.
    """

    def __init__(self, reach: float, free_margin: float = 0.0) -> None:
        warm()
        self._free_margin = free_margin
        self._reach = float(reach)
        self._sensors = np.empty((0, 4))
        self._tried = TriedPlaces()
        self._rounds, self._looks = ROUNDS, LOOKS
        self._frontiers: Sequence[Frontier] = ()
        self._last: Pose2D | None = None
        self.ground: Costmap | None = None
        self.obstacles: Costmap | None = None
        self._footprint = np.empty((0, 2))  # by which it was chosen
        self._faced, self._corner = np.zeros((1, 1), np.uint8), (0, 0)  # how often each cell has been faced
        self._expected = self._near = None  # of each cell, and of the best beside it
        self._passed, self._farther = Passed(), FARTHER
        self._home: Pose2D | None = None  # where the way home counts
        self._chosen, self._misfits = 0.0, 0

    def add_sensor(self, mount: Sequence[float], field_of_view: float) -> None:
        """One that sits at a mount (x, y, yaw; m, rad) on the robot and has a cone as wide as field_of_view, rad."""
        self._sensors = np.vstack((self._sensors, (*mount[:3], 0.5 * field_of_view)))

    @property
    def sensors(self) -> int:
        """How many there are."""
        return len(self._sensors)

    def forget(self) -> None:
        """Expect as much of everything as if nothing had been heard."""
        self._faced[:], self._expected, self._farther, self._home, self._looks = 0, None, FARTHER, None, LOOKS
        self._passed.release()
        self._tried.clear()

    def tried(self, choice: Choice, reached: bool) -> None:
        """Nobody drives there once more; what could not be reached is tried again when nothing else is left, in ROUNDS
        since something was reached.
        """
        self._tried.add(choice.pose, reached, turned=not reached)
        self._rounds = ROUNDS if reached else self._rounds

    def looks_again(self) -> bool:
        """See Chooser. A cone is wider than what it frees: a border may have been faced from afar in vain."""
        if not (self._looks and self._frontiers):
            return False
        self._looks -= 1
        columns, rows = cells_of(np.concatenate([of.points for of in self._frontiers]), self.ground.geometry)
        left = np.zeros(self._faced.shape, bool)
        left[rows, columns] = True
        self._faced[binary_dilation(left, iterations=BESIDE)], self._expected = 0, None
        return True

    def given_up(self, frontier: Frontier) -> bool:
        """Whether little is expected of a frontier any more."""
        return self._sum(frontier) < GIVEN_UP * len(frontier.points)

    def on_costmap(self, costmap: Costmap, found: Sequence[Frontier]) -> None:
        """The newest map; frontiers are sought on it anew, for gaps between what sensors tell are none. Raises
        ValueError for a map of one row or column.
        """
        if min(costmap.costs.shape) < 2:
            raise ValueError(f'a map of {" x ".join(map(str, costmap.costs.shape))} cells is none')
        self._frontiers = found
        self.ground = costmap = filled(costmap, GAP)
        costs, g = costmap.costs, costmap.geometry
        unknown = large_patches(costs == UNKNOWN, round(PATCH / g.resolution) ** 2)
        kinds = np.full(costs.shape, FREE_CELL, np.uint8)
        kinds[unknown] = UNKNOWN_CELL
        kinds[without_slits((costs >= INSCRIBED) & (costs != UNKNOWN))] = WALL_CELL
        self._cells = with_normals(kinds, g.grid)
        self._border = (kinds == FREE_CELL) & binary_dilation(unknown)
        corner = round(g.origin_x / g.resolution), round(g.origin_y / g.resolution)
        faced = np.zeros(costs.shape, np.uint8)
        paste(self._faced, self._corner, faced, corner)
        self._faced, self._corner, self._expected = faced, corner, None
        self._passed.on_cells(self._cells)

    def on_obstacles(self, costmap: Costmap) -> None:
        """What move_base plans by: where its footprint would touch an obstacle, it refuses to go."""
        self.obstacles = costmap

    def finish(self, home: Pose2D | None) -> None:
        """Little time is left: nothing is begun any more that has not been passed, nor where much else would be, and of
        ways counts half, and half of by how much they make the way home longer: what lies on that can wait.
        """
        self._farther, self._home = 0.0, home
        self._passed.hold()

    def on_way_home(
        self, planner: Planner, footprint: np.ndarray, start: Pose2D, home: Pose2D, left: float
    ) -> Choice | None:
        """See Chooser."""
        self.finish(home)
        return self._choose(planner, footprint, start, True, left)

    def at(self, pose: Pose2D) -> None:
        """The robot is at a pose."""
        self._passed.at(pose)
        last = self._last
        if last is not None and not is_apart(last, pose, MOVED_M, MOVED_RAD):
            return
        self._last = pose
        if self.ground is None or not len(self._sensors):
            return
        places = self._heard(np.array([[pose.x, pose.y, pose.yaw]]))
        places = np.unique(places[places >= 0])
        self._faced.ravel()[places] = np.minimum(self._faced.ravel()[places], 200) + 1
        self._expected = None

    def expected(self) -> np.ndarray:
        """float32 (rows, columns): what is expected of each cell of the map, 0 to 1."""
        if self._expected is None:
            faced = maximum_filter(self._faced, 3)
            self._expected = np.where(self._border, np.float32(AGAIN) ** faced, 0.0).astype(np.float32)
            self._near = maximum_filter(self._expected, 3)
        return self._expected

    def stays(self, choice: Choice) -> bool:
        """Whether enough is expected still of what was expected of a place when it was chosen, and the robot fits."""
        self._misfits = 0 if self._fits(choice.pose) else self._misfits + 1
        return self._misfits < MISFITS and self._sum(choice.frontier) >= LEFT * self._chosen

    def _fits(self, pose):
        """Whether the footprint touches none of move_base's obstacles at a pose."""
        return self.obstacles is None or not LocalWorld(self.obstacles, self._footprint, False).collides(pose)

    def _sum(self, frontier):
        """Cells of which something is expected, where those of a frontier are or beside them."""
        columns, rows = cells_of(frontier.points, self.ground.geometry)
        height, width = self._border.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        self.expected()
        return float(self._near[rows[inside], columns[inside]].sum())

    def choose(self, planner: Planner, footprint: np.ndarray, start: Pose2D, under_way: bool) -> Choice | None:
        """From where most is expected for the time it takes to get there; None where nothing is left that a plan leads
        to. Its cost is what is expected, less than 0, m per s.
        """
        return self._choose(planner, footprint, start, under_way, math.inf)

    def _choose(self, planner, footprint, start, under_way, left):
        self._footprint = footprint
        ground = self.ground if self.obstacles is None else with_obstacles(self.ground, self.obstacles)
        around = Surroundings(ground, start, footprint)
        ground = around.costmap
        ground = replace(ground, costs=freed(ground.costs, ground.geometry.resolution, self._free_margin))
        stands, ways = around.stands(EVERY, HEADINGS, ROOM)
        if not (len(stands) and len(self._sensors)):
            return None
        listening = Listening(start, stands, ways, self._heard)
        worth, of_any = self._gains()
        detours = self._detours(ground, start, stands, ways)
        seconds, longer = (PACE.seconds_to(stands, of, start, THERE) for of in (0.5 * (ways + detours), detours))
        fits = (longer <= left) & ~self._tried.hold(stands)
        most, of_worth = listening.at_most(of_any), listening.at_most(worth) / seconds
        for least in (LEAST,) if under_way else (LEAST, LITTLE):
            best = self._best(np.where(fits & (most >= least), of_worth, 0.0), stands)
            offers = listening.offers(islice(best, COMPARED), worth, of_any, seconds)
            offers = [offer for offer in offers if offer.gain >= least]
            if offers:
                break
        if not offers:
            return self._again(planner, footprint, start) if self._rounds and not under_way else None
        for offer in offers[:TRIES]:
            pose = Pose2D(*stands[offer.stand].tolist())
            try:
                planner.plan(ground, start, pose)
            except PlanError:
                self._tried.add(pose, False)
                continue
            frontier = self._frontier(offer.cells, offer.gain)
            self._chosen, self._misfits = self._sum(frontier), 0
            return Choice(frontier, pose, -offer.rate)
        return None

    def _gains(self):
        """Gains of what is expected: by what it is worth, and of anything that may be driven to."""
        expected, passed, g = self.expected(), self._passed.free(), self.ground.geometry
        return tuple(
            Gains(np.where(passed, expected, np.float32(beyond) * expected), g.resolution)
            for beyond in (self._farther, self._farther > 0.0)
        )

    def _best(self, rate, stands):
        """Numbers of stands (n, 3), those of the greatest rate (n,) first, where something may be begun."""
        shares: dict[tuple[float, float], float] = {}
        for k in np.argsort(-rate, kind='stable')[: np.count_nonzero(rate > 0.0)].tolist():
            x, y = stands[k, :2].tolist()
            if not self._farther and (x, y) not in shares:
                shares[x, y] = self._passed.share_from(x, y)
            if self._farther or shares[x, y] >= KNOWN:
                yield k

    def _detours(self, ground, start, stands, ways):
        """m that ways to stands are longer than the way home; as they are where none is known."""
        if self._home is None:
            return ways
        from_home = Surroundings(ground, self._home, self._footprint)
        home = from_home.way_to(start.x, start.y)
        return np.maximum(ways + from_home.ways_to(stands[:, :2]) - home, 0.0) if math.isfinite(home) else ways

    def _again(self, planner, footprint, start):
        """As choose, of what could not be reached."""
        self._rounds -= 1
        self._tried.clear_unreached()
        return self.choose(planner, footprint, start, False)

    def _frontier(self, cells, size):
        """The Frontier of those of the cells (flat indices) of which something is expected; of all where it is of cells
        beside them alone.
        """
        hoped = self.expected().ravel()[cells] > 0.0
        rows, columns = np.unravel_index(cells[hoped] if hoped.any() else cells, self._border.shape)
        return frontier_at(np.column_stack(self.ground.geometry.to_world(columns, rows)), size)

    def _heard(self, poses):
        return heard_from(self._cells, poses, self._sensors, self._reach)
