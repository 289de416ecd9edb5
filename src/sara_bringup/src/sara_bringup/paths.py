"""Where the packages' files lie, in the source tree and in an install space alike."""

from __future__ import annotations

from pathlib import Path

from sara_common import paths


def share(package: str = 'sara_bringup') -> Path:
    """The share folder of a package. Raises FileNotFoundError."""
    return paths.share(package)


def config_file(name: str, package: str = 'sara_bringup') -> Path:
    """Path of config/NAME of a package."""
    return share(package) / 'config' / name
