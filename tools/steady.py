"""Pytest plugin: property tests draw the same examples every time, so that a test that passes passes again.

With SARA_RANDOM_TESTS set they draw new ones, as `make campaign` does: what they find goes into the test as an example.
"""

import os

from hypothesis import settings

settings.register_profile('steady', derandomize='SARA_RANDOM_TESTS' not in os.environ, deadline=None)
settings.load_profile('steady')
