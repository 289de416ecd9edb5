"""What every planner shares: its plan, its errors, and the register that finds planners by name.

A plan is an array (n, 3) of x, y (m) and yaw (rad) in the costmap's frame, from the robot to the goal; yaw points
along the path but in the last row, where it is the goal's.
"""
import importlib
import math

import numpy as np

from sara_nav.geometry import Pose2D


class PlanError(Exception):
    """There is no way; the message says why."""


class UnknownPlanner(ValueError):
    """A planner was asked for by a name that nothing answers to."""


class Registry:
    """Planners by the name users write into ``base_global_planner`` or ``base_local_planner``.

    modules: those that register planners, imported when the first name is asked for. refused: {name: what to use
    instead} of planners users may know that are not here.
    """

    def __init__(self, parameter, modules=(), refused=None):
        self.parameter = parameter
        self._modules = tuple(modules)
        self._refused = dict(refused or {})
        self._classes = {}

    def register(self, name):
        """Return a class decorator that enters a planner under ``name``."""
        def enter(cls):
            self._classes[name] = cls
            cls.plugin_name = name
            return cls
        return enter

    def names(self):
        """Return the names that can be asked for, sorted."""
        for module in self._modules:
            importlib.import_module(module)
        return sorted(self._classes)

    def find(self, name):
        """Return the class of that name; raises UnknownPlanner, whose text says what there is."""
        names = self.names()
        try:
            return self._classes[name]
        except (KeyError, TypeError):
            pass
        if isinstance(name, str) and name in self._refused:
            raise UnknownPlanner('%s is %r, which is not here: use %s' % (self.parameter, name, self._refused[name]))
        raise UnknownPlanner('%s is %r but must be one of: %s' % (self.parameter, name, ', '.join(names)))


GLOBAL_PLANNERS = Registry(
    'base_global_planner', ('sara_nav.grid_planner', 'sara_nav.navfn', 'sara_nav.global_planner'), {
        'carrot_planner/CarrotPlanner': 'navfn/NavfnROS with a default_tolerance, which moves a goal in an obstacle '
                                        'to the nearest place that can be reached'})


FURTHEST = 1e5
"""No tolerance moves a goal further than this (m)."""


def place_of(pose):
    """Return '(x, y)' for messages."""
    return '(%.2f, %.2f)' % (pose.x, pose.y)


def nearest_cell(free, geometry, x, y, tolerance):
    """Return (column, row) of the free cell whose centre is nearest to the point (m), or None.

    free: bool (rows, columns). Only centres within tolerance (m) of the point count.
    """
    g = geometry
    if not (math.isfinite(x) and math.isfinite(y) and tolerance > 0.0):
        return None
    reach = min(tolerance, (g.width + g.height) * g.resolution + math.hypot(x - g.origin_x, y - g.origin_y))
    left, bottom = (math.floor((v - reach - o) / g.resolution) for v, o in ((x, g.origin_x), (y, g.origin_y)))
    right, top = (math.floor((v + reach - o) / g.resolution) + 1 for v, o in ((x, g.origin_x), (y, g.origin_y)))
    left, bottom = max(left, 0), max(bottom, 0)
    rows, columns = np.nonzero(free[bottom:max(top, 0), left:max(right, 0)])
    if len(rows) == 0:
        return None
    cx, cy = g.to_world(columns + left, rows + bottom)
    squared = (cx - x) ** 2 + (cy - y) ** 2
    best = int(squared.argmin())
    if squared[best] > tolerance ** 2:
        return None
    return int(columns[best] + left), int(rows[best] + bottom)


def squares_about(goal, geometry, tolerance):
    """Return the points (n, 2), m, on the map about a Pose2D goal that move_base's make_plan tries, in its order.

    They lie on growing squares, steps of three cells apart, up to tolerance (m) away in x and in y; a tolerance below
    three cells is itself the step.
    """
    g = geometry
    tolerance = min(tolerance, FURTHEST)
    if not (goal.is_finite() and tolerance > 0.0):
        return np.empty((0, 2))
    step = min(3.0 * g.resolution, tolerance)
    reach = math.floor(tolerance / step + 1e-9)
    offsets = []
    for middle, low, cells in ((goal.x, g.origin_x, g.width), (goal.y, g.origin_y, g.height)):
        first = max(-reach, (low - middle) / step - 1.0)
        last = min(reach, (low + cells * g.resolution - middle) / step + 1.0)
        offsets.append(np.arange(math.ceil(first), math.floor(last) + 1) if first <= last else np.empty(0, int))
    x, y = (values.ravel() for values in np.meshgrid(*offsets))
    order = np.lexsort((x, y, abs(x), abs(y), np.maximum(abs(x), abs(y))))
    order = order[(x[order] != 0) | (y[order] != 0)]
    points = np.column_stack([goal.x + x[order] * step, goal.y + y[order] * step])
    return points[[g.to_cell(*point) is not None for point in points]]


