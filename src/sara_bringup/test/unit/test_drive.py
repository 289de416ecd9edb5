"""The true pose at the stamp of a fused one."""

import math

import pytest

from sara_bringup.missions.drive import pose_at

BEFORE, AFTER = (1.0, (0.0, 2.0, 3.0)), (1.02, (0.02, 2.0, -3.0))


@pytest.mark.parametrize('t, x, turned', [(1.0, 0.0, 0.0), (1.01, 0.01, 0.5), (1.02, 0.02, 1.0)])
def test_between_two_poses_it_moves_evenly_and_turns_the_short_way(t, x, turned):
    found = pose_at(t, (BEFORE, AFTER))
    assert found == pytest.approx((x, 2.0, 3.0 + turned * (2.0 * math.pi - 6.0)))


def test_outside_of_them_it_is_the_nearer_and_of_one_pose_alone_that_pose():
    assert pose_at(0.5, (BEFORE, AFTER)) == BEFORE[1]
    assert pose_at(9.0, (BEFORE, AFTER))[:2] == AFTER[1][:2]
    assert pose_at(9.0, (BEFORE,)) == BEFORE[1]
    assert pose_at(9.0, ()) is None


def test_a_late_fused_pose_is_compared_with_the_true_ones_of_its_own_time():
    later = (1.04, (0.04, 2.0, -2.5)), (1.06, (0.06, 2.0, -2.0))
    assert pose_at(1.01, (BEFORE, AFTER, *later))[0] == pytest.approx(0.01)
    assert pose_at(1.05, (BEFORE, AFTER, *later))[0] == pytest.approx(0.05)
