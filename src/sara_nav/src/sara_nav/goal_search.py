"""Plans for whoever asks (make_plan): to the goal, or to the nearest place about it that a plan leads to.

The search is the C++ move_base's: growing squares in steps of three cells up to the tolerance, rows from the goal outwards,
below the goal before above it and left before right.
"""
import numpy as np

from sara_nav import costmap as cm
from sara_nav.costmap import Costmap
from sara_nav.geometry import Pose2D
from sara_nav.planning import PlanError


class GivenUp(Exception):
    """The search was told to stop."""


def offsets(tolerance, resolution):
    """Yield (dx, dy) (m) of the places tried after the goal itself; nothing for a tolerance of 0."""
    step = 3.0 * resolution
    if 0.0 < tolerance < step:
        step = tolerance
    rings = int(tolerance / step + 1e-6)
    for ring in range(1, rings + 1):
        for row in range(ring + 1):
            for column in range(ring + 1):
                if max(row, column) < ring:
                    continue
                for y in ((-row, row) if row else (0,)):
                    for x in ((-column, column) if column else (0,)):
                        yield x * step, y * step


def cleared(costmap, pose, radius):
    """Return a copy of the Costmap with the square of half side ``radius`` (m) about the pose free."""
    g = costmap.geometry
    low = [int(np.clip((v - radius - o) / g.resolution, 0, n)) for v, o, n in (
        (pose.x, g.origin_x, g.width), (pose.y, g.origin_y, g.height))]
    high = [int(np.clip((v + radius - o) / g.resolution + 1, 0, n)) for v, o, n in (
        (pose.x, g.origin_x, g.width), (pose.y, g.origin_y, g.height))]
    costs = costmap.costs.copy()
    costs[low[1]:high[1], low[0]:high[0]] = cm.FREE
    return Costmap(costs, g)


def search_plan(planner, costmap, start, goal, tolerance, add_unreachable_goal=True, give_up=lambda: False):
    """Return (plan (n, 3), text): to the goal, or to a place within ``tolerance`` (m) of it; (None, why) without any.

    A plan to another place ends with the asked goal as well when ``add_unreachable_goal``. Raises GivenUp once ``give_up()``
    says so, asked before each try.
    """
    problem = ''
    places = [(0.0, 0.0)]
    if tolerance > 0.0:
        places += offsets(tolerance, costmap.geometry.resolution)
    for dx, dy in places:
        if give_up():
            raise GivenUp
        place = Pose2D(goal.x + dx, goal.y + dy, goal.yaw)
        if (dx or dy) and (costmap.cost_at(place.x, place.y) or cm.FREE) in (cm.INSCRIBED, cm.LETHAL):
            continue  # no planner leads there
        try:
            plan = planner.plan(costmap, start, place)
        except PlanError as error:
            problem = problem or str(error)
            continue
        if not (dx or dy):
            return plan, ''
        if add_unreachable_goal:
            plan = np.vstack([plan, [[goal.x, goal.y, goal.yaw]]])
        return plan, 'no plan leads to the goal (%s); this one leads to (%.2f, %.2f)' % (problem, place.x, place.y)
    return None, problem
