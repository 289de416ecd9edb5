"""What a scanner saw: free where rays passed, places where they ended, and for how long either counts."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_control.zones.scan_memory import CELL, ScanMemory


def fan(reach, count=400):
    """Ends of rays all round the origin, `reach` m long or a function of the angle."""
    angles = np.linspace(-math.pi, math.pi, count, endpoint=False)
    far = np.array([reach(a) for a in angles]) if callable(reach) else np.full(count, reach)
    return np.column_stack([far * np.cos(angles), far * np.sin(angles)])


def open_floor(walk=1.0, memory=3.0, reach=2.0):
    memory = ScanMemory(walk, memory)
    memory.add(10.0, (0.0, 0.0), fan(reach), np.zeros(400, bool))
    return memory


def known(memory, x, y=0.0):
    return bool(memory.known(np.array([[x, y]]))[0])


@settings(max_examples=30)
@given(st.floats(0.1, 2.9), st.floats(-math.pi, math.pi))
def test_rays_free_what_they_pass_and_nothing_beyond(distance, angle):
    memory = open_floor()
    assert known(memory, distance * math.cos(angle), distance * math.sin(angle)) == (distance < 2.0) or (
        abs(distance - 2.0) < 1.5 * CELL
    )


def test_a_hit_is_a_place_until_it_is_seen_through_or_forgotten():
    memory = ScanMemory(1.0, 3.0)
    memory.add(10.0, (0.0, 0.0), np.array([[1.013, 0.021]]), np.ones(1, bool))
    assert memory.places() == pytest.approx(np.array([[1.013, 0.021]]))
    memory.add(10.1, (0.0, 0.0), np.array([[0.0, 1.0]]), np.ones(1, bool))
    assert len(memory.places()) == 2
    memory.add(10.2, (0.0, 0.0), np.array([[2.0, 0.042]]), np.zeros(1, bool))
    assert memory.places() == pytest.approx(np.array([[0.0, 1.0]]))
    memory.add(13.2, (0.0, 0.0), np.array([[-1.0, 0.0]]), np.zeros(1, bool))
    assert len(memory.places()) == 0


@pytest.mark.parametrize('seconds', [0.3, 0.5, 1.0])
def test_unseen_it_stays_free_no_longer_than_somebody_needs_to_walk_there(seconds):
    """Nothing is known beyond 2 m: who stood there may have come so much nearer, and no more than one and a half times
    that is given up.
    """
    memory, nothing = open_floor(), (np.empty((0, 2)), np.zeros(0, bool))
    for k in range(1, round(seconds / 0.1) + 1):
        memory.add(10.0 + 0.1 * k, (0.0, 0.0), *nothing)
    for angle in np.linspace(-3.0, 3.0, 25):
        for way in (seconds * 0.95, seconds * 0.5):
            x, y = (2.0 - way) * math.cos(angle), (2.0 - way) * math.sin(angle)
            assert not known(memory, x, y), 'somebody may be there'
    assert known(memory, 0.0) == (1.5 * seconds < 1.9)


def test_nobody_walks_through_what_was_hit():
    memory, nothing = ScanMemory(1.0, 3.0), (np.empty((0, 2)), np.zeros(0, bool))
    memory.add(10.0, (0.0, 0.0), fan(1.0), np.ones(400, bool))
    for k in range(1, 21):
        memory.add(10.0 + 0.1 * k, (0.0, 0.0), *nothing)
    assert known(memory, 0.8) and known(memory, 0.0, -0.8) and not known(memory, 1.2)


def test_nobody_walks_at_all():
    memory = open_floor(walk=0.0)
    memory.add(12.9, (0.0, 0.0), np.empty((0, 2)), np.zeros(0, bool))
    assert known(memory, 1.9)
    memory.add(13.1, (0.0, 0.0), np.empty((0, 2)), np.zeros(0, bool))
    assert not known(memory, 0.5), 'the memory is over'


def test_the_grid_goes_along_and_keeps_what_it_shows():
    memory = open_floor(walk=0.0)
    for k in range(1, 30):
        memory.add(10.0 + 0.05 * k, (0.1 * k, -0.05 * k), np.array([[0.1 * k + 0.3, -0.05 * k]]), np.ones(1, bool))
    assert known(memory, 1.0) and known(memory, 0.5, -1.0) and not known(memory, 0.5, 5.0)
    assert np.abs(memory.places() - (3.2, -1.45)).sum(axis=1).min() < 1e-9
    memory.clear()
    assert not known(memory, 1.0) and len(memory.places()) == 0
