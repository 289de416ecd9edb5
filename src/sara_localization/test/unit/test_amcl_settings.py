"""check_config on amcl's parameters; and that config/amcl.yaml says what is so."""

from pathlib import Path

import pytest
import yaml

from sara_common.diagnostics import ERROR, WARN
from sara_localization.checks.amcl_settings import check_amcl, is_for_amcl
from sara_localization.particles.amcl_config import AmclConfig

PACKAGE = Path(__file__).resolve().parents[2]
OURS = yaml.safe_load((PACKAGE / 'config' / 'amcl.yaml').read_text())


def test_the_file_of_all_parameters_holds_their_defaults_and_nothing_is_wrong_with_it():
    assert AmclConfig.from_params(OURS) == AmclConfig() and check_amcl(OURS) == [] and is_for_amcl(OURS)
    text = (PACKAGE / 'config' / 'amcl.yaml').read_text()
    missing = [name for name in AmclConfig.__dataclass_fields__ if f'{name}:' not in text]
    assert missing == ['warnings']


@pytest.mark.parametrize('name', ['ekf_default.yaml', 'ekf_thesis.yaml'])
def test_a_filter_s_file_is_not_taken_for_one(name):
    assert not is_for_amcl(yaml.safe_load((PACKAGE / 'config' / name).read_text()))


@pytest.mark.parametrize(
    'params, key',
    [
        ({'odom_model_type': 'omni-corrected'}, 'odom_alpha'),
        ({'recovery_alpha_slow': 0.1, 'recovery_alpha_fast': 0.001}, 'recovery_alpha_slow'),
        ({'lost_limit': 0.3}, 'lost_limit'),
        ({'lost_recovery': False, 'lost_keeps_heading': 0.95}, 'lost_keeps_heading'),
        ({'laser_likelihood_max_dist': 0.3}, 'laser_likelihood_max_dist'),
        ({'laser_likelihood_power': 8.0}, 'laser_likelihood_power'),
        ({'laser_likelihood_power': 2.0, 'laser_model_type': 'likelihood_field_prob'}, 'laser_likelihood_power'),
        ({'do_beamskip': True}, 'do_beamskip'),
        ({'first_map_only': True}, 'first_map_only'),
        ({'update_min_d': 2.0}, 'update_min_d'),
        ({'transform_tolerance': 0.0}, 'transform_tolerance'),
        ({'laser_max_beam': 60}, 'parameters'),
    ],
)
def test_what_is_probably_not_meant_is_told_in_one_sentence(params, key):
    (finding,) = check_amcl({**OURS, **params})
    assert (finding.level, finding.key) == (WARN, key) and finding.sentence.endswith('.')


def test_what_cannot_work_is_an_error():
    found = check_amcl({'laser_model_type': 'beams', 'kld_err': 0, 'laser_max_beam': 3})
    assert [finding.level for finding in found] == [ERROR, ERROR, WARN]
