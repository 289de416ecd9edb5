"""check_config's comparison of an IMU's heading with the way that the GPS says the robot went."""

import math

import numpy as np
import pytest

from sara_common.diagnostics import ERROR, WARN
from sara_localization.checks.gps_heading import Stretches, heading_findings, stretches


def drive(told=lambda t, yaw: yaw, turns=1.0, noise=0.3, seconds=160):
    """Along a square of 40 m at 1 m/s; told: the heading that the IMU says."""
    rng = np.random.default_rng(0)
    t = np.arange(0.0, seconds, 0.4)
    yaw = turns * np.floor(t / 40.0) * math.pi / 2
    x, y = np.cumsum(0.4 * np.cos(yaw)), np.cumsum(0.4 * np.sin(yaw))
    places = np.column_stack([t, x + rng.normal(0, noise, len(t)), y + rng.normal(0, noise, len(t))])
    return stretches(places, np.column_stack([t, [told(*pair) for pair in zip(t, yaw)]]))


@pytest.mark.parametrize('turns', [1.0, -1.0])
def test_a_heading_that_is_right_is_left_alone(turns):
    found = drive(turns=turns)
    assert len(found.courses) > 20 and abs(found.median) < math.radians(3.0)
    assert heading_findings(found, 0.0) == []


@pytest.mark.parametrize(
    'off, offset, wanted',
    [(math.pi / 2, 0.0, '1.570796'), (math.pi, 0.0, '3.141593'), (-math.pi / 2, math.pi / 2, '0')],
)
def test_a_yaw_offset_that_is_wrong_is_told_with_the_right_one(off, offset, wanted):
    (finding,) = heading_findings(drive(lambda t, yaw: yaw - off), offset)
    assert (finding.level, finding.key) == (ERROR, 'yaw_offset')
    assert f'set yaw_offset to {wanted}, unless' in finding.sentence.replace('-3.14', '3.14')


def test_an_odd_offset_is_told_as_it_is():
    (finding,) = heading_findings(drive(lambda t, yaw: yaw - 0.7), 0.0)
    assert 0.65 < float(finding.sentence.split('set yaw_offset to ')[1].split(',')[0]) < 0.75


def test_a_heading_that_counts_clockwise_is_found():
    (finding,) = heading_findings(drive(lambda t, yaw: -yaw), 0.0)
    assert finding.level == ERROR and 'grows clockwise' in finding.sentence


def test_a_heading_that_depends_on_the_direction_is_found():
    (finding,) = heading_findings(drive(lambda t, yaw: yaw + 0.3 * (round(yaw / 1.57) - 1.5)), 0.0)
    assert finding.level == WARN and 'as near iron' in finding.sentence


@pytest.mark.parametrize('stuck', [0.0, 0.4, -2.0])
@pytest.mark.parametrize('seconds', [160, 120])
def test_a_heading_that_does_not_turn_is_no_wrong_offset(stuck, seconds):
    (finding,) = heading_findings(drive(lambda t, yaw: stuck, seconds=seconds), 0.0)
    assert finding.level == ERROR and 'does not follow the way' in finding.sentence


def test_quartiles_more_than_half_a_turn_apart_are_wide():
    (finding,) = heading_findings(Stretches(np.repeat([0.0, 1.8, -1.8], [12, 8, 8]), np.zeros(28)), 0.0)
    assert 'does not follow the way' in finding.sentence


def test_a_drive_without_straight_stretches_says_nothing():
    (finding,) = heading_findings(drive(lambda t, yaw: 3.0 * t), 0.0)
    assert finding.level == WARN and 'too few' in finding.sentence
    (finding,) = heading_findings(stretches(np.zeros((0, 3)), np.zeros((0, 2))), 0.0)
    assert '0 straight stretches' in finding.sentence
