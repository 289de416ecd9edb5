"""Where the packages' files lie, in the source tree and in an install space alike."""

import os
from pathlib import Path
from typing import Any

import yaml


def share(package: str = 'sara_bringup') -> Path:
    """The share folder of a package: on ROS_PACKAGE_PATH, else beside this one's sources. Raises FileNotFoundError."""
    candidates = [Path(entry) / package for entry in os.environ.get('ROS_PACKAGE_PATH', '').split(':') if entry]
    candidates.append(Path(__file__).resolve().parents[3] / package)
    for folder in candidates:
        if (folder / 'package.xml').is_file():
            return folder
    raise FileNotFoundError(f"the package {package} was found nowhere; source the workspace's setup.bash first")


def config_file(name: str, package: str = 'sara_bringup') -> Path:
    """Path of config/NAME of a package."""
    return share(package) / 'config' / name


def parameters(package: str, name: str) -> dict:
    """The parameters in config/NAME of a package, as its nodes load them."""
    return plain(config_file(name, package).read_text())


def plain(text: str) -> Any:
    """What YAML of plain values says, read by libyaml where it is there. Raises yaml.YAMLError."""
    return yaml.load(text, Loader=getattr(yaml, 'CSafeLoader', yaml.SafeLoader))
