"""What the chair's own iron does to the magnetometer, and how it is taken away.

    field = matrix (measured - offset)
Hard iron (magnets) shifts the field by `offset`; soft iron distorts it linearly, which `matrix` undoes. On a level
floor a turning robot sees an ellipse: its centre is the hard iron, and the matrix that makes a circle of it the soft
iron. The ellipse is fitted as Halir and Flusser do (Numerically stable direct least squares fitting of ellipses, 1998).
An ellipse does not show how far it is turned: of the matrices that make a circle of it, the symmetric one is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sara_common.config import is_number

LARGEST_OFFSET, LARGEST_GAIN, LARGEST_LEAN = 300.0, 3.0, 0.2
"""uT, of an element of the matrix, rad: beyond, no magnetometer on a robot measured that."""


class IronError(ValueError):
    """One sentence: why these fields give no calibration."""


@dataclass(frozen=True)
class Iron:
    """offset: three uT. matrix: nine numbers, row by row. horizontal, down: the earth's field there, uT.
    motors: two uT, forward and left, what the motors add when they turn the robot left on the spot at full effort.
    lean: rad/s about x and y that the gyroscope, which is not mounted level, shows for each rad/s of a level turn.
    gain: factor on the gyroscope's yaw rate by the same turns. yaw_sigma: deg, of the heading's constant error.
    """

    offset: tuple[float, ...]
    matrix: tuple[float, ...]
    horizontal: float
    down: float
    motors: tuple[float, ...] = (0.0, 0.0)
    lean: tuple[float, ...] = (0.0, 0.0)
    gain: float = 1.0
    yaw_sigma: float = 1.0

    @property
    def total(self) -> float:
        """The strength of the earth's field, uT."""
        return math.hypot(self.horizontal, self.down)

    @property
    def dip(self) -> float:
        """rad by which the field points below the horizon."""
        return math.atan2(self.down, self.horizontal)

    def corrected(self, measured: tuple[float, float, float]) -> tuple[float, float, float]:
        """The field along the robot's axes, uT, without its iron."""
        x, y, z = (value - offset for value, offset in zip(measured, self.offset))
        a, b, c, d, e, f, g, h, i = self.matrix
        return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z

    def fields(self) -> dict[str, object]:
        """Its values under the names that a calibration file gives them."""
        return {f'compass_{name}': value for name, value in vars(self).items()}

    def faults(self) -> list[str]:
        """Sentences about what cannot be, empty if it is plausible."""
        faults = []
        for name, count, limit in (
            ('offset', 3, LARGEST_OFFSET),
            ('matrix', 9, LARGEST_GAIN),
            ('motors', 2, LARGEST_OFFSET),
            ('lean', 2, LARGEST_LEAN),
        ):
            value = getattr(self, name)
            if not (
                isinstance(value, tuple)
                and len(value) == count
                and all(is_number(v) and abs(v) <= limit for v in value)
            ):
                faults.append(f'{name} is {value!r}, allowed are {count} numbers of -{limit:g} to {limit:g}')
        for name, low, high in (
            ('horizontal', 1.0, 70.0),
            ('down', -70.0, 70.0),
            ('gain', 0.5, 2.0),
            ('yaw_sigma', 0.0, 180.0),
        ):
            value = getattr(self, name)
            if not (is_number(value) and low <= value <= high):
                faults.append(f'{name} is {value!r}, allowed is {low:g} to {high:g}')
        return faults


class Ellipse(NamedTuple):
    """centre: (2,); matrix: (2, 2), symmetric, makes a circle of radius 1 of it; radius: mean of the half-axes; ratio:
    of the longer one to the shorter.
    """

    centre: np.ndarray
    matrix: np.ndarray
    radius: float
    ratio: float


def fitted_ellipse(points: np.ndarray) -> Ellipse:
    """The ellipse of points (n, 2), n >= 6. Raises IronError where they lie on none."""
    middle = points.mean(axis=0)
    size = float(np.abs(points - middle).max())
    if not (len(points) >= 6 and math.isfinite(size) and size > 0.0):
        raise IronError('the field did not change while the robot turned')
    x, y = ((points - middle) / size).T  # the fit's numbers are of order 1 then
    quadratic, linear = np.column_stack((x * x, x * y, y * y)), np.column_stack((x, y, np.ones_like(x)))
    try:
        substitute = -np.linalg.solve(linear.T @ linear, linear.T @ quadratic)
        reduced = quadratic.T @ quadratic + quadratic.T @ linear @ substitute
        values, vectors = np.linalg.eig(np.array((reduced[2] / 2.0, -reduced[1], reduced[0] / 2.0)))
    except np.linalg.LinAlgError:
        raise IronError('the fields lie on a straight line') from None
    vectors = np.real(vectors[:, np.isreal(values)])
    vectors = vectors[:, 4.0 * vectors[0] * vectors[2] - vectors[1] ** 2 > 0.0]
    if vectors.shape[1] != 1:
        raise IronError('the fields lie on no ellipse')
    a, b, c = vectors[:, 0]
    d, e, f = substitute @ vectors[:, 0]
    form, gradient = np.array(((a, b / 2.0), (b / 2.0, c))), np.array((d, e))
    centre = -0.5 * np.linalg.solve(form, gradient)
    axes, turned = np.linalg.eigh(form / (centre @ form @ centre - f))  # 1 / half-axis squared
    if not axes.min() > 0.0:
        raise IronError('the fields lie on no ellipse')
    scales = np.sqrt(axes)
    matrix = (turned * scales) @ turned.T / size
    return Ellipse(middle + size * centre, matrix, size * float((1.0 / scales).mean()), float(scales[1] / scales[0]))
