"""Pytest plugin: property tests draw the same few examples every time, so that a test that passes passes again.

With SARA_RANDOM_TESTS set they draw ten times as many new ones, as `make campaign` does: what they find goes into the
test as an example. Tests that are long are short in `make test`, and whole there: `whole(5, 1)` is how much of it.
"""

import os

from hypothesis import settings

settings.register_profile('steady', derandomize=True, deadline=None, max_examples=50)
settings.register_profile('random', deadline=None, max_examples=500)
WHOLE = 'SARA_RANDOM_TESTS' in os.environ
settings.load_profile('random' if WHOLE else 'steady')


def whole(much, little):
    """How much of what a test repeats: `much` in `make campaign`, `little` in `make test`."""
    return much if WHOLE else little
