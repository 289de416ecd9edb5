"""Missions as data: where a drive starts and which poses it is to reach, read from a YAML file of config/."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from sara_common.paths import plain


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
    if not (
        isinstance(entry, (list, tuple))
        and len(entry) == 3
        and all(isinstance(v, (int, float)) and math.isfinite(v) for v in entry)
    ):
        raise MissionError(f'{where} must be [x m, y m, yaw deg], three finite numbers; it holds {entry!r}')
    return float(entry[0]), float(entry[1]), math.radians(entry[2])


def load_mission(path: Path | str) -> Mission:
    """Read a mission from a YAML file with `start`, `corners` and `leg_timeout_s`.

    Raises MissionError naming the entry that is wrong.
    """
    path = Path(path)
    content = plain(path.read_text())
    missing = [key for key in ('start', 'corners', 'leg_timeout_s') if key not in (content or {})]
    if missing:
        raise MissionError(f'{path}: {", ".join(missing)} missing')
    goals = tuple(_pose(entry, f'{path}: corner {number}') for number, entry in enumerate(content['corners'], 1))
    if not goals:
        raise MissionError(f'{path}: corners is empty; at least one pose is needed')
    return Mission(path.stem, _pose(content['start'], f'{path}: start'), goals, float(content['leg_timeout_s']))
