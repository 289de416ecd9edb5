"""Ramps: rectangles of the floor that slope, and the attitude of a chair that stands on them.

The chair's axis from rear to front wheels is a line of length `wheelbase`; the share of it that lies on a ramp is exact
(clipping of a line against a rectangle, Liang and Barsky, 1984), so that the chair tips over an edge as its wheels pass
it, without a jump.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from math import atan, cos, sin, tan

from sara_common.config import is_number


class TerrainError(ValueError):
    """A ramp that cannot be; the text says why."""


@dataclass(frozen=True)
class Ramp:
    """A rectangle centred on (x, y), m; `yaw` (rad): the way uphill, along its `length`; `slope`: rad, at most 20
    degrees.
    """

    x: float
    y: float
    length: float
    width: float
    yaw: float
    slope: float

    def __post_init__(self):
        faults = [
            f'{field.name} is {getattr(self, field.name)!r}, allowed is a finite number'
            for field in fields(self)
            if not is_number(getattr(self, field.name))
        ]
        if not faults:
            faults += [
                f'{name} is {getattr(self, name)!r}, allowed are numbers above 0'
                for name in ('length', 'width')
                if getattr(self, name) <= 0
            ]
            if abs(self.slope) > math.radians(20.0):
                faults.append(f'slope is {self.slope!r}, allowed are slopes within 20 degrees (0.349 rad)')
        if faults:
            raise TerrainError('; '.join(faults))

    def share(self, x: float, y: float, dx: float, dy: float) -> float:
        """Share of the line from (x, y) - (dx, dy) to (x, y) + (dx, dy) that lies on the ramp."""
        c, s = cos(self.yaw), sin(self.yaw)
        low, high = -1.0, 1.0
        for offset, along, half in (
            (c * (x - self.x) + s * (y - self.y), c * dx + s * dy, self.length / 2),
            (c * (y - self.y) - s * (x - self.x), c * dy - s * dx, self.width / 2),
        ):
            if abs(along) < 1e-12:
                if abs(offset) > half:
                    return 0.0
                continue
            ends = sorted(((-half - offset) / along, (half - offset) / along))
            low, high = max(low, ends[0]), min(high, ends[1])
        return max(0.5 * (high - low), 0.0)


def attitude(ramps: list[Ramp], x: float, y: float, yaw: float, wheelbase: float) -> tuple[float, float]:
    """(roll, pitch) of a chair at (x, y, yaw), rad: a nose that points up is a negative pitch (REP-103)."""
    dx, dy = 0.5 * wheelbase * cos(yaw), 0.5 * wheelbase * sin(yaw)
    rise_x = rise_y = 0.0
    for ramp in ramps:
        share = ramp.share(x, y, dx, dy)
        if share:
            steep = share * tan(ramp.slope)
            rise_x += steep * cos(ramp.yaw)
            rise_y += steep * sin(ramp.yaw)
    if not rise_x and not rise_y:
        return 0.0, 0.0
    c, s = cos(yaw), sin(yaw)
    pitch = -atan(c * rise_x + s * rise_y)
    # A left side that is higher than the right rolls the chair to the right: positive roll.
    return atan((c * rise_y - s * rise_x) * cos(pitch)), pitch
