"""Planned speeds keep their limits, what caps them ahead, and end where they are to."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_nav.pursuit.smooth_speed import Caps, Motion, SpeedLimits, approach, braking_to_rest, next_speed, way_to_slow

LIMITS = st.builds(SpeedLimits, st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.floats(0.2, 5.0))


def braked(v, a, braking, jerk, dt=1e-4):
    """The way and the time to rest, step by step: brake as long as letting go now would not end at rest."""
    way = 0.0
    for step in range(400000):
        if v <= 0.0 and a <= 0.0 or v < 1e-9:
            return way, step * dt
        over = v - a * a / (2.0 * jerk) if a < 0.0 else v
        a = max(a - jerk * dt, -braking) if over > 0.0 else min(a + jerk * dt, 0.0)
        v += a * dt
        way += max(v, 0.0) * dt
    raise AssertionError('no rest')


@pytest.mark.parametrize(
    'v, a, braking, jerk',
    [
        (0.5, 0.0, 0.3, 0.8),
        (0.5, 0.4, 0.3, 0.8),
        (0.1, 0.0, 0.8, 0.8),
        (0.05, 0.3, 0.8, 0.8),
        (1.0, -0.5, 0.8, 0.8),
        (0.3, -0.3, 0.3, 2.0),
    ],
)
def test_the_way_to_rest_is_what_braking_step_by_step_takes(v, a, braking, jerk):
    way, time = braking_to_rest(v, a, braking, jerk)
    stepped_way, stepped_time = braked(v, a, braking, jerk)
    assert way == pytest.approx(stepped_way, abs=2e-3) and time == pytest.approx(stepped_time, abs=0.02)


@given(LIMITS, st.floats(0.0, 1.5), st.floats(-1.0, 1.0), st.floats(0.0, 1.0))
def test_the_way_to_a_speed_is_that_to_rest_seen_from_something_that_moves_so_fast(limits, above, share, end):
    a = share * (limits.braking if share < 0.0 else limits.acceleration)
    way, time = braking_to_rest(above, a, limits.braking, limits.jerk)
    if above > 0.0:
        assert way_to_slow(end + above, a, end, limits.braking, limits.jerk) == pytest.approx(
            way + end * time, rel=1e-6, abs=1e-9
        )
    assert way_to_slow(end, min(a, 0.0), end, limits.braking, limits.jerk) == 0.0


@given(
    LIMITS, st.lists(st.tuples(st.floats(0.1, 8.0), st.floats(0.0, 1.0)), min_size=1, max_size=5), st.floats(0.2, 1.5)
)
def test_every_cap_ahead_is_kept_where_it_stands_and_is_named(limits, caps, highest):
    dt, v, a, x, seen = 0.05, 0.0, 0.0, 0.0, []
    caps = [(way, cap) for way, cap in caps] + [(9.0, 0.0)]
    for _ in range(20000):
        ahead = [(way - x, cap) for way, cap in caps if way > x]
        if not ahead:
            break
        before = v
        v, a, at = next_speed(Motion(v, a), highest, Caps(*zip(*ahead)), limits, dt)
        x += 0.5 * (before + v) * dt
        seen.append((x, v))
        assert at == -1 or v <= highest + 1e-9 and 0 <= at < len(ahead)
        if v == 0.0 and len(seen) > 5:
            break
    slack = 3.0 * dt * (limits.braking + limits.jerk * dt)
    for way, cap in caps:
        for (x0, v0), (x1, _) in zip(seen, seen[1:]):
            if x0 <= way < x1:
                assert v0 <= cap + slack


@given(LIMITS, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_a_target_of_either_sign_is_approached_within_limits_and_not_overshot(limits, v, target):
    a, begin = 0.0, v
    for _ in range(3000):
        before, a_before = v, a
        v, a = approach(v, a, target, limits.acceleration, limits.jerk, 0.05)
        assert abs(a) <= limits.acceleration + 1e-9 and abs(a - a_before) <= 0.05 * limits.jerk + 1e-9
        assert v - before == pytest.approx(0.05 * a, abs=1e-12)
        assert min(begin, target) - 1e-6 <= v <= max(begin, target) + 1e-6
    assert v == pytest.approx(target, abs=1e-3)


def drive(length, highest, limits, dt=0.05, start=(0.0, 0.0)):
    """All (speed, acceleration) of a drive of that length; and how far it came."""
    v, a = start
    x, samples = 0.0, [(v, a)]
    for _ in range(100000):
        before = v
        v, a, _ = next_speed(Motion(v, a), highest, Caps([length - x], [0.0]), limits, dt)
        x += 0.5 * (before + v) * dt
        samples.append((v, a))
        if v == 0.0 and len(samples) > 5:
            return samples, x
    raise AssertionError('never at rest')


@given(LIMITS, st.floats(0.05, 20.0), st.floats(0.1, 1.5))
def test_a_drive_keeps_all_limits_and_ends_where_it_is_to(limits, length, highest):
    dt = 0.05
    samples, x = drive(length, highest, limits, dt)
    for (v0, a0), (v1, a1) in zip(samples, samples[1:]):
        assert 0.0 <= v1 <= highest + 1e-9
        assert -limits.braking - 1e-9 <= a1 <= limits.acceleration + 1e-9
        if v1 > 0.0:
            assert abs(a1 - a0) <= limits.jerk * dt + 1e-9
            assert v1 - v0 == pytest.approx(a1 * dt, abs=1e-9)
    assert x <= length + 0.002  # steps of 0.05 s are no continuum
    assert x >= length - max(0.02, 3.0 * dt * dt * (limits.braking + limits.jerk))


@given(LIMITS, st.floats(0.0, 1.5), st.floats(-2.0, 2.0), st.floats(-1.0, 5.0), st.floats(0.0, 1.5))
def test_whatever_is_asked_one_step_keeps_acceleration_and_jerk_or_is_rest(limits, v, a, left, highest):
    a = min(max(a, -limits.braking), limits.acceleration)
    speed, acceleration, _ = next_speed(Motion(v, a), highest, Caps([left], [0.0]), limits, 0.05)
    assert speed >= 0.0
    if speed > 0.0:
        assert abs(acceleration - a) <= 0.05 * limits.jerk + 1e-9
        assert -limits.braking - 1e-9 <= acceleration <= limits.acceleration + 1e-9


@given(LIMITS, st.floats(0.2, 1.5))
def test_a_way_that_is_suddenly_shorter_is_braked_for_as_hard_as_allowed(limits, v):
    samples, _ = drive(0.0, 1.5, limits, start=(v, 0.0))
    hardest = [max(a0 - 0.05 * limits.jerk, -limits.braking) for _, a0 in samples[:-1]]
    assert all(a == pytest.approx(h, abs=1e-9) for (_, a), h in list(zip(samples[1:], hardest))[:3] if a != 0.0)
