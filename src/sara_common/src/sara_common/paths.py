"""Where the packages' files lie, in the source tree and in an install space alike, and what YAML files say."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import yaml


def share(package: str) -> Path:
    """The share folder of a package: on ROS_PACKAGE_PATH, else beside this one's sources. Raises FileNotFoundError."""
    candidates = [Path(entry) / package for entry in os.environ.get('ROS_PACKAGE_PATH', '').split(':') if entry]
    candidates.append(Path(__file__).resolve().parents[3] / package)
    for folder in candidates:
        if (folder / 'package.xml').is_file():
            return folder
    raise FileNotFoundError(f"the package {package} was found nowhere; source the workspace's setup.bash first")


def plain(text: str) -> Any:
    """What YAML of plain values says, read by libyaml where it is there. Raises yaml.YAMLError."""
    return yaml.load(text, Loader=getattr(yaml, 'CSafeLoader', yaml.SafeLoader))


def merged(tree: dict, over: dict) -> dict:
    """A tree of parameters with another laid over it; neither is changed."""
    result = dict(tree)
    for name, value in over.items():
        result[name] = (
            merged(result[name], value) if isinstance(value, dict) and isinstance(result.get(name), dict) else value
        )
    return result
