"""The same numbers give the same digits, wherever they lie in memory."""

import math

import numpy as np
import pytest

from sara_common.repeatable import cos_sin, directions, times, weighted_sum

RANDOM = np.random.default_rng(3)
PLACES = 60


def lying_about(array):
    """Copies of an array at different places in memory."""
    kept = []
    for k in range(PLACES):
        kept.append(np.empty(int(RANDOM.integers(1, 5000))))  # the next one lies elsewhere
        there = np.empty(array.size + 8)[k % 8 : k % 8 + array.size].reshape(array.shape)
        there[:] = array
        yield there


def digits(function, *arrays):
    """What a function makes of arrays that lie about: all that is different."""
    return {np.asarray(function(*these)).tobytes() for these in zip(*map(lying_about, arrays))}


@pytest.mark.parametrize('n', (3, 15, 100, 2621))
def test_no_digit_depends_on_where_in_memory_arrays_lie(n):
    rows, weights, matrix = RANDOM.standard_normal((n, 3)), RANDOM.random(n), RANDOM.standard_normal((7, n))
    assert len(digits(lambda these: cos_sin(these[:, 2]), rows)) == 1
    assert len(digits(lambda these: directions(these[:, :2]), rows)) == 1
    assert len(digits(weighted_sum, weights, rows[:, 0])) == 1
    assert len(digits(times, matrix, weights)) == 1


def test_they_are_what_they_are_called():
    steps, weights = RANDOM.standard_normal((40, 2)), RANDOM.random(40)
    assert directions(steps) == pytest.approx([math.atan2(y, x) for x, y in steps.tolist()])
    cosines, sines = cos_sin(steps)
    assert cosines == pytest.approx(np.cos(steps)) and sines == pytest.approx(np.sin(steps))
    assert all(of.shape == () for of in cos_sin(np.float64(1.0)))
    assert weighted_sum(weights, steps[:, 0]) == pytest.approx(math.fsum(weights * steps[:, 0]))
    assert times(steps.T, weights) == pytest.approx(steps.T @ weights)
    assert len(directions(np.empty((0, 2)))) == 0
