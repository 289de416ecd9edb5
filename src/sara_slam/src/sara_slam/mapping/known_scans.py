"""What key scans show about a place, to match another one with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sara_slam.mapping.key_scan import KeyScan
from sara_slam.matching.likelihood_grid import Grain, LikelihoodGrid
from sara_slam.matching.surfaces import Surfaces, placed

BEYOND = 1.0
"""m beyond the longest ray that a grid shows."""
KEPT = 200
"""Key scans whose surfaces are kept."""


class KnownScans:
    """scans, poses (x, y, yaw): lists that grow, and whose items may be exchanged."""

    def __init__(self, scans: list[KeyScan], poses: list[tuple[float, float, float]]) -> None:
        self._scans, self._poses, self._surfaces = scans, poses, {}

    def grid(
        self,
        key: KeyScan,
        nodes: Sequence[int],
        pose: tuple[float, float, float],
        margin: float,
        grain: Grain,
        cleared: bool = True,
    ) -> LikelihoodGrid | None:
        """The LikelihoodGrid of some of the scans for another, `key`, about a pose, which may be off by a margin (m),
        as far as that one reaches beyond; None where they show nothing there. cleared: it tells also where their rays
        went through.
        """
        ends = key.ends
        reach = (float(np.hypot(ends[:, 0], ends[:, 1]).max()) if len(ends) else 0.0) + margin + BEYOND
        seen = [self._surfaces_of(node).placed(self._poses[node]) for node in nodes]
        known = Surfaces(*(np.concatenate(parts) for parts in zip(*seen)))
        near = (np.abs(known.points - pose[:2]) < reach).all(1)
        near &= known.facing(placed(np.array([key.origin]), pose)[0], margin)
        if not near.any():
            return None
        grid = LikelihoodGrid(Surfaces(known.points[near], known.normals[near]), margin, grain)
        if cleared:
            for node in nodes:
                scan = self._scans[node]
                placed_ends = placed(np.vstack((scan.origin, scan.ends)).astype(float), self._poses[node])
                grid.clear(placed_ends[0], placed_ends[1:])
        return grid

    def _surfaces_of(self, node):
        """Those of a key scan; the newest that were asked for are kept."""
        found = self._surfaces.pop(node, None) or self._scans[node].surfaces()
        self._surfaces[node] = found
        if len(self._surfaces) > KEPT:
            del self._surfaces[next(iter(self._surfaces))]
        return found
