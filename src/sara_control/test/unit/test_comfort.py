"""Comfort limits hold exactly, whatever is asked and however long a step is."""

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_control.gate.comfort import AxisLimiter, Comfort, Profile, read_profiles

STEPS = st.lists(
    st.tuples(st.floats(-1.5, 1.5), st.integers(1, 40), st.sampled_from([0.01, 0.02, 0.05])), min_size=1, max_size=12
)
LIMITS = st.tuples(st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.floats(0.1, 5.0))


def run(limiter, plan):
    """(dt, speed before, speed after) of each step of a plan of (target, steps, dt)."""
    rows = []
    for target, count, dt in plan:
        for _ in range(count):
            before = limiter.speed
            rows.append((dt, before, limiter.step(target, dt)))
    return rows


@given(LIMITS, STEPS)
@example((0.11, 1.0, 3.0), [(0.0, 2, 0.01), (5e-324, 1, 0.01), (-0.5, 1, 0.05)])  # times anything, that speed is zero
def test_acceleration_braking_and_jerk_hold_exactly(limits, plan):
    growing, shrinking, jerk = limits
    last = 0.0
    for dt, before, after in run(AxisLimiter(*limits), plan):
        acceleration = (after - before) / dt
        assert abs(acceleration - last) <= jerk * dt + 1e-9
        limit = shrinking if min(before, acceleration) < 0.0 < max(before, acceleration) else growing
        assert abs(acceleration) <= limit + 1e-9
        last = acceleration


@given(LIMITS, STEPS, st.floats(-1.5, 1.5))
def test_a_held_target_is_reached_exactly(limits, plan, target):
    limiter = AxisLimiter(*limits)
    run(limiter, plan)
    for _ in range(20000):
        if limiter.step(target, 0.02) == target and limiter.acceleration == 0.0:
            break
    assert (limiter.speed, limiter.acceleration) == (target, 0.0)


@given(LIMITS, st.floats(0.01, 1.5), st.lists(st.sampled_from([0.005, 0.02, 0.1]), min_size=400, max_size=400))
@settings(max_examples=100)
def test_a_fixed_target_is_never_overshot_from_rest(limits, target, lengths):
    limiter = AxisLimiter(*limits)
    for dt in lengths:
        assert limiter.step(target, dt) <= target


@given(LIMITS, STEPS)
@settings(max_examples=100)
def test_mirrored(limits, plan):
    one = run(AxisLimiter(*limits), plan)
    other = run(AxisLimiter(*limits), [(-target, count, dt) for target, count, dt in plan])
    assert [(dt, -before, -after) for dt, before, after in one] == other


def test_the_ramp_of_the_defaults():
    limiter = AxisLimiter(0.4, 0.8, 0.8)
    speeds = [limiter.step(0.8, 0.02) for _ in range(200)]
    # 0.5 s to build the acceleration up, 2 s less the two halves of the ramps at 0.4, 0.5 s to take it back.
    arrived = next(i for i, speed in enumerate(speeds) if speed > 0.7999) * 0.02
    assert arrived == pytest.approx(2.5, abs=0.06)
    speeds = [limiter.step(0.0, 0.02) for _ in range(200)]
    assert next(i for i, speed in enumerate(speeds) if speed < 1e-4) * 0.02 == pytest.approx(2.0, abs=0.06)


def test_a_falling_target_is_followed_as_it_falls():
    """0.8 m/s falling by 0.3 m/s2, at 50 Hz, at move_base's 20 Hz, and in the steps of sonars at 5 Hz."""
    for every in (1, 2, 10):
        limiter = AxisLimiter(0.4, 0.8, 0.8)
        for _ in range(300):
            limiter.step(0.8, 0.02)
        behind = [
            limiter.step(0.8 - 0.006 * (step // every * every), 0.02) - (0.8 - 0.006 * step) for step in range(110)
        ]
        assert max(map(abs, behind[70:])) < 0.02 + 0.006 * every, every


@given(st.floats(0.0, 0.8), st.floats(0.0, 0.8))
@settings(max_examples=50)
def test_a_step_down_is_hardly_undershot(first, second):
    limiter = AxisLimiter(0.4, 0.8, 0.8)
    for _ in range(300):
        limiter.step(max(first, second), 0.02)
    speeds = [limiter.step(min(first, second), 0.02) for _ in range(400)]
    assert min(speeds) >= min(first, second) - 0.02 and min(speeds) >= 0.0 and speeds[-1] == min(first, second)


def test_the_other_direction_by_way_of_rest():
    limiter = AxisLimiter(0.4, 0.8, 0.8)
    speeds = [limiter.step(target, 0.02) for target in [0.5] * 200 + [-0.5] * 300]
    assert 0.0 in speeds[200:] and speeds[-1] == -0.5
    symmetric = AxisLimiter(0.8, 0.8, 2.4)
    assert 0.0 not in [symmetric.step(target, 0.02) for target in [0.5] * 200 + [-0.5] * 300][200:]


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_shape_keeps_the_curve_and_the_limits(v, w):
    profile = Profile()
    shaped_v, shaped_w = profile.shape(v, w)
    assert -profile.max_reverse - 1e-12 <= shaped_v <= profile.max_forward + 1e-12
    assert abs(shaped_w) <= profile.max_turn + 1e-12 and abs(shaped_v * shaped_w) <= profile.max_lateral + 1e-12
    assert shaped_v * w == pytest.approx(shaped_w * v, abs=1e-12)
    if (
        -profile.max_reverse <= v <= profile.max_forward
        and abs(w) <= profile.max_turn
        and abs(v * w) <= profile.max_lateral
    ):
        assert (shaped_v, shaped_w) == (v, w)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(1.0, 2.0))
def test_a_chair_that_slips_keeps_the_profile_itself(v, w, slip):
    """What it drives, its turn rate being the commanded one through the slip, is what the profile makes of that."""
    profile = Profile()
    commanded = profile.commanded(slip)
    shaped_v, shaped_w = commanded.shape(v, w * slip)
    assert (shaped_v, shaped_w / slip) == pytest.approx(profile.shape(v, w), abs=1e-9)
    assert commanded.turn_acceleration == pytest.approx(slip * profile.turn_acceleration)
    assert commanded.turn_jerk == pytest.approx(slip * profile.turn_jerk)
    assert commanded.acceleration == profile.acceleration and profile.commanded(1.0) == profile


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.005, 0.1))
def test_braking_is_linear_and_on_the_curve(v, w, dt):
    comfort = Comfort(Profile())
    comfort._forward.set(v)
    comfort._turn.set(w)
    needed = max(abs(v) / 1.5, abs(w) / 3.0)
    for _ in range(int(needed / dt) + 2):
        before = comfort.v, comfort.w
        comfort.brake(dt, 1.5, 3.0)
        assert (
            abs(before[0]) - abs(comfort.v) <= 1.5 * dt + 1e-12 and abs(before[1]) - abs(comfort.w) <= 3.0 * dt + 1e-12
        )
        assert comfort.v * w == pytest.approx(comfort.w * v, abs=1e-9)
        assert abs(comfort.v) <= abs(before[0]) and abs(comfort.w) <= abs(before[1])
    assert not comfort.moving


