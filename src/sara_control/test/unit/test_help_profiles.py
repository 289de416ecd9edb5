"""The profiles of shared control: what differs for a rider, and what is wrong with them."""

from dataclasses import replace

import pytest

from sara_common.config import ConfigError
from sara_common.platforms import load, parameters
from sara_control.assist.assist_config import AssistConfig
from sara_control.assist.help_profiles import PER_RIDER, HelpProfiles

BASE = {'length': 1.0, 'width': 0.6, 'help': 0.6}


def faults(**params):
    with pytest.raises(ConfigError) as error:
        HelpProfiles.from_params({**BASE, **params})
    return error.value.faults


def test_a_profile_is_the_rest_with_what_is_its_own():
    profiles = HelpProfiles.from_params(
        {**BASE, 'profile': 'own', 'profiles': {'own': {'help': 0.1, 'clear': 0.2}, 'off': {'enabled': False}}}
    )
    base = AssistConfig(**BASE)
    assert profiles.configs == {'own': replace(base, help=0.1, clear=0.2), 'off': replace(base, enabled=False)}
    assert profiles.name == 'own' and profiles.config == profiles.configs['own']


def test_without_profiles_there_is_one():
    assert HelpProfiles.from_params(BASE) == HelpProfiles({'much': AssistConfig(**BASE)}, 'much')


def test_our_own_file():
    profiles = HelpProfiles.from_params(parameters('sara_control', 'assist.yaml', load('sara')))
    much, little, switches, gate_only = profiles.configs.values()
    assert list(profiles.configs) == ['much', 'little', 'switches', 'gate_only'] and profiles.config == much
    assert switches == replace(much, steady_time=0.0, veer_time=3.0) and much.veer_time == 0.0
    assert much.farthest_look > little.farthest_look and much.enabled and little.enabled and not gate_only.enabled


@pytest.mark.parametrize(
    'params, named',
    [
        ({'profile': 'none'}, "profile is 'none', allowed are much"),
        ({'profile': ['much']}, "profile is ['much'], allowed are much"),
        ({'profiles': {}}, 'profiles is {}'),
        ({'profiles': ['much']}, "profiles is ['much']"),
        ({'profiles': {'much': 0.6}}, 'profiles/much is 0.6'),
        ({'profiles': {'much': {}, False: {}}}, 'profiles has the name False'),
        ({'profiles': {'much': {'help': 2.0}}}, 'profiles/much/help is 2.0'),
        ({'profiles': {'much': {'width': 0.5}}}, 'profiles/much/width is 0.5'),
        ({'profiles': {'much': {'enabled': 'no'}}}, "profiles/much/enabled is 'no'"),
    ],
)
def test_a_fault_is_named(params, named):
    (fault,) = faults(**params)
    assert fault.startswith(named)


def test_all_faults_at_once():
    found = faults(margin=-1.0, profile='x', profiles={'much': {'help': 3, 'wide': 1}, 'little': {'insist': 0}})
    assert [fault.split(' ')[0] for fault in found] == [
        'margin',
        'profiles/much/wide',
        'profiles/much/help',
        'profiles/little/insist',
        'profile',
    ]


def test_no_mapping():
    with pytest.raises(ConfigError, match='mapping'):
        HelpProfiles.from_params([])


def test_what_is_a_rider_s_is_there():
    assert set(PER_RIDER) < set(AssistConfig.__dataclass_fields__)
