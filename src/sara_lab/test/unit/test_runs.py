"""Runs of true values."""

import numpy as np
import pytest

from sara_lab.judge.runs import runs


@pytest.mark.parametrize(
    'holds, found',
    [
        ([], []),
        ([0, 0], []),
        ([1], [(0, 1)]),
        ([1, 1, 0, 1], [(0, 2), (3, 4)]),
        ([0, 1, 1, 0], [(1, 3)]),
    ],
)
def test_each_run_is_found_with_the_index_after_its_last(holds, found):
    assert runs(np.array(holds, bool)) == found
