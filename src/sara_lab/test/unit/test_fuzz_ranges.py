"""Random inputs at range_localization: nothing raised, nothing that is no number."""

import pytest
from steady import whole

from sara_lab.fuzz.localization.fuzz_ranges import fuzz_ranges
from sara_lab.fuzz.localization.ranges_command import main
from sara_localization.particles.range_localizer import RangeLocalizer


@pytest.mark.parametrize('seed', range(whole(4, 1)))
def test_thousands_of_random_inputs(seed):
    report = fuzz_ranges(5000, seed)
    assert report.faults == [] and report.inputs == 5000
    kinds = {'bad_range', 'jumped', 'no_map', 'out_of_span', 'ambiguous', 'longer', 'first', 'used', 'searched'}
    assert kinds | {'no map', 'start refused'} <= set(report.kinds)


def test_a_pose_that_is_no_number_is_found(monkeypatch):
    monkeypatch.setattr(RangeLocalizer, 'forget', lambda self: setattr(self.correction, 'offset', (float('nan'), 0, 0)))
    assert 'put: the pose is not finite' in fuzz_ranges(5000, 0).faults[0]


def test_the_command_tells_what_came_of_it(capsys):
    main(['--count', '300', '--seed', '3'])
    assert capsys.readouterr().out.startswith('300 inputs to ranges, no failure')
