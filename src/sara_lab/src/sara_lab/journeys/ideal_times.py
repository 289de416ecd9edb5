"""Ideal times of recorded drives and of travel.py's journeys; those are kept in a folder, as each takes seconds."""

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from sara_common.files import write_whole
from sara_common.platforms import chosen, parameters
from sara_control.gate.comfort import Profile
from sara_control.gate.gate_config import SafetyConfig
from sara_lab.ideal.ideal import Ideal, ideal, limits_of, space_of
from sara_lab.ideal.moves import Limits, Space
from sara_lab.journeys.travel_cases import map_file, pairs
from sara_lab.judge.judgement import Track
from sara_nav.maps import map_io

TIMED = {'true': 'true pose', 'fused': 'fused pose', 'boxes': 'unknown boxes'}
"""Modes of travel whose journeys have an ideal time, in words; among people it is not theirs alone."""
QUICK = 2.0
"""Times the ideal time; less is quick."""


@cache
def default_profile() -> Profile:
    """The profile that the safety gate starts with."""
    config = SafetyConfig.from_params(parameters('sara_control', 'safety.yaml'))
    return config.profiles[config.profile]


def default_limits() -> Limits:
    """Its Limits."""
    return limits_of(default_profile())


@cache
def map_space(path: Path | str) -> Space:
    """The Space of a map's YAML file: what is not known to be free is occupied."""
    grid = map_io.load_map(str(path))
    geometry = grid.geometry
    return space_of(
        grid.data != map_io.FREE, geometry.resolution, (geometry.origin_x, geometry.origin_y), chosen().size
    )


def with_ideal(track: Track, path: Path | str) -> Track:
    """The Track whose goals have their ideal time on a map (its YAML file), from where the chair was then."""

    def timed(goal):
        row = min(int(np.searchsorted(track.t, goal.given)), len(track.t) - 1)
        seconds = ideal(
            map_space(path), default_limits(), track.pose[row], goal.pose, 0.5 * chosen().body.width
        ).seconds
        return goal if math.isnan(seconds) else replace(goal, ideal=seconds)

    return replace(track, goals=tuple(map(timed, track.goals)))


def ideal_path(name: str, number: int) -> Ideal:
    """The Ideal of journey `number` on a map."""
    pair = pairs(name)[number]
    return ideal(map_space(map_file(name)), default_limits(), pair.start, pair.goal, 0.5 * chosen().body.width)


def ideal_time(name: str, number: int, folder: Path | str) -> float:
    """s of that Ideal, kept in `folder`, by limits."""
    path = Path(folder) / f'ideal_{name}_{number}.json'
    known = json.loads(path.read_text()) if path.exists() else {}
    key = ' '.join(f'{value:g}' for value in (*default_limits(), *chosen().size))
    if key not in known:
        known[key] = round(ideal_path(name, number).seconds, 6)
        write_whole(path, json.dumps(known, indent=1) + '\n')
    return known[key]
