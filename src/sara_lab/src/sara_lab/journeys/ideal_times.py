"""Ideal times of the journeys of travel.py, remembered in a folder: each takes seconds to find."""

import json
from functools import cache
from pathlib import Path

from sara_bringup.paths import parameters
from sara_control.gate.gate_config import SafetyConfig
from sara_lab.ideal.ideal import Ideal, ideal, limits_of, space_of
from sara_lab.ideal.moves import Limits, Space
from sara_lab.journeys.travel_cases import map_file, pairs
from sara_lab.judge.judge import BODY
from sara_nav.maps import map_io


@cache
def default_limits() -> Limits:
    """The Limits of the profile that the safety gate starts with."""
    config = SafetyConfig.from_params(parameters('sara_control', 'safety.yaml'))
    return limits_of(config.profiles[config.profile])


@cache
def map_space(path: Path | str) -> Space:
    """The Space of a map's YAML file: what is not known to be free is occupied."""
    grid = map_io.load_map(str(path))
    geometry = grid.geometry
    return space_of(grid.data != map_io.FREE, geometry.resolution, (geometry.origin_x, geometry.origin_y), BODY)


def ideal_path(name: str, number: int) -> Ideal:
    """The Ideal of journey `number` on a map."""
    pair = pairs(name)[number]
    return ideal(map_space(map_file(name)), default_limits(), pair.start, pair.goal)


def ideal_time(name: str, number: int, folder: Path | str) -> float:
    """s of that Ideal, kept in `folder`, by journey and limits."""
    path = Path(folder) / f'ideal_{name}.json'
    known = json.loads(path.read_text()) if path.exists() else {}
    key = f'{number}: ' + ' '.join(f'{value:g}' for value in (*default_limits(), *BODY))
    if key not in known:
        known[key] = round(ideal_path(name, number).seconds, 6)
        path.write_text(json.dumps(known, indent=1) + '\n')
    return known[key]
