"""Whether a robot's footprint touches anything on a costmap."""
import numpy as np

from sara_nav import kernels
from sara_nav.footprint import cover


class CollisionChecker:
    """Looks a footprint up in a costmap.

    footprint: corners (k, 2), metres, robot's frame. ``unknown_blocks``: unknown cells are obstacles.
    """

    def __init__(self, costmap, footprint, unknown_blocks=True):
        self.geometry = costmap.geometry
        self.unknown_blocks = bool(unknown_blocks)
        self._costs = costmap.costs
        self._points = cover(footprint, 0.5 * costmap.geometry.resolution)

    def touched(self, poses):
        """Return how many of the footprint's points lie on obstacles at each pose of poses (n, 3), int64 (n,)."""
        g = self.geometry
        return kernels.touched(self._costs, float(g.origin_x), float(g.origin_y), float(g.resolution), self._points,
                               np.ascontiguousarray(poses, dtype=np.float64), self.unknown_blocks)

    def collides(self, pose):
        """True when the footprint at a Pose2D overlaps an obstacle or leaves the map."""
        return bool(self.touched([[pose.x, pose.y, pose.yaw]])[0] > 0)

    def worsens(self, poses):
        """True when any later pose touches more than the first: so a robot already in contact can only leave."""
        counts = self.touched(poses)
        return bool(counts.max() > counts[0])
