"""A costmap read from parameters under costmap_2d's names: with ``plugins``, or in the form from before Hydro.

In that form the costmap's own parameters go before a layer's, as in the peer, which moves them into the layer's
namespace: what was tuned is left there, and an edited YAML file must win against what the last run left.

Every fault is collected and named; what has no effect is warned of.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from sara_nav.config.parameters import Parameters
from sara_nav.config.registry import UnknownPlanner
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers import LAYERS
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import SourceConfig
from sara_nav.costmaps.layers.range_sensor import RangeSensorConfig, RangeSensorLayer
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.grids.footprint import FootprintError, circle_footprint, pad_footprint, parse_footprint, radii
from sara_nav.maps.map_io import GridMap

FROM_PARENT = {
    'costmap_2d::StaticLayer': ('map_topic', 'unknown_cost_value', 'lethal_cost_threshold', 'track_unknown_space'),
    'costmap_2d::ObstacleLayer': ('max_obstacle_height', 'track_unknown_space'),
    'costmap_2d::InflationLayer': ('cost_scaling_factor', 'inflation_radius'),
}
"""Parameters of a layer that are also read where they were before Hydro: in the costmap's own namespace."""
OF_VOXELS = ('origin_z', 'z_resolution', 'z_voxels', 'mark_threshold', 'unknown_threshold', 'publish_voxel_map')
SEARCHED = ('obstacle_range', 'raytrace_range')
"""Parameters of an observation source that are looked for upward, from the layer's namespace on."""
UNSET = (None, '', '[]', [])


@dataclass(frozen=True)
class CostmapSettings:
    """A costmap's whole configuration. layers: (name, layer class, its config) from the bottom up; ``unpadded``:
    corners (k, 2) of the footprint, m; ``robot_radius``: what they were made from, None where a polygon was given.
    elsewhere: those of the footprint's parameters that are not set in the costmap's own namespace.
    """

    prefix: str
    config: CostmapConfig
    layers: tuple
    unpadded: np.ndarray
    robot_radius: float = None
    footprint_padding: float = 0.01
    footprint_topic: str = 'footprint'
    published_footprint_topic: str = 'footprint'
    elsewhere: tuple = ()

    @property
    def footprint(self) -> np.ndarray:
        """The padded corners (k, 2), m."""
        return pad_footprint(self.unpadded, self.footprint_padding)

    @property
    def inscribed_radius(self) -> float:
        """Inscribed radius of the padded footprint (m)."""
        return radii(self.footprint)[0]

    def make(self, grid_map: GridMap | None = None) -> LayeredCostmap:
        """Return the LayeredCostmap; its static layers get ``grid_map`` when one is given."""
        layers = [layer(name, config) for name, layer, config in self.layers]
        costmap = LayeredCostmap(self.config, layers, self.footprint)
        for layer in costmap.map_layers.values() if grid_map is not None else ():
            layer.set_map(grid_map)
        return costmap


