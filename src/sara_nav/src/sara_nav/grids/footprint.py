"""The outline of a robot: reading it from parameters, its radii, padding, and points that cover it.

A footprint is an array (k, 2) of corners in the robot's frame, metres.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

FARTHEST = 10.0
"""m from its origin that a footprint may reach, as robot_radius and footprint_padding may."""


class FootprintError(ValueError):
    """A footprint makes no sense; the message says what was given and what is allowed."""


def parse_footprint(value: str | Sequence) -> np.ndarray:
    """Return a footprint (k, 2) from ``[[x, y], ...]`` as a list or as a string; raises FootprintError."""
    corners = _parse_array(value) if isinstance(value, str) else value
    try:
        corners = np.array([[float(x), float(y)] for x, y in corners], dtype=float)
    except (TypeError, ValueError):
        raise FootprintError(f'footprint is {value!r}, allowed is a list of [x, y] pairs') from None
    if len(corners) < 3:
        raise FootprintError(f'footprint has {len(corners)} corners but must have at least 3')
    if not (np.abs(corners) <= FARTHEST).all():  # nor NaN
        raise FootprintError(f'footprint is {value!r}, allowed are numbers from {-FARTHEST:g} to {FARTHEST:g} (m)')
    return corners


def _parse_array(text):
    """Return the lists of numbers in a list of lists; commas and blanks separate, as in costmap_2d's array parser."""
    rows, depth = [], 0
    try:
        for token in re.findall(r'[][]|[^][,\s]+', text):
            if token == '[':
                depth += 1
                if depth == 2:
                    rows.append([])
            elif token == ']':
                depth -= 1
            elif depth != 2:
                raise ValueError
            else:
                rows[-1].append(float(token))
            if not 0 <= depth <= 2:
                raise ValueError
        if depth != 0:
            raise ValueError
    except ValueError:
        raise FootprintError(f'footprint is {text!r} but must look like [[x1, y1], [x2, y2], [x3, y3]]') from None
    return rows


def circle_footprint(radius: float, corners: int = 16) -> np.ndarray:
    """Return a regular polygon (corners, 2) on a circle of ``radius`` (m); raises FootprintError."""
    if not (math.isfinite(radius) and radius > 0.0):
        raise FootprintError(f'robot_radius is {radius!r}, allowed are numbers above 0')
    angles = np.arange(corners) * (2.0 * math.pi / corners)
    return radius * np.column_stack([np.cos(angles), np.sin(angles)])


def pad_footprint(corners: np.ndarray, padding: float) -> np.ndarray:
    """Return the footprint with ``padding`` (m) added to each coordinate away from zero."""
    corners = np.asarray(corners, float)
    return corners + np.where(corners > 0.0, padding, np.where(corners < 0.0, -padding, 0.0))


def contains_origin(corners: np.ndarray) -> bool:
    """True when the robot's centre lies inside the footprint (even-odd rule)."""
    inside = False
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0)):
        if (y0 > 0.0) != (y1 > 0.0) and (x1 - x0) * (0.0 - y0) / (y1 - y0) + x0 > 0.0:
            inside = not inside
    return inside


def depths(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return how far (m) each of points (n, 2) in the footprint or on its outline is from the outline."""
    corners = np.asarray(corners, float)
    depth = np.full(len(points), np.inf)
    for start, end in zip(corners, np.roll(corners, -1, axis=0)):
        edge = end - start
        along = np.clip((points - start) @ edge / max(float(edge @ edge), 1e-300), 0.0, 1.0)
        depth = np.minimum(depth, np.hypot(*(points - start - along[:, None] * edge).T))
    return depth


def radii(corners: np.ndarray) -> tuple[float, float]:
    """Return (inscribed, circumscribed) radius (m) of the footprint about the robot's centre.

    The inscribed radius is the least distance of the outline from the centre, 0 when the centre is outside.
    """
    corners = np.asarray(corners, float)
    inscribed = float(depths(corners, np.zeros((1, 2)))[0]) if contains_origin(corners) else 0.0
    return inscribed, float(np.hypot(*corners.T).max())


def cover(corners: np.ndarray, spacing: float) -> np.ndarray:
    """Return points (n, 2) on the outline and inside the footprint, no further apart than ``spacing`` (m).

    Looking these points up in a grid whose cells are no smaller than ``spacing`` finds every obstacle that
    reaches into the footprint by more than half the spacing.
    """
    corners = np.asarray(corners, float)
    following = np.roll(corners, -1, axis=0)
    points = []
    for start, end in zip(corners, following):
        steps = max(1, math.ceil(np.hypot(*(end - start)) / spacing))
        points.append(start + np.arange(steps)[:, None] / steps * (end - start))
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y = np.meshgrid(np.arange(low[0] + spacing, high[0], spacing), np.arange(low[1] + spacing, high[1], spacing))
    inner = np.column_stack([x.ravel(), y.ravel()])
    inside = np.zeros(len(inner), bool)
    for (x0, y0), (x1, y1) in zip(corners, following):
        if y0 != y1:
            crosses = (y0 > inner[:, 1]) != (y1 > inner[:, 1])
            inside ^= crosses & (inner[:, 0] < (x1 - x0) * (inner[:, 1] - y0) / (y1 - y0) + x0)
    points.append(inner[inside])
    return np.ascontiguousarray(np.vstack(points))
