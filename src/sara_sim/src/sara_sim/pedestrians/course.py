"""What stands, slopes and walks on a map, from a YAML file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import yaml

from sara_common.config import is_number
from sara_sim.pedestrians.pedestrian import Pedestrian, PedestrianConfig
from sara_sim.pedestrians.routes import Routes
from sara_sim.world.obstacles import Obstacle, ObstacleError
from sara_sim.world.terrain import Ramp, TerrainError, Threshold
from sara_sim.world.world import World

KINDS = {'obstacles': Obstacle, 'ramps': Ramp, 'pedestrians': PedestrianConfig, 'thresholds': Threshold}


class Course(NamedTuple):
    """What a file holds."""

    obstacles: list[Obstacle]
    ramps: list[Ramp]
    pedestrians: list[PedestrianConfig]
    thresholds: list[Threshold]

    def put_on(self, world: World) -> None:
        """Add all to a World. Raises ObstacleError where a pedestrian has no way."""
        for obstacle in self.obstacles:
            world.obstacles.add(obstacle)
        world.ramps.extend(self.ramps)
        world.thresholds.extend(self.thresholds)
        if self.pedestrians:
            routes = Routes(world, [place for config in self.pedestrians for place in config.places])
            for config in self.pedestrians:
                world.obstacles.add(Pedestrian(config, world, routes))


def load(path: str | Path) -> Course:
    """The Course of a YAML file: {obstacles: [{...}], ramps: [{...}], pedestrians: [{...}],
    thresholds: [{...}]}, with the fields of Obstacle, Ramp, PedestrianConfig and Threshold; angles also as `yaw_deg`,
    `slope_deg`.

    Raises ObstacleError that names every fault.
    """
    try:
        text = yaml.safe_load(Path(path).read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ObstacleError(f'the obstacles {path} cannot be read: {error}.') from error
    if not isinstance(text, dict) or not set(text) <= set(KINDS):
        raise ObstacleError(f'the obstacles {path} must be a file with the lists {", ".join(KINDS)}.')
    faults, made = [], {kind: [] for kind in KINDS}
    for kind, build in KINDS.items():
        entries = text.get(kind) or []
        if not isinstance(entries, list):
            faults.append(f'{kind} in {path} must be a list')
            continue
        for number, entry in enumerate(entries, 1):
            try:
                made[kind].append(build(**_in_radians(entry)))
            except (TypeError, ObstacleError, TerrainError) as error:
                faults.append(f'{kind} entry {number} of {path}: {error}')
    if faults:
        raise ObstacleError('; '.join(faults))
    return Course(**made)


def _in_radians(entry: dict) -> dict:
    if not isinstance(entry, dict):
        raise ObstacleError(f'{entry!r} must be a set of fields.')
    values = dict(entry)
    for name in [name for name in values if isinstance(name, str) and name.endswith('_deg')]:
        value = values.pop(name)
        if not is_number(value):
            raise ObstacleError(f'{name} is {value!r}, allowed is a finite number')
        values[name[:-4]] = math.radians(value)
    return values
