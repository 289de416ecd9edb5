"""Profiles of shared control: how much it helps, for each rider. A profile is what its rider's AssistConfig has of its
own; with `enabled: false` the rider goes with the safety gate alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from sara_common.config import ConfigError
from sara_control.assist.assist_config import AssistConfig

PER_RIDER = (
    'enabled',
    'horizon',
    'nearest_look',
    'farthest_look',
    'margin',
    'clear',
    'help',
    'braking',
    'steady_time',
    'veer_time',
    'insist',
    'insist_time',
)


class HelpProfiles(NamedTuple):
    """configs: {name: AssistConfig}. name: of the profile at start."""

    configs: dict[str, AssistConfig]
    name: str

    @property
    def config(self) -> AssistConfig:
        """The profile's at start."""
        return self.configs[self.name]

    @classmethod
    def from_params(cls, params: object) -> HelpProfiles:
        """From shared_control's parameters; where they name no profiles, one called `much` is what they say. Raises
        ConfigError with every fault.
        """
        if not isinstance(params, dict):
            raise ConfigError(f'{params!r} is given where a mapping of parameters is allowed')
        own, faults, base = dict(params), [], AssistConfig(length=1.0, width=1.0)
        profiles, name = own.pop('profiles', {'much': {}}), own.pop('profile', 'much')
        try:
            base = AssistConfig.from_params(own)
        except ConfigError as error:
            faults += error.faults
        if not isinstance(profiles, dict) or not profiles:
            raise ConfigError([*faults, f'profiles is {profiles!r}, allowed is a mapping from names to parameters'])
        configs = {profile: _config(base, profile, values, faults) for profile, values in profiles.items()}
        if name not in list(profiles):
            faults.append(f'profile is {name!r}, allowed are {", ".join(map(str, profiles))}')
        if faults:
            raise ConfigError(faults)
        return cls(configs, name)


def _config(base, name, values, faults):
    """The AssistConfig of a profile; what is wrong is added to `faults`."""
    if not isinstance(name, str):
        faults.append(f'profiles has the name {name!r}, allowed are texts')
    if not isinstance(values, dict):
        faults.append(f'profiles/{name} is {values!r}, allowed is a mapping of parameters')
        return base
    faults += [
        f"profiles/{name}/{key} is {value!r}, but that is not the rider's; allowed are {', '.join(PER_RIDER)}"
        for key, value in values.items()
        if key not in PER_RIDER
    ]
    try:
        return replace(base, **{key: value for key, value in values.items() if key in PER_RIDER})
    except ConfigError as error:
        faults += [f'profiles/{name}/{fault}' for fault in error.faults]
        return base
