"""Random scans, maps, poses and parameters at amcl: what scanners, map servers and users get wrong, in every
combination.

`fuzz_amcl(count, seed)` tells what came of `count` inputs. Nothing may be raised, particles, poses and transforms must
be finite, weights add up to 1, and every kind of trouble is said once.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from sara_common.config import ConfigError
from sara_lab.fuzz.blocks import Report
from sara_lab.fuzz.localization.random_scans import (
    FRAMES,
    WEIRD,
    number,
    random_map,
    random_mount,
    random_sweep,
    random_transform,
)
from sara_localization.particles.amcl import Amcl
from sara_localization.particles.amcl_config import ODOM_MODELS, SCAN_MODELS, AmclConfig
from sara_localization.particles.amcl_status import Heard, statuses
from sara_localization.particles.scan_input import ScanInput

INPUTS_PER_NODE = 200


def fuzz_amcl(count: int, seed: int) -> Report:
    """`count` inputs from a seed."""
    report, rng = Report(), np.random.default_rng(seed)
    while report.inputs < count and not report.faults:
        _one_node(rng, min(INPUTS_PER_NODE, count - report.inputs), report)
    return report


def _one_node(rng, count, report):
    said = []
    amcl = Amcl(_config(rng), said.append)
    shares = {
        _scan: 0.8,
        _set_map: 0.06,
        _set_pose: 0.05,
        _anywhere: 0.02,
        _force: 0.03,
        _forget: 0.02,
        _reconfigure: 0.02,
    }
    acts = [(share, partial(act, rng, amcl, report)) for act, share in shares.items()]
    report.attack(rng, count, acts, lambda: _wrong(amcl), lambda: amcl.config)
    if not report.faults:
        report.kinds.update(amcl.counts)
        report.check_said(said, len(amcl.counts))


def _wrong(amcl):
    """What must not be so after any input."""
    poses, weights = amcl.filter.poses, amcl.filter.weights
    if not (np.isfinite(poses).all() and len(poses)):
        yield 'a particle is not finite'
    if not (np.isfinite(weights).all() and weights.min() >= 0.0 and abs(weights.sum() - 1.0) < 1e-6):
        yield 'weights do not add up to 1'
    if np.abs(poses[:, 2]).max() > math.pi + 1e-9:
        yield 'a heading is not wrapped'
    if amcl.belief is not None:
        covariance = amcl.belief.covariance
        if not (
            np.isfinite(amcl.belief.pose).all() and np.isfinite(covariance).all() and covariance.diagonal().min() >= 0
        ):
            yield f'the pose or its covariance is not finite: {amcl.belief}'
    if not 0.0 <= amcl.lost.probability <= 1.0:
        yield f'the probability of being lost is {amcl.lost.probability}'
    offset = amcl.map_from_odom
    if offset is not None and not np.isfinite((*offset.translation, *offset.rotation)).all():
        yield 'map -> odom is not finite'
    for status in statuses(amcl, 1.0, Heard(0.5, 0.0, '/scan')):
        if 'nan' in status.message:
            yield f'diagnostics say {status.message}'


def _config(rng):
    """Parameters that are accepted, also odd ones."""
    while True:
        least = int(rng.integers(1, 60))
        params = {
            'min_particles': least,
            'max_particles': least + int(rng.integers(0, 200)),
            'laser_model_type': str(rng.choice(SCAN_MODELS)),
            'odom_model_type': str(rng.choice(ODOM_MODELS)),
            'seed': int(rng.integers(1000)),
            **{name: bool(rng.random() < 0.5) for name in ('do_beamskip', 'selective_resampling', 'lost_recovery')},
            **{
                name: float(rng.choice([0.0, 0.001, 0.1, 1.0]))
                for name in ('recovery_alpha_slow', 'recovery_alpha_fast')
            },
            **{f'odom_alpha{k}': float(rng.choice([0.0, 0.2, 1000.0])) for k in range(1, 6)},
            **{
                f'laser_z_{part}': float(rng.choice([0.0, 0.05, 0.95, 1000.0]))
                for part in ('hit', 'short', 'max', 'rand')
            },
            'laser_sigma_hit': float(rng.choice([1e-3, 0.2, 100.0])),
            'laser_lambda_short': float(rng.choice([1e-300, 0.1, 1e300])),
            'laser_likelihood_max_dist': float(rng.choice([1e-300, 0.5, 2.0])),
            'laser_likelihood_power': float(rng.choice([1e-3, 1.0, 5.0, 100.0])),
            'laser_max_beams': int(rng.choice([1, 2, 30, 1000])),
            'laser_max_range': float(rng.choice([-1.0, 3.0])),
            'lost_limit': float(rng.choice([0.0, 0.5, 0.9, 1.0])),
            'lost_keeps_heading': float(rng.choice([0.0, 0.5, 1.0])),
            'resample_interval': int(rng.integers(1, 4)),
            'kld_err': float(rng.choice([1e-300, 0.01, 10.0])),
        }
        try:
            return AmclConfig.from_params(params)
        except ConfigError:
            continue


def _scan(rng, amcl, _report):
    ended = random_transform(rng, 3.0) if rng.random() < 0.5 else None
    frame = FRAMES[rng.integers(len(FRAMES))]
    amcl.on_scan(ScanInput(frame, random_sweep(rng), random_mount(rng), random_transform(rng, 3.0), ended))


def _set_map(rng, amcl, report):
    map_ = random_map(rng)
    if map_ is None:
        report.kinds['no map'] += 1
    else:
        amcl.set_map(map_)


def _set_pose(rng, amcl, report):
    covariance = np.diag(10.0 ** rng.uniform(-6, 2, 3))
    if rng.random() < 0.4:
        covariance[rng.integers(3), rng.integers(3)] = WEIRD[rng.integers(len(WEIRD))]
    if amcl.set_pose(tuple(number(rng, 2.0, 0.05) for _ in range(3)), covariance):
        report.kinds['pose refused'] += 1


def _anywhere(_rng, amcl, report):
    if amcl.start_anywhere():
        report.kinds['start refused'] += 1


def _force(_rng, amcl, _report):
    amcl.force_update()


def _forget(_rng, amcl, _report):
    amcl.forget_odometry()


def _reconfigure(rng, amcl, _report):
    amcl.reconfigure(_config(rng))
