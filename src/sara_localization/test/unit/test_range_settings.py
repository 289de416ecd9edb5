"""check_config on range_localization's parameters."""

from pathlib import Path

import pytest
import yaml

from sara_common.diagnostics import ERROR, WARN
from sara_localization.checks.range_settings import check_ranges, is_for_ranges

PACKAGE = Path(__file__).resolve().parents[2]
OURS = {'range_topics': ['/left_range', '/right_range']}


@pytest.mark.parametrize('name', ['ekf_default.yaml', 'ekf_thesis.yaml', 'amcl.yaml'])
def test_another_node_s_file_is_not_taken_for_one(name):
    assert not is_for_ranges(yaml.safe_load((PACKAGE / 'config' / name).read_text()))


def test_the_defaults_are_well():
    assert is_for_ranges(OURS) and check_ranges(OURS) == []


@pytest.mark.parametrize(
    'params, key',
    [
        ({'range_z_rand': 3.0}, 'range_z_hit'),
        ({'search_min_d': 2.0}, 'search_min_d'),
        ({'search_clearance': 0.5}, 'search_clearance'),
        ({'search_min_distance': 0.2}, 'parameters'),
    ],
)
def test_what_is_probably_not_meant_is_told_in_one_sentence(params, key):
    (finding,) = check_ranges({**OURS, **params})
    assert (finding.level, finding.key) == (WARN, key) and finding.sentence.endswith('.')


@pytest.mark.parametrize(
    'params', [{'range_z_hit': 0}, {'search_min_d': -1}, {'seed': -1}, {'seed': 0.5}, {'search_sigma_hit': 'wide'}]
)
def test_what_cannot_work_is_an_error(params):
    (finding,) = check_ranges({**OURS, **params})
    assert finding.level == ERROR and finding.sentence.endswith('.')
