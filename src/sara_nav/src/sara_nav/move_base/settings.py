"""Everything move_base is configured with, read from its parameter tree under the names users know."""

from dataclasses import dataclass, fields, replace
from typing import Any

from sara_nav.config.parameters import Parameters
from sara_nav.config.registry import Registry, UnknownPlanner
from sara_nav.costmaps.costmap_settings import CostmapSettings, read_costmap
from sara_nav.costmaps.layers.speed import SpeedFilter
from sara_nav.goals.move_base_config import MoveBaseConfig
from sara_nav.maps.map_io import GridMap
from sara_nav.move_base.state_machine import MoveBase
from sara_nav.planners.local_command import LOCAL_PLANNERS
from sara_nav.planners.planning import GLOBAL_PLANNERS
from sara_nav.recovery.behaviours import RECOVERIES, ClearCostmapRecovery, RotateRecovery

GLOBAL, LOCAL = 'global_costmap/', 'local_costmap/'
TRAJECTORY = 'TrajectoryPlannerROS/'
OLD_NAMES = {
    TRAJECTORY: {
        'max_rotational_vel': 'max_vel_theta',
        'min_in_place_rotational_vel': 'min_in_place_vel_theta',
        'acc_lim_th': 'acc_lim_theta',
        'backup_vel': 'escape_vel',
        'pdist_scale': 'path_distance_bias',
        'gdist_scale': 'goal_distance_bias',
    },
    'DWAPlannerROS/': {
        'max_trans_vel': 'max_vel_trans',
        'min_trans_vel': 'min_vel_trans',
        'max_rot_vel': 'max_vel_theta',
        'min_rot_vel': 'min_vel_theta',
        'acc_limit_trans': 'acc_lim_trans',
        'rot_stopped_vel': 'theta_stopped_vel',
        'trans_stopped_velocity': 'trans_stopped_vel',
    },
}
"""What the peers' planners call their parameters, or once did: the old name's value is taken."""
DEFAULT_RECOVERIES = ('conservative_reset', 'rotate_recovery', 'aggressive_reset')


@dataclass(frozen=True)
class RecoverySettings:
    """The behaviours that are set, as (name, class, config), or None: the peer's default list. ``circumscribed_radius``
    (m) and the configurations under the default names are for that.
    """

    chosen: tuple
    defaults: dict
    circumscribed_radius: float

    def make(self, config: MoveBaseConfig) -> tuple:
        """Return the behaviours, in order, as a MoveBaseConfig has the default ones."""
        if self.chosen is not None:
            return tuple(cls(name, own) for name, cls, own in self.chosen)
        conservative, rotate, aggressive = (self.defaults[name] for name in DEFAULT_RECOVERIES)
        turn = (RotateRecovery('rotate_recovery', rotate),) if config.clearing_rotation_allowed else ()
        return (
            ClearCostmapRecovery(
                'conservative_reset', replace(conservative, reset_distance=config.conservative_reset_dist)
            ),
            *turn,
            ClearCostmapRecovery(
                'aggressive_reset', replace(aggressive, reset_distance=4.0 * self.circumscribed_radius)
            ),
            *turn,
        )


@dataclass(frozen=True)
class Settings:
    """A whole configuration. warnings: sentences to tell the user."""

    move_base: MoveBaseConfig
    global_costmap: CostmapSettings
    local_costmap: CostmapSettings
    global_planner: object
    local_planner: object
    recoveries: RecoverySettings
    warnings: tuple = ()

    @property
    def global_frame(self) -> str:
        """The frame that is planned in."""
        return self.global_costmap.config.global_frame

    @property
    def local_frame(self) -> str:
        """The frame of the local costmap."""
        return self.local_costmap.config.global_frame

    @property
    def robot_base_frame(self) -> str:
        """The robot's frame."""
        return self.global_costmap.config.robot_base_frame

    def make_move_base(self, grid_map: GridMap | None = None) -> MoveBase:
        """Return the MoveBase these settings describe. grid_map: GridMap for the static layers; None: it comes
        later.
        """
        return MoveBase(
            self.move_base,
            self.global_costmap.make(grid_map),
            self.local_costmap.make(grid_map),
            self.global_planner,
            self.local_planner,
            self.recoveries.make(self.move_base),
        )


