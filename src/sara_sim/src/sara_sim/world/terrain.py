"""Ramps and thresholds: rectangles of the floor that slope or are higher, and the attitude of a chair on them.

The chair's axis from rear to front wheels is a line of length `wheelbase`; the share of it that lies on a ramp is exact
(clipping of a line against a rectangle, Liang and Barsky, 1984), so that the chair tips over an edge as its wheels pass
it, without a jump.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from math import atan, copysign, cos, pi, sin, sqrt, tan

from sara_common.config import is_number

PATCH = 0.05  # m of a tyre that touch the floor
HIGHEST = 0.03  # m: what is higher is a kerb


class TerrainError(ValueError):
    """A ramp or threshold that cannot be; the text says why."""


def _faults(of, *sizes: str) -> list[str]:
    """Sentences: which fields of a dataclass are no numbers, and which `sizes` are not above 0."""
    wrong = [field.name for field in fields(of) if not is_number(getattr(of, field.name))]
    faults = [f'{name} is {getattr(of, name)!r}, allowed is a finite number' for name in wrong]
    return faults or [
        f'{name} is {getattr(of, name)!r}, allowed are numbers above 0' for name in sizes if getattr(of, name) <= 0
    ]


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
        faults = _faults(self, 'length', 'width')
        if not faults and abs(self.slope) > math.radians(20.0):
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


@dataclass(frozen=True)
class Threshold:
    """A strip of the floor, centred on (x, y), m, that is `height` (m) higher, 0.03 at most; `yaw` (rad): the way over
    it, along its `length`; `width`: m, across that.
    """

    x: float
    y: float
    length: float
    width: float
    yaw: float
    height: float

    def __post_init__(self):
        faults = _faults(self, 'length', 'width', 'height')
        if not faults and self.height > HIGHEST:
            faults.append(f'height is {self.height!r}, allowed are heights up to {HIGHEST:g} m')
        if faults:
            raise TerrainError('; '.join(faults))

    def under(self, x: float, y: float, radius: float) -> tuple[float, float]:
        """(m that the hub of a wheel of `radius`, m, at (x, y) is lifted; its rise per m towards `yaw`). A rigid disc
        begins to rise sqrt(h (2 r - h)) before an edge of height h; the tyre spreads this by PATCH, as a cosine.
        """
        c, s = cos(self.yaw), sin(self.yaw)
        along = c * (x - self.x) + s * (y - self.y)
        if abs(c * (y - self.y) - s * (x - self.x)) > self.width / 2:
            return 0.0, 0.0
        climb = sqrt(self.height * (2.0 * radius - self.height)) + PATCH
        share = (abs(along) - 0.5 * (self.length - PATCH)) / climb
        if not 0.0 < share < 1.0:
            return (self.height if share <= 0.0 else 0.0), 0.0
        steep = 0.5 * pi * self.height / climb
        return 0.5 * self.height * (1.0 + cos(pi * share)), -copysign(steep * sin(pi * share), along)


def bump(
    thresholds: list[Threshold], pose: tuple[float, float, float], wheelbase: float, radius: float
) -> tuple[float, float]:
    """(pitch, steepness) of a chair at a pose (x, y, yaw) whose wheels, of `radius`, roll over thresholds. Pitch: rad,
    as in `attitude`. Steepness: rise per m ahead, mean of front and rear wheels, which each carry half the weight.
    """
    x, y, yaw = pose
    lifts, rises = [0.0, 0.0], 0.0
    for axle, ahead in enumerate((0.5 * wheelbase, -0.5 * wheelbase)):
        for threshold in thresholds:
            lift, rise = threshold.under(x + ahead * cos(yaw), y + ahead * sin(yaw), radius)
            lifts[axle] += lift
            rises += 0.5 * rise * cos(yaw - threshold.yaw)
    return -atan((lifts[0] - lifts[1]) / wheelbase), rises
