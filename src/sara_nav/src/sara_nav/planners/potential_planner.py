"""What navfn/NavfnROS and global_planner/GlobalPlanner share: the wave over a costmap, and a plan traced down it.

A planner says which costs are passable and what they cost, and where the wave starts; the rest is here.
"""

import functools
from typing import Any

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.planners import gradient_path, potential, potential_astar
from sara_nav.planners.planning import PlanError, nearest_cell, place_of, plan_from_points, require_finite


class _Fields:
    """The arrays of one search over a grid of this shape; kept, for taking new memory costs as much as using it."""

    def __init__(self, shape: tuple[int, int]):
        self.shape = shape
        self.width = shape[1] + 2
        size = (shape[0] + 2) * self.width
        self.steps = np.empty(size, np.uint8)
        self.potential = np.empty(size, np.float32)
        self.pending = np.empty(size, np.uint8)
        self.blocks = tuple(np.empty(size, np.uint32) for _ in range(3))

    def field(self, obstacle: int) -> potential.Field:
        """Return the Field in which costs from ``obstacle`` on are impassable."""
        return potential.Field(self.steps, self.potential, self.pending, self.width, int(obstacle))

    def index(self, cell: tuple[int, int]) -> int:
        """Return where the cell (column, row) is in the flat arrays."""
        return (cell[1] + 1) * self.width + cell[0] + 1

    def inner(self) -> np.ndarray:
        """Return the potential (rows, columns) as a view."""
        return self.potential.reshape(self.shape[0] + 2, self.width)[1:-1, 1:-1]


@functools.cache
def warm() -> None:
    """Compile, or load from the cache, every kernel of these planners, once; making a planner does it too."""
    for module in (potential, potential_astar, gradient_path):
        module.warm()


