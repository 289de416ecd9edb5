"""What every planner shares: its plan, its errors, and the register that finds planners by name.

A plan is an array (n, 3) of x, y (m) and yaw (rad) in the costmap's frame, from the robot to the goal; yaw points
along the path but in the last row, where it is the goal's.
"""

import math

import numpy as np

from sara_common.planar import Pose2D
from sara_common.repeatable import directions
from sara_nav.config.registry import Registry
from sara_nav.grids.grid import GridGeometry


class PlanError(Exception):
    """There is no way; the message says why."""


GLOBAL_PLANNERS = Registry(
    'base_global_planner',
    {
        'sara_nav/GridPlanner': 'sara_nav.planners.grid_planner',
        'sara_nav/LatticePlanner': 'sara_nav.lattice.planner',
        'navfn/NavfnROS': 'sara_nav.planners.navfn',
        'global_planner/GlobalPlanner': 'sara_nav.planners.global_planner',
    },
    {
        'carrot_planner/CarrotPlanner': 'navfn/NavfnROS with a default_tolerance, which moves a goal in an obstacle '
        'to the nearest place that can be reached'
    },
)


def place_of(pose: Pose2D) -> str:
    """Return '(x, y)' for messages."""
    return f'({pose.x:.2f}, {pose.y:.2f})'


def require_finite(start: Pose2D, goal: Pose2D) -> None:
    """Raise the PlanError of a start or a goal (Pose2D) that holds a NaN or an infinity."""
    for name, pose in (("robot's pose", start), ('goal', goal)):
        if not pose.is_finite():
            raise PlanError(f'the {name} ({pose.x!r}, {pose.y!r}, {pose.yaw!r}) is not finite')


def nearest_cell(
    free: np.ndarray, geometry: GridGeometry, x: float, y: float, tolerance: float
) -> tuple[int, int] | None:
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
    rows, columns = np.nonzero(free[bottom : max(top, 0), left : max(right, 0)])
    if len(rows) == 0:
        return None
    cx, cy = g.to_world(columns + left, rows + bottom)
    squared = (cx - x) ** 2 + (cy - y) ** 2
    best = int(squared.argmin())
    if squared[best] > tolerance**2:
        return None
    return int(columns[best] + left), int(rows[best] + bottom)


def plan_from_points(points: np.ndarray, goal_yaw: float) -> np.ndarray:
    """Return the plan (n, 3) along points (m, 2): yaw to the next point, the last one's the goal's; no point twice."""
    points = np.asarray(points, float)
    steps = points[1:] - points[:-1]
    moves = np.hypot(steps[:, 0], steps[:, 1]) > 1e-9
    if not moves.all():
        points = np.vstack([points[:-1][moves], points[-1:]])
        steps = points[1:] - points[:-1]
    plan = np.empty((len(points), 3))
    plan[:, :2], plan[:-1, 2], plan[-1, 2] = points, directions(steps), goal_yaw
    return plan


def dense_plan(vertices: np.ndarray, goal_yaw: float, spacing: float = 0.05) -> np.ndarray:
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


def simplify(points: np.ndarray, tolerance: float) -> np.ndarray:
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
        between = points[first + 1 : last] - points[first]
        along = np.clip(between @ chord / length2, 0.0, 1.0) if length2 > 0.0 else np.zeros(len(between))
        off = np.hypot(*(between - along[:, None] * chord).T)
        worst = int(off.argmax())
        if off[worst] > tolerance:
            middle = first + 1 + worst
            keep[middle] = True
            stack += [(first, middle), (middle, last)]
    return points[keep]


def distances_along(points: np.ndarray) -> np.ndarray:
    """Return how far (m) along a path (n, 2 or more) each of its points is, (n,)."""
    return np.concatenate([[0.0], np.hypot(*np.diff(points[:, :2], axis=0).T).cumsum()])


def path_length(points: np.ndarray) -> float:
    """Return the length (m) of a path (n, 2 or more)."""
    return float(np.hypot(*np.diff(np.asarray(points, float)[:, :2], axis=0).T).sum())
