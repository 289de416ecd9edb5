"""Stamps: seconds as a float, nanoseconds beside it."""

import copy
import pickle

from hypothesis import given
from hypothesis import strategies as st

from sara_localization.geometry.stamps import Stamp, later, nanoseconds

SECONDS, NANOS = st.integers(0, 4 * 10**9), st.integers(0, 10**9 - 1)


@given(SECONDS, NANOS)
def test_a_stamp_is_a_float_that_knows_its_nanoseconds(s, ns):
    stamp = Stamp(s, ns)
    assert stamp == s + 1e-9 * ns and nanoseconds(stamp) == s * 10**9 + ns
    assert nanoseconds(pickle.loads(pickle.dumps(stamp))) == nanoseconds(copy.copy(stamp)) == nanoseconds(stamp)
    assert abs(nanoseconds(float(stamp)) - nanoseconds(stamp)) <= 300
    assert type(stamp + 1.0) is float


@given(SECONDS, NANOS, st.floats(-10, 10))
def test_later_is_exact(s, ns, dt):
    assert nanoseconds(later(Stamp(s + 100, ns), dt)) == (s + 100) * 10**9 + ns + round(dt * 1e9)