def read_costmap(
    parameters: Parameters,
    prefix: str,
    footprint: np.ndarray | None = None,
    robot_radius: float | None = None,
    static_map: bool = False,
    defaults: CostmapConfig = CostmapConfig(),
) -> CostmapSettings:
    """Return the CostmapSettings under a prefix ('global_costmap/'), which only make sense when there are no faults.

    footprint, robot_radius: found by a search above the node's own namespace. static_map: whether there is a map where
    neither ``plugins`` nor ``static_map`` says. Faults and warnings go to ``parameters``.
    """
    values = {
        field.name: parameters.take(prefix + field.name, getattr(defaults, field.name))
        for field in dataclasses.fields(CostmapConfig)
    }
    for name in ('global_frame', 'robot_base_frame'):
        values[name] = values[name].lstrip('/')
    config = CostmapConfig(**values)
    parameters.faults += [prefix + fault for fault in config.faults()]
    parameters.take(prefix + 'restore_defaults', False)  # dynamic_reconfigure leaves it behind
    layers = []
    for name, kind in _plugins(parameters, prefix, static_map):
        try:
            cls = LAYERS.find(kind)
        except UnknownPlanner as error:
            parameters.faults.append(f'{prefix}plugins: layer {name}: {error}')
            parameters.ignore(f'{prefix}{name}/')
            continue
        own = f'{prefix}{name}/'
        parameters.take(own + 'restore_defaults', False)
        if cls is ObstacleLayer:
            layer = _obstacles(parameters, prefix, own, config)
        else:
            layer = _layer(parameters, cls, prefix, own)
        layers.append((name, cls, layer))
    names = [name for name, _, _ in layers]
    if len(set(names)) < len(names):
        parameters.faults.append('{}plugins names a layer twice: {}'.format(prefix, ', '.join(names)))
    early = () if parameters.has(prefix + 'plugins') else parameters.take(prefix + 'observation_sources', '').split()
    parameters.unowned(prefix, [*names, *early], 'layer')
    parameters.unsearched(prefix, SEARCHED, 'no observation source looks for it there')
    corners, radius, padding = _footprint(parameters, prefix, footprint, robot_radius)
    settings = CostmapSettings(
        prefix,
        config,
        tuple(layers),
        corners,
        radius,
        padding,
        *[parameters.search(prefix, name, 'footprint') for name in ('footprint_topic', 'published_footprint_topic')],
        elsewhere=_elsewhere(parameters, prefix),
    )
    _warn(parameters, settings)
    return settings


def _plugins(parameters, prefix, static_map):
    """Return [(name, type)] of the layers, from ``plugins`` or as before Hydro."""
    before_hydro = {
        name: parameters.take(prefix + name, default)
        for name, default in (('static_map', bool(static_map)), ('map_type', 'costmap'))
    }
    if parameters.has(prefix + 'plugins'):
        for name in before_hydro:
            if parameters.has(prefix + name):
                parameters.warnings.append(f'parameter {prefix}{name} has no effect: plugins is given')
        result = []
        for entry in parameters.take(prefix + 'plugins', []):
            if isinstance(entry, dict) and isinstance(entry.get('name'), str) and entry['name'] and 'type' in entry:
                result.append((entry['name'], entry['type']))
            else:
                parameters.faults.append(f'{prefix}plugins holds {entry!r} but must hold {{name: ..., type: ...}}')
        return result
    result = [('static_layer', 'costmap_2d::StaticLayer')] if before_hydro['static_map'] else []
    if before_hydro['map_type'] == 'voxel':
        parameters.faults.append(f"{prefix}map_type is 'voxel', which is not here: use 'costmap'")
        for name in OF_VOXELS:
            parameters.take(prefix + name, None)
    return result + [('obstacle_layer', 'costmap_2d::ObstacleLayer'), ('inflation_layer', 'costmap_2d::InflationLayer')]


def _layer(parameters, cls, prefix, own, **given):
    """Return the configuration of a layer, from its own namespace, some of it else from the costmap's.

    given: defaults that are not the class's, and values that are not read (``sources``).
    """
    shared = FROM_PARENT.get(cls.plugin_name, ())
    values = dict(given)
    for field in dataclasses.fields(cls.config_class):
        if field.name == 'sources':
            continue
        name, default = field.name, given.get(field.name, field.default)
        if name in shared and name != 'track_unknown_space' and parameters.has(prefix + name):
            if not parameters.has(prefix + 'plugins'):
                parameters.move(prefix + name, own + name)
            elif parameters.has(own + name):
                parameters.warnings.append(
                    'parameter {}{} has no effect on the layer {}, which has its own'.format(
                        prefix, name, own.rstrip('/')
                    )
                )
        if name in shared:
            default = parameters.take(prefix + name, default)
        values[name] = parameters.take(own + name, default)
    if cls is RangeSensorLayer and parameters.has(own + 'transform_tolerance_'):
        values['transform_tolerance'] = parameters.take(
            own + 'transform_tolerance_', RangeSensorConfig.transform_tolerance
        )
        if parameters.has(own + 'transform_tolerance'):
            parameters.warnings.append(
                f'parameter {own}transform_tolerance has no effect: transform_tolerance_ is given'
            )
    config = cls.config_class(**values)
    parameters.faults += [own + fault for fault in config.faults()]
    return config


