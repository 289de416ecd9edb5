"""What is looked at of a range reading's cone: no cell is left out that it says something of."""

import types

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_nav.costmaps.layers import cone

readings = st.lists(
    st.tuples(
        st.floats(-0.5, 3.5),
        st.floats(-0.5, 3.5),
        st.floats(-7.0, 7.0),
        st.floats(0.02, 3.0),
        st.floats(0.01, 1.7),
        st.booleans(),
    ),
    min_size=1,
    max_size=4,
)
PLAIN = getattr(cone.apply, '__wrapped__', None) or cone.apply.py_func
BOUNDLESS = types.FunctionType(PLAIN.__code__, {**vars(cone), '_around': lambda *_: np.full((4, 2), np.inf)})


def told(apply, readings, remember, inflate_cone):
    """Return all that some readings change, taken one after the other."""
    grid, seen_at = np.full((32, 32), 0.5, np.float32), np.full((32, 32), -np.inf)
    free_at = np.full((32, 32) if remember else (0, 0), -np.inf)
    windows = [
        apply(
            grid,
            seen_at,
            free_at,
            0.0,
            0.0,
            0.1,
            x,
            y,
            yaw,
            distance,
            half,
            1.2,
            inflate_cone,
            clear,
            0.2,
            0.8,
            float(t),
            t - 2.0,
        )
        for t, (x, y, yaw, distance, half, clear) in enumerate(readings)
    ]
    return grid, seen_at, free_at, np.array(windows)


@settings(deadline=None, max_examples=60)
@given(readings, st.booleans(), st.floats(0.3, 1.0))
def test_the_rows_bounds_leave_nothing_out(readings, remember, inflate_cone):
    """As the plain form of the kernel with bounds that leave no cell of the window out."""
    for bounded, whole in zip(
        told(cone.apply, readings, remember, inflate_cone), told(BOUNDLESS, readings, remember, inflate_cone)
    ):
        np.testing.assert_allclose(bounded, whole, rtol=1e-6)
