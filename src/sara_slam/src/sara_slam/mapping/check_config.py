"""What is wrong with the parameters of slam_gmapping, without running it.

    rosrun sara_slam check_config FILE.yaml

One line for each finding, errors first. The status is 1 where something is an error, 2 where the file is of no use,
else 0.
"""

from __future__ import annotations

import argparse
import sys

from sara_common.config import ConfigError
from sara_localization.config import parameters
from sara_slam.mapping.slam_config import SlamConfig

_FAR, _FAR_TURN = 1.5, 0.8
"""m and rad between two scans used, from which on these share little."""


def check(params: dict[str, object]) -> tuple[list[str], list[str]]:
    """(errors, warnings): sentences about slam_gmapping's parameters."""
    try:
        config = SlamConfig.from_params(params)
    except ConfigError as refused:
        return list(refused.faults), list(refused.warnings)
    return [], [*config.warnings, *(sentence for applies, sentence in _doubtful(config) if applies)]


def _doubtful(c):
    return (
        (
            c.linearUpdate > _FAR or c.angularUpdate > _FAR_TURN,
            f'a scan is used only every {c.linearUpdate:g} m or {c.angularUpdate:g} rad: scans share little. 0.25 and '
            '0.25 are usual.',
        ),
        (
            c.linearUpdate == 0.0 or c.angularUpdate == 0.0,
            'every scan is used, even at rest: memory and time grow. 0.25 m and 0.25 rad are usual.',
        ),
        (
            c.transform_publish_period == 0.0,
            'transform_publish_period is 0: map -> odom is not published, so nobody knows the robot in the map.',
        ),
        (
            c.sigma < 0.5 * c.search_resolution,
            f'sigma is {c.sigma:g} m, less than half of search_resolution ({c.search_resolution:g} m): echoes fall '
            'between the cells.',
        ),
        (
            c.minimumScore > 0.0,
            f'minimumScore is {c.minimumScore:g}: the sum over a scan of how likely its echoes are, so at most their '
            'number. minimum_response does not depend on that number.',
        ),
    )


def main(argv: list[str] | None = None) -> None:
    """The program."""
    parser = argparse.ArgumentParser(prog='check_config', description=__doc__.split('\n\n')[0])
    parser.add_argument('params', metavar='FILE.yaml')
    arguments = parser.parse_args(sys.argv[1:] if argv is None else argv)
    try:
        errors, warnings = check(parameters.load(arguments.params))
    except ConfigError as error:
        print(f'check_config: {error}', file=sys.stderr)
        sys.exit(2)
    for kind, sentences in (('error', errors), ('warning', warnings)):
        for sentence in sentences:
            print(f'{kind}: {sentence}')
    if not errors and not warnings:
        print('nothing to mend was found')
    sys.exit(1 if errors else 0)
