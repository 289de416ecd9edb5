"""What every configuration asks of a value before it is believed."""

import math


def is_number(value):
    """Whether a value is a finite number; true and false are none, though Python counts with them."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
