"""Where a robot's world frame lies on the earth: what takes latitudes and longitudes to its coordinates and back."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_localization.geometry.rigid import Transform, Vector, quaternion_from_rpy, rotation_matrix
from sara_localization.gps.grid import Grid, NoPlace, level


class Anchor(NamedTuple):
    """A place on the earth (deg, m), the point of the world frame that is there (m), and the heading of the world's x
    axis: rad, 0 true east, counter-clockwise.
    """

    latitude: float
    longitude: float
    altitude: float
    point: Vector
    heading: float


class WorldFrame:
    """The world frame of an anchor, in the coordinates of a grid.

    The frame is level: its z is the altitude less a constant. Raises NoPlace for an anchor that the grid does not
    reach.
    """

    def __init__(self, anchor: Anchor, grid: Grid):
        level(anchor.altitude)
        self.anchor, self.grid = anchor, grid
        x, y = grid.forward(anchor.latitude, anchor.longitude, anchor.altitude)
        self.convergence = grid.convergence(anchor.latitude, anchor.longitude)
        turn = Transform(rotation=quaternion_from_rpy(0.0, 0.0, anchor.heading + self.convergence))
        moved = turn.apply(anchor.point)
        self.grid_from_world = Transform((x - moved[0], y - moved[1], anchor.altitude - moved[2]), turn.rotation)
        self._world_from_east = rotation_matrix(quaternion_from_rpy(0.0, 0.0, -anchor.heading))

    def description(self) -> str:
        """Where the frame is, in a sentence."""
        a = self.anchor
        x, y, z = a.point
        heading, convergence = math.degrees(a.heading), math.degrees(self.convergence)
        return (
            f'latitude {a.latitude:.7f}, longitude {a.longitude:.7f}, altitude {a.altitude:.2f} is x {x:.2f}, '
            f'y {y:.2f}, z {z:.2f} of the world frame; its x axis is {heading:.2f} deg counter-clockwise from east; '
            f'{self.grid.name}, whose north is {convergence:.3f} deg clockwise from the true one there'
        )

    def from_earth(self, latitude: float, longitude: float, altitude: float) -> Vector:
        """The point (m) of a place (deg, m). Raises NoPlace."""
        level(altitude)
        x, y = self.grid.forward(latitude, longitude, altitude)
        return self.grid_from_world.inverse().apply((x, y, altitude))

    def to_earth(self, point: Vector) -> tuple[float, float, float]:
        """Latitude, longitude (deg), altitude (m) of a point (m). Raises NoPlace."""
        if not all(map(math.isfinite, point)):
            raise NoPlace('the point ({:g}, {:g}, {:g}) m is not finite'.format(*point))
        x, y, altitude = self.grid_from_world.apply(point)
        level(altitude)
        return (*self.grid.inverse(x, y, altitude), altitude)

    def covariance_from_earth(self, covariance: np.ndarray) -> np.ndarray:
        """A covariance (3, 3) of east, north, up along the axes of the world."""
        return self._world_from_east @ covariance @ self._world_from_east.T

    def covariance_to_earth(self, covariance: np.ndarray) -> np.ndarray:
        """A covariance (3, 3) along the axes of the world as one of east, north, up."""
        return self._world_from_east.T @ covariance @ self._world_from_east
