"""Smoothing against scipy's, on any grid."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from sara_sim.world import smooth


@st.composite
def grids(draw):
    rows, columns = draw(st.integers(1, 20)), draw(st.integers(1, 20))
    return np.random.default_rng(draw(st.integers(0, 1000))).random((rows, columns)) < draw(
        st.sampled_from([0.0, 0.05, 0.5, 1.0])
    )


@given(grids(), st.floats(0.3, 3.0))
def test_the_blur_is_that_of_scipy(grid, sigma):
    ours, theirs = smooth.gaussian(grid, sigma), ndimage.gaussian_filter(grid.astype(float), sigma)
    assert ours == pytest.approx(theirs, abs=1e-3)  # cut off at four sigma rounded up here, rounded there


def test_the_blur_at_the_sigma_of_the_world_is_that_of_scipy():
    grid = np.random.default_rng(0).random((40, 30)) < 0.1
    assert smooth.gaussian(grid, 1.5) == pytest.approx(ndimage.gaussian_filter(grid.astype(float), 1.5), abs=1e-12)


@given(grids())
def test_slopes_are_those_of_sobel(grid):
    grid = grid.astype(float)
    x, y = smooth.slopes(grid)
    assert x == pytest.approx(ndimage.sobel(grid, axis=1), abs=1e-12) and y == pytest.approx(
        ndimage.sobel(grid, axis=0), abs=1e-12
    )


@given(grids(), st.integers(0, 25))
def test_none_within_is_no_dilation_by_a_square(grid, reach):
    dilated = ndimage.binary_dilation(grid, np.ones((2 * reach + 1, 2 * reach + 1), bool))
    assert (smooth.none_within(grid, reach) == ~dilated).all()