def plan_within(planner, costmap, start, goal, tolerance, before_each=lambda: None):
    """Return (plan, goal used) to a Pose2D goal or, where that fails, to the first of the squares_about it that works.

    tolerance: m, 0 for the goal alone. Of a planner that can ``explore`` only places it reaches are tried. The goal
    used is the planner's own ``goal_used`` where it says. before_each is called before each search and may raise, to
    give up. Raises the PlanError of the goal itself.
    """
    before_each()
    try:
        return planner.plan(costmap, start, goal), _goal_used(planner, goal)
    except PlanError as error:
        refusal = error
    points = squares_about(goal, costmap.geometry, tolerance)
    if len(points) and hasattr(planner, 'explore') and costmap.geometry.to_cell(start.x, start.y) is not None:
        cells = np.array([costmap.geometry.to_cell(*point) for point in points])
        points = points[planner.explore(costmap, start)[cells[:, 1], cells[:, 0]]]
    for x, y in points:
        before_each()
        other = Pose2D(float(x), float(y), goal.yaw)
        try:
            return planner.plan(costmap, start, other), _goal_used(planner, other)
        except PlanError:
            pass
    raise refusal


def _goal_used(planner, goal):
    used = getattr(planner, 'goal_used', None)
    return goal if used is None else used


def plan_from_points(points, goal_yaw):
    """Return the plan (n, 3) along points (m, 2): yaw to the next point, the last one's the goal's; no point twice."""
    points = np.asarray(points, float)
    steps = np.diff(points, axis=0)
    moves = np.hypot(*steps.T) > 1e-9
    points = np.vstack([points[:-1][moves], points[-1:]])
    steps = np.diff(points, axis=0)
    return np.column_stack([points, np.append(np.arctan2(steps[:, 1], steps[:, 0]), goal_yaw)])


def dense_plan(vertices, goal_yaw, spacing=0.05):
    """Return the plan (n, 3) along straight lines between vertices (m, 2), points no further apart than spacing."""
    vertices = np.asarray(vertices, float)
    rows = []
    heading = goal_yaw
    for start, end in zip(vertices[:-1], vertices[1:]):
        dx, dy = end - start
        length = math.hypot(dx, dy)
        if length < 1e-9:
            continue
        heading = math.atan2(dy, dx)
        steps = max(1, math.ceil(length / spacing))
        f = np.arange(steps)[:, None] / steps
        rows.append(np.column_stack([start + f * (end - start), np.full(steps, heading)]))
    rows.append([[vertices[-1][0], vertices[-1][1], goal_yaw]])
    return np.vstack(rows)


def simplify(points, tolerance):
    """Return the corners (m, 2) of a path (n, 2): Douglas and Peucker (1973), no point off by over tolerance (m)."""
    points = np.asarray(points, float)[:, :2]
    keep = np.zeros(len(points), bool)
    keep[[0, -1]] = True
    stack = [(0, len(points) - 1)]
    while stack:
        first, last = stack.pop()
        if last - first < 2:
            continue
        chord = points[last] - points[first]
        length2 = float(chord @ chord)
        between = points[first + 1:last] - points[first]
        along = np.clip(between @ chord / length2, 0.0, 1.0) if length2 > 0.0 else np.zeros(len(between))
        off = np.hypot(*(between - along[:, None] * chord).T)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            middle = first + 1 + worst
            keep[middle] = True
            stack += [(first, middle), (middle, last)]
    return points[keep]


def path_length(points):
    """Return the length (m) of a path (n, 2 or more)."""
    return float(np.hypot(*np.diff(np.asarray(points, float)[:, :2], axis=0).T).sum())
