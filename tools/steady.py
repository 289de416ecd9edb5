"""Pytest plugin: property tests draw the same few examples every time, so that a test that passes passes again.

With SARA_RANDOM_TESTS set they draw ten times as many new ones, as `make campaign` does: what they find goes into the
test as an example.
"""

import os

from hypothesis import settings

settings.register_profile('steady', derandomize=True, deadline=None, max_examples=50)
settings.register_profile('random', deadline=None, max_examples=500)
settings.load_profile('random' if 'SARA_RANDOM_TESTS' in os.environ else 'steady')
