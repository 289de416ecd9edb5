"""What range sensors with wide cones hear, on a grid of what is free, occupied and not known; compiled by numba.

A wall answers from where the sensor's ray meets it squarely, and the nearest of what is in the cone is heard. A ray
that ends at the unknown may meet a wall there, which answers if it lies as the border does.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt

from ahead_of_time import kernel
from sara_common.repeatable import cos_sin
from sara_nav.grids.grid import Grid

RAYS = 9
"""In a span."""
SIGHT_RAYS = 360
"""All round."""
SQUARELY = math.cos(0.4)
"""Cosine of the angle between a ray and the normal of a border up to which a wall there would answer from there."""
STEEPEST = math.cos(math.radians(60.0))
"""Between a cone's axis and the normal of a wall that still answers."""
FREE_CELL, WALL_CELL, UNKNOWN_CELL = 0, 1, 2
STEP = 0.5
"""Cells from one place that is looked at to the next one on a ray."""


class Cells(NamedTuple):
    """Of a map: uint8 (rows, columns) FREE_CELL and so on; the unit normals of borders, float32 each, to the free side;
    and its `strides`.
    """

    kinds: np.ndarray
    normal_x: np.ndarray
    normal_y: np.ndarray
    strides: np.ndarray
    grid: Grid


def strides(kinds: np.ndarray) -> np.ndarray:
    """int32 (rows, columns): how many STEPs from anywhere in a cell, whatever the way, surely lead through free cells
    alone and end in one; 1 where none do.
    """
    off = distance_transform_edt(np.pad(kinds == FREE_CELL, 1))[1:-1, 1:-1]  # beyond the map nothing is free
    return np.maximum(np.ceil((off - math.sqrt(2.0)) / STEP) - 1.0, 1.0).astype(np.int32)


@kernel
def borders_heard(cells: Cells, sensors: np.ndarray, reach: float, places: np.ndarray, far: np.ndarray) -> None:
    """Of sensors (n, 4), x, y, axis and half the cone (m, rad): puts into places int32 (n, RAYS) the flat index of the
    last free cell before the unknown on each ray from which a wall would be heard, -1 for none, and into far float32
    how far off it is, m.
    """
    rows, columns = cells.kinds.shape
    g = cells.grid
    most = int(reach / (g.resolution * STEP))
    for n in range(len(sensors)):
        x = (sensors[n, 0] - g.origin_x) / g.resolution
        y = (sensors[n, 1] - g.origin_y) / g.resolution
        axis, half = sensors[n, 2], sensors[n, 3]
        ax, ay = math.cos(axis), math.sin(axis)
        echo = reach  # of the nearest wall that is known
        for ray in range(RAYS):
            angle = axis - half + 2.0 * half * ray / (RAYS - 1)
            dx, dy = math.cos(angle), math.sin(angle)
            places[n, ray] = -1
            far[n, ray] = 0.0
            last, k = -1, 0
            while k <= most:
                column = int(math.floor(x + k * STEP * dx))
                row = int(math.floor(y + k * STEP * dy))
                if column < 0 or row < 0 or column >= columns or row >= rows:
                    break
                kind = cells.kinds[row, column]
                if kind == FREE_CELL:
                    last = row * columns + column
                    k += cells.strides[row, column]
                    continue
                if last < 0:
                    k += 1
                    continue  # the sensor sits in what is not known yet
                distance = k * STEP * g.resolution
                if kind == WALL_CELL:
                    facing = -(ax * cells.normal_x[row, column] + ay * cells.normal_y[row, column])
                    if facing > STEEPEST and distance < echo:
                        echo = distance
                else:
                    facing = -(dx * cells.normal_x[row, column] + dy * cells.normal_y[row, column])
                    if facing > SQUARELY:
                        places[n, ray] = last
                        far[n, ray] = distance
                break
        for ray in range(RAYS):
            if far[n, ray] > echo:
                places[n, ray] = -1


@kernel
def mark_seen(cells: Cells, places: np.ndarray, reach: float, seen: np.ndarray) -> None:
    """Put True into seen, bool (rows, columns), for cells up to `reach` (m) in line of sight of places (n, 2), m, on
    free cells.
    """
    rows, columns = cells.kinds.shape
    g = cells.grid
    most = int(2.0 * reach / g.resolution)
    for n in range(len(places)):
        x, y = (places[n, 0] - g.origin_x) / g.resolution, (places[n, 1] - g.origin_y) / g.resolution
        for ray in range(SIGHT_RAYS):
            angle = 2.0 * math.pi * ray / SIGHT_RAYS
            dx, dy = 0.5 * math.cos(angle), 0.5 * math.sin(angle)
            for k in range(most + 1):
                column, row = int(math.floor(x + k * dx)), int(math.floor(y + k * dy))
                if column < 0 or row < 0 or column >= columns or row >= rows or cells.kinds[row, column] != FREE_CELL:
                    break
                seen[row, column] = True


def sensors_at(poses: np.ndarray, mounts: np.ndarray) -> np.ndarray:
    """(..., 3): x, y, axis (m, rad, not wrapped) of sensors at mounts (..., 3) of robots at poses (..., 3), broadcast
    against each other.
    """
    (x, y, yaw), (mx, my, axis) = np.moveaxis(poses, -1, 0), np.moveaxis(mounts, -1, 0)
    c, s = cos_sin(yaw)
    return np.stack((x + c * mx - s * my, y + s * mx + c * my, yaw + axis), -1)


def heard_from(cells: Cells, poses: np.ndarray, sensors: np.ndarray, reach: float) -> np.ndarray:
    """int32 (n, m): flat indices of the cells that robots at poses (n, 3) hear, -1 for none: see borders_heard.
    sensors (k, 4): x, y, axis on the robot, and half the cone.
    """
    placed = sensors_at(poses[:, None], sensors[:, :3])
    half = np.broadcast_to(sensors[:, 3], placed.shape[:2])
    placed = np.concatenate((placed, half[..., None]), -1).reshape(-1, 4)
    places, far = np.empty((len(placed), RAYS), np.int32), np.empty((len(placed), RAYS), np.float32)
    borders_heard(cells, placed, reach, places, far)
    return places.reshape(len(poses), -1)


def warm() -> None:
    """Compile, or load from the cache, the kernels for the types they are called with."""
    flat = np.zeros((3, 3), np.float32)
    kinds = np.zeros((3, 3), np.uint8)
    cells = Cells(kinds, flat, flat, strides(kinds), Grid(0.0, 0.0, 1.0))
    places, far = np.empty((1, RAYS), np.int32), np.empty((1, RAYS), np.float32)
    borders_heard(cells, np.zeros((1, 4)), 1.5, places, far)
    mark_seen(cells, np.zeros((1, 2)), 1.0, np.zeros((3, 3), np.bool_))
