"""What the tests of the planners on a potential share: a small Costmap, and which of its cells hang together."""

import numpy as np

from sara_nav.costmaps.costmap import Costmap
from sara_nav.grids.grid import GridGeometry


def make(costs, resolution=0.1, x=-0.3, y=2.0):
    costs = np.ascontiguousarray(costs)
    return Costmap(costs, GridGeometry(costs.shape[1], costs.shape[0], resolution, x, y))


def connected(free, start):
    """Cells reachable over sides: a flood written out plainly, as the oracle."""
    found, todo = {start}, [start]
    while todo:
        x, y = todo.pop()
        for a, b in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
            if (a, b) not in found and 0 <= a < free.shape[1] and 0 <= b < free.shape[0] and free[b, a]:
                found.add((a, b))
                todo.append((a, b))
    return found
