"""The parameters of range_localization: amcl's where amcl has them, range_* where amcl says laser_*."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from sara_common.config import ConfigError, is_whole
from sara_common.planar import is_apart
from sara_localization.config.parameters import ParameterReader
from sara_localization.ranges.range_data import BeamModel

_FRAMES = ('base_frame_id', 'odom_frame_id', 'global_frame_id')
_ABOVE_ZERO = (
    'range_max_range',
    'range_sigma_hit',
    'gate',
    'sigmas',
    'max_innovation',
    'plane_tolerance',
    'twice_within',
    'max_correction_rate',
    'max_correction_turn_rate',
    'max_vel_x',
    'max_vel_theta',
    'initial_cov_xx',
    'initial_cov_yy',
    'initial_cov_aa',
    'search_min_d',
    'search_min_a',
    'search_sigma_hit',
    'range_z_hit',
    'range_z_rand',
)


@dataclass(frozen=True)
class RangeConfig:
    """m, rad, s, and their squares. Frames without a leading slash; `range_topics`: sensor_msgs/Range."""

    base_frame_id: str = 'base_link'
    odom_frame_id: str = 'odom'
    global_frame_id: str = 'map'
    range_topics: tuple[str, ...] = ()
    tf_broadcast: bool = True
    join_at_odometry_time: bool = False
    """As ekf_se's: map -> odom is of the time of odom -> base, which is older than the dead reckoning."""
    transform_tolerance: float = 0.1
    """s that map -> odom is dated ahead, and that a range may be newer than the dead reckoning."""
    map_occupied_above: float = 65.0
    """Cells of a higher occupancy (0..100) are walls."""

    initial_cov_xx: float = 0.01
    initial_cov_yy: float = 0.01
    initial_cov_aa: float = 0.0012
    odom_alpha1: float = 1e-4
    """rad2 per rad turned: turning from turning. These four are variances per way, not per step as amcl's are."""
    odom_alpha2: float = 2e-5
    """rad2 per m driven: turning from driving."""
    odom_alpha3: float = 4e-4
    """m2 per m driven: place from driving."""
    odom_alpha4: float = 1e-4
    """m2 per rad turned: place from turning."""
    turn_scale_sigma: float = 0.0
    """Standard deviation of the scale of the dead reckoning's turns, which is learned; 0: it is 1."""
    turn_scale_file: str = ''
    """Where the scale is kept from one drive to the next, absolute or below ROS_HOME; empty: nowhere."""

    range_min_range: float = 0.2
    range_max_range: float = 2.4
    range_delay: float = 0.0
    """s from the burst of a reading to its stamp, filters included."""
    range_sigma_hit: float = 0.05
    """m; greater than a single reading's scatter, as readings of the same wall err together."""
    range_sigma_edge: float = 0.12
    """m; the same of an edge, such as a jamb's; 0: edges are not used."""
    gate: float = 2.0
    """Standard deviations from which on a reading is not of the map."""
    max_innovation: float = 0.3
    """m from which on it is not, however uncertain the pose is."""
    sigmas: float = 2.0
    """Standard deviations of the pose over which a plane must be heard."""
    plane_tolerance: float = 0.03
    """m by which cells may differ from a plane, and predictions from a straight line."""
    twice_within: float = 0.6
    """s within which a sensor must agree with the map twice."""
    update_min_d: float = 0.05
    update_min_a: float = 0.05
    """m driven or rad turned between two readings of a sensor that are used: a robot that stands learns nothing new."""

    search_min_d: float = 0.2
    search_min_a: float = 0.35
    """m driven or rad turned between two steps of a search for the place, and of judging whether it is right."""
    search_clearance: float = 0.25
    """m from the walls that the robot's middle keeps: half its width, or less."""
    search_sigma_hit: float = 0.1
    """m; of the beam model while searching."""
    range_z_hit: float = 0.8
    range_z_short: float = 0.06
    range_z_max: float = 0.06
    range_z_rand: float = 0.08
    """Shares of readings that are as the map has it, shorter, without an echo, and anything; any sum, for they are
    divided by it."""
    seed: int = 0
    """Of the search's random numbers."""

    lost_recovery: bool = True
    """Whether the place is searched for once the pose is probably wrong."""
    lost_limit: float = 0.5
    """The probability, 0 to 1, from which on that is so."""

    max_correction_rate: float = 0.05
    """m/s at which what is given out follows the estimate."""
    max_correction_turn_rate: float = 0.0175
    """rad/s of the same."""
    max_vel_x: float = 1.5
    max_vel_theta: float = 2.0
    """m/s and rad/s; dead reckoning that goes faster was put elsewhere, and is believed anew."""
    warnings: tuple[str, ...] = ()

    @property
    def beam_model(self) -> BeamModel:
        """Of the search."""
        return BeamModel(
            self.search_sigma_hit, self.range_z_hit, self.range_z_short, self.range_z_max, self.range_z_rand
        )

    def has_moved(self, last: tuple[float, float, float], here: tuple[float, float, float]) -> bool:
        """Whether a robot has moved enough for a step of a search, or to be judged anew, between two poses."""
        return is_apart(last, here, self.search_min_d, self.search_min_a)

    def faults(self) -> list[str]:
        """Sentences, one for each bad value."""
        found = [
            f'{name} is {getattr(self, name):g}, allowed are numbers above 0'
            for name in _ABOVE_ZERO
            if not getattr(self, name) > 0.0
        ]
        found += [
            f'{f.name} is {getattr(self, f.name):g}, allowed are numbers of 0 or more'
            for f in fields(self)
            if isinstance(f.default, float) and f.name not in _ABOVE_ZERO and not getattr(self, f.name) >= 0.0
        ]
        found += [
            f'{f.name} is {getattr(self, f.name)!r}, allowed is a finite number'
            for f in fields(self)
            if isinstance(f.default, float) and not math.isfinite(getattr(self, f.name))
        ]
        if not self.range_min_range < self.range_max_range:
            found.append(
                f'range_min_range is {self.range_min_range:g}, allowed is less than range_max_range '
                f'({self.range_max_range:g})'
            )
        if not self.map_occupied_above < 100.0:
            found.append(f'map_occupied_above is {self.map_occupied_above:g}, allowed are numbers below 100')
        if self.lost_limit > 1.0:
            found.append(f'lost_limit is {self.lost_limit:g}, allowed are 0 to 1')
        names = [getattr(self, name) for name in _FRAMES]
        if len(set(names)) < 3:
            found.append(
                'odom_frame_id, base_frame_id and global_frame_id must differ; they are {}.'.format(', '.join(names))
            )
        return found

    @classmethod
    def from_params(cls, params: dict[str, object]) -> RangeConfig:
        """From a dictionary of parameters; raises ConfigError with every fault that was found."""
        reader = ParameterReader(params)
        values = reader.by_defaults(cls, _FRAMES, apart=('seed',))
        seed = reader.take('seed', cls.seed)
        values['seed'] = seed if is_whole(seed, 0) else cls.seed
        if not is_whole(seed, 0):
            reader.faults.append(f'seed is {seed!r}, allowed are whole numbers of 0 or more')
        values['turn_scale_file'] = reader.take('turn_scale_file', cls.turn_scale_file)
        if not isinstance(values['turn_scale_file'], str):
            reader.faults.append(f'turn_scale_file is {values["turn_scale_file"]!r}, allowed is the name of a file')
        topics = reader.take('range_topics', [])
        if (
            not isinstance(topics, (list, tuple))
            or not topics
            or not all(isinstance(topic, str) and topic for topic in topics)
        ):
            reader.faults.append(f'range_topics is {topics!r}, allowed is a list of one topic or more')
            topics = ()
        elif len(set(topics)) < len(topics):
            reader.faults.append(
                'range_topics names a topic twice; a sensor must agree with the map twice by itself: {}.'.format(
                    ', '.join(topics)
                )
            )
        unknown = tuple(f'{name} is no parameter of range_localization: ignored.' for name in sorted(reader.left))
        config = cls(range_topics=tuple(topics), warnings=unknown, **values)
        faults = reader.faults + config.faults()
        if faults:
            raise ConfigError(faults, unknown)
        return config
