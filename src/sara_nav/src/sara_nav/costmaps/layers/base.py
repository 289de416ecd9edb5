"""What every layer of a costmap has in common; the scheme is costmap_2d's (Lu, Hershberger, Smart, IROS 2014).

Each update asks the layers, from the bottom up, first which cells changed and then to write their costs into those.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Protocol

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import UNKNOWN
from sara_nav.grids.grid import GridGeometry
from sara_nav.grids.windows import Window, Windows

HERE = Pose2D(0.0, 0.0, 0.0)
"""A costmap's frame in its own grid's."""


class LayerConfig(Protocol):
    """A layer's parameters, a frozen dataclass."""

    enabled: bool

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""


class Parent(Protocol):
    """What a layer uses of the LayeredCostmap that it is part of."""

    geometry: GridGeometry
    footprint: np.ndarray
    inscribed_radius: float
    layers: dict[str, Layer]

    def touch_all(self) -> None:
        """Have everything computed anew in the next update."""

    def resize(self, geometry: GridGeometry, locked: bool = False) -> None:
        """Take another GridGeometry."""


class Layer:
    """One layer. ``name``: as in ``plugins``; ``config``: its frozen dataclass, with the field ``enabled``.

    ``counts``: what was dropped, by kind; ``problem``: the last such thing in words.
    """

    config_class = None

    def __init__(self, name: str, config: LayerConfig | None = None) -> None:
        self.name = name
        self.config = self.config_class() if config is None else config
        faults = self.config.faults()
        if faults:
            raise ValueError('; '.join(f'{name}/{fault}' for fault in faults))
        self.counts = Counter()
        self.problem = ''
        self.parent = None
        self._passing_until = -math.inf

    @property
    def enabled(self) -> bool:
        """False when the layer is switched off; then it neither marks nor clears."""
        return self.config.enabled

    def attach(self, parent: Parent) -> None:
        """Take the LayeredCostmap that this layer is part of."""
        self.parent = parent
        self.resize(parent.geometry)

    def resize(self, geometry: GridGeometry) -> None:
        """The costmap has a new GridGeometry: what was known is forgotten."""

    def roll(self, columns: int, rows: int) -> None:
        """The window moved by whole cells; what is still in it is kept."""

    def update_bounds(self, t: float, pose: Pose2D | None, windows: Windows) -> None:
        """Take in what was learned until ``t`` (s) and enter what changed into the Windows. pose: Pose2D or None."""

    def update_costs(self, costs: np.ndarray, window: Window) -> None:
        """Write into the cells of a window of the costmap's array (h, w)."""

    def finish(self, costs: np.ndarray, window: Window) -> None:
        """Write what depends on the costs around a window too, once all windows were written."""

    def reset(self) -> None:
        """Forget what sensors said."""

    def clear(self, x0: int, y0: int, xn: int, yn: int, invert: bool) -> bool:
        """Forget all cells but x0 < x < xn, y0 < y < yn, or with ``invert`` just those; False: nothing to forget."""
        return False

    def footprint_changed(self) -> None:
        """The robot's outline is another one now."""

    def reconfigure(self, config: LayerConfig) -> None:
        """Take a new configuration; raises ValueError naming what is wrong in it."""
        faults = config.faults()
        if faults:
            raise ValueError('; '.join(f'{self.name}/{fault}' for fault in faults))
        self.config = config
        self.parent.touch_all()

    def time_went_back(self, t: float) -> None:
        """The clock was set back to ``t`` (s): stamps from before mean nothing."""
        self._passing_until = -math.inf

    def let_pass(self, t: float) -> None:
        """Whoever stops the robot says at t (s) that somebody who moves passes: a layer with a `passing_memory` marks
        nothing for so long, and forgets what it marked so long before. It clears all the same.
        """
        memory = getattr(self.config, 'passing_memory', 0.0)
        if memory > 0.0 and self.enabled:
            if t > self._passing_until:
                self.forget_since(t - memory)
            self._passing_until = t + memory

    def forget_since(self, since: float) -> None:
        """Let go of what was last marked after ``since`` (s)."""

    def stale(self, t: float) -> str:
        """Return '' or a sentence on what this layer waits for."""
        return ''

    def drop(self, kind: str, text: str) -> None:
        """Count something that cannot be used."""
        self.counts[kind] += 1
        self.problem = text


class GridLayer(Layer):
    """A layer that keeps costs (h, w) uint8 of its own, on the costmap's cells."""

    default = UNKNOWN
    """Cost of a cell that nothing is known of; unknown cells leave the costmap as it is."""

    def resize(self, geometry: GridGeometry) -> None:
        self.costs = np.full(geometry.shape, self.default, np.uint8)

    def roll(self, columns: int, rows: int) -> None:
        self.costs = shifted(self.costs, columns, rows, self.default)

    def reset(self) -> None:
        self.costs[:] = self.default
        self.parent.touch_all()

    def clear(self, x0: int, y0: int, xn: int, yn: int, invert: bool) -> bool:
        self.costs[outside(self.costs.shape, x0, y0, xn, yn, invert)] = UNKNOWN
        self.parent.touch_all()
        return True


def shifted(array: np.ndarray, columns: int, rows: int, fill: float) -> np.ndarray:
    """Return what a window over ``array`` (h, w) sees after it moved by whole cells; new cells hold ``fill``."""
    result = np.empty(array.shape, array.dtype)
    result.fill(fill)
    height, width = array.shape
    if abs(columns) < width and abs(rows) < height:
        x, y = max(0, columns), max(0, rows)
        part = array[y : height + min(0, rows), x : width + min(0, columns)]
        result[y - rows : y - rows + part.shape[0], x - columns : x - columns + part.shape[1]] = part
    return result


def outside(shape: tuple[int, int], x0: int, y0: int, xn: int, yn: int, invert: bool) -> np.ndarray:
    """Return a mask of all cells but x0 < x < xn, y0 < y < yn; with ``invert`` of just those."""
    mask = np.full(shape, not invert)
    mask[max(0, y0 + 1) : max(0, yn), max(0, x0 + 1) : max(0, xn)] = invert
    return mask


def combine(costs: np.ndarray, own: np.ndarray, window: Window, maximum: bool) -> None:
    """Write a layer's costs into a window: the greater one (``maximum``), or its own; unknown cells write nothing."""
    x0, y0, xn, yn = window
    master, values = costs[y0:yn, x0:xn], own[y0:yn, x0:xn]
    known = values != UNKNOWN
    if maximum:
        known &= (master == UNKNOWN) | (master < values)
    np.copyto(master, values, where=known)
