"""A robot's settings of the safety gate, for the checks that compare something with them."""

from __future__ import annotations

from sara_common.config import ConfigError
from sara_common.platforms import Platform, parameters
from sara_control.gate.gate_config import SafetyConfig


def safety_of(platform: Platform) -> SafetyConfig | None:
    """The SafetyConfig; None where it cannot be read, which check_config reports once."""
    try:
        return SafetyConfig.from_params(parameters('sara_control', 'safety.yaml', platform))
    except (ConfigError, KeyError, TypeError, ValueError):
        return None
