"""What can be started but will not do what its author wants: navsat_transform_node's parameters, each in one sentence
with its remedy.
"""

from __future__ import annotations

import math

from sara_localization.checks.findings import Finding, of_parameters
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
_LARGEST_DECLINATION = math.radians(45.0)
_QUARTER = math.pi / 2.0
_NEAR = math.radians(10.0)


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
