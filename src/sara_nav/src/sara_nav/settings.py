"""Everything move_base is configured with, read from its parameter tree under the names users know."""
from dataclasses import dataclass, replace

import numpy as np

from sara_nav.costmap import InflationConfig, StaticLayerConfig, build
from sara_nav.footprint import FootprintError, circle_footprint, pad_footprint, parse_footprint, radii
from sara_nav.grid_planner import GLOBAL_PLANNERS
from sara_nav.local_planner import LOCAL_PLANNERS
from sara_nav.move_base import MoveBase, MoveBaseConfig
from sara_nav.planning import UnknownPlanner

STATIC, INFLATION = 'costmap_2d::StaticLayer', 'costmap_2d::InflationLayer'
COSTMAP = 'global_costmap/'


@dataclass(frozen=True)
class Settings:
    """A whole configuration. footprint: padded corners (k, 2), m; warnings: sentences to tell the user."""

    move_base: MoveBaseConfig
    global_planner: object
    local_planner: object
    footprint: np.ndarray
    static: StaticLayerConfig
    inflation: InflationConfig
    global_frame: str = 'map'
    robot_base_frame: str = 'base_link'
    map_topic: str = 'map'
    first_map_only: bool = False
    warnings: tuple = ()

    @property
    def inscribed_radius(self):
        """Inscribed radius of the padded footprint (m)."""
        return radii(self.footprint)[0]

    def make_costmap(self, grid_map):
        """Return the Costmap of a GridMap as these settings have it."""
        return build(grid_map, self.inscribed_radius, self.static, self.inflation)

    def make_move_base(self, costmap=None):
        """Return the MoveBase these settings describe."""
        return MoveBase(self.move_base, self.footprint, costmap, self.global_planner, self.local_planner)


def read_settings(parameters, footprint=None, robot_radius=None):
    """Return the Settings of a Parameters tree; raises ParameterError naming everything that is wrong.

    footprint, robot_radius: what a search up the namespaces found, if anything; used where the tree holds none.
    """
    warnings = []
    config = parameters.config(MoveBaseConfig, '')
    tolerance = parameters.take(COSTMAP + 'transform_tolerance', 0.3)
    if not parameters.has('transform_tolerance'):
        config = replace(config, transform_tolerance=tolerance)
        if not 0.0 <= tolerance <= 10.0:
            parameters.faults.append(COSTMAP + 'transform_tolerance is %r but must be in 0..10' % tolerance)
    planners = []
    for registry, name in ((GLOBAL_PLANNERS, config.base_global_planner), (LOCAL_PLANNERS, config.base_local_planner)):
        try:
            cls = registry.find(name)
        except UnknownPlanner:  # already among the faults
            continue
        planners.append(cls(parameters.config(cls.config_class, name.split('/')[-1] + '/')))
    static_at, inflation_at = _layers(parameters, warnings)
    static = parameters.config(StaticLayerConfig, *static_at)
    map_topic = parameters.take(static_at[0] + 'map_topic', parameters.take(COSTMAP + 'map_topic', 'map'))
    first_only = parameters.take(static_at[0] + 'first_map_only', False)
    for name in ('subscribe_to_updates', 'use_maximum'):
        if parameters.take(static_at[0] + name, False):
            warnings.append('parameter %s%s has no effect: not built yet' % (static_at[0], name))
    for at in (static_at[0], inflation_at[0]):
        if not parameters.take(at + 'enabled', True):
            warnings.append('parameter %senabled is false, which has no effect: not built yet' % at)
    inflation = parameters.config(InflationConfig, *inflation_at)
    corners = _footprint(parameters, footprint, robot_radius)
    frames = [parameters.take(COSTMAP + name, default) for name, default in (
        ('global_frame', 'map'), ('robot_base_frame', 'base_link'))]
    parameters.check()
    if inflation.inflation_radius < radii(corners)[0]:
        warnings.append('inflation_radius (%.3f m) is less than the inscribed radius of the footprint (%.3f m): '
                        'plans may touch obstacles' % (inflation.inflation_radius, radii(corners)[0]))
    return Settings(config, *planners, corners, static, inflation, frames[0].lstrip('/'), frames[1].lstrip('/'),
                    map_topic, first_only, tuple(warnings + parameters.left_over()))


def _layers(parameters, warnings):
    """Return where the static and the inflation layer's parameters are: (own, costmap's) prefixes of each."""
    found = {STATIC: 'static_layer', INFLATION: 'inflation_layer'}
    plugins = parameters.take(COSTMAP + 'plugins', [])
    static_map = parameters.take(COSTMAP + 'static_map', True)
    if not static_map:
        warnings.append('parameter %sstatic_map is false, which has no effect: a costmap without a map is not built '
                        'yet' % COSTMAP)
    for entry in plugins:
        if not isinstance(entry, dict) or not isinstance(entry.get('name'), str):
            parameters.faults.append('%splugins holds %r but must hold {name: ..., type: ...}' % (COSTMAP, entry))
        elif entry.get('type') in found:
            found[entry['type']] = entry['name']
        else:
            warnings.append('layer %s of type %s is left out of the global costmap: not built yet (built: %s)' % (
                entry['name'], entry.get('type'), ', '.join(sorted(found))))
    return tuple((COSTMAP + found[kind] + '/', COSTMAP) for kind in (STATIC, INFLATION))


def _footprint(parameters, footprint, robot_radius):
    """Return the padded footprint; the polygon is preferred to the radius, and the nearest setting to a far one."""
    padding = parameters.take(COSTMAP + 'footprint_padding', parameters.take('footprint_padding', 0.01))
    for place in (COSTMAP, ''):
        own = parameters.take(place + 'footprint', None)
        radius = parameters.take(place + 'robot_radius', None)
        if own not in (None, '', '[]', []):
            footprint = own
            break
        if radius is not None:
            footprint, robot_radius = None, radius
            break
    try:
        if footprint not in (None, '', '[]', []):
            corners = parse_footprint(footprint)
        else:
            radius = 0.46 if robot_radius is None else robot_radius
            if isinstance(radius, bool) or not isinstance(radius, (int, float)):
                raise FootprintError('robot_radius is %r but must be a number > 0' % (radius,))
            corners = circle_footprint(float(radius))
        return pad_footprint(corners, padding)
    except FootprintError as error:
        parameters.faults.append(str(error))
        return circle_footprint(0.46)
