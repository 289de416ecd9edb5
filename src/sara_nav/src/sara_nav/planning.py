"""What every planner shares: its plan, its errors, and the register that finds planners by name.

A plan is an array (n, 3) of x, y (m) and yaw (rad) in the costmap's frame, from the robot to the goal; yaw points
along the path but in the last row, where it is the goal's.
"""
import math

import numpy as np


class PlanError(Exception):
    """There is no way; the message says why."""


class UnknownPlanner(ValueError):
    """A planner was asked for by a name that nothing answers to."""


class Registry:
    """Planners by the name users write into ``base_global_planner`` or ``base_local_planner``."""

    def __init__(self, parameter):
        self.parameter = parameter
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
        return sorted(self._classes)

    def find(self, name):
        """Return the class of that name; raises UnknownPlanner, whose text lists those available."""
        try:
            return self._classes[name]
        except (KeyError, TypeError):
            raise UnknownPlanner('%s is %r but must be one of: %s' % (
                self.parameter, name, ', '.join(self.names()))) from None


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
