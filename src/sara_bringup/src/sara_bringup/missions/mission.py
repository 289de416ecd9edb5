"""Missions as data: where a drive starts and which poses it is to reach, read from a YAML file of config/."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import yaml

from sara_common.config import is_number
from sara_common.files import plain


class MissionError(ValueError):
    """A mission file that cannot be driven."""


@dataclass(frozen=True)
class Mission:
    """Poses are (x, y, yaw) in the map frame, metres and radians; `leg_timeout_s` is ROS time for one of them."""

    name: str
    start: tuple
    goals: tuple
    leg_timeout_s: float


def _pose(entry, where):
    if not (isinstance(entry, list) and len(entry) == 3 and all(map(is_number, entry))):
        raise MissionError(f'{where} must be [x m, y m, yaw deg], three finite numbers; it holds {entry!r}')
    return float(entry[0]), float(entry[1]), math.radians(entry[2])


def load_mission(path: Path | str) -> Mission:
    """Read a mission from a YAML file with `start`, `corners` and `leg_timeout_s`.

    Raises MissionError naming the entry that is wrong.
    """
    path = Path(path)
    try:
        content = plain(path.read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise MissionError(f'the mission {path} cannot be read: {error}') from error
    if not isinstance(content, dict):
        raise MissionError(f'{path} must hold start, corners and leg_timeout_s; it holds {content!r}')
    missing = [key for key in ('start', 'corners', 'leg_timeout_s') if key not in content]
    if missing:
        raise MissionError(f'{path}: {", ".join(missing)} missing')
    if not isinstance(content['corners'], list):
        raise MissionError(f'{path}: corners is {content["corners"]!r}, allowed is a list of poses')
    limit = content['leg_timeout_s']
    if not (is_number(limit) and limit > 0.0):
        raise MissionError(f'{path}: leg_timeout_s is {limit!r}, allowed are numbers above 0')
    goals = tuple(_pose(entry, f'{path}: corner {number}') for number, entry in enumerate(content['corners'], 1))
    if not goals:
        raise MissionError(f'{path}: corners is empty; at least one pose is needed')
    return Mission(path.stem, _pose(content['start'], f'{path}: start'), goals, float(limit))
