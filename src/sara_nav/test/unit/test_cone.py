"""What is looked at of a range reading's cone: no cell is left out that it says something of."""

import types

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_nav.costmaps.layers import cone
from sara_nav.grids.grid import Grid

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


def plain(kernel, **others):
    """Return the plain form of a kernel of ``cone``, with other functions in place of some that it calls."""
    function = getattr(kernel, '__wrapped__', None) or kernel.py_func
    return types.FunctionType(function.__code__, {**vars(cone), **others})


BOUNDLESS = plain(cone.apply, _take=plain(cone._take, corners_around=lambda _: np.full((4, 2), np.inf)))


def told(apply, readings, remember, inflate_cone):
    """Return all that some readings change, taken one after the other."""
    grid, seen_at = np.full((32, 32), 0.5, np.float32), np.full((32, 32), -np.inf)
    free_at = np.full((32, 32) if remember else (0, 0), -np.inf)
    belief, model = cone.Belief(grid, seen_at, free_at), cone.Model(1.2, inflate_cone, 0.2, 0.8)
    windows = [
        apply(belief, Grid(0.0, 0.0, 0.1), model, cone.When(float(t), t - 2.0), cone.Reading(*reading))
        for t, reading in enumerate(readings)
    ]
    return grid, seen_at, free_at, np.array(windows)


@settings(max_examples=60)
@given(readings, st.booleans(), st.floats(0.3, 1.0))
def test_the_rows_bounds_leave_nothing_out(readings, remember, inflate_cone):
    """As the plain form of the kernel with bounds that leave no cell of the window out."""
    for bounded, whole in zip(
        told(cone.apply, readings, remember, inflate_cone), told(BOUNDLESS, readings, remember, inflate_cone)
    ):
        np.testing.assert_allclose(bounded, whole, rtol=1e-6)
