"""Random messages: nothing raised, nothing that is no number, each kind said once."""

import pytest
from steady import whole

from sara_lab.fuzz.localization.fuzz import fuzz


@pytest.mark.parametrize('seed', range(whole(2, 1)))
def test_ten_thousand_random_messages(seed):
    report = fuzz(10000, seed)
    assert report.faults == [] and report.messages == 10000
    assert report.outputs > 2000
    assert {
        'not_finite',
        'bad_variance',
        'bad_orientation',
        'no_stamp',
        'out_of_order',
        'no_transform',
        'huge_value',
        'huge_variance',
        'before_set_pose',
        'indefinite_covariance',
    } <= set(report.problems)


def test_random_messages_at_the_filters_by_filterpy():
    report = fuzz(2000, 0, backend='filterpy')
    assert report.faults == [] and report.messages == 2000 and report.outputs > 400
