"""costmap_2d::ObstacleLayer: what laser scanners and depth cameras see, marked at the points and cleared on the way.

Sources, ranges, heights, persistence and the ways to combine are the peer's. What is seen is given to it as points in
the costmap's frame (observations.py).
"""

from __future__ import annotations

import math

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import FREE, UNKNOWN
from sara_nav.costmaps.layers import rays
from sara_nav.costmaps.layers.base import HERE, GridLayer, Parent, combine, shifted
from sara_nav.costmaps.layers.obstacle_config import MAXIMUM, NOTHING, ObstacleConfig
from sara_nav.costmaps.observations import Observation
from sara_nav.grids.grid import LETHAL, GridGeometry
from sara_nav.grids.windows import Window, Windows


class ObstacleLayer(GridLayer):
    """Marks what its sources see and clears what they see through."""

    config_class = ObstacleConfig

    @property
    def default(self) -> int:
        """Cost of a cell that nothing is known of."""
        return UNKNOWN if self.config.track_unknown_space else FREE

    def attach(self, parent: Parent) -> None:
        self._seen = {source.name: [] for source in self.config.sources}
        self._heard = {}
        self._new = set()
        self._started = None
        super().attach(parent)

    def resize(self, geometry: GridGeometry) -> None:
        super().resize(geometry)
        self._forget_times()

    def roll(self, columns: int, rows: int) -> None:
        super().roll(columns, rows)
        if len(self._times[0]):
            fills = -math.inf, -math.inf, False
            self._times = tuple(shifted(kept, columns, rows, fill) for kept, fill in zip(self._times, fills))

    def _forget_times(self):
        """Keep since when, and until when, cells were marked only where that is asked for; nothing is known yet."""
        shape = self.costs.shape if self.config.keeps_times else (0, 0)
        self._times = np.full(shape, -math.inf), np.full(shape, -math.inf), np.zeros(shape, bool)

    @property
    def _marks(self):
        return rays.Marks(self.costs, *self._times)

    def reconfigure(self, config: ObstacleConfig) -> None:
        super().reconfigure(config)
        if config.keeps_times != bool(len(self._times[0])):
            self._forget_times()
        for source in config.sources:
            self._seen.setdefault(source.name, [])

    def marked(self) -> tuple[np.ndarray, GridGeometry, Pose2D]:
        """Return (costs (h, w), the GridGeometry they lie on, the costmap's frame in that grid's, Pose2D)."""
        return self.costs, self.parent.geometry, HERE

    # -- observations in ---------------------------------------------------------------------------------------

    def add_observation(self, observation: Observation) -> None:
        """Take an Observation for the coming updates; one that makes no sense is dropped and counted."""
        source = next((s for s in self.config.sources if s.name == observation.source), None)
        if source is None:
            self.drop(
                'unknown_sources', f'an observation of {observation.source!r}, which observation_sources does not name'
            )
            return
        points = np.array(observation.points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            self.drop('bad_clouds', f'an observation of {source.name} whose points have shape {points.shape}')
            return
        if not all(map(math.isfinite, (observation.stamp, *observation.origin))):
            self.drop('bad_poses', f'an observation of {source.name} whose origin or stamp is not a number')
            return
        seen = self._seen[source.name]
        if seen and observation.stamp < seen[0].stamp:
            self.drop('old_observations', f'an observation of {source.name} that is older than the one before')
            return
        self._new.add(source.name)
        if not self.enabled:
            seen.clear()  # switched on again, it begins with what is seen then
            return
        good = np.isfinite(points).all(axis=1)
        if not good.all():
            self.drop('bad_points', f'points of {source.name} that are not numbers')
            points = points[good]
        with_height = (points[:, 2] >= source.min_obstacle_height) & (points[:, 2] <= source.max_obstacle_height)
        seen.insert(
            0,
            Observation(
                source.name,
                observation.stamp,
                tuple(map(float, observation.origin)),
                np.ascontiguousarray(points[with_height]),
            ),
        )
        persists = source.observation_persistence
        seen[1:] = [o for o in seen[1:] if persists > 0.0 and observation.stamp - o.stamp <= persists]

    def forget_observations(self) -> None:
        """Forget what was observed; the marks it made stay."""
        for seen in self._seen.values():
            seen.clear()

    def time_went_back(self, t: float) -> None:
        super().time_went_back(t)
        self.forget_observations()
        self._heard.clear()
        self._new.clear()
        self._started = t
        for stamps in self._times[:2]:
            np.minimum(stamps, t, out=stamps)

    def forget_since(self, since: float) -> None:
        self._forget(since, math.inf)
        self.parent.touch_all()

    def _forget(self, since, until):
        """Let go of what was last marked between two times (s); returns the window (x0, y0, xn, yn) of it."""
        return rays.forget_marks(self._marks, float(since), float(until), self.default)

    def stale(self, t: float) -> str:
        late = []
        for source in self.config.sources:
            silent = t - self._heard.get(source.name, t if self._started is None else self._started)
            if source.name not in self._new and 0.0 < source.expected_update_rate < silent:
                late.append(
                    f'{source.data_type} on {source.topic or source.name} silent for {silent:.1f} s '
                    f'(expected_update_rate {source.expected_update_rate:g} s)'
                )
        return '; '.join(late)

    # -- the layer ---------------------------------------------------------------------------------------------

    def update_bounds(self, t: float, pose: Pose2D | None, windows: Windows) -> None:
        if self._started is None:
            self._started = t
        self._heard.update((name, t) for name in self._new)
        self._new.clear()
        for source in self.config.sources:
            if source.observation_persistence > 0.0:
                self._seen[source.name] = [
                    o for o in self._seen[source.name] if t - o.stamp <= source.observation_persistence
                ]
        for source in self.config.sources:
            for observation in self._seen[source.name] if source.clearing else ():
                self._clear_rays(observation, source, windows, pose)
        grid, highest = self.parent.geometry.grid, float(self.config.max_obstacle_height)
        marks = self._marks
        for source in self.config.sources:
            reach = rays.Reach(float(source.obstacle_range), highest)
            for o in self._seen[source.name] if source.marking else ():
                if o.stamp > self._passing_until:
                    points = self._unmapped(o.points) if self.config.ignore_mapped else o.points
                    sensor = np.array(o.origin, np.float64)
                    at = float(min(o.stamp, t))  # a clock that is ahead must not make marks that stay
                    windows.add(*rays.mark_points(marks, grid, at, sensor, points, reach))
        if self.config.pixel_decay > 0.0:
            windows.add(*self._forget(-math.inf, t - self.config.pixel_decay))
        if self.config.footprint_clearing_enabled and pose is not None and len(self.parent.footprint) > 2:
            self._clear_footprint(pose, windows)
        if self.config.mark_after > 0.0:
            windows.add(*rays.find_standing(marks, float(self.config.mark_after)))

    def _unmapped(self, points):
        """Those of the points (n, 3) that nothing on the map explains."""
        for layer in self.parent.layers.values():
            mapped = layer.mapped() if layer.enabled and hasattr(layer, 'mapped') else None
            if mapped is not None:
                costs, g, frame = mapped
                place = float(frame.x), float(frame.y), float(frame.yaw)
                points = points[rays.far_from(costs, g.grid, place, points, float(self.config.mapped_tolerance))]
        return points

    def _clear_rays(self, observation, source, windows, pose):
        g = self.parent.geometry
        x, y, _ = observation.origin
        if g.to_cell(x, y) is None:
            if pose is not None or not self.parent.config.rolling_window:  # else the window is not about the robot yet
                self.drop('sensors_off_the_map', f'the clearing by a sensor at ({x:.2f}, {y:.2f}), off the map')
            return
        reach = math.ceil(source.raytrace_range / g.resolution)
        windows.add(*rays.clear_rays(self.costs, g.grid, (float(x), float(y)), observation.points, reach))

    def _clear_footprint(self, pose, windows):
        g = self.parent.geometry
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        x, y = self.parent.footprint.T
        cells = np.column_stack(
            [
                np.floor((pose.x + c * x - s * y - g.origin_x) / g.resolution),
                np.floor((pose.y + s * x + c * y - g.origin_y) / g.resolution),
            ]
        )
        if np.abs(cells).max() < 1e6:
            windows.add(*rays.free_polygon(self.costs, cells.astype(np.int64)))

    def update_costs(self, costs: np.ndarray, window: Window) -> None:
        if self.config.combination_method == NOTHING:
            return
        x0, y0, xn, yn = window
        part = np.s_[y0:yn, x0:xn]
        own = self.costs[part]
        if self.config.mark_after > 0.0:
            own = np.where((own == LETHAL) & ~self._marks.stands[part], np.uint8(self.default), own)
        combine(costs[part], own, (0, 0, xn - x0, yn - y0), self.config.combination_method == MAXIMUM)


def warm() -> None:
    """Compile, or load from the cache, every kernel."""
    rays.warm()
