"""How long amcl takes for a scan that counts, for `make bench`: tracking a robot that goes to and fro in the school."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from sara_bringup.lockstep.corrected import range_map
from sara_bringup.paths import share
from sara_common.planar import compose
from sara_common.scans import Sweep
from sara_lab.benches.timed import Limit, timed
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.amcl import Amcl
from sara_localization.particles.amcl_config import SCAN_MODELS, AmclConfig
from sara_localization.particles.field import squares_of
from sara_localization.particles.scan_input import ScanInput
from sara_localization.ranges import map_echo
from sara_localization.ranges.range_data import RangeMap
from sara_nav.maps.map_io import load_map

if TYPE_CHECKING:
    from sara_lab.benches.timed import Clock, Timed

PARTICLES, BEAMS, RUNS = 5000, 60, 100
MANY_PARTICLES, MANY_BEAMS = (500, 1000, 2000, 5000, 10000, 20000), (15, 30, 60, 120, 240)
RAYS, MOST, WAY = 360, 20.0, 0.3  # -, m, m
LIMITS = {'likelihood_field': Limit('median', 10.0)}


def school() -> tuple[RangeMap, tuple[float, float, float]]:
    """The map, and a pose (x, y, yaw) in its most open place."""
    loaded = load_map(share() / 'maps' / 'school.yaml')
    map_ = range_map(loaded, AmclConfig.map_occupied_above)
    open_ = np.where(map_.cells == map_echo.FREE, squares_of(map_, 100), 0)
    row, column = np.unravel_index(int(open_.argmax()), open_.shape)
    return map_, (*loaded.geometry.to_world(int(column), int(row)), 0.3)


def scan_at(map_: RangeMap, pose: tuple[float, float, float], odometry: tuple[float, float, float]) -> ScanInput:
    """What a scanner of 360 rays all round measures at a pose, off by 0.02 m."""
    step = 2.0 * math.pi / RAYS
    x, y = (pose[0] - map_.origin[0]) / map_.resolution, (pose[1] - map_.origin[1]) / map_.resolution
    cast = lambda k: map_echo.cast(map_.cells, x, y, pose[2] - math.pi + k * step, MOST / map_.resolution)[0]
    ranges = map_.resolution * np.array([cast(k) for k in range(RAYS)]) + np.random.default_rng(0).normal(0, 0.02, RAYS)
    sweep = Sweep(1.0, -math.pi, math.pi - step, step, 0.0, 0.1, MOST, ranges)
    return ScanInput('laser', sweep, Transform(), Transform.from_xyz_rpy(*odometry[:2], yaw=odometry[2]))


def times(model: str, particles: int, beams: int, clock: Clock, runs: int = RUNS) -> list[float]:
    """ms of each scan that counts; every second one draws the particles anew."""
    map_, start = school()
    amcl = Amcl(
        AmclConfig(laser_model_type=model, laser_max_beams=beams, min_particles=particles, max_particles=particles)
    )
    amcl.set_map(map_)
    amcl.set_pose(start, np.diag([0.04, 0.04, 0.02]))
    steps = (0.0, 0.0, 0.0), (WAY, 0.0, 0.0)
    scans, taken = [scan_at(map_, compose(start, step), step) for step in steps], []
    for k in range(runs + 4):
        began = clock()
        amcl.on_scan(scans[k % 2])
        taken.append(1e3 * (clock() - began))
    if len(amcl.filter.poses) != particles or amcl.counts['updates'] != runs + 4:
        raise AssertionError(f'{len(amcl.filter.poses)} particles, {dict(amcl.counts)}')
    return taken[4:]


def update(runs: int = RUNS, clock: Clock = time.process_time) -> Iterator[Timed]:
    """A scan of 60 beams, 5000 particles, by each model."""
    for model in SCAN_MODELS:
        found = times(model, PARTICLES, BEAMS, clock, runs)
        yield timed(f'amcl, {PARTICLES} x {BEAMS}: {model}', 'ms', found, limit=LIMITS.get(model))


def growth(
    particles: Sequence[int] = MANY_PARTICLES,
    beams: Sequence[int] = MANY_BEAMS,
    runs: int = 12,
    clock: Clock = time.process_time,
) -> Iterator[Timed]:
    """ms of a scan over the number of particles, and of beams."""
    for model in SCAN_MODELS:
        for count in particles:
            name = f'amcl by particles: {model}, {count} particles'
            yield timed(name, 'ms', times(model, count, BEAMS, clock, runs))
        for count in beams:
            yield timed(f'amcl by beams: {model}, {count} beams', 'ms', times(model, PARTICLES, count, clock, runs))
