"""Random ranges, dead reckoning, maps and parameters at range_localization: what sensors, filters and users get wrong,
in every combination.

`fuzz_ranges(count, seed)` tells what came of `count` inputs. Nothing may be raised; poses, covariances, particles and
what is told must be finite, and weights add up to 1.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from sara_common.config import ConfigError
from sara_common.planar import compose, inverse
from sara_lab.fuzz.blocks import Report
from sara_lab.fuzz.localization.random_scans import WEIRD, number, random_map
from sara_localization.particles.range_localizer import RangeLocalizer
from sara_localization.ranges import map_echo
from sara_localization.ranges.range_config import RangeConfig
from sara_localization.ranges.range_data import RangeData, RangeMap
from sara_localization.ranges.range_status import Heard, status
from sara_localization.ranges.turn_scale import MOST

INPUTS_PER_NODE = 400
SENSORS = ('/front', '/left', '/rear')
FAR = 100.0
"""m from which on no wall is looked for."""


class _Robot:
    """A RangeLocalizer, and where the dead reckoning has the robot when."""

    def __init__(self, rng):
        self.localizer, self.stamp, self.pose = RangeLocalizer(_config(rng)), 100.0, (0.0, 0.0, 0.0)


def fuzz_ranges(count: int, seed: int) -> Report:
    """`count` inputs from a seed."""
    report, rng = Report(), np.random.default_rng(seed)
    shares = {_pose: 0.4, _range: 0.54, _set_map: 0.02, _anywhere: 0.01, _put: 0.03}
    while report.inputs < count and not report.faults:
        robot = _Robot(rng)
        acts = [(share, partial(act, rng, robot, report)) for act, share in shares.items()]
        localizer = robot.localizer
        size = min(INPUTS_PER_NODE, count - report.inputs)
        report.attack(rng, size, acts, partial(_wrong, localizer), lambda of=localizer: of.config)
        report.kinds.update(localizer.correction.counts)
    return report


def _wrong(localizer):
    """What must not be so after any input."""
    correction = localizer.correction
    if not np.isfinite((*correction.offset, *(correction.pose or ()))).all():
        yield f'the pose is not finite: {correction.pose}'
    P = correction.P
    if not (np.isfinite(P).all() and (P.diagonal() >= 0.0).all() and np.abs(P - P.T).max() <= 1e-9 * P.max()):
        yield f'the covariance is none: {P.tolist()}'
    if not abs(correction.scale - 1.0) <= MOST + 1e-9:
        yield f'the scale of turns is {correction.scale}'
    if localizer.search is not None:
        poses, weights = localizer.search.filter.poses, localizer.search.filter.weights
        if not (np.isfinite(poses).all() and np.isfinite(weights).all() and abs(weights.sum() - 1.0) < 1e-6):
            yield 'a particle is not finite, or weights do not add up to 1'
    told = status('range_localization', correction, 1.0, Heard(0.5, 0.5, '', localizer.told))
    for text in (told.message, *(value for _, value in told.values)):
        if 'nan' in text.split():
            yield f'diagnostics say {text}'


def _config(rng):
    """Parameters that are accepted, also odd ones."""
    odd = {
        'range_max_range': (0.5, 2.4, 1e3),
        'range_min_range': (0.0, 0.2),
        'range_delay': (0.0, 0.3),
        'range_sigma_hit': (1e-6, 0.05, 1e6),
        'range_sigma_edge': (0.0, 1e-6, 0.12, 1e6),
        'gate': (1e-6, 2.0, 1e6),
        'max_innovation': (0.01, 0.3, 1e6),
        'sigmas': (0.01, 2.0, 100.0),
        'twice_within': (0.1, 1e6),
        'update_min_d': (0.0, 0.05),
        'turn_scale_sigma': (0.0, 0.01, 100.0),
        'odom_alpha1': (0.0, 1e-4, 1e3),
        'odom_alpha3': (0.0, 4e-4, 1e3),
        'initial_cov_xx': (1e-12, 0.01, 1e6),
        'search_min_d': (1e-3, 0.2),
        'search_clearance': (0.0, 0.25),
        'search_sigma_hit': (1e-3, 0.1, 100.0),
        'range_z_short': (0.0, 0.06, 100.0),
        'range_z_max': (0.0, 0.06, 100.0),
    }
    while True:
        params = {name: float(rng.choice(values)) for name, values in odd.items() if rng.random() < 0.5}
        try:
            return RangeConfig.from_params({'range_topics': list(SENSORS), 'seed': int(rng.integers(1000)), **params})
        except ConfigError:
            continue


def _pose(rng, robot, _report):
    """The robot drives on; some poses and stamps are odd."""
    robot.stamp += float(rng.choice([0.05, 0.1, 0.1, 0.1, 0.0, 2.0], p=[0.5, 0.3, 0.1, 0.09, 0.008, 0.002]))
    robot.pose = compose(robot.pose, (0.03 * float(rng.random()), 0.0, 0.03 * float(rng.normal())))
    pose = tuple(value if rng.random() < 0.998 else number(rng, 10.0, 0.5) for value in robot.pose)
    robot.localizer.on_pose(robot.stamp if rng.random() < 0.998 else number(rng, 1e3, 0.5), pose)


def _range(rng, robot, _report):
    """A reading of now or a little before; some are odd in one way or another."""
    sensor = int(rng.choice(len(SENSORS), p=[0.6, 0.3, 0.1]))
    mount = (0.3, 0.2, math.pi / 2.0 * sensor)
    distance = float(rng.choice([rng.uniform(0.0, 3.0), math.inf, -math.inf], p=[0.7, 0.2, 0.1]))
    if rng.random() < 0.9:
        distance = _to_wall(robot.localizer.correction, mount, distance)
    values = [robot.stamp - float(rng.choice([0.0, 0.1, 0.3])), mount, distance, 0.16, 2.5, math.radians(55.0)]
    if rng.random() < 0.05:
        at = int(rng.integers(len(values)))
        weird = float(WEIRD[rng.integers(len(WEIRD))])
        values[at] = (weird, 0.0, 0.0) if at == 1 else weird
    robot.localizer.on_range(RangeData(SENSORS[sensor], *values))


def _to_wall(correction, mount, otherwise):
    """m along a sensor's axis to what the map has there."""
    map_, pose = correction.map, correction.pose
    if map_ is None or pose is None or max(map(abs, pose)) > FAR:
        return otherwise
    x, y, axis = compose(inverse(map_.origin), compose(pose, mount))
    return map_echo.cast(map_.cells, x / map_.resolution, y / map_.resolution, axis, 1e3)[0] * map_.resolution


def _set_map(rng, robot, report):
    """A random map, or a room with a pillar."""
    map_ = random_map(rng) if rng.random() < 0.5 else _room()
    if map_ is None:
        report.kinds['no map'] += 1
    elif robot.localizer.set_map(map_):
        report.kinds['search refused'] += 1


def _room():
    cells = np.full((32, 42), 100, np.int8)
    cells[1:-1, 1:-1] = 0
    cells[20:26, 30:33] = 100
    return RangeMap.from_occupancy(cells, 0.1, (-1.6, -1.2, 0.3), 65)


def _anywhere(_rng, robot, report):
    if robot.localizer.start_anywhere():
        report.kinds['start refused'] += 1


def _put(rng, robot, _report):
    """The robot is put somewhere, in the room as a rule, and its dead reckoning there."""
    robot.pose = tuple(number(rng, size, 0.0) for size in (0.5, 0.5, 1.0))
    robot.localizer.forget()
