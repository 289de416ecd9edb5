"""Random inputs at slam_gmapping: nothing raised, nothing that is no number, each kind said once."""

import pytest
from steady import whole

from sara_lab.fuzz.localization.fuzz_slam import fuzz_slam
from sara_lab.fuzz.localization.slam_command import main


@pytest.mark.parametrize('seed', range(whole(2, 1)))
def test_thousands_of_random_inputs(seed):
    report = fuzz_slam(2000, seed)
    assert report.faults == [] and report.inputs == 2000
    kinds = {'bad_scan', 'bad_odometry', 'bad_mount', 'not_deskewed', 'no_points', 'no_fit', 'scans', 'used', 'loops'}
    assert kinds | {'optimised', 'map', 'forget'} <= set(report.kinds)
    assert report.kinds['used'] > 500


def test_the_command_tells_what_came_of_it(capsys):
    main(['--count', '200', '--seed', '3'])
    assert capsys.readouterr().out.startswith('200 inputs to slam, no failure')
