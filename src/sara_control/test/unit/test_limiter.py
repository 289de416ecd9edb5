"""Limits: equal to the C++ peer's in every call, but for a jerk limit that holds; and what a limit must mean."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_control.wheels.config import ControllerConfig
from sara_control.wheels.limiter import KINDS, Limits, Motion, SpeedLimiter

REFERENCE = np.load(Path(__file__).resolve().parents[1] / 'data' / 'diff_drive.npz')
SETS = range(8)
DT = 0.05
BASE = {
    'wheel_separation': 0.5,
    'wheel_radius': 0.1,
    'left_wheel': 'l',
    'right_wheel': 'r',
    'pose_covariance_diagonal': [0.0] * 6,
    'twist_covariance_diagonal': [0.0] * 6,
}


def limits(k):
    pairs = REFERENCE[f'lim_{k}_limits'].reshape(3, 2)
    return Limits(**{kind: tuple(pair) for kind, pair, has in zip(KINDS, pairs, REFERENCE[f'lim_{k}_has']) if has})


def as_the_peer(k):
    """The peer lets twice the jerk through: its limits, said as ours."""
    said = limits(k)
    return SpeedLimiter(said if said.jerk is None else replace(said, jerk=(2.0 * said.jerk[0], 2.0 * said.jerk[1])))


def chain(limiter, wanted, dt=DT):
    last = Motion(dt=dt)
    out = []
    for v in wanted:
        last = last.after(limiter.limit(v, last, dt), dt)
        out.append(last.speed)
    return np.array(out)


def after_two(v0, v1, dt):
    """The Motion that ends at v0 after v1, in cycles of equal length: the peer's two last commands."""
    return Motion(v1, 0.0, dt).after(v0, dt)


@pytest.mark.parametrize('k', SETS)
def test_every_call_equals_the_peers(k):
    """But for a cycle of no time under a limit of jerk alone: the peer's goes on by the last difference of speed."""
    limiter = as_the_peer(k)
    v, v0, v1, dt, out = (REFERENCE[f'lim_{k}_{name}'] for name in ('v', 'v0', 'v1', 'dt', 'out'))
    if limiter.limits.jerk is not None and limiter.limits.acceleration is None:
        np.testing.assert_array_equal(out[dt == 0.0], (v0 + (v0 - v1))[dt == 0.0])
        out = np.where(dt == 0.0, v0, out)
    limited = [limiter.limit(v, after_two(v0, v1, dt), dt) for v, v0, v1, dt in zip(v, v0, v1, dt)]
    np.testing.assert_allclose(limited, out, rtol=0, atol=1e-9)


@pytest.mark.parametrize('k', SETS)
def test_a_chain_of_commands_equals_the_peers(k):
    np.testing.assert_allclose(
        chain(as_the_peer(k), REFERENCE[f'lim_{k}_chain_in']), REFERENCE[f'lim_{k}_chain_out'], rtol=0, atol=1e-9
    )


@pytest.mark.parametrize('k', [k for k in SETS if REFERENCE[f'lim_{k}_has'][2]])
def test_the_peer_exceeds_the_jerk_it_was_given_and_this_does_not(k):
    lowest, highest = limits(k).jerk
    alone = SpeedLimiter(Limits(jerk=(lowest, highest)))
    wanted = REFERENCE[f'lim_{k}_chain_in']
    jerk = np.diff(chain(alone, wanted), 2, prepend=[0.0, 0.0]) / DT**2
    assert lowest - 1e-9 <= jerk.min() and jerk.max() <= highest + 1e-9
    peer = np.diff(REFERENCE[f'lim_{k}_chain_out'], 2, prepend=[0.0, 0.0]) / DT**2
    assert peer.max() > 1.9 * highest


speeds = st.floats(-5.0, 5.0)


