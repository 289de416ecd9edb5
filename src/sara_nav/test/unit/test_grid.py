"""Where cells are: costmap_2d's coordinates tests rebuilt from their description, and the law of the round trip."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_nav.grids.grid import GridError, GridGeometry

EASY = GridGeometry(2, 3, 1.0, 0.0, 0.0)
HARD = GridGeometry(2, 3, 0.1, -0.2, 0.2)


def test_easy_coordinates():
    assert EASY.to_world(0, 0) == (0.5, 0.5) and EASY.to_world(1, 2) == (1.5, 2.5)
    assert EASY.to_cell(1.5, 2.5) == EASY.to_cell_unbounded(1.5, 2.5) == (1, 2)
    assert EASY.to_cell(2.5, 2.5) is None
    assert EASY.to_cell_unbounded(2.5, 2.5) == (2, 2)
    for x, column in ((0.0, 0), (0.25, 0), (0.75, 0), (0.9999, 0), (1.0, 1), (1.25, 1), (1.75, 1), (1.9999, 1)):
        assert EASY.to_cell(x, 2.5) == (column, 2)
    assert EASY.to_cell(2.0, 2.5) is None


def test_hard_coordinates():
    assert HARD.to_world(0, 0) == pytest.approx((-0.15, 0.25)) and HARD.to_world(1, 2) == pytest.approx((-0.05, 0.45))
    assert HARD.to_cell(-0.05, 0.45) == HARD.to_cell_unbounded(-0.05, 0.45) == (1, 2)
    assert HARD.to_cell(2.5, 0.45) is None
    assert HARD.to_cell_unbounded(2.5, 0.45) == (27, 2)


@given(st.integers(0, 99), st.integers(0, 49), st.floats(1e-3, 10.0), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_the_cell_of_a_cells_centre_is_that_cell(column, row, resolution, x, y):
    grid = GridGeometry(100, 50, resolution, x, y)
    centre = grid.to_world(column, row)
    assert grid.to_cell(*centre) == grid.to_cell_unbounded(*centre) == (column, row)


def test_no_cell_holds_a_point_at_infinity():
    for x, y in ((math.nan, 1.0), (1.0, math.nan), (1.0, math.inf), (-math.inf, 1.0), (1e308, 1.0), (1.0, -1e308)):
        assert EASY.to_cell(x, y) is None and HARD.to_cell(x, y) is None


def test_a_grid_moved_by_whole_cells():
    assert HARD.moved(3, -2) == GridGeometry(2, 3, 0.1, -0.2 + 3 * 0.1, 0.2 - 2 * 0.1)
    assert EASY.size == (2.0, 3.0)


@pytest.mark.parametrize(
    'wrong',
    [
        (2, 3, 0.0, 0, 0),
        (2, 3, -1.0, 0, 0),
        (2, 3, math.nan, 0, 0),
        (0, 3, 1.0, 0, 0),
        (2, 0, 1.0, 0, 0),
        (2, 3, 1.0, math.nan, 0),
        (2, 3, 1.0, 0, math.inf),
    ],
)
def test_grids_that_make_no_sense_are_refused(wrong):
    with pytest.raises(GridError):
        GridGeometry(*wrong)
