"""Nonsense for move_base, and the small house it is thrown at: goals, maps, sensor messages, poses, configurations.

All chance comes from the random.Random that is given, so that a seed says everything.
"""

import dataclasses
import math
import random

import numpy as np

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import InflationConfig, StaticLayerConfig
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.keepout import KeepoutConfig, KeepoutFilter
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig, SourceConfig
from sara_nav.costmaps.layers.range_sensor import RangeReading, RangeSensorConfig, RangeSensorLayer
from sara_nav.costmaps.layers.speed import SpeedFilter
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.costmaps.observations import Observation, scan_points
from sara_nav.goals.move_base_config import LIMITS, MoveBaseConfig
from sara_nav.grids.footprint import pad_footprint, parse_footprint
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.edits import KEEP_OUT, SLOW, Edit, keep_out_mask, speed_mask
from sara_nav.maps.map_io import GridMap
from sara_nav.move_base.local_planners import LOCAL_PLANNERS
from sara_nav.move_base.state_machine import MoveBase
from sara_nav.planners.planning import GLOBAL_PLANNERS
from sara_nav.recovery.back_out import BackOutRecovery
from sara_nav.recovery.behaviours import ClearCostmapConfig, ClearCostmapRecovery, RotateRecovery
from sara_nav.recovery.help import AskForHelp, AskForHelpConfig

STRANGE = (math.nan, math.inf, -math.inf, 0.0, -0.0, 1e-320, -1e300, 1e300, 1e9, -1.0)
FRAMES = ('map', '/map', 'odom', 'nowhere', '', '/', 'base_link')
FOOTPRINT = parse_footprint([[0.2, 0.15], [0.2, -0.15], [-0.2, -0.15], [-0.2, 0.15]])


def house(chance: random.Random) -> GridMap:
    """Return a GridMap of 6 m x 6 m: two rooms and a door, which is sometimes walled up."""
    data = np.zeros((60, 60), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    data[:, 30] = 100
    if chance.random() < 0.8:
        data[10:22, 30] = 0
    if chance.random() < 0.3:
        data[40:50, 40:50] = -1
    return GridMap(data, GridGeometry(60, 60, 0.1, 0.0, 0.0))


def number(chance: random.Random, low: float = -2.0, high: float = 8.0, strange: float = 0.15) -> float:
    """Return a number, now and then a strange one."""
    return chance.choice(STRANGE) if chance.random() < strange else chance.uniform(low, high)


def pose(chance: random.Random, strange: float = 0.1) -> Pose2D:
    """Return a Pose2D in or about the house."""
    return Pose2D(
        number(chance, 0.0, 6.0, strange), number(chance, 0.0, 6.0, strange), number(chance, -4.0, 4.0, strange)
    )


def message(chance: random.Random) -> tuple:
    """Return (frame, position, quaternion) as a client may send them."""
    yaw = chance.uniform(-math.pi, math.pi)
    quaternion = [0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)]
    luck = chance.random()
    if luck < 0.08:
        quaternion = [0.0, 0.0, 0.0, 0.0]
    elif luck < 0.2:
        quaternion = [number(chance, -1.0, 1.0, 0.3) for _ in range(4)]
    frame = chance.choice(FRAMES) if chance.random() < 0.2 else 'map'
    return (
        frame,
        [number(chance, -0.5, 6.5, 0.05), number(chance, -0.5, 6.5, 0.05), number(chance, 0.0, 0.0, 0.05)],
        quaternion,
    )


def grid_map(chance: random.Random) -> GridMap:
    """Return a GridMap, or raise what says that there is none: empty, of resolution 0, of another size than it says."""
    if chance.random() < 0.5:
        return house(chance)
    width, height = (chance.choice((0, 1, 2, 7, 60, 61)) for _ in range(2))
    geometry = GridGeometry(
        width,
        height,
        chance.choice((0.1, 0.05, 0.5, 0.0, -0.1, math.nan, math.inf)),
        number(chance, -3.0, 3.0, 0.1),
        number(chance, -3.0, 3.0, 0.1),
    )
    values = [chance.choice((0, 100, -1, 50, -128, 127)) for _ in range(4)]
    shape = (height, width) if chance.random() < 0.8 else (width + 1, height)
    data = np.resize(np.array(values, np.int8), shape)
    return GridMap(data, geometry, chance.choice((0.0, 0.0, 0.5, math.nan)))


def mask(chance: random.Random) -> GridMap:
    """Return a GridMap with a keep-out or slow place or none, or what is no such mask, or raise what says so."""
    if chance.random() < 0.3:
        return grid_map(chance)
    a, b = ((chance.uniform(-1.0, 7.0), chance.uniform(-1.0, 7.0)) for _ in range(2))
    kind, draw = chance.choice(((KEEP_OUT, keep_out_mask), (SLOW, speed_mask)))
    places = [Edit(kind, a, b)] if chance.random() < 0.5 else []
    return draw(house(chance), places)


def reading(chance: random.Random, source: str, at: Pose2D, t: float) -> RangeReading:
    """Return a RangeReading, more often than not a sound one from about the robot."""
    if chance.random() < 0.7:
        return RangeReading(
            source,
            t,
            at.x,
            at.y,
            chance.uniform(-math.pi, math.pi),
            chance.choice((chance.uniform(0.1, 3.0), math.inf, -math.inf)),
            0.16,
            2.5,
            1.0,
        )
    return RangeReading(
        source,
        number(chance, t - 5.0, t + 5.0),
        number(chance),
        number(chance),
        number(chance),
        number(chance),
        number(chance),
        number(chance),
        number(chance, 0.0, 7.0),
    )


