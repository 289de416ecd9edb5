"""range_sensor_layer::RangeSensorLayer: ultrasonic and infrared rangers, the thesis's "ultrasonic" layer.

Readings follow REP-117: -Inf is an echo nearer than the sensor can measure and marks at min_range; +Inf and anything
beyond max_range is no echo, and clears the cone (``clear_on_max_reading``, on here and off in the peer). What was
marked is forgotten after ``pixel_decay`` (``use_decay``, on here and off in the peer). With ``ignore_mapped`` (not the
peer's) echoes that the map explains mark nothing, for the cone of an ultrasonic sensor drawn as an arc closes doors.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.layers import cone, mapped_echo
from sara_nav.costmaps.layers.base import Layer, Parent, outside, shifted
from sara_nav.costmaps.layers.range_sensor_config import RangeSensorConfig
from sara_nav.grids.grid import GridGeometry
from sara_nav.grids.windows import Window, Windows, around

FARTHEST = 1e6
"""Positions (m) and angles (rad) beyond this are nonsense; cells there could not even be counted."""
MOST_WAITING = 1000
"""Readings kept between two updates; older ones are dropped."""


class RangeReading(NamedTuple):
    """One reading: ``source`` topic, ``stamp`` s, sensor's x, y, yaw (m, rad) in the costmap's global frame, ``range``
    m or +-Inf, limits m, ``field_of_view`` rad (the whole cone)."""

    source: str
    stamp: float
    x: float
    y: float
    yaw: float
    range: float
    min_range: float
    max_range: float
    field_of_view: float


class RangeSensorLayer(Layer):
    """Joins range readings in a grid of probabilities; marks and clears by thresholds."""

    config_class = RangeSensorConfig

    def attach(self, parent: Parent) -> None:
        self._waiting = deque(maxlen=MOST_WAITING)
        self._stamps = {}
        self._heard = {}
        self._started = None
        self._kind = self.config.input_sensor_type.upper()
        super().attach(parent)

    def resize(self, geometry: GridGeometry) -> None:
        self._grid = np.full(geometry.shape, 0.5, np.float32)
        self._seen_at = np.full(geometry.shape, -math.inf)
        self._forget_free()
        self._marks = None

    def roll(self, columns: int, rows: int) -> None:
        self._grid = shifted(self._grid, columns, rows, 0.5)
        self._seen_at = shifted(self._seen_at, columns, rows, -math.inf)
        if len(self._free_at):
            self._free_at = shifted(self._free_at, columns, rows, -math.inf)
        if self._marks is not None:
            x0, y0, xn, yn = self._marks
            height, width = self._grid.shape
            self._marks = (max(0, x0 - columns), max(0, y0 - rows), min(width, xn - columns), min(height, yn - rows))

    def reset(self) -> None:
        self._waiting.clear()
        self.resize(self.parent.geometry)
        self.parent.touch_all()

    def clear(self, x0: int, y0: int, xn: int, yn: int, invert: bool) -> bool:
        forgotten = outside(self._grid.shape, x0, y0, xn, yn, invert)
        self._grid[forgotten] = 0.5
        if len(self._free_at):
            self._free_at[forgotten] = -math.inf
        self.parent.touch_all()
        return True

    def reconfigure(self, config: RangeSensorConfig) -> None:
        remembered = self.config.free_memory > 0.0
        super().reconfigure(config)
        self._kind = config.input_sensor_type.upper()
        if remembered != (config.free_memory > 0.0):
            self._forget_free()

    def _forget_free(self):
        """Keep when cells were last seen free only where that is asked for; nothing is known of it yet."""
        self._free_at = np.full(self._grid.shape if self.config.free_memory > 0.0 else (0, 0), -math.inf)

    def time_went_back(self, t: float) -> None:
        super().time_went_back(t)
        self._waiting.clear()
        self._stamps.clear()
        self._heard.clear()
        self._started = t
        np.minimum(self._seen_at, t, out=self._seen_at)
        self._free_at[:] = -math.inf

    # -- readings in -------------------------------------------------------------------------------------------

    def add_range(self, reading: RangeReading) -> None:
        """Take a RangeReading for the next update; one that makes no sense is dropped and counted, and while the layer
        is switched off nothing is kept.
        """
        if not self.enabled:
            return
        kind, text = self._fault(reading)
        if kind:
            self.drop(kind, f'a reading of {reading.source}: {text}')
            return
        self._stamps[reading.source] = reading.stamp
        if len(self._waiting) == self._waiting.maxlen:
            self.drop('overflow', f'more than {MOST_WAITING} readings between two updates')
        self._waiting.append(reading)

    def forget_since(self, since: float) -> None:
        lately = (self._seen_at > since) & (self._grid > self.config.mark_threshold)
        if lately.any():
            self._grid[lately] = 0.5
            self.parent.touch_all()

    def _fault(self, r):
        source, stamp, x, y, yaw, distance, least, most, field_of_view = r
        if not (math.isfinite(stamp) and abs(x) <= FARTHEST and abs(y) <= FARTHEST and abs(yaw) <= FARTHEST):
            return 'bad_poses', f'its stamp is no number, or its pose none within {FARTHEST:g}'
        if not (0.0 <= least <= most <= FARTHEST and most > 0.0):
            return 'bad_limits', f'min_range {least!r}, max_range {most!r}'
        if not 0.0 < field_of_view <= 2.0 * math.pi + 1e-6:
            return 'bad_limits', f'field_of_view {field_of_view!r}'
        if math.isnan(distance):
            return 'nan_ranges', 'its range is NaN'
        if stamp < self._stamps.get(source, -math.inf):
            return 'old_readings', 'it is older than the one before'
        return '', ''

    def _meaning(self, r):
        """Return (distance m, True to clear the cone) of a reading, or None when it says nothing."""
        if self._kind == 'FIXED' or (self._kind == 'ALL' and r.min_range == r.max_range):
            if math.isfinite(r.range):
                self.drop(
                    'bad_fixed_ranges',
                    f'a reading of {r.source}: a sensor of fixed distance may only say +Inf or -Inf',
                )
                return None
            if r.range > 0.0:
                return (r.min_range, True) if self.config.clear_on_max_reading else None
            return r.min_range, False
        if r.range == -math.inf:
            return r.min_range, False
        if r.range < r.min_range:
            self.drop('below_min_range', f'a reading of {r.source}: {r.range:.3f} m is below min_range')
            return None
        if self.config.clear_on_max_reading and r.range >= r.max_range:
            return r.max_range, True
        return None if r.range > r.max_range else (r.range, False)

    # -- the layer ---------------------------------------------------------------------------------------------

    def update_bounds(self, t: float, pose: Pose2D | None, windows: Windows) -> None:
        if self._started is None:
            self._started = t
        g, c = self.parent.geometry, self.config
        waiting, self._waiting = self._waiting, deque(maxlen=MOST_WAITING)
        readings, near = [], []
        for r in waiting:
            source, stamp, x, y, yaw, distance, _, _, field_of_view = r
            self._heard[source] = t
            meaning = self._meaning(r)
            if meaning is not None:
                empty = meaning[1] or stamp <= self._passing_until
                readings.append((x, y, yaw, meaning[0], 0.5 * field_of_view, empty))
                near.append(distance == -math.inf)
        if readings:
            readings = np.array(readings, dtype=np.float64)
            if c.ignore_mapped or c.ignore_seen:
                readings = self._unexplained(readings, np.array(near))
            belief = cone.Belief(self._grid, self._seen_at, self._free_at)
            model = cone.Model(float(c.phi), float(c.inflate_cone), float(c.clear_threshold), float(c.mark_threshold))
            when = cone.When(float(t), float(t - c.free_memory))
            reached, changes = cone.apply_all(belief, g.grid, model, when, readings)
            for change in changes.tolist():
                windows.add(*change)
            if reached[0] < reached[2]:
                self._marks = reached if self._marks is None else around(self._marks, reached)
        if c.use_decay and self._marks is not None:
            changed, left = cone.forget(self._grid, self._seen_at, self._marks, float(t - c.pixel_decay))
            windows.add(*changed)
            self._marks = left if left[0] < left[2] else None

    def _unexplained(self, readings, near):
        """Return readings (n, 6) with each echo that the map or an obstacle layer explains turned into an empty cone up
        to where that may be.
        """
        c = self.config
        for layer in self.parent.layers.values():
            known = self._explaining(layer) if layer.enabled else None
            if known is not None:
                costs, g, frame = known
                place = float(frame.x), float(frame.y), float(frame.yaw)
                steepest = math.cos(c.mapped_steepest)
                mapped = mapped_echo.Mapped(costs, g.grid, place, float(c.mapped_tolerance), steepest)
                mapped_echo.explain(mapped, readings, near)
        return mapped_echo.of_some_length(readings)

    def _explaining(self, layer):
        """(costs, their GridGeometry, the costmap's frame in that grid's) of what a layer explains echoes with; None
        without such.
        """
        if self.config.ignore_mapped and hasattr(layer, 'mapped'):
            return layer.mapped()
        return layer.marked() if self.config.ignore_seen and hasattr(layer, 'marked') else None

    def update_costs(self, costs: np.ndarray, window: Window) -> None:
        cone.write(self._grid, costs, window, float(self.config.clear_threshold), float(self.config.mark_threshold))

    def stale(self, t: float) -> str:
        limit = self.config.no_readings_timeout
        if limit <= 0.0 or not self.enabled or self._started is None:
            return ''
        silent = [(t - self._heard.get(source, self._started), source) for source in self.config.sources()]
        return '; '.join(f'range sensor on {source} silent for {age:.1f} s' for age, source in silent if age > limit)

    @property
    def probabilities(self) -> np.ndarray:
        """float32 (h, w): how likely each cell is occupied; 0.5 where nothing is known."""
        return self._grid


def warm() -> None:
    """Compile, or load from the cache, every kernel."""
    cone.warm()
    mapped_echo.warm()
