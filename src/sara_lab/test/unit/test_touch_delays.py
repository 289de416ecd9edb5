"""A finger's event counts as answered by a command of its own or of a newer event."""

import math

import pytest

from sara_lab.benches.touch_delays import delays

EVENTS = [(1.0, 0.1), (1.05, 0.2), (1.10, 0.3)]


@pytest.mark.parametrize(
    'published, wanted',
    [
        ([(1.01, 0.1), (1.06, 0.2), (1.13, 0.3)], [0.01, 0.01, 0.03]),
        ([(1.01, 0.1), (1.13, 0.3)], [0.01, 0.08, 0.03]),  # the second one was overtaken
        ([(1.01, 0.1), (1.04, 0.1), (1.09, 0.1), (1.2, 0.3)], [0.01, 0.15, 0.10]),  # the first one is repeated
        ([(0.9, 0.1), (1.01, 0.1), (1.06, 0.2), (1.07, 0.0)], [0.01, 0.01, math.inf]),
    ],
)
def test_delays(published, wanted):
    assert delays(EVENTS, published) == pytest.approx(wanted)


def test_the_same_speed_again_is_of_the_newer_event():
    assert delays([(1.0, 0.1), (1.05, 0.2), (2.0, 0.1)], [(1.01, 0.1), (1.06, 0.2), (2.02, 0.1)]) == pytest.approx(
        [0.01, 0.01, 0.02]
    )
