"""Where the packages' files lie, in the source tree and in an install space alike."""

from __future__ import annotations

from pathlib import Path

from sara_common import files


def share(package: str = 'sara_bringup') -> Path:
    """The share folder of a package. Raises FileNotFoundError."""
    return files.share(package)


def config_file(name: str, package: str = 'sara_bringup') -> Path:
    """Path of config/NAME of a package."""
    return share(package) / 'config' / name
