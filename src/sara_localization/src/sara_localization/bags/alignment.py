"""How far an estimated way is from a reference, where the two begin is not to matter: SE(2)-aligned root mean square
error.

The rotation and translation that bring the one best onto the other are in closed form (B. Horn, "Closed-form solution
of absolute orientation using unit quaternions", 1987, in the plane).
"""

from __future__ import annotations

import numpy as np

EARTH_RADIUS, FLATNESS = 6378137.0, 6.69437999014e-3
"""m at the equator; squared eccentricity (WGS 84)."""


def aligned(points: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """(n, 2) points turned and moved so that they lie best on (n, 2) reference."""
    p, q = points - points.mean(axis=0), reference - reference.mean(axis=0)
    angle = np.arctan2((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum())
    c, s = np.cos(angle), np.sin(angle)
    return p @ np.array([[c, s], [-s, c]]) + reference.mean(axis=0)


def rmse(t: np.ndarray, points: np.ndarray, reference_t: np.ndarray, reference: np.ndarray) -> float:
    """Root mean square distance (m) after alignment, of a way (n, 2) at times t (n,) from a reference (m, 2) at its
    times (m,).

    The way is taken at the reference's times; those that it does not cover are left out.
    """
    t, points = np.asarray(t, dtype=float), np.asarray(points, dtype=float)
    reference_t, reference = np.asarray(reference_t, dtype=float), np.asarray(reference, dtype=float)
    inside = (reference_t >= t[0]) & (reference_t <= t[-1])
    at = np.column_stack([np.interp(reference_t[inside], t, points[:, k]) for k in (0, 1)])
    difference = aligned(at, reference[inside]) - reference[inside]
    return float(np.sqrt((difference**2).sum(axis=1).mean()))


def local_plane(latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
    """(n, 2) metres east and north of the first of latitudes and longitudes (n,) in degrees; for ways of a few km."""
    turned = (np.asarray(longitude) - longitude[0] + 180.0) % 360.0 - 180.0  # the short way round, over 180 deg
    latitude, turned = np.radians(latitude), np.radians(turned)
    bent = 1.0 - FLATNESS * np.sin(latitude[0]) ** 2
    across, along = EARTH_RADIUS / np.sqrt(bent), EARTH_RADIUS * (1.0 - FLATNESS) / bent**1.5
    return np.column_stack([across * np.cos(latitude[0]) * turned, along * (latitude - latitude[0])])


def path_length(x: np.ndarray, y: np.ndarray, still: float = 0.02) -> float:
    """Length (m) of a path, in steps of at least `still` m, so that noise at rest adds nothing; jumps over 0.5 m are
    left out.
    """
    length, last = 0.0, None
    for point in zip(x, y):
        if last is None:
            last = point
            continue
        step = float(np.hypot(point[0] - last[0], point[1] - last[1]))
        if step >= still:
            length += step if step < 0.5 else 0.0
            last = point
    return length
