"""Costmaps: what it costs a robot's centre to be in each cell of a map.

Cost values and formulas are those of costmap_2d, so that its parameters and pictures carry over: 0 free,
1..252 near an obstacle, 253 the robot certainly touches (nearer than its inscribed radius), 254 an obstacle,
255 unknown. Distances to obstacles are exact Euclidean ones between cell centres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sara_common.config import range_faults
from sara_nav.grids import distances
from sara_nav.grids.grid import FREE, INSCRIBED, LETHAL, UNKNOWN, GridGeometry
from sara_nav.maps.map_io import GridMap


@dataclass(frozen=True)
class StaticLayerConfig:
    """Where a map comes from and how it becomes costs; names and defaults of costmap_2d::StaticLayer.

    Not the peer's: unknown cells within ``free_margin`` (m) of free ones are free.
    """

    track_unknown_space: bool = True
    lethal_cost_threshold: int = 100
    unknown_cost_value: int = -1
    trinary_costmap: bool = True
    map_topic: str = 'map'
    first_map_only: bool = False
    subscribe_to_updates: bool = False
    use_maximum: bool = False
    free_margin: float = 0.0
    enabled: bool = True

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        result = []
        if not 1 <= self.lethal_cost_threshold <= 100:
            result.append(f'lethal_cost_threshold is {self.lethal_cost_threshold!r}, allowed are numbers from 1 to 100')
        if not self.map_topic:
            result.append('map_topic is empty, allowed is the name of a topic')
        return result + range_faults(self, {'free_margin': (0.0, 10.0)})


@dataclass(frozen=True)
class InflationConfig:
    """How costs fall off around obstacles; names and defaults of costmap_2d::InflationLayer."""

    inflation_radius: float = 0.55
    cost_scaling_factor: float = 10.0
    inflate_unknown: bool = False
    enabled: bool = True

    def faults(self) -> list[str]:
        """Return a list of sentences, one for each bad value."""
        return range_faults(self, {'inflation_radius': (0.0, 50.0), 'cost_scaling_factor': (0.0, 100.0)})


@dataclass(frozen=True)
class Costmap:
    """Costs (height, width) uint8 with row 0 at the bottom, and where the cells are."""

    costs: np.ndarray
    geometry: GridGeometry

    def cost_at(self, x: float, y: float) -> int:
        """Return the cost at a point (m), or None off the map."""
        cell = self.geometry.to_cell(x, y)
        return None if cell is None else int(self.costs[cell[1], cell[0]])


def static_costs(data: np.ndarray, config: StaticLayerConfig = StaticLayerConfig()) -> np.ndarray:
    """Return costs uint8 of occupancy values int8 (-1 unknown, 0..100), same shape.

    Other negative values, and -1 where another value means unknown, are obstacles.
    """
    values = np.asarray(data).astype(np.int8).view(np.uint8).astype(np.int16)  # as the peer, which takes -1 for 255
    unknown = values == (config.unknown_cost_value & 255)
    lethal = values >= config.lethal_cost_threshold
    if config.trinary_costmap:
        costs = np.zeros(values.shape, np.uint8)
    else:
        costs = (values / config.lethal_cost_threshold * LETHAL).clip(0, LETHAL).astype(np.uint8)
    costs[lethal] = LETHAL
    costs[unknown] = UNKNOWN if config.track_unknown_space else FREE
    return costs


def freed(costs: np.ndarray, resolution: float, margin: float) -> np.ndarray:
    """Return costs (h, w), uint8, in which unknown cells within ``margin`` (m) of free ones are free."""
    blocked = costs != FREE
    if margin <= 0.0 or blocked.all():  # of no free cell, the transform would measure to the corner
        return costs
    from scipy.ndimage import distance_transform_edt  # takes long to import, and most costmaps have no such margin

    near = distance_transform_edt(blocked) * resolution <= margin
    return np.where(near & (costs == UNKNOWN), FREE, costs).astype(np.uint8)


def cost_of_distance(distance: np.ndarray | float, inscribed_radius: float, cost_scaling_factor: float) -> np.ndarray:
    """Return the cost 0..254 at ``distance`` (m, array) from an obstacle: floor(252 exp(-k (d - r_i)))."""
    distance = np.asarray(distance, float)
    costs = np.floor((INSCRIBED - 1) * np.exp(-cost_scaling_factor * np.maximum(distance - inscribed_radius, 0.0)))
    costs = np.where(distance <= inscribed_radius, INSCRIBED, costs)
    return np.where(distance == 0.0, LETHAL, costs).astype(np.uint8)


def reach_of(radius: float, resolution: float, shape: tuple[int, int]) -> int:
    """Return how many cells a radius (m) reaches on a grid of this shape: ceil(radius/resolution), never beyond its
    diagonal.
    """
    return math.ceil(min(radius / resolution, math.hypot(*shape)))


def cost_table(reach: int, resolution: float, inscribed_radius: float, cost_scaling_factor: float) -> np.ndarray:
    """Return the costs (uint8, reach^2 + 1) by squared distance in cells."""
    return cost_of_distance(resolution * np.sqrt(np.arange(reach * reach + 1)), inscribed_radius, cost_scaling_factor)


def inflate(
    costs: np.ndarray, resolution: float, inscribed_radius: float, config: InflationConfig = InflationConfig()
) -> np.ndarray:
    """Return costs with every obstacle (254) spread to ``inflation_radius``; the greater cost wins.

    An unknown cell becomes known when ``inflate_unknown`` is set and the obstacle's cost there is not 0, or
    when that cost is 253.
    """
    reach = reach_of(config.inflation_radius, resolution, costs.shape)
    result = np.array(costs, np.uint8)
    if reach:
        distances.spread(
            np.array(costs, np.uint8),
            result,
            (0, 0, result.shape[1], result.shape[0]),
            reach,
            cost_table(reach, resolution, inscribed_radius, config.cost_scaling_factor),
            1 if config.inflate_unknown else INSCRIBED,
        )
    return result


def build(
    grid_map: GridMap,
    inscribed_radius: float,
    static: StaticLayerConfig = StaticLayerConfig(),
    inflation: InflationConfig = InflationConfig(),
) -> Costmap:
    """Return the Costmap of a GridMap for a robot of this inscribed radius (m)."""
    costs = static_costs(grid_map.data, static)
    return Costmap(
        np.ascontiguousarray(inflate(costs, grid_map.geometry.resolution, inscribed_radius, inflation)),
        grid_map.geometry,
    )


def to_occupancy(costs: np.ndarray) -> np.ndarray:
    """Return costs as the peer publishes them: 0 -> 0, 253 -> 99, 254 -> 100, 255 -> -1, others 1..98 (int8)."""
    return _OCCUPANCY[costs]


_OCCUPANCY = (1 + 97 * (np.arange(256) - 1) // 251).astype(np.int8)
_OCCUPANCY[[FREE, INSCRIBED, LETHAL, UNKNOWN]] = 0, 99, 100, -1
