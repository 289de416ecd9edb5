"""Random inputs at navsat_transform_node: nothing raised, nothing that is no number, each kind said once."""

import pytest
from steady import whole

from sara_lab.fuzz.localization.fuzz_navsat import fuzz_navsat
from sara_lab.fuzz.localization.navsat_command import main

KINDS = {
    'fix no_fix',
    'fix no_stamp',
    'fix bad_place',
    'fix no_covariance',
    'fix bad_covariance',
    'fix huge_covariance',
    'fix ahead',
    'fix no_antenna',
    'imu no_orientation',
    'odometry not_usable',
    'odometry went_back',
    'odometry clock_went_back',
    'from_ll refused',
    'to_ll refused',
    'datum refused',
    'zone refused',
    'gps/filtered',
    'gps/heading',
    'velocity other_speed',
    'velocity other_time',
    'velocity no_antenna',
    'transforms',
}


@pytest.mark.parametrize('seed', range(whole(4, 1)))
def test_thousands_of_random_inputs(seed):
    report = fuzz_navsat(5000, seed)
    assert report.faults == [] and report.inputs == 5000
    assert set(report.kinds) >= KINDS and report.kinds['odometry/gps'] > 500


def test_the_command_tells_what_came_of_it(capsys):
    main(['--count', '300', '--seed', '3'])
    assert capsys.readouterr().out.startswith('300 inputs to navsat, no failure')
