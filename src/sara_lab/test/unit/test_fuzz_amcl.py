"""Random inputs at amcl: nothing raised, nothing that is no number, each kind said once."""

import pytest
from steady import whole

from sara_lab.fuzz.localization.amcl_command import main
from sara_lab.fuzz.localization.fuzz_amcl import fuzz_amcl


@pytest.mark.parametrize('seed', range(whole(4, 1)))
def test_thousands_of_random_inputs(seed):
    report = fuzz_amcl(5000, seed)
    assert report.faults == [] and report.inputs == 5000
    kinds = {'bad_scan', 'bad_odometry', 'bad_mount', 'no_map', 'no_beams', 'scans', 'updates'}
    assert kinds | {'no map', 'pose refused', 'start refused'} <= set(report.kinds)
    assert report.kinds['updates'] > 500


def test_the_command_tells_what_came_of_it(capsys):
    main(['--count', '300', '--seed', '3'])
    assert capsys.readouterr().out.startswith('300 inputs to amcl, no failure')