@given(speeds, speeds, speeds, st.floats(0.001, 0.2), st.floats(0.0, 3.0), st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_each_limit_alone_holds(v, v0, v1, dt, velocity, acceleration, jerk):
    last = after_two(v0, v1, dt)
    assert abs(SpeedLimiter(Limits(velocity=(-velocity, velocity))).limit(v, last, dt)) <= velocity
    limited = SpeedLimiter(Limits(acceleration=(-acceleration, 0.5 * acceleration))).limit(v, last, dt)
    assert -acceleration * dt - 1e-9 <= limited - v0 <= 0.5 * acceleration * dt + 1e-9
    limited = SpeedLimiter(Limits(jerk=(-jerk, jerk))).limit(v, last, dt)
    assert abs((limited - v0) - (v0 - v1)) <= jerk * dt * dt + 1e-9


@given(speeds, speeds, speeds, st.floats(0.001, 0.2))
def test_without_limits_and_within_them_a_command_is_itself(v, v0, v1, dt):
    last = after_two(v0, v1, dt)
    assert SpeedLimiter().limit(v, last, dt) == v
    assert SpeedLimiter(Limits((-9.0, 9.0), (-1e9, 1e9), (-1e9, 1e9))).limit(v, last, dt) == pytest.approx(v, abs=1e-9)


# Cycles as a busy machine or a simulated clock makes them: of any length, some at the time of the one before.
partitions = st.lists(st.just(0.0) | st.floats(1e-6, 0.1), min_size=20, max_size=100)


@given(partitions, st.sampled_from([-1.0, 1.0]))
def test_a_step_gives_the_same_profile_in_every_partition_of_time(cycles, sign):
    """Jerk alone: the parabola jerk t^2 / 2, in its exact points."""
    limiter, last, t = SpeedLimiter(Limits(jerk=(-2.0, 2.0))), Motion(), 0.0
    for dt in cycles:
        t += dt
        last = last.after(limiter.limit(1e3 * sign, last, dt), dt)
        assert last.speed == pytest.approx(sign * t * t, abs=1e-9)


@given(partitions)
def test_the_profile_with_all_limits_differs_by_no_more_than_one_cycle_makes(cycles):
    jerk, acceleration, velocity = 5.0, 0.5, 1.0
    limiter = SpeedLimiter(Limits((-velocity, velocity), (-acceleration, acceleration), (-jerk, jerk)))
    last, t, ramp = Motion(), 0.0, acceleration / jerk
    for dt in cycles:
        t += dt
        last = last.after(limiter.limit(10.0, last, dt), dt)
        exact = 0.5 * jerk * t * t if t < ramp else acceleration * (t - 0.5 * ramp)
        assert last.speed == pytest.approx(min(exact, velocity), abs=0.5 * jerk * max(cycles) ** 2 + 1e-9)


@given(speeds, speeds, st.floats(-5.0, 5.0), st.floats(-0.1, 0.0))
def test_a_cycle_that_takes_no_time_changes_neither_speed_nor_acceleration(v, speed, acceleration, dt):
    last = Motion(speed, acceleration, 0.02)
    for limits in (Limits(acceleration=(-1.0, 1.0)), Limits(jerk=(-1.0, 1.0))):
        assert last.after(SpeedLimiter(limits).limit(v, last, dt), dt) == last


def test_parameters_have_the_peers_names_and_min_is_the_negative_max():
    config = ControllerConfig.from_params(
        {
            **BASE,
            'linear': {
                'x': {
                    'has_velocity_limits': True,
                    'max_velocity': 1.0,
                    'min_velocity': -0.5,
                    'has_acceleration_limits': True,
                    'max_acceleration': 2,
                    'has_jerk_limits': False,
                    'max_jerk': 5.0,
                }
            },
            'angular/z/has_jerk_limits': True,
            'angular/z/max_jerk': 3.0,
        }
    )
    assert config.linear_limits == Limits((-0.5, 1.0), (-2.0, 2.0), None)
    assert config.angular_limits == Limits(jerk=(-3.0, 3.0))


@pytest.mark.parametrize(
    'given_, sentence',
    [
        (
            {'linear/x/has_velocity_limits': True},
            'linear/x/max_velocity is missing though linear/x/has_velocity_limits is true',
        ),
        ({'linear/x/has_jerk_limits': 1}, 'linear/x/has_jerk_limits is 1, allowed are true and false'),
        ({'angular/z/max_velocity': 'fast'}, "angular/z/max_velocity is 'fast', allowed are numbers"),
        (
            {'linear/x/has_velocity_limits': True, 'linear/x/max_velocity': -1.0},
            'is 1 to -1, allowed is a range with 0 in it',
        ),
        (
            {'linear/x/has_velocity_limits': True, 'linear/x/max_velocity': float('nan')},
            'max_velocity is nan, allowed are numbers',
        ),
    ],
)
def test_bad_limits_are_named(given_, sentence):
    with pytest.raises(ConfigError, match=sentence):
        ControllerConfig.from_params({**BASE, **given_})
