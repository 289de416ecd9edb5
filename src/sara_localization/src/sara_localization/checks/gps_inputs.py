"""What can be started but will not do what its author wants: the parameters of a filter that takes odometry/gps, each
in one sentence with its remedy.
"""

from __future__ import annotations

import math

from sara_common.diagnostics import OK
from sara_localization.checks.findings import Finding, error, warning
from sara_localization.config.filter_config import FilterConfig
from sara_localization.config.input_config import InputConfig
from sara_localization.filters.state import NAMES, ROLL, VX, YAW, X, Y

_GPS = 'odometry/gps'
_NO_GATE = 1e6
_KNOWN_YAW = math.radians(2.0)
"""A standard deviation of the first yaw below which fixes take long to correct it."""


def is_gps(i: InputConfig) -> bool:
    """Whether an input is navsat_transform_node's output, by the end of its topic."""
    return i.kind == 'odom' and i.topic.strip('/').endswith(_GPS)


def gps_inputs(config: FilterConfig) -> list[Finding]:
    """Mistakes of a filter that takes odometry/gps."""
    found = []
    for i in config.inputs:
        if is_gps(i):
            found += _gps_input(config, i)
    return found


def _gps_input(config, i):
    key, found = i.name + '_configuration', []
    if i.differential or i.relative:
        name = i.name + ('_differential' if i.differential else '_relative')
        found.append(
            error(key, f'{name} is true for {_GPS}: its places are used as differences, and drift. Set it false.')
        )
    if not (i.mask[X] and i.mask[Y]):
        found.append(error(key, f'{i.name} is {_GPS} but its x and y are not both used. Set the first two true.'))
    wrong = ', '.join(NAMES[k] for k in range(ROLL, len(i.mask)) if i.mask[k])
    if wrong:
        found.append(
            error(key, f'{i.name} is {_GPS}, which knows nothing of {wrong}: take that out of {i.name}_config.')
        )
    if math.isinf(i.pose_threshold) or i.pose_threshold > _NO_GATE:
        found.append(
            Finding(
                OK,
                key,
                f'{i.name} has no gate: multipath throws fixes 10 m off, and the estimate with them. '
                f'{i.name}_pose_rejection_threshold: 3 leaves them out.',
            )
        )
    if not i.correlation_time:
        found.append(
            Finding(
                OK,
                key,
                f"{i.name}_pose_correlation_time is not given: a receiver's error wanders over a minute, and fixes "
                'that count as independent make the filter far too sure. 60 s is usual, 0 for RTK.',
            )
        )
    sigma = math.sqrt(config.initial_estimate_covariance[YAW, YAW])
    if not any(other.mask[YAW] and not other.differential for other in config.inputs) and sigma < _KNOWN_YAW:
        found.append(
            warning(
                'initial_estimate_covariance',
                f'no input measures yaw itself, and initial_estimate_covariance says that the first one is known to '
                f'{math.degrees(sigma):.2g} deg: {_GPS} can hardly correct it. Use the yaw of an IMU, or give yaw a '
                'variance of 0.1 (18 deg).',
            )
        )
    if not any(other.mask[VX] for other in config.inputs):
        found.append(
            warning(
                'VX_configuration',
                f'{_GPS} is used but no input measures vx: between fixes, and without them, the robot is lost. Use the '
                "wheels' vx.",
            )
        )
    return found