def read_settings(parameters: Parameters) -> Settings:
    """Return the Settings of a Parameters tree; raises ConfigError naming everything that is wrong."""
    config = _move_base(parameters)
    above = {name: parameters.above.get(name) for name in ('footprint', 'robot_radius')}
    for name in above:
        parameters.search(GLOBAL, name, None)  # one that a nearer one hides is not unknown
    # The peer's global costmap is empty when nothing says that there is a map; planning on that helps nobody.
    global_costmap = read_costmap(parameters, GLOBAL, static_map=True, **above)
    local_costmap = read_costmap(parameters, LOCAL, **above)
    parameters.warnings += [
        f'{GLOBAL}{name}: sara_nav/SpeedFilter has no effect there: put it into {LOCAL}plugins'
        for name, layer, _ in global_costmap.layers
        if layer is SpeedFilter
    ]
    planners = [
        read_planner(parameters, registry, name)
        for registry, name in (
            (GLOBAL_PLANNERS, config.base_global_planner),
            (LOCAL_PLANNERS, config.base_local_planner),
        )
    ]
    recoveries = _recoveries(parameters, config)
    _warn_of_other_planners(parameters, planners)
    parameters.check()
    settings = Settings(config, global_costmap, local_costmap, *planners, recoveries)
    if config.recovery_behavior_enabled:
        costmaps = global_costmap.make(), local_costmap.make()
        for behaviour in dict.fromkeys(recoveries.make(config)):
            if recoveries.chosen is not None:
                parameters.warnings += behaviour.missing(*costmaps)
    return replace(settings, warnings=tuple(parameters.warnings + parameters.left_over()))


def _warn_of_other_planners(parameters, planners):
    """Warn of parameters of planners that were not chosen; planners: (global, local), None where there is none."""
    for registry, planner in zip((GLOBAL_PLANNERS, LOCAL_PLANNERS), planners, strict=True):
        for other in registry.names():
            group = other.split('/')[-1] + '/'
            if not parameters.has_any(group):
                continue
            defaults = {entry.name: entry.default for entry in fields(registry.find(other).config_class)}
            unread = parameters.ignore(group, defaults) if planner is not None and other != planner.plugin_name else ()
            if unread:
                parameters.warnings.append(
                    'the parameters under {} ({}) have no effect: {} is {}'.format(
                        group, ', '.join(path[len(group) :] for path in unread), registry.parameter, planner.plugin_name
                    )
                )


def read_planner(parameters: Parameters, registry: Registry, name: str) -> Any:
    """Return the planner of that name with its parameters; None, and a fault, when there is no such planner."""
    try:
        cls = registry.find(name)
    except UnknownPlanner as error:
        parameters.faults.append(str(error))
        return None
    prefix = name.split('/')[-1] + '/'
    both_ways = parameters.has(prefix + 'max_rotational_vel') and not parameters.has(prefix + 'min_vel_theta')
    for old, new in OLD_NAMES.get(prefix, {}).items():
        parameters.rename(prefix, old, new)
    known = {entry.name for entry in fields(cls.config_class)}
    if 'y_vels' in known:
        parameters.adapt(prefix + 'y_vels', _listed)
    config = parameters.config(cls.config_class, prefix)
    if both_ways and 'min_vel_theta' in known:
        config = replace(config, min_vel_theta=-config.max_vel_theta)
    if 'controller_frequency' in known:
        config = replace(
            config, controller_frequency=parameters.search(prefix, 'controller_frequency', config.controller_frequency)
        )
    for name, why in getattr(cls.config_class, 'WITHOUT_EFFECT', {}).items():
        unread = parameters.ignore(prefix + name) if name.endswith('/') else parameters.has(prefix + name)
        if unread and (name.endswith('/') or getattr(config, name) != getattr(cls.config_class(), name)):
            parameters.warnings.append(f'parameter {prefix}{name} has no effect, as in the C++ planner: {why}')
    if hasattr(config, 'warnings'):
        parameters.warnings += [prefix + text for text in config.warnings()]
    frame = parameters.take(LOCAL + 'global_frame', 'map')
    if parameters.has(prefix + 'global_frame_id') and parameters.take(prefix + 'global_frame_id', frame) != frame:
        parameters.warnings.append(
            f'parameter {prefix}global_frame_id has no effect: clouds are in local_costmap/global_frame, {frame}'
        )
    return cls(config) if not config.faults() else None


def _listed(value):
    """Return a list of numbers as the string that the peer takes in its place."""
    return ','.join(f'{v!r}' for v in value) if isinstance(value, list) else value


