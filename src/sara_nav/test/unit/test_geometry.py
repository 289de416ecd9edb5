"""Laws of grid cells."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_nav.grids.grid import GridError, GridGeometry


@given(st.integers(0, 39), st.integers(0, 29))
def test_a_cells_centre_is_in_the_cell(column, row):
    grid = GridGeometry(40, 30, 0.05, -1.3, 2.7)
    assert grid.to_cell(*grid.to_world(column, row)) == (column, row)


def test_off_the_grid_is_none():
    grid = GridGeometry(40, 30, 0.05, 0.0, 0.0)
    for x, y in ((-1e-6, 1.0), (1.0, -1e-6), (2.0, 1.0), (1.0, 1.5), (math.nan, 1.0), (1.0, math.inf)):
        assert grid.to_cell(x, y) is None


@pytest.mark.parametrize(
    'fault', [(0, 3, 0.1, 0, 0), (3, 0, 0.1, 0, 0), (3, 3, 0.0, 0, 0), (3, 3, math.nan, 0, 0), (3, 3, 0.1, math.inf, 0)]
)
def test_senseless_grids_are_refused(fault):
    with pytest.raises(GridError):
        GridGeometry(*fault)
