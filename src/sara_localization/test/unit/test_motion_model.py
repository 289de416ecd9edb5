"""Laws of the motion model."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sara_localization.filters import motion_model
from sara_localization.filters.state import ACCELERATION, ANGLES, PITCH, POSITION, RATES, VELOCITY, YAW
from sara_localization.geometry.rigid import Transform, rotation_matrix

numbers = st.floats(-2.0, 2.0)
states = st.lists(numbers, min_size=15, max_size=15).map(np.array)
steps = st.floats(0.0, 0.5)


def level(x):
    x = x.copy()
    x[PITCH] *= 0.6  # away from the nose straight up, where the Euler rates are infinite
    return x


@given(states, steps)
def test_jacobian_is_that_of_finite_differences(x, dt):
    x = level(x)
    _, F = motion_model.predict(x, dt)
    h = 1e-6
    for i in range(15):
        up, down = x.copy(), x.copy()
        up[i] += h
        down[i] -= h
        slope = (motion_model.predict(up, dt)[0] - motion_model.predict(down, dt)[0]) / (2 * h)
        np.testing.assert_allclose(F[:, i], slope, atol=1e-6, rtol=1e-6)


@given(states)
def test_no_time_no_motion(x):
    following, F = motion_model.predict(x, 0.0)
    np.testing.assert_array_equal(following, x)
    np.testing.assert_array_equal(F, np.eye(15))


@given(states, steps, numbers, st.integers(-3, 3))
def test_turning_the_world_turns_the_motion(x, dt, turn, k):
    x = level(x)
    turned = x.copy()
    R = rotation_matrix(Transform.from_xyz_rpy(yaw=turn).rotation)
    turned[POSITION] = R @ x[POSITION]
    turned[YAW] += turn + 2 * np.pi * k
    a, b = motion_model.predict(x, dt)[0], motion_model.predict(turned, dt)[0]
    np.testing.assert_allclose(b[POSITION], R @ a[POSITION], atol=1e-9)
    np.testing.assert_allclose(b[YAW], a[YAW] + turn + 2 * np.pi * k, atol=1e-9)
    np.testing.assert_allclose(b[VELOCITY], a[VELOCITY])


@given(states, steps)
def test_rates_and_accelerations_stay(x, dt):
    following, _ = motion_model.predict(level(x), dt)
    np.testing.assert_array_equal(following[RATES], level(x)[RATES])
    np.testing.assert_array_equal(following[ACCELERATION], level(x)[ACCELERATION])


def test_nose_straight_up_stays_finite():
    x = np.zeros(15)
    x[ANGLES] = 0.1, np.pi / 2, 0.2
    x[RATES] = 0.1, 0.2, 0.3
    following, F = motion_model.predict(x, 0.1)
    assert np.isfinite(following).all() and np.isfinite(F).all()
