"""The layers of a costmap, found by the names users of costmap_2d write into ``plugins``."""

from sara_nav.config.registry import Registry
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.keepout import KeepoutFilter
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.range_sensor import RangeSensorLayer
from sara_nav.costmaps.layers.speed import SpeedFilter
from sara_nav.costmaps.layers.static import StaticLayer

LAYERS = Registry(
    'type',
    refused={
        'costmap_2d::VoxelLayer': 'costmap_2d::ObstacleLayer, with min_obstacle_height and max_obstacle_height of '
        'each source',
        'costmap_prohibition_layer_namespace::CostmapProhibitionLayer': 'sara_nav/KeepoutFilter, with the areas as '
        "keep_out in the map's edits file",
    },
)
for _name, _layer in (
    ('costmap_2d::StaticLayer', StaticLayer),
    ('costmap_2d::ObstacleLayer', ObstacleLayer),
    ('range_sensor_layer::RangeSensorLayer', RangeSensorLayer),
    ('sara_nav/KeepoutFilter', KeepoutFilter),
    ('sara_nav/SpeedFilter', SpeedFilter),
    ('costmap_2d::InflationLayer', InflationLayer),
):
    LAYERS.register(_name)(_layer)
