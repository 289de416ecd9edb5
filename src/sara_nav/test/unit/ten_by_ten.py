"""The map of costmap_2d's own tests, ten by ten cells of a metre, with an obstacle layer over it; used by several
tests.
"""

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig, SourceConfig
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.costmaps.observations import Observation
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.map_io import GridMap

AT_ORIGIN = Pose2D(0.0, 0.0, 0.0)
NO_FOOTPRINT = np.zeros((0, 2))
FAR = SourceConfig('far', clearing=True, obstacle_range=100.0, raytrace_range=100.0, observation_persistence=1e6)


def ten_by_ten():
    """The peer's map: 20 obstacles of one metre."""
    values = np.zeros((10, 10), np.int8)
    values[0:2, 7:] = values[2, 3:6] = values[5:8, 7:] = 100
    values[5:7, 4] = 100
    return GridMap(values, GridGeometry(10, 10, 1.0, 0.0, 0.0))


def make(static=True, track_unknown=False, footprint=NO_FOOTPRINT, sources=(FAR,), more=(), **parameters):
    """Return (LayeredCostmap, its ObstacleLayer) of 10 x 10 cells of 1 m."""
    layer = ObstacleLayer(
        'obstacles', ObstacleConfig(track_unknown_space=track_unknown, sources=tuple(sources), **parameters)
    )
    layers = ([StaticLayer('static_map')] if static else []) + [layer] + list(more)
    costmap = LayeredCostmap(
        CostmapConfig(resolution=1.0, track_unknown_space=track_unknown),
        layers,
        np.ones((1, 2)) if len(footprint) == 0 else footprint,
    )
    if static:
        layers[0].set_map(ten_by_ten())
    return costmap, layer


def see(layer, x, y, z=0.0, origin=(0.0, 0.0, 1.0), stamp=0.0, source='far'):
    layer.add_observation(Observation(source, stamp, origin, np.array([[x, y, z]], float)))


def count(costmap, value):
    return int((costmap.costmap.costs == value).sum())
