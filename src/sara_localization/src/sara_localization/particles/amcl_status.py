"""What amcl says of itself in /diagnostics, as plain data."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_common.diagnostics import ERROR, OK, WARN, Status, new_faults
from sara_localization.particles.amcl import Amcl

SILENT_AFTER = 15.0
"""s without a scan until that is told."""
FAULTS = ('bad_scan', 'bad_odometry', 'bad_mount', 'no_transform', 'no_fit', 'jump')
"""What becomes of scans by a fault; all else is what the surroundings are like."""


class Heard(NamedTuple):
    """When the last scan came and when the node began to listen, s; the topic; what is waited for, or ''."""

    last_scan: float | None
    since: float
    topic: str
    waiting: str = ''


def statuses(amcl: Amcl, now: float, heard: Heard, before: dict[str, int] | None = None) -> list[Status]:
    """The node's statuses at a time (s); `before`: the counts of the last time, for faults are told when they are
    new.
    """
    return [_state(amcl, now, heard, before or {}), _deviation(amcl)]


def _state(amcl, now, heard, before):
    faults = new_faults(amcl.counts, before, FAULTS)
    silent = now - (heard.since if heard.last_scan is None else heard.last_scan)
    level, message = OK, f'{len(amcl.filter.poses)} particles, {amcl.counts["updates"]} scans used'
    if amcl.map is None:
        level, message = ERROR, 'waiting for the map'
    elif silent > SILENT_AFTER:
        level, message = ERROR, f'no scan on {heard.topic} for {silent:.0f} s'
    elif heard.waiting:
        level, message = ERROR, heard.waiting
    elif amcl.belief is None:
        level, message = WARN, f'waiting for a scan on {heard.topic}'
    elif amcl.filter.is_searching:
        level, message = WARN, f'searching for the place with {len(amcl.filter.poses)} particles'
    elif amcl.lost.probability > amcl.config.lost_limit:
        level = WARN
        message = f'lost: the pose is wrong with a probability of {amcl.lost.probability:.2f}'
    elif faults:
        level, message = WARN, faults
    values = [(what, str(count)) for what, count in sorted(amcl.counts.items())]
    values += [('probability of being lost', f'{amcl.lost.probability:.3f}')]
    values += [('particles', str(len(amcl.filter.poses))), ('random share', f'{amcl.filter.random_share:.3f}')]
    if amcl.belief is not None:
        x, y, yaw = np.sqrt(amcl.belief.cluster_covariance.diagonal())
        values += [
            ('clusters', str(amcl.belief.clusters)),
            ('weight of the pose', f'{amcl.belief.weight:.3f}'),
            ('sigma of its cluster (m, m, deg)', f'{x:.3f} {y:.3f} {math.degrees(yaw):.2f}'),
        ]
    return Status('amcl', level, message, tuple(values))


def _deviation(amcl):
    """The C++ node's status, with its keys."""
    c = amcl.config
    levels = (c.std_warn_level_x, c.std_warn_level_y, c.std_warn_level_yaw)
    if amcl.belief is None:
        return Status('Standard deviation', WARN, 'no pose yet', ())
    deviations = np.sqrt(amcl.belief.covariance.diagonal())
    names = ('x', 'y', 'yaw')
    values = [(f'std_{name}', f'{deviation:.4f}') for name, deviation in zip(names, deviations)]
    values += [(f'std_warn_level_{name}', f'{level:g}') for name, level in zip(names, levels)]
    large = [name for name, deviation, level in zip(names, deviations, levels) if deviation > level]
    message = 'Too large: ' + ', '.join(large) if large else 'OK'
    return Status('Standard deviation', WARN if large else OK, message, tuple(values))
