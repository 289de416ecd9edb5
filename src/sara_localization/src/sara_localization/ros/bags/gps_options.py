"""The options of the offline tools that run navsat_transform_node beside a filter."""

from __future__ import annotations

import argparse
import sys

from sara_common.config import ConfigError
from sara_localization.gps.navsat_config import NavSatConfig
from sara_localization.ros.bags.bag_tools import UsageError, load_params
from sara_localization.ros.bags.gps_filter import GpsInputs
from sara_localization.ros.inputs import resolved


def add(parser: argparse.ArgumentParser, required: bool = False) -> None:
    """--navsat, --fix, --imu, --vel."""
    parser.add_argument(
        '--navsat',
        required=required,
        metavar='NAVSAT.yaml',
        help='the parameters of navsat_transform_node, which runs beside the filter',
    )
    add_topics(parser)
    parser.add_argument(
        '--vel',
        default=GpsInputs._field_defaults['velocity'],
        help="topic of the receiver's velocities, for velocity_heading (%(default)s)",
    )


def add_topics(parser: argparse.ArgumentParser) -> None:
    """--fix, --imu."""
    parser.add_argument('--fix', default=GpsInputs._field_defaults['fix'], help='topic of its fixes (%(default)s)')
    parser.add_argument('--imu', default=GpsInputs._field_defaults['imu'], help='topic of its IMU (%(default)s)')


def inputs(arguments: argparse.Namespace, quiet: bool = False) -> GpsInputs:
    """What navsat_transform_node runs on; raises UsageError."""
    try:
        config = NavSatConfig.from_params(load_params(arguments.navsat))
    except ConfigError as error:
        raise UsageError(f'{arguments.navsat}: {error}') from None
    for warning in () if quiet else config.warnings:
        print(f'warning: {arguments.navsat}: {warning}', file=sys.stderr)
    topics = GpsInputs(config, resolved(arguments.fix), resolved(arguments.imu))
    return topics._replace(velocity=resolved(arguments.vel)) if 'vel' in arguments else topics