class PotentialPlanner:
    """A planner whose plan leads down a potential. After ``plan``:

    ``goal_used``: the Pose2D planned to, another than asked where default_tolerance moved it.
    ``potential``: float32 (rows, columns), potential.HIGH (1e10) where the wave did not come, or None before a plan.
    """

    def __init__(self, config: Any):
        warm()
        self.config = config
        self.goal_used = None
        self._fields = None
        self._geometry = None

    @property
    def potential(self) -> np.ndarray | None:
        """A copy of the last search's potential, or None."""
        return None if self._geometry is None else self._fields.inner().copy()

    def explore(self, costmap: Costmap, start: Pose2D) -> np.ndarray:
        """Return which cells, bool (rows, columns), a plan from Pose2D start can lead to; start must be on the map."""
        fields = self._search(costmap, start, costmap.geometry.to_cell(start.x, start.y), None)
        return fields.inner() < potential.HIGH

    def plan(self, costmap: Costmap, start: Pose2D, goal: Pose2D) -> np.ndarray:
        """Return a plan (n, 3) from Pose2D start to Pose2D goal; raises PlanError.

        A goal that cannot be reached moves to the nearest place that can, within default_tolerance (m).
        """
        self.goal_used = self._geometry = None
        g = costmap.geometry
        require_finite(start, goal)
        first, last = g.to_cell(start.x, start.y), g.to_cell(goal.x, goal.y)
        if first is None:
            raise PlanError(f'the robot at {place_of(start)} is off the map')
        refusal = self._refusal(costmap, goal, first, last)
        if refusal and not self.config.default_tolerance > 0.0:
            raise PlanError(refusal)
        fields = self._search(costmap, start, first, None if refusal else last)
        if not refusal and fields.potential[fields.index(last)] < potential.HIGH:
            self.goal_used = goal
        else:
            closed = self._closed(costmap, first)
            self.goal_used = self._moved(
                goal,
                refusal
                or 'no way leads from {}{} to the goal {}'.format(
                    place_of(start), f', which is {closed},' if closed else '', place_of(goal)
                ),
            )
        return self._oriented(self._trace(start, self.goal_used), start)

    def _moved(self, goal, reason):
        """Return the nearest pose within default_tolerance of a goal that the search has reached; raises PlanError."""
        tolerance = self.config.default_tolerance
        near = nearest_cell(self._fields.inner() < potential.HIGH, self._geometry, goal.x, goal.y, tolerance)
        if near is not None:
            return Pose2D(*self._geometry.to_world(*near), goal.yaw)
        raise PlanError(
            reason
            + (
                f', and no place within the default_tolerance of {tolerance:g} m can be reached'
                if tolerance > 0.0
                else ''
            )
        )

    def _refusal(self, costmap, goal, first, last):
        """Return why no way can end at the goal, or ''. first, last: cells of robot and goal."""
        if last is None:
            return f'the goal {place_of(goal)} is off the map'
        closed = '' if last == first else self._closed(costmap, last)
        return f'the goal {place_of(goal)} is {closed}' if closed else ''

    def _closed(self, costmap, cell):
        """Return what closes a cell (column, row), or ''."""
        cost = int(costmap.costs[cell[1], cell[0]])
        table, obstacle = self._table()
        return (
            ''
            if table[cost] < obstacle
            else {255: 'in unknown space', 254: 'in an obstacle', 253: 'too near an obstacle'}.get(
                cost, f'on a cell of cost {cost}'
            )
        )

    def _search(self, costmap, start, first, target):
        """Send the wave out from the start until it has settled the target cell, or everywhere for None."""
        if self._fields is None or self._fields.shape != costmap.costs.shape:
            self._fields = _Fields(costmap.costs.shape)
        fields = self._fields
        self._geometry = costmap.geometry
        table, obstacle = self._table()
        outline = self._outline() and not any(_at_edge(cell, costmap.geometry) for cell in (first, target) if cell)
        potential.prepare(costmap.costs, table, outline, fields.field(obstacle))
        sources = dict(self._sources(fields, obstacle, start, first))
        for index, value in sources.items():
            fields.potential[index] = value
        # The order is the peer's: within a block the potential depends a little (up to 1 %) on who comes first.
        front = [n + step for n in sources for step in (1, -1, -fields.width, fields.width)]
        front = [n for n in dict.fromkeys(front) if n not in sources and fields.steps[n] < obstacle]
        fields.blocks[0][: len(front)] = front
        self._spread(fields, len(front), -1 if target is None else fields.index(target), obstacle)
        return fields

    def _spread(self, fields, count, target, obstacle):
        """Run the wave; A* planners have their own."""
        wave = potential.Wave(target, self._increment(), self._quadratic())
        potential.spread(fields.field(obstacle), fields.blocks, count, wave)

    def _sources(self, fields, obstacle, start, first):
        """Yield (index, potential) of the cells the wave starts with."""
        yield fields.index(first), 0.0

    def _trace(self, start, goal, follow=gradient_path.descend):
        """Return the points (n, 2), m, from the start to a goal that the wave reached."""
        g = self._geometry
        ends = []
        for p in (start, goal):
            for v, low, cell in zip((p.x, p.y), (g.origin_x, g.origin_y), g.to_cell(p.x, p.y)):
                within = (v - low) / g.resolution - cell  # kept off the cell's edge: rounding must not change the cell
                ends.append(cell + 0.5 + min(max(within, 1e-6), 1.0 - 1e-6))
        points = follow(self._fields.potential, self._fields.width, *ends)
        if len(points) == 0:
            raise PlanError(f'no way leads from {place_of(start)} to the goal {place_of(goal)}')
        points = (points[::-1] - 0.5) * g.resolution + (g.origin_x, g.origin_y)
        points[0], points[-1] = (start.x, start.y), (goal.x, goal.y)
        return points

    def _oriented(self, points, start):
        """Return the plan (n, 3) of points (n, 2)."""
        return plan_from_points(points, self.goal_used.yaw)

    def _table(self):
        """Return the steps (256,) uint8 of costs, and the value from which on they are obstacles."""
        raise NotImplementedError

    def _outline(self):
        """True when the outermost cells of the map are obstacles, unless a plan begins or ends on them."""
        return True

    def _increment(self):
        """Return the width of a priority block."""
        return 100.0

    def _quadratic(self):
        """True for the plane wave, False for the lowest neighbour plus the cost."""
        return True


def _at_edge(cell, geometry):
    """True when a cell (column, row) is one of the map's outermost."""
    return cell[0] in (0, geometry.width - 1) or cell[1] in (0, geometry.height - 1)
