"""What the lattice's kernels look at: distances to obstacles, the body among them, and the rules that time moves."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_nav.grids.footprint import cover, radii


class Rules(NamedTuple):
    """How moves are timed and what gaps are allowed; all floats."""

    speed: float
    """m/s that legs and arcs are timed with."""
    turn_rate: float
    """rad/s that turns are timed with."""
    lateral: float
    """m/s2 across that arcs are timed with."""
    reverse_factor: float
    """How many times longer a move astern counts than one ahead."""
    hard_margin: float
    """m; the least gap allowed."""
    greatest_gap: float
    """m; greater gaps are not told apart."""
    clearance: float
    """m; the gap from which on nothing slows a drive."""
    clearance_weight: float
    """How many times its time a drive takes longer without any gap."""
    turning_room: float
    """m of room wanted round the circle that turning in place sweeps."""
    turning_room_weight: float
    """How many times its time a turn takes longer without that room."""
    turn_cost: float
    """s for beginning a turn in place."""
    gear_cost: float
    """s for changing between ahead and astern."""
    origin_x: float
    """m; the map's corner."""
    origin_y: float
    """m; the map's corner."""
    resolution: float
    """m of a cell's side."""
    spacing: float
    """m between the outline's points."""
    radius: float
    """m from the body's origin to its farthest corner."""
    sense: float
    """1.0, or -1.0 where moves are searched backwards in time, so that ahead is astern."""
    narrow: float
    """m; a gap of less makes a place narrow."""
    run_up: float
    """m of straight leg wished for before and after narrow places."""
    run_up_cost: float
    """s that its want costs at either end of a leg."""
    blind: float
    """m before the front and behind the rear, within which sensors do not measure."""
    beside: float
    """m; the gap beside the body with less of which it is not let turn in place."""
    blind_weight: float
    """How many times its time a turn or an arc takes longer with something there."""


class World(NamedTuple):
    """A body among obstacles."""

    distances: np.ndarray
    """float32 (rows + 1, columns + 1): m from each corner of cells to the nearest obstacle."""
    rules: Rules
    outline: np.ndarray
    """float64 (n, 2): points on the body's outline in their order, ``rules.spacing`` apart at most, m."""
    inside: np.ndarray
    """float64 (k, 2): points that cover the body, m."""
    ends: np.ndarray
    """float64 (6, 2): points before the front and behind the rear, m; within 0.55 ``rules.blind`` of them is where
    sensors do not measure.
    """


class Body:
    """A footprint (k, 2), m, as the kernels need it. ``outline`` and ``inside``: see World; ``spacing``: m between the
    outline's points; ``inscribed``, ``circumscribed``: radii, m.
    """

    def __init__(self, corners: np.ndarray, resolution: float) -> None:
        self.corners, self.resolution = np.ascontiguousarray(corners, dtype=np.float64), resolution
        self.inscribed, self.circumscribed = radii(self.corners)
        following = np.roll(self.corners, -1, axis=0)
        points, self.spacing = [], 0.0
        for a, b in zip(self.corners, following):
            length = math.hypot(*(b - a))
            n = max(1, math.ceil(length / (0.5 * resolution)))
            self.spacing = max(self.spacing, length / n)
            points.append(a + np.arange(n)[:, None] / n * (b - a))
        self.outline = np.ascontiguousarray(np.vstack(points))
        self.inside = cover(self.corners, 0.5 * resolution)

    def ends(self, blind: float) -> np.ndarray:
        """World.ends, where sensors at both ends, 0.6 of the body's width apart at most, do not measure within
        ``blind`` m.
        """
        low, high = self.corners.min(axis=0), self.corners.max(axis=0)
        y = 0.5 * (low[1] + high[1]) + 0.3 * (high[1] - low[1]) * np.array([-1.0, 0.0, 1.0])
        return np.array([(x, side) for x in (low[0] - 0.5 * blind, high[0] + 0.5 * blind) for side in y])


def example_world() -> World:
    """A small World of the types that kernels are compiled for."""
    points = np.zeros((4, 2))
    return World(np.zeros((4, 4), np.float32), Rules(*(1.0 for _ in Rules._fields)), points, points, points)
