"""Where the packages' files lie, in the source tree and in an install space alike; what YAML files say; and files that
are written whole or not at all: a power cut leaves the old one or the new one.
"""

from __future__ import annotations

import os
import tempfile
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


def write_whole(path: str | Path, data: str | bytes, mode: int = 0o644) -> None:
    """Write a file (text as UTF-8) with those permissions, in the place of the one that is there; folders are made.
    Raises OSError, and leaves what was there.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    descriptor, temporary = tempfile.mkstemp(prefix=f'.{path.name}.', dir=path.parent)
    try:
        with os.fdopen(descriptor, 'wb') as stream:
            stream.write(data.encode() if isinstance(data, str) else data)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, mode)
        os.replace(temporary, path)
    except OSError:
        Path(temporary).unlink(missing_ok=True)
        raise
