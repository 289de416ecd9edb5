"""The street: a short drive recorded and filtered, and what the campaign's judge makes of drives."""

import math

import numpy as np
import pytest

from sara_lab.campaign import street
from sara_lab.studies import street_drive, street_filter
from sara_lab.studies.street_drive import StreetDrive
from sara_sim.chips.gps_config import GpsConfig


@pytest.fixture(scope='module')
def drive():
    gps = GpsConfig(jump_interval=8.0, jump_duration=4.0, outage_interval=25.0, outage_duration=5.0)
    return street_drive.record(1, gps, length=15.0)


def test_a_drive_holds_what_the_chair_said_and_where_it_was(drive):
    assert drive.truth[-1, 1] - drive.truth[0, 1] == pytest.approx(15.0, abs=1.0)
    assert np.median(np.diff(drive.headings[:, 0])) == pytest.approx(0.05, abs=0.01)
    assert np.median(np.diff(drive.fixes[:, 0])) == pytest.approx(0.4, abs=0.01)
    assert drive.outages and (drive.fixes[drive.fixes[:, 1] < 0][:, 2:4] != drive.fixes[0, 2:4]).all()
    assert drive.wheels[-1, 1] == pytest.approx(0.8, abs=0.05)
    assert len(drive.velocities) == np.sum(drive.fixes[:, 1] >= 0)


def test_the_filter_follows_it_and_leaves_out_what_multipath_throws(drive):
    done = street_filter.replay(drive, 1)
    errors = np.array([estimate.error for estimate in done.estimates])
    assert np.hypot(*errors[:, :2].T).max() < 1.5 and np.abs(np.degrees(errors[:, 2])).max() < 6.0
    known = {row[0] for row in drive.fixes if row[6] and row[4] < 3.0}  # the first comes without its deviation
    fates = dict(done.fates.tolist())
    assert [stamp for stamp in known & set(fates) if fates[stamp]] == [] and known & set(fates)
    assert any('outliers are rejected' in sentence for _, sentence in done.said)


def test_times_without_fixes_and_jumps_are_found():
    fixes = np.zeros((10, 9))
    fixes[:, 0] = 0.4 * np.arange(10)
    fixes[3:5, 1] = -1.0
    fixes[[1, 6, 7, 8], 6] = 1.0
    drive = StreetDrive(np.zeros((2, 4)), np.zeros((1, 6)), np.zeros((1, 3)), fixes, np.zeros((1, 3)), np.array(0.0))
    assert drive.outages == [pytest.approx((1.2, 2.0))]
    assert drive.jumps == [pytest.approx((0.4, 0.8)), pytest.approx((2.4, 3.6))]


def test_a_pose_is_interpolated_the_short_way_round():
    truth = np.array([[0.0, 0.0, 0.0, 3.1], [1.0, 2.0, 4.0, -3.1]])
    drive = StreetDrive(truth, np.zeros((1, 6)), np.zeros((1, 3)), np.zeros((1, 9)), np.zeros((1, 3)), np.array(0.0))
    x, y, yaw = drive.pose(0.5)
    assert (x, y) == (1.0, 2.0) and abs(yaw) == pytest.approx(math.pi)


def test_what_is_not_met_is_told():
    good = {
        'off_m': {'p95': 1.4},
        'outage_share': {'median': 0.01},
        'nees': 3.0,
        'nees_low': 2.0,
        'nees_high': 4.0,
        'thrown_rejected': 1.0,
        'jumps_said': 1.0,
    }
    assert street._verdict(good) == []
    bad = {
        'off_m': {'p95': 1.6},
        'outage_share': {'median': 0.02},
        'nees': 9.0,
        'thrown_rejected': 0.9,
        'jumps_said': 0.9,
    }
    assert len(street._verdict({**good, **bad})) == 5


def test_a_jump_is_in_the_log_as_long_as_the_filter_calls_fixes_outliers():
    said = [
        (1.0, 'imu1 (gps/heading): outliers are rejected, 4.0 sigmas off (the gate is 3)'),
        (2.0, 'odom1 (odometry/gps): outliers are rejected, 5.0 sigmas off (the gate is 3)'),
        (3.0, 'imu1 (gps/heading): taken again, after 3 outliers in 2.0 s'),
        (4.0, 'odom1 (odometry/gps): taken again, after 5 outliers in 2.4 s'),
        (9.0, 'odom1 (odometry/gps): outliers are rejected, 5.0 sigmas off (the gate is 3)'),
    ]
    rows = street._rows(said)
    assert rows == [(2.0, 4.0), (9.0, math.inf)] and street._rows([]) == []
    assert [street._in_log(jump, rows) for jump in ((1.0, 1.5), (4.5, 5.0), (0.0, 1.0), (-2.0, -1.0), (8.0, 9.0))] == [
        True,
        False,
        True,
        False,
        True,
    ]


def test_a_jump_is_in_the_diagnostics_that_call_one_of_its_fixes_the_last_outlier():
    reports = [
        (5.0, 'odom1 (odometry/gps): 12 used'),
        (6.0, 'odom1 (odometry/gps): 13 used, 1 rejected by the gate (the last 0.7 s ago, 4.1 sigmas off)'),
        (7.0, 'odom1 (odometry/gps): 15 used, 1 rejected by the gate (the last 1.7 s ago, 4.1 sigmas off)'),
    ]
    rejections = street._rejections(reports)
    assert rejections == [pytest.approx((6.0, 5.3)), pytest.approx((7.0, 5.3))]
    assert street._in_diagnostics((5.2, 5.4), rejections)
    assert not street._in_diagnostics((5.5, 6.5), rejections)
    assert not street._in_diagnostics((2.0, 3.8), [(6.0, 3.0)])  # too late


def test_the_filter_says_of_each_jump_that_it_rejects_something(drive):
    done = street_filter.replay(drive, 1)
    rejected = [time for time, used in done.fates if not used]
    found = street.judged(1, drive, done)
    assert found['jumps'] == len(drive.jumps)
    assert found['jumps_in_log'] <= found['jumps_said']
    held = [any(begin <= time < end for time in rejected) for begin, end in drive.jumps]
    assert found['jumps_said'] == sum(held) > 0
