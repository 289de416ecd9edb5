"""The buffer's rules: the tree joined both ways, interpolation, the latest where a time is not covered."""

import pytest

from sara_localization.geometry.rigid import Transform
from sara_localization.geometry.transforms import TransformBuffer


def at(x, yaw=0.0):
    return Transform.from_xyz_rpy(x=x, yaw=yaw)


@pytest.fixture
def buffer():
    buffer = TransformBuffer()
    buffer.set_transform('base_link', 'imu_link', at(0.5))
    for t in range(5):
        buffer.set_transform('odom', 'base_link', at(float(t)), stamp=100.0 + t)
    return buffer


def test_interpolates_and_joins_static_with_moving(buffer):
    assert buffer.lookup('odom', 'imu_link', 101.5).translation[0] == pytest.approx(2.0)
    assert buffer.lookup('imu_link', 'odom', 101.5).translation[0] == pytest.approx(-2.0)


def test_siblings_meet_at_their_common_parent(buffer):
    buffer.set_transform('base_link', 'camera', at(0.1))
    assert buffer.lookup('camera', 'imu_link', 101.0).translation[0] == pytest.approx(0.4)


@pytest.mark.parametrize('stamp', [50.0, 104.5, 1000.0])
def test_outside_of_its_time_the_latest_is_given(buffer, stamp):
    assert buffer.lookup('odom', 'base_link', stamp).translation[0] == pytest.approx(4.0)


@pytest.mark.parametrize('stamp, age', [(50.0, 0.0), (101.5, 0.0), (104.0, 0.0), (104.5, 0.5)])
def test_the_age_of_what_is_given(buffer, stamp, age):
    assert buffer.age('odom', 'imu_link', stamp) == buffer.age('imu_link', 'odom', stamp) == pytest.approx(age)
    assert buffer.age('base_link', 'imu_link', stamp) == buffer.age('map', 'imu_link', stamp) == 0.0


def test_what_is_not_joined_is_none(buffer):
    assert buffer.lookup('map', 'base_link', 101.0) is None
    assert buffer.lookup('odom', 'laser', 101.0) is None


def test_repeated_and_old_stamps_are_not_taken(buffer):
    assert not buffer.set_transform('odom', 'base_link', at(9.0), stamp=102.0)
    assert not buffer.set_transform('odom', 'base_link', at(9.0), stamp=80.0)
    assert buffer.lookup('odom', 'base_link', 102.0).translation[0] == pytest.approx(2.0)


def test_late_ones_are_put_in_order(buffer):
    assert buffer.set_transform('odom', 'base_link', at(7.0), stamp=101.5)
    assert buffer.lookup('odom', 'base_link', 101.5).translation[0] == pytest.approx(7.0)


def test_a_frame_with_a_new_parent_is_joined_as_it_is_now(buffer):
    buffer.set_transform('map', 'base_link', at(20.0), stamp=105.0)
    assert buffer.lookup('map', 'imu_link', 101.5).translation[0] == pytest.approx(20.5)
    assert buffer.lookup('odom', 'base_link', 101.5) is None


def test_what_is_newest_is_asked_anew_after_another_sample_and_under_another_parent():
    buffer = TransformBuffer()
    for k in range(3):
        there = Transform.from_xyz_rpy(x=float(k), yaw=0.1 * k)
        buffer.set_transform('odom', 'base_link', there, float(k))
        for _ in range(2):
            assert buffer.lookup('odom', 'base_link', k + 0.5) == there
            assert buffer.lookup('base_link', 'odom', k + 0.5) == there.inverse()
    buffer.set_transform('elsewhere', 'base_link', Transform.from_xyz_rpy(x=9.0), 3.0)
    assert buffer.lookup('odom', 'base_link', 3.5) is None
    assert buffer.lookup('elsewhere', 'base_link', 3.5) == Transform.from_xyz_rpy(x=9.0)


@pytest.mark.parametrize('stamp, x', [(101.5, 2.0), (104.0, 4.5), (104.5, None), (99.0, None)])
def test_at_that_very_time_only_what_is_covered_is_given(buffer, stamp, x):
    found = buffer.lookup_at('odom', 'imu_link', stamp)
    assert found is None if x is None else found.translation[0] == pytest.approx(x)
    assert buffer.lookup_at('base_link', 'imu_link', stamp).translation[0] == pytest.approx(0.5)
    assert buffer.lookup_at('map', 'imu_link', stamp) is None
    assert buffer.lookup_at('odom', 'odom', stamp) == Transform()


def test_what_is_not_known_yet_may_come_and_what_is_past_will_not(buffer):
    assert buffer.is_past('odom', 'imu_link', 99.0) and not buffer.is_past('odom', 'imu_link', 104.5)
    assert not buffer.is_past('map', 'imu_link', 99.0) and not buffer.is_past('base_link', 'imu_link', 99.0)
    assert buffer.latest('odom', 'imu_link').translation[0] == pytest.approx(4.5)
