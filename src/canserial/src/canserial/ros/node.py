"""What nodes need at the start: a configuration from private parameters, and an end that says why."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Never

import rospy

from sara_common.config import ConfigError


def config_from_params(config_type: type) -> object:
    """The frozen dataclass `config_type` from the private parameters of its fields' names.

    What a platform knows of it (`OfPlatform`) need not be given. A wrong one ends the node with a sentence that names
    it.
    """
    fields = config_type.__dataclass_fields__
    given = {name: rospy.get_param(f'~{name}') for name in fields if rospy.has_param(f'~{name}')}
    for name, value in given.items():  # YAML's 1 is meant as 1.0 where a float is due
        if isinstance(fields[name].default, float) and isinstance(value, int) and not isinstance(value, bool):
            given[name] = float(value)
    try:
        return getattr(config_type, 'of', config_type)(**given)
    except ConfigError as error:
        stop(f'wrong configuration of {rospy.get_name()}: {error}')


def warn_of_unknown_params(known: Iterable[str]) -> None:
    """Say which private parameters are none of `known`, for a misspelt one would do nothing."""
    given = rospy.get_param(rospy.get_name(), {})
    unknown = sorted(set(given) - set(known)) if isinstance(given, dict) else []
    if unknown:
        rospy.logwarn('%s has no parameter %s', rospy.get_name(), ', '.join(unknown))


def stop(sentence: str) -> Never:
    """Say why, and end the process with status 1."""
    rospy.logfatal(sentence)
    rospy.signal_shutdown(sentence)
    raise SystemExit(1)
