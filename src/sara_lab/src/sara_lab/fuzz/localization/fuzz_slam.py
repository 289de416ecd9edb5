"""Random scans, odometry and parameters at slam_gmapping: what scanners, drivers and users get wrong, in every
combination.

`fuzz_slam(count, seed)` tells what came of `count` inputs. Nothing may be raised, poses, edges and map -> odom must be
finite, the map must be one, every kind of trouble is said once, and a graph that is kept comes back as it was.
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from sara_common.config import ConfigError
from sara_common.scans import Sweep
from sara_lab.fuzz.blocks import Report
from sara_lab.fuzz.localization.random_scans import FRAMES, random_mount, random_sweep, random_transform
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.scan_input import ScanInput
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN
from sara_slam.mapping.journal import Journal
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig

INPUTS_PER_NODE = 100
ROOM = (3.0, 2.0)
"""m from the middle to the walls of the room that some scans show."""
MOST_CELLS = 50_000_000
"""Of a map that is looked at."""


def fuzz_slam(count: int, seed: int) -> Report:
    """`count` inputs from a seed."""
    report, rng = Report(), np.random.default_rng(seed)
    while report.inputs < count and not report.faults:
        _one_node(rng, min(INPUTS_PER_NODE, count - report.inputs), report)
    return report


def _one_node(rng, count, report):
    said = []
    with TemporaryDirectory(prefix='fuzz_slam_') as folder:
        path = Path(folder) / 'state'
        slam = Slam(_config(rng), said.append, Journal(path))
        drive = _Drive(rng)
        shares = {drive.seen: 0.6, _scan: 0.32, _map: 0.04, _forget: 0.04}
        acts = [(share, partial(act, rng, slam)) for act, share in shares.items()]
        report.attack(rng, count, acts, lambda: _wrong(slam), lambda: slam.config)
        if report.faults:
            return
        report.faults += _kept(slam, path)
    report.kinds.update(slam.counts)
    report.check_said(said, len(slam.counts))


def _kept(slam, path):
    """What is wrong with the graph that was kept."""
    again = Slam(slam.config, journal=Journal(path))
    if len(again.poses) != len(slam.poses) or not np.allclose(again.poses, slam.poses, rtol=1e-6, atol=1e-3):
        yield 'the graph does not come back as it was'


def _wrong(slam):
    """What must not be so after any input."""
    if slam.poses and not np.isfinite(slam.poses[-1]).all():
        yield 'a pose is not finite'
    if slam.poses and not abs(slam.poses[-1][2]) <= math.pi + 1e-9:
        yield 'a heading is not wrapped'
    if slam.graph.edges:
        edge = slam.graph.edges[-1]
        if not np.isfinite((*edge.relation, *edge.covariance.ravel())).all():
            yield f'an edge is not finite: {edge}'
        elif np.linalg.eigvalsh(edge.covariance).min() <= 0.0:
            yield f'a covariance is none: {edge}'
    if slam.map_from_odom is not None and not np.isfinite(slam.map_from_odom).all():
        yield 'map -> odom is not finite'
    if math.isnan(slam.entropy):
        yield 'the entropy is no number'


def _config(rng):
    """Parameters that are accepted, also odd ones."""
    while True:
        params = {
            **{name: float(rng.choice([0.0, 0.1, 0.5])) for name in ('linearUpdate', 'angularUpdate')},
            **{name: float(rng.choice([0.0, 0.1, 100.0])) for name in ('srr', 'srt', 'str', 'stt')},
            **{name: bool(rng.random() < 0.7) for name in ('loop_closing', 'deskew')},
            **{name: float(rng.choice([0.0, 0.3, 0.9])) for name in ('loop_response', 'loop_agreement')},
            'minimum_response': float(rng.choice([0.0, 0.3, 1.0])),
            'maxRange': float(rng.choice([0.0, 3.0, 20.0])),
            'maxUrange': float(rng.choice([0.0, 2.0])),
            'temporalUpdate': float(rng.choice([-1.0, 0.5])),
            'local_scans': int(rng.choice([1, 3, 20])),
            'lskip': int(rng.choice([0, 3])),
            'delta': float(rng.choice([0.05, 0.5])),
            'search_resolution': float(rng.choice([0.05, 0.2])),
            'sigma': float(rng.choice([0.005, 0.06, 0.5])),
            'loop_drift': float(rng.choice([1e-6, 0.012, 1.0])),
            'loop_together': int(rng.choice([1, 4])),
            'occ_thresh': float(rng.choice([0.0, 0.25, 1.0])),
        }
        try:
            return SlamConfig.from_params(params)
        except ConfigError:
            continue


class _Drive:
    """Scans of a room with a box in it, from a robot that goes to and fro; now and then its odometry is at fault."""

    def __init__(self, rng):
        self._t, self._way, self._drift = 1.0, 0.0, 0.05 * rng.standard_normal(2)

    def seen(self, rng, slam):
        """A scan, as it should be."""
        self._t += 0.3
        self._way += float(rng.choice([0.0, 0.2, 0.3]))
        x, yaw = 2.0 * math.sin(self._way), math.pi * (math.cos(self._way) < 0.0)
        angles = np.linspace(-2.3, 2.3, 60)
        c, s = np.cos(yaw + angles), np.sin(yaw + angles)
        walls = [(side * ROOM[0] - x) / c for side in (-1, 1)] + [side * ROOM[1] / s for side in (-1, 1)]
        ranges = np.min([np.where(wall > 0.0, wall, np.inf) for wall in walls], 0) + 0.01 * rng.standard_normal(60)
        increment = float(angles[1] - angles[0])
        sweep = Sweep(self._t, -2.3, 2.3, increment, float(rng.choice([0.0, 1e-3])), 0.05, 10.0, ranges)
        odometry = Transform.from_xyz_rpy(x + self._drift[0] * self._way, self._drift[1] * self._way, 0.0, yaw=yaw)
        ended = odometry if sweep.time_increment and rng.random() < 0.9 else None
        slam.on_scan(ScanInput('laser', sweep, Transform(), odometry, ended))


def _scan(rng, slam):
    ended = random_transform(rng, 3.0) if rng.random() < 0.3 else None
    frame = FRAMES[rng.integers(len(FRAMES))]
    slam.on_scan(ScanInput(frame, random_sweep(rng), random_mount(rng), random_transform(rng, 3.0), ended))


def _map(_rng, slam):
    grid = slam.map()
    if grid.data.size > MOST_CELLS:
        raise MemoryError(f'a map of {grid.data.size} cells')
    if not np.isin(grid.data, (FREE, OCCUPIED, UNKNOWN)).all():
        raise ValueError('a map with other values')


def _forget(_rng, slam):
    slam.forget_odometry()
