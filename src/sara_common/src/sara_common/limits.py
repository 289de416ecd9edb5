"""Checking the numbers of a configuration against their limits, one sentence for each that is outside."""

import math


def number_faults(config, limits):
    """Return sentences about the fields of ``config`` named in limits {name: (low, high[, low is excluded])}."""
    result = []
    for name, (low, high, *excluded) in limits.items():
        value = getattr(config, name)
        above = value > low if excluded and excluded[0] else value >= low
        if not (math.isfinite(value) and above and value <= high):
            result.append(
                '{} is {!r} but must be a number {} {:g} and <= {:g}'.format(
                    name, value, '>' if excluded and excluded[0] else '>=', low, high
                )
            )
    return result


def range_faults(config, limits):
    """Return sentences about the fields of ``config`` that are outside limits {name: (low, high)}, both included."""
    return [
        f'{name} is {getattr(config, name)!r} but must be in {low:g}..{high:g}'
        for name, (low, high) in limits.items()
        if not low <= getattr(config, name) <= high
    ]