def observation(chance: random.Random, at: Pose2D, t: float) -> Observation:
    """Return an Observation of a scan or of points at random; raises ObservationError for scans that are none."""
    if chance.random() < 0.6:
        ranges = [number(chance, 0.0, 4.0) for _ in range(chance.choice((0, 1, 40)))]
        points = scan_points(
            ranges,
            number(chance, -3.0, 3.0, 0.05),
            number(chance, 0.0, 0.2, 0.05),
            number(chance, 0.0, 0.2, 0.05),
            number(chance, 2.0, 5.0, 0.05),
            chance.random() < 0.5,
        )
        points = points + (at.x, at.y, 0.0)
    else:
        shape = chance.choice(((0, 3), (1, 3), (30, 3), (4, 2), (5,)))
        points = np.array([number(chance) for _ in range(int(np.prod(shape)))]).reshape(shape)
    origin = (at.x, at.y, 0.3) if chance.random() < 0.8 else tuple(number(chance) for _ in range(3))
    return Observation(chance.choice(('scan', 'scan', 'unknown')), number(chance, t - 2.0, t, 0.1), origin, points)


def configuration(chance: random.Random, config: MoveBaseConfig) -> MoveBaseConfig:
    """Return a MoveBaseConfig with one value changed, which may make no sense."""
    name = chance.choice(sorted(LIMITS))
    value = number(chance, *LIMITS[name], strange=0.4)
    if isinstance(getattr(config, name), int) and math.isfinite(value):
        value = int(value)
    return dataclasses.replace(config, **{name: value})


def costmap(chance: random.Random, rolling: bool) -> LayeredCostmap:
    """Return a LayeredCostmap with one layer of each kind."""
    layers = [
        StaticLayer('static', StaticLayerConfig(track_unknown_space=chance.random() < 0.5)),
        ObstacleLayer(
            'obstacles',
            ObstacleConfig(
                sources=(SourceConfig('scan', clearing=True, max_obstacle_height=2.0),),
                pixel_decay=chance.choice((0.0, 2.0)),
                passing_memory=chance.choice((0.0, 1.0)),
                mark_after=chance.choice((0.0, 0.5)),
            ),
        ),
        RangeSensorLayer(
            'ultrasonic',
            RangeSensorConfig(
                topics=('front', 'rear'),
                no_readings_timeout=chance.choice((0.0, 0.0, 3.0)),
                ignore_seen=chance.random() < 0.5,
            ),
        ),
        SpeedFilter('slow'),
        KeepoutFilter('keepout', KeepoutConfig(override_lethal_cost=chance.random() < 0.8)),
        InflationLayer('inflation', InflationConfig(inflation_radius=0.4)),
    ]
    config = CostmapConfig(
        rolling_window=rolling, width=4.0, height=4.0, resolution=0.1, update_frequency=chance.choice((2.0, 5.0, 20.0))
    )
    return LayeredCostmap(config, layers, pad_footprint(FOOTPRINT, 0.01))


def _planner(chance, registry):
    """A planner of the registry at random."""
    cls = registry.find(chance.choice(registry.names()))
    values = {}
    if 'default_tolerance' in cls.config_class.__dataclass_fields__:
        values['default_tolerance'] = chance.choice((0.0, 0.0, 0.5))
    if 'max_expansions' in cls.config_class.__dataclass_fields__:
        values['max_expansions'] = chance.choice((100, 1500))  # most of these goals have no path: give up soon
    return cls(cls.config_class(**values))


def machine(chance: random.Random) -> tuple[MoveBase, Pose2D | None]:
    """Return (a MoveBase with planners and recoveries at random, the Pose2D of the map's origin in the local frame or
    None).
    """
    offset = None if chance.random() < 0.7 else Pose2D(1.0, -0.5, 0.4)
    config = MoveBaseConfig(
        planner_frequency=chance.choice((0.0, 2.0)),
        planner_patience=chance.choice((0.3, 2.0)),
        controller_patience=chance.choice((0.5, 3.0)),
        oscillation_timeout=chance.choice((0.0, 1.0)),
        max_planning_retries=chance.choice((-1, -1, 0, 2)),
        shutdown_costmaps=chance.random() < 0.2,
        recovery_behavior_enabled=chance.random() < 0.9,
        replan_when_blocked=chance.random() < 0.5,
        stuck_timeout=chance.choice((0.0, 1.0)),
        recovery_memory=chance.choice((0.0, 1.0)),
    )
    planners = [_planner(chance, registry) for registry in (GLOBAL_PLANNERS, LOCAL_PLANNERS)]
    recoveries = [
        ClearCostmapRecovery(
            'clear', ClearCostmapConfig(chance.choice((0.0, 1.0, 3.0)), chance.random() < 0.5, chance.random() < 0.5)
        ),
        RotateRecovery('turn'),
        BackOutRecovery('back_out'),
        AskForHelp('help', AskForHelpConfig(patience=chance.choice((1.0, 3.0)))),
    ]
    recoveries = chance.sample(recoveries, chance.randint(0, len(recoveries)))
    result = MoveBase(
        config,
        costmap(chance, False),
        costmap(chance, chance.random() < 0.7 or offset is not None),
        *planners,
        recoveries,
    )
    return result, offset
