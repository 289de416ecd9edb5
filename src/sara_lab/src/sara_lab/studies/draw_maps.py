"""A map that was made, laid on the true one: true walls grey, mapped ones red, the way blue."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from sara_lab.experiments.plotting import figure
from sara_lab.journeys.drawing import draw_map
from sara_lab.journeys.travel_cases import map_file
from sara_lab.judge.walls import Pose, occupied_points, placed
from sara_lab.studies import map_trial, sonar_trial
from sara_sim.world.world import World

WIDE = 9.0  # inches


def draw(name: str, made: map_trial.Made | sonar_trial.Made, poses: np.ndarray | Sequence[Pose], path: Path) -> None:
    """Write a picture of what was made of a map. poses (n, 2 or more): of the robot in the map that was made."""
    world = World.from_yaml(map_file(name))
    rows, columns = world.occupied.shape
    with figure(path, size=(WIDE, WIDE * rows / columns + 0.4)) as (_, axis):
        draw_map(axis, world)
        axis.plot(*placed(occupied_points(made.grid), made.errors.pose).T, 's', color='tab:red', markersize=0.7)
        axis.plot(*placed(np.array(poses)[:, :2], made.errors.pose).T, color='tab:blue', linewidth=0.8)
        axis.set(xlabel='x (m)', ylabel='y (m)', aspect='equal')
        axis.set_title(f'walls off: median {made.errors.median:.3f} m, p95 {made.errors.p95:.3f} m')
