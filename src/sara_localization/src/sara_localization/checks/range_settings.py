"""What can be started as range_localization but will not do what its author wants, each in one sentence with its
remedy.
"""

from __future__ import annotations

from sara_localization.checks.findings import Finding, of_parameters
from sara_localization.ranges.range_config import RangeConfig

_WIDE_STEP = 0.5
"""m between two steps of a search from which on the dead reckoning between them hides what is heard."""
_WIDE_ROBOT = 0.45
"""m beside a robot's middle from which on it does not pass a door of 0.90 m."""


def is_for_ranges(params: dict[str, object]) -> bool:
    """Whether a file's parameters are range_localization's, by their names."""
    return any(name.startswith(('range_', 'search_')) for name in params)


def check_ranges(params: dict[str, object]) -> list[Finding]:
    """Everything found in range_localization's parameters."""
    return of_parameters(RangeConfig.from_params, params, _doubtful)


def _doubtful(c):
    others = c.range_z_short + c.range_z_max + c.range_z_rand
    return (
        (
            c.range_z_hit < others,
            'range_z_hit',
            f'range_z_hit is {c.range_z_hit:g}, less than range_z_short, range_z_max and range_z_rand together '
            f'({others:g}): a search hardly heeds the map. 0.8 of 1 is usual.',
        ),
        (
            c.search_min_d > _WIDE_STEP,
            'search_min_d',
            f'search_min_d is {c.search_min_d:g} m: a search has few steps on its way. 0.2 m is usual.',
        ),
        (
            c.search_clearance > _WIDE_ROBOT,
            'search_clearance',
            f'search_clearance is {c.search_clearance:g} m: a search leaves out every door narrower than '
            f'{2.0 * c.search_clearance:g} m. Half the width of the robot is enough.',
        ),
    )
