"""A picture of a plan on its costmap: free white, costs grey, obstacles black, unknown blue-grey; the plan red, the
robot's footprint green at the start, red at the goal and thin blue along the plan.
"""

import math

import numpy as np
from PIL import Image, ImageDraw

from sara_common.planar import Pose2D, wrap
from sara_nav.costmaps.costmap import Costmap

LEAST_SIDE = 600
"""Pixels; smaller maps are drawn with several pixels a cell."""
PLAN, START, GOAL, BODY = (220, 30, 30), (20, 150, 40), (220, 30, 30), (110, 150, 235)
BODY_EVERY, BODY_TURN = 0.5, 0.4
"""m of way and rad of turn after which the footprint is drawn along the plan."""


def _shades():
    table = np.empty((256, 3), np.uint8)
    table[:253] = (255 - 0.6 * np.arange(253))[:, None]
    table[253], table[254], table[255] = (90, 90, 90), (0, 0, 0), (170, 185, 200)
    return table


def draw_plan(
    path: str, costmap: Costmap, plan: np.ndarray | None, start: Pose2D, goal: Pose2D, footprint: np.ndarray
) -> None:
    """Write a picture file (format by its suffix); raises OSError or ValueError when that fails.

    plan: (n, 3) or None; start, goal: Pose2D; footprint: (k, 2) m.
    """
    g = costmap.geometry
    scale = max(1, math.ceil(LEAST_SIDE / max(g.width, g.height)))
    picture = Image.fromarray(_shades()[costmap.costs[::-1]]).resize((g.width * scale, g.height * scale), Image.NEAREST)
    pen = ImageDraw.Draw(picture)

    def pixels(points):
        return [
            ((x - g.origin_x) / g.resolution * scale, (g.height - (y - g.origin_y) / g.resolution) * scale)
            for x, y in points
        ]

    def outline(x, y, yaw, colour):
        turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
        pen.polygon(pixels(np.asarray(footprint) @ turn + (x, y)), outline=colour)

    if plan is not None:
        for x, y, yaw in _spread(np.asarray(plan, float)):
            outline(x, y, yaw, BODY)
        pen.line(pixels(plan[:, :2]), fill=PLAN, width=2)
    for pose, colour in ((start, START), (goal, GOAL)):
        if pose.is_finite() and g.to_cell(pose.x, pose.y) is not None:
            outline(pose.x, pose.y, pose.yaw, colour)
    picture.save(path)


def _spread(plan):
    """Yield the rows of a plan (n, 3) at which the footprint is drawn."""
    last = plan[0]
    for row in plan[1:-1]:
        turned = abs(wrap(row[2] - last[2]))
        if math.hypot(row[0] - last[0], row[1] - last[1]) >= BODY_EVERY or turned >= BODY_TURN:
            last = row
            yield row
