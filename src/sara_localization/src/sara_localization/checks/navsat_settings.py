"""What can be started but will not do what its author wants: navsat_transform_node's parameters, and those of a filter
that takes odometry/gps; each in one sentence with its remedy.
"""

from __future__ import annotations

import math

from sara_common.diagnostics import OK
from sara_localization.checks.findings import Finding, error, of_parameters, warning
from sara_localization.config.filter_config import FilterConfig
from sara_localization.config.input_config import InputConfig
from sara_localization.filters.state import NAMES, ROLL, VX, YAW, X, Y
from sara_localization.gps.navsat_config import NavSatConfig

_ITS_OWN = (
    'magnetic_declination_radians',
    'yaw_offset',
    'zero_altitude',
    'publish_filtered_gps',
    'broadcast_cartesian_transform',
    'broadcast_utm_transform',
    'use_odometry_yaw',
    'wait_for_datum',
    'datum',
    'use_local_cartesian',
    'velocity_heading',
)
_GPS = 'odometry/gps'
_LARGEST_DECLINATION = math.radians(45.0)
_QUARTER = math.pi / 2.0
_NEAR = math.radians(10.0)
_NO_GATE = 1e6
_KNOWN_YAW = math.radians(2.0)
"""A standard deviation of the first yaw below which fixes take long to correct it."""


def is_for_navsat(params: dict[str, object]) -> bool:
    """Whether a file's parameters are navsat_transform_node's, by their names."""
    return any(name in _ITS_OWN for name in params)


def check_navsat(params: dict[str, object]) -> list[Finding]:
    """Everything found in navsat_transform_node's parameters."""
    return of_parameters(NavSatConfig.from_params, params, _doubtful)


def _doubtful(c):
    declination = c.magnetic_declination_radians or 0.0
    quarters = round(c.yaw_offset / _QUARTER)
    return (
        (
            abs(declination) > _LARGEST_DECLINATION,
            'magnetic_declination_radians',
            f'magnetic_declination_radians is {declination:g}, which is {math.degrees(declination):.0f} deg: it '
            'counts in radians. Without the line it comes from the world magnetic model.',
        ),
        (
            abs(c.yaw_offset) > 2.0 * math.pi,
            'yaw_offset',
            f'yaw_offset is {c.yaw_offset:g}: it counts in radians. 1.5707963 is right for an IMU that says 0 '
            'facing north.',
        ),
        (
            abs(c.yaw_offset) <= 2.0 * math.pi and abs(c.yaw_offset - quarters * _QUARTER) > _NEAR,
            'yaw_offset',
            f'yaw_offset is {c.yaw_offset:g} rad, no quarter turn: it makes up for an IMU that says 0 facing north '
            '(1.5707963) or south (-1.5707963) instead of east; its mounting on the robot belongs into tf, and the '
            'declination into magnetic_declination_radians.',
        ),
        (
            c.datum is not None and not c.wait_for_datum,
            'datum',
            'datum has no effect without wait_for_datum: true. The first fix is taken instead.',
        ),
        (
            c.datum is not None and c.wait_for_datum and declination != 0.0,
            'datum',
            "magnetic_declination_radians is added to the datum's heading too, as in the C++ node: take it out where "
            'that heading is the true one.',
        ),
        (
            c.broadcast_cartesian_transform_as_parent_frame and not c.broadcast_cartesian_transform,
            'broadcast_cartesian_transform',
            'broadcast_cartesian_transform_as_parent_frame has no effect without broadcast_cartesian_transform: true.',
        ),
        (
            c.use_odometry_yaw and c.wait_for_datum,
            'use_odometry_yaw',
            "use_odometry_yaw has no effect with wait_for_datum: the heading is the datum's.",
        ),
        (
            c.transform_timeout * c.frequency > 5.0,
            'transform_timeout',
            f'transform_timeout is {c.transform_timeout:g} s, several cycles of the node: it stands still while it '
            'waits for a transform. 0 to 0.1 s is usual.',
        ),
    )


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
