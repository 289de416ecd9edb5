"""Exact distances on grids."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sara_common.grids import distances

small = hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=14)
grids = hnp.arrays(np.uint8, small, elements=st.sampled_from([0, 0, 0, 0, 0, 100, 253, 254, 255]))


@given(grids, st.integers(1, 15))
def test_distances_are_exact(cells, reach):
    found = distances.squared_distances(cells, reach)
    rows, columns = np.nonzero(cells == distances.OBSTACLE)
    for y in range(cells.shape[0]):
        for x in range(cells.shape[1]):
            true = min(((rows - y) ** 2 + (columns - x) ** 2).tolist(), default=10**6)
            assert found[y, x] == true if true <= reach * reach else found[y, x] > reach * reach
