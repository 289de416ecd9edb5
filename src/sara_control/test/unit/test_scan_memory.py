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
    memory = ScanMemory(walk, memory, 20.0)
    memory.add(10.0, (0.0, 0.0), fan(reach), np.zeros(400, bool))
    return memory


def known(memory, x, y=0.0):
    return bool(memory.known(np.array([[x, y]]))[0])


def hits(memory):
    return memory.places()[0]


def moving(memory):
    places, moves = memory.places()
    return places[moves]


def seen_from(sensor, discs, wall, random):
    """Rays all round from a place among discs (x, y, radius) before a wall at x = `wall`, all m: (ends, hit)."""
    angles = np.linspace(-math.pi, math.pi, 720, endpoint=False)
    c, s = np.cos(angles), np.sin(angles)
    far = np.where(c > 1e-3, (wall - sensor[0]) / np.maximum(c, 1e-3), math.inf)
    for x, y, radius in discs:
        along, across = (x - sensor[0]) * c + (y - sensor[1]) * s, (y - sensor[1]) * c - (x - sensor[0]) * s
        met = (np.abs(across) < radius) & (along > 0.0)
        far = np.where(met, np.minimum(far, along - np.sqrt(np.maximum(radius**2 - across**2, 0.0))), far)
    hit = far < 2.5
    far = np.minimum(far, 2.5) + np.where(hit, random.normal(0.0, 0.01, len(far)), 0.0)
    return np.column_stack([sensor[0] + far * c, sensor[1] + far * s]), hit


@settings(max_examples=30)
@given(st.floats(0.1, 2.9), st.floats(-math.pi, math.pi))
def test_rays_free_what_they_pass_and_nothing_beyond(distance, angle):
    memory = open_floor()
    assert known(memory, distance * math.cos(angle), distance * math.sin(angle)) == (distance < 2.0) or (
        abs(distance - 2.0) < 1.5 * CELL
    )


def test_a_hit_is_a_place_until_it_is_seen_through_or_forgotten():
    memory = ScanMemory(1.0, 3.0, 20.0)
    memory.add(10.0, (0.0, 0.0), np.array([[1.013, 0.021]]), np.ones(1, bool))
    assert hits(memory) == pytest.approx(np.array([[1.013, 0.021]]))
    memory.add(10.1, (0.0, 0.0), np.array([[0.0, 1.0]]), np.ones(1, bool))
    assert len(hits(memory)) == 2
    memory.add(10.2, (0.0, 0.0), np.array([[2.0, 0.042]]), np.zeros(1, bool))
    assert hits(memory) == pytest.approx(np.array([[0.0, 1.0]]))
    memory.add(13.2, (0.0, 0.0), np.array([[-1.0, 0.0]]), np.zeros(1, bool))
    assert len(hits(memory)) == 0


def test_what_stood_still_is_remembered_longer_but_not_once_it_is_seen_through():
    memory, nothing = ScanMemory(1.0, 3.0, 20.0), (np.empty((0, 2)), np.zeros(0, bool))
    jamb, passing = np.array([[0.52, 0.33]]), np.array([[0.52, -0.33]])
    for k in range(15):
        memory.add(10.0 + 0.1 * k, (0.0, 0.0), *((jamb, np.ones(1, bool)) if k % 3 else nothing))
    memory.add(11.5, (0.0, 0.0), passing, np.ones(1, bool))
    memory.add(14.6, (0.0, 0.0), *nothing)
    assert hits(memory) == pytest.approx(jamb)
    memory.add(31.3, (0.0, 0.0), *nothing)
    assert hits(memory) == pytest.approx(jamb)
    memory.add(31.5, (0.0, 0.0), *nothing)
    assert len(hits(memory)) == 0
    for k in range(15):
        memory.add(40.0 + 0.1 * k, (0.0, 0.0), jamb, np.ones(1, bool))
    memory.add(41.5, (0.0, 0.0), 2.0 * jamb, np.zeros(1, bool))
    assert len(hits(memory)) == 0


@pytest.mark.parametrize('speed', [0.4, 0.8, 1.3])
def test_who_walks_moves_and_once_standing_does_not(speed):
    memory, random = ScanMemory(1.0, 3.0, 20.0), np.random.default_rng(3)
    for k in range(20):
        memory.add(10.0 + 0.1 * k, (0.0, 0.0), *seen_from((0.0, 0.0), [], 2.2, random))
    assert len(moving(memory)) == 0
    for k in range(10):  # across before the wall
        person = 1.5, -0.5 * speed + 0.1 * k * speed, 0.2
        memory.add(12.0 + 0.1 * k, (0.0, 0.0), *seen_from((0.0, 0.0), [person], 2.2, random))
    found = moving(memory)
    assert len(found) >= 3 and np.hypot(*(found - person[:2]).T).max() < 0.2 + speed * 1.0 + 0.05
    for k in range(45):
        memory.add(13.0 + 0.1 * k, (0.0, 0.0), *seen_from((0.0, 0.0), [person], 2.2, random))
    assert len(moving(memory)) == 0 and np.hypot(*(hits(memory) - person[:2]).T).min() < 0.25


@settings(max_examples=15)
@given(st.floats(0.8, 2.4), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.integers(0, 99))
def test_what_stands_does_not_move_however_the_chair_does(wall, vx, vy, seed):
    memory, random = ScanMemory(1.0, 3.0, 20.0), np.random.default_rng(seed)
    posts = [(0.9 * wall, 0.8, 0.05), (-1.0, -0.6, 0.2)]
    for k in range(10):
        at = 0.1 * k * vx, 0.1 * k * vy
        memory.add(10.0 + 0.1 * k, at, *seen_from(at, posts, wall, random))
        places, moves = memory.places()
        assert moves.sum() <= 0.01 * len(places)


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
    memory, nothing = ScanMemory(1.0, 3.0, 20.0), (np.empty((0, 2)), np.zeros(0, bool))
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
    assert np.abs(hits(memory) - (3.2, -1.45)).sum(axis=1).min() < 1e-9
    memory.clear()
    assert not known(memory, 1.0) and len(hits(memory)) == 0