def _obstacles(parameters, prefix, own, config):
    """Return the ObstacleConfig with its sources; before Hydro they were in the costmap's namespace."""
    at = own if parameters.has(own + 'observation_sources') or parameters.has(prefix + 'plugins') else prefix
    names = parameters.take(at + 'observation_sources', '').split()
    sources = []
    for name in names:
        place = f'{at}{name}/'
        values = {
            field.name: parameters.take(place + field.name, field.default)
            for field in dataclasses.fields(SourceConfig)
            if field.name != 'name'
        }
        for searched in SEARCHED:
            if not parameters.has(place + searched):
                values[searched] = parameters.search(own, searched, values[searched])
        if values['inf_is_valid'] and values['data_type'] != 'LaserScan':
            parameters.warnings.append(
                'parameter {}inf_is_valid has no effect on a {}'.format(place, values['data_type'])
            )
        sources.append(SourceConfig(name, **values))
    parameters.unowned(own, names, 'observation source')
    return _layer(
        parameters, ObstacleLayer, prefix, own, sources=tuple(sources), track_unknown_space=config.track_unknown_space
    )


def _elsewhere(parameters, prefix):
    """Return which of the footprint's parameters are not set under the prefix; either of the first two hides both."""
    shape = ('footprint', 'robot_radius')
    nearer = any(parameters.has(prefix + name) for name in shape)
    padding = () if parameters.has(prefix + 'footprint_padding') else ('footprint_padding',)
    return padding if nearer else (*shape, *padding)


def _footprint(parameters, prefix, footprint, robot_radius):
    """Return (corners, radius or None, padding); the polygon is preferred to the radius, and the nearest setting to a
    far one.
    """
    padding = parameters.take(prefix + 'footprint_padding', parameters.take('footprint_padding', 0.01))
    for place in (prefix, ''):
        own = parameters.take(place + 'footprint', None)
        radius = parameters.take(place + 'robot_radius', None)
        if own not in UNSET:
            footprint = own
            break
        if radius is not None:
            footprint, robot_radius = None, radius
            break
    else:
        if footprint in UNSET and robot_radius is None:
            footprint, robot_radius = [parameters.search('', name, None) for name in ('footprint', 'robot_radius')]
    try:
        if not np.isfinite(padding) or abs(padding) > 10.0:
            raise FootprintError(f'{prefix}footprint_padding is {padding!r}, allowed are numbers from -10 to 10')
        if footprint not in UNSET:
            return parse_footprint(footprint), None, padding
        radius = 0.46 if robot_radius is None else robot_radius
        if isinstance(radius, bool) or not isinstance(radius, (int, float)):
            raise FootprintError(f'robot_radius is {radius!r}, allowed are numbers above 0')
        return circle_footprint(float(radius)), float(radius), padding
    except FootprintError as error:
        if str(error) not in parameters.faults:
            parameters.faults.append(str(error))
        return circle_footprint(0.46), 0.46, 0.01


def _warn(parameters, settings):
    """Say what is allowed but hardly meant."""
    for name, cls, config in settings.layers:
        if cls is InflationLayer and config.enabled and config.inflation_radius < settings.inscribed_radius:
            parameters.warnings.append(
                f'{settings.prefix}{name}: inflation_radius ({config.inflation_radius:.3f} m) is less than the '
                f'inscribed radius of the footprint ({settings.inscribed_radius:.3f} m): plans may '
                'touch obstacles'
            )
        for parameter, explaining, of in (
            ('ignore_mapped', StaticLayer, (RangeSensorLayer, ObstacleLayer)),
            ('ignore_seen', ObstacleLayer, (RangeSensorLayer,)),
        ):
            there = any(other is explaining for _, other, _ in settings.layers)
            if cls in of and getattr(config, parameter) and not there:
                parameters.warnings.append(
                    f'parameter {settings.prefix}{name}/{parameter} has no effect: the costmap has no '
                    f'costmap_2d::{explaining.__name__}'
                )
    if settings.config.update_frequency == 0.0:
        parameters.warnings.append(f'parameter {settings.prefix}update_frequency is 0: the costmap is never updated')