def test_a_step_of_no_length_changes_nothing():
    comfort = Comfort(Profile())
    assert comfort.step(0.5, 0.5, 0.0) == (0.0, 0.0)
    comfort.step(0.5, 0.5, 0.02)
    before = comfort.v, comfort.w
    assert comfort.step(0.5, 0.5, 0.0) == before and comfort.brake(0.0, 1.5, 3.0) == before


def test_another_rider_from_the_next_rest_on():
    gentle = Profile(max_forward=0.3, acceleration=0.2)
    comfort = Comfort(Profile())
    for _ in range(100):
        comfort.step(0.8, 0.0, 0.02)
    comfort.change(gentle)
    for _ in range(100):
        comfort.step(0.8, 0.0, 0.02)
    assert comfort.v == pytest.approx(0.8)
    while comfort.moving:
        comfort.step(0.0, 0.0, 0.02)
    for _ in range(300):
        comfort.step(0.8, 0.0, 0.02)
    assert comfort.profile is gentle and comfort.v == 0.3


def test_rest_is_at_once():
    comfort = Comfort(Profile())
    comfort.step(0.8, 0.8, 0.1)
    comfort.rest()
    assert not comfort.moving


def test_bad_profiles_name_every_fault():
    with pytest.raises(ConfigError) as error:
        read_profiles(
            {'a': {'jerk': 0, 'acceleration': 'fast'}, 'b': 3, 'c': {'speed': 1.0}, 'd': {'braking': math.inf}}
        )
    text = str(error.value)
    for part in (
        'profiles/a/jerk is 0',
        "profiles/a/acceleration is 'fast'",
        'profiles/b is 3',
        'profiles/c/speed is 1.0',
        'profiles/d/braking is inf',
    ):
        assert part in text
    with pytest.raises(ConfigError, match='profiles is'):
        read_profiles({})
    assert read_profiles({'x': {'jerk': 1}})['x'].jerk == 1


@pytest.mark.parametrize('v, w', [(0.35, 0.17), (-0.2, 0.32), (0.6, -0.1), (0.35, 0.6)])
@pytest.mark.parametrize('on, period', [(8, 25), (15, 25), (10, 20), (100, 150)])
def test_let_go_again_and_again_it_turns_no_sharper_than_told(v, w, on, period):
    comfort, way, turned = Comfort(Profile()), 0.0, 0.0
    for k in range(2000):
        comfort.step(*((v, w) if k % period < on else (0.0, 0.0)), 0.02, together=True)
        way, turned = way + comfort.v * 0.02, turned + comfort.w * 0.02
    assert 0.25 < turned / way / (w / v) < 1.1


def test_an_axis_that_drives_already_is_not_held_back():
    comfort = Comfort(Profile())
    for _ in range(100):
        comfort.step(0.0, 0.4, 0.02)
    least = min(comfort.step(0.4, 0.5, 0.02, together=True)[1] for _ in range(200))
    assert least >= 0.4 and comfort.w == pytest.approx(0.5) and comfort.v == pytest.approx(0.4)


def test_as_a_rule_each_axis_goes_by_its_own_limits():
    comfort, alone = Comfort(Profile()), Comfort(Profile())
    for _ in range(30):
        comfort.step(0.4, 0.5, 0.02)
        alone.step(0.0, 0.5, 0.02)
    assert comfort.w == alone.w > comfort.v > 0.0
