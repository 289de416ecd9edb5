"""What every configuration asks of a value before it is believed."""

import math


def is_number(value):
    """Whether a value is a finite number; true and false are none, though Python counts with them."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def number_faults(config, above_0=(), from_0=(), prefix=''):
    """One sentence for each of these attributes that is not a number above 0, or not one of 0 or more: its name, what
    it holds, what is allowed.
    """
    return [
        f'{prefix}{name} is {getattr(config, name)!r}, allowed are numbers {allowed}'
        for names, fits, allowed in (
            (above_0, lambda value: value > 0, 'above 0'),
            (from_0, lambda value: value >= 0, 'of 0 or more'),
        )
        for name in names
        if not (is_number(getattr(config, name)) and fits(getattr(config, name)))
    ]
