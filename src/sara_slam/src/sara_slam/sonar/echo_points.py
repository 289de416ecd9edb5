"""Points that stand for what is no wall: corners, and small things. Echoes of a point lie on arcs that meet in it."""

from __future__ import annotations

import numpy as np

from sara_slam.sonar.forward_model import THROUGH, Heard, driven_over, glances, looked_through, unexplained
from sara_slam.sonar.sonar_config import SonarConfig

POINT_VOTES = 6
"""Echoes of a point."""
BESIDE = 0.02
"""m by which an arc is thick, either way."""
DIRECTIONS = 41
"""In a cone."""


def other_points(config: SonarConfig, heard: Heard, pieces: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """(n, 2): points that explain the echoes that pieces of walls (m, 4) do not, those of most echoes first, and none
    where the robot was at poses (k, 3).
    """
    rest = unexplained(config, heard, pieces)
    if not len(rest.ranges):
        return np.empty((0, 2))
    places, touched = _arcs(config, rest)
    cell = np.concatenate(touched)
    votes = np.bincount(cell, minlength=len(places)).astype(float)
    candidates = np.flatnonzero(votes >= POINT_VOTES)
    votes[candidates[driven_over(config, poses, places[candidates])]] = 0.0
    candidates = np.flatnonzero(votes >= POINT_VOTES)
    if not len(candidates):
        return np.empty((0, 2))
    all_round = np.hstack((places[candidates], np.zeros((len(candidates), 2))))
    through = looked_through(config, heard, all_round, glances(config, heard, all_round), pieces)
    votes[candidates[through > THROUGH * votes[candidates]]] = 0.0
    return places[_greedy(votes, touched)]


def _arcs(config, heard):
    """(cells, 2) m, middles of the cells that arcs touch; and for each reading which of them it touches."""
    size = config.resolution
    low = heard.sensors[:, :2].min(0) - config.range_max_range - size
    rows = int(np.ceil((heard.sensors[:, 1].max() + config.range_max_range + size - low[1]) / size)) + 1
    fan = np.linspace(-0.5 * config.field_of_view, 0.5 * config.field_of_view, DIRECTIONS)
    touched = []
    for (x, y, axis), distance in zip(heard.sensors.tolist(), heard.ranges.tolist()):
        reach = np.array((distance - BESIDE, distance + BESIDE))[:, None]
        column = (x + reach * np.cos(axis + fan) - low[0]) // size
        row = (y + reach * np.sin(axis + fan) - low[1]) // size
        touched.append(np.unique((column * rows + row).astype(int)))
    names, cell = np.unique(np.concatenate(touched), return_inverse=True)
    places = np.stack((names // rows, names % rows), 1) * size + low + 0.5 * size
    return places, np.split(cell, np.cumsum([len(cells) for cells in touched])[:-1])


def _greedy(votes, touched):
    """Cells that most readings that are left touch, one after the other. votes is overwritten."""
    cell = np.concatenate(touched)
    reading = np.repeat(np.arange(len(touched)), [len(cells) for cells in touched])
    by_cell = np.argsort(cell, kind='stable')
    begin = np.searchsorted(cell[by_cell], np.arange(len(votes) + 1))
    left, found = np.ones(len(touched), bool), []
    while True:
        best = int(np.argmax(votes))
        if votes[best] < POINT_VOTES:
            return np.array(found, int)
        found.append(best)
        for number in reading[by_cell[begin[best] : begin[best + 1]]].tolist():
            if left[number]:
                left[number] = False
                votes[touched[number]] -= 1.0
        votes[best] = 0.0