def _move_base(parameters):
    config = parameters.config(MoveBaseConfig, '')
    if not parameters.has('transform_tolerance'):
        tolerance = parameters.take(GLOBAL + 'transform_tolerance', 0.3)
        config = replace(config, transform_tolerance=tolerance)
    base = parameters.take(GLOBAL + 'robot_base_frame', 'base_link')
    for name, known in (('transform_tolerance', config.transform_tolerance), ('robot_base_frame', base)):
        if parameters.take(LOCAL + name, known) != known:
            parameters.warnings.append(f'parameter {LOCAL}{name} has no effect: it is {known}')
    if not parameters.has('clearing_radius'):
        config = replace(config, clearing_radius=parameters.take(LOCAL + 'circumscribed_radius', 0.46))
    parameters.take(LOCAL + 'inscribed_radius', 0.325)  # the peer reads it and uses it nowhere
    return config


def _recoveries(parameters, config):
    """Return the RecoverySettings."""
    entries = parameters.take('recovery_behaviors', None)
    chosen, defaults = None, {}
    if entries is None:
        for name, cls in zip(DEFAULT_RECOVERIES, (ClearCostmapRecovery, RotateRecovery, ClearCostmapRecovery)):
            defaults[name] = _recovery(parameters, name, cls, config)
    else:
        chosen = tuple(_chosen(parameters, entries, config))
        for name in set(DEFAULT_RECOVERIES) - {name for name, _, _ in chosen}:
            if parameters.ignore(name + '/'):
                parameters.warnings.append(
                    f'the parameters under {name}/ have no effect: recovery_behaviors does not list it'
                )
    radius = parameters.take(LOCAL + 'circumscribed_radius', 0.46)
    if entries is None:
        for name, value, source in (
            ('conservative_reset', config.conservative_reset_dist, 'conservative_reset_dist'),
            ('aggressive_reset', 4.0 * radius, 'four times local_costmap/circumscribed_radius'),
        ):
            if parameters.has(name + '/reset_distance') and abs(defaults[name].reset_distance - value) > 1e-9:
                parameters.warnings.append(
                    f'parameter {name}/reset_distance has no effect: with the default recovery behaviours '
                    f'it is {source}, {value:.2f} m'
                )
    return RecoverySettings(chosen, defaults, radius)


def _chosen(parameters, entries, config):
    """Yield (name, class, config) of each entry of recovery_behaviors; what is wrong with the list becomes a fault."""
    if not isinstance(entries, list):
        parameters.faults.append(f'recovery_behaviors is {entries!r}, allowed is a list of {{name: ..., type: ...}}')
        return
    names = set()
    for entry in entries:
        if not (isinstance(entry, dict) and isinstance(entry.get('name'), str) and isinstance(entry.get('type'), str)):
            parameters.faults.append(f'recovery_behaviors holds {entry!r} but must hold {{name: ..., type: ...}}')
            continue
        if entry['name'] in names:
            parameters.faults.append(
                'recovery_behaviors holds two behaviours called {}, which is not allowed'.format(entry['name'])
            )
            continue
        names.add(entry['name'])
        try:
            cls = RECOVERIES.find(entry['type'])
        except UnknownPlanner as error:
            parameters.faults.append(str(error))
            continue
        if entry['type'] != cls.plugin_name:
            parameters.warnings.append(
                'recovery_behaviors: {} should be called {}'.format(entry['type'], cls.plugin_name)
            )
        yield entry['name'], cls, _recovery(parameters, entry['name'], cls, config)


def _recovery(parameters, name, cls, config):
    if cls is not RotateRecovery:
        return parameters.config(cls.config_class, name + '/')
    # The peer takes these from the classic planner whichever drives; here the planner that does drive may set them,
    # too.
    for old, new in OLD_NAMES[TRAJECTORY].items():
        if new in ('max_vel_theta', 'min_in_place_vel_theta', 'acc_lim_theta'):
            parameters.rename(TRAJECTORY, old, new)
    own = parameters.config(cls.config_class, name + '/', TRAJECTORY, config.base_local_planner.split('/')[-1] + '/')
    if parameters.has(name + '/frequency') and own.frequency != config.controller_frequency:
        parameters.warnings.append(
            f'parameter {name}/frequency has no effect: a turn is commanded in each control cycle, '
            f'{config.controller_frequency:g} Hz '
            '(controller_frequency)'
        )
    return own
