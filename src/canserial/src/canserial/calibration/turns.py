"""Two turns on the spot, one to each side, and the calibration that they give.

The motors' currents have a field of their own, which turns with the robot as hard iron does. It changes its sign with
the direction of the turn, so that turns to both sides tell the two apart. What an ellipse cannot show, a constant error
of the heading (the chip's mounting, and coefficient A of a ship's compass), takes a heading that is known at the start.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from canserial.calibration.iron import Ellipse, Iron, IronError, fitted_ellipse
from sara_common.repeatable import directions

SLOWEST = 0.05
"""rad/s; slower is no turn."""
SECTORS = 12
"""Of the circle; a turn is whole when there are fields of each."""
FEWEST = 60
"""Fields in each turn."""
LARGEST_RATIO = 2.0
"""Of the ellipse's axes: more distorts the field too much to be put right."""
LARGEST_RESIDUAL = 0.05
"""Of the radius, r.m.s.: more is a field that changed meanwhile."""
STRENGTHS = 0.5, 2.0
"""Of the measured radius to the earth's."""
LARGEST_WANDER = math.radians(5.0)
"""r.m.s. between compass and gyroscope along the turns."""
LEAST_EFFORT = 0.05
"""Of the motors, if it is they that turn the robot."""
FACING_SIGMA, MOUNTING_SIGMA = 0.5, 2.0
"""deg of the constant error where a heading was known at the start, and where none was."""


class Turned(NamedTuple):
    """iron: Iron. residual: uT r.m.s. from the circle. wander: rad r.m.s. between compass and gyroscope. scale: the
    angle by the compass over that by the gyroscope. ratio: of the ellipse's axes.
    """

    iron: Iron
    residual: float
    wander: float
    scale: float
    ratio: float


class Turns:
    """Collects fields while the robot turns."""

    def __init__(self) -> None:
        self._rows: list[tuple[float, ...]] = []
        self._seen: dict[int, set[int]] = {1: set(), -1: set()}

    def add(
        self,
        field: tuple[float, float, float],
        angle: float,
        rates: tuple[float, float, float],
        efforts: tuple[float, float],
    ) -> None:
        """field: measured, uT; angle: turned since any beginning by the gyroscope, rad, not wrapped, left positive;
        rates: rad/s; efforts: of the right and the left motor, -1..1.
        """
        if not all(map(math.isfinite, (*field, angle, *rates, *efforts))):
            return
        side = 0 if abs(rates[2]) < SLOWEST else 1 if rates[2] > 0.0 else -1
        if side:
            self._seen[side].add(math.floor(angle / math.tau * SECTORS) % SECTORS)
        self._rows.append((*field, angle, side, 0.5 * abs(efforts[0] - efforts[1]), *rates))

    @property
    def missing(self) -> tuple[float, float]:
        """rad of the circle that have not been seen yet while turning (left, right)."""
        left, right = (math.tau * (1.0 - len(self._seen[side]) / SECTORS) for side in (1, -1))
        return left, right

    def result(self, horizontal: float, down: float, gain: float, facing: float | None, north: float) -> Turned:
        """horizontal, down: the earth's field at this place, uT. gain: that of the angles. facing: the robot's yaw at
        the start, rad, None where it is not known. north: the yaw that faces magnetic north, rad. Raises IronError.
        """
        for side, left in zip(('left', 'right'), self.missing):
            if left:
                raise IronError(f'{math.degrees(left):.0f} deg of the turn to the {side} are missing')
        rows = np.array(self._rows)
        turning = rows[rows[:, 4] != 0.0]
        middles = []
        for side in (1, -1):
            of = turning[turning[:, 4] == side]
            if len(of) < FEWEST:
                raise IronError(f'{len(of)} fields in a turn are too few, {FEWEST} are needed: turn slower')
            middles.append(fitted_ellipse(of[:, :2]).centre)
        motors = 0.5 * (middles[0] - middles[1])
        level = turning[:, :2] - turning[:, 4:5] * motors
        ellipse = fitted_ellipse(level)
        residual = _judged(ellipse, level, horizontal)
        circle = (level - ellipse.centre) @ ellipse.matrix.T * horizontal
        scale, behind, wander = _against_the_gyroscope(circle, turning[:, 3] - rows[0, 3])
        yaw_sigma, turn = MOUNTING_SIGMA, 0.0
        if facing is not None:
            turn = math.remainder(north - behind - facing, math.tau)
            yaw_sigma = math.hypot(FACING_SIGMA, 0.5 * math.degrees(wander))
        flat = rotation(turn) @ ellipse.matrix * horizontal
        lift, *tilt = np.linalg.lstsq(np.column_stack((np.ones(len(circle)), circle)), turning[:, 2], rcond=None)[0]
        third = -np.array(tilt) @ (ellipse.matrix * horizontal)
        matrix = (*flat[0], 0.0, *flat[1], 0.0, *third, 1.0)
        offset = (*ellipse.centre, lift + down)  # the field points down, z up
        effort = float(turning[:, 5].mean())
        added = _plain(flat @ motors / effort) if effort > LEAST_EFFORT else (0.0, 0.0)
        rates = turning[:, 6:]
        lean = _plain(rates[:, :2].T @ rates[:, 2] / (rates[:, 2] @ rates[:, 2]))
        iron = Iron(*map(_plain, (offset, matrix)), horizontal, down, added, lean, gain * scale, float(yaw_sigma))
        faults = iron.faults()
        if faults:
            raise IronError('; '.join(faults))
        return Turned(iron, residual, wander, scale, ellipse.ratio)


def _judged(ellipse: Ellipse, points: np.ndarray, horizontal: float) -> float:
    """uT r.m.s. of the points from the circle. Raises IronError where the ellipse cannot be the earth's field."""
    away = np.linalg.norm((points - ellipse.centre) @ ellipse.matrix.T, axis=1) - 1.0
    residual = float(np.sqrt(np.mean(away**2)))
    if ellipse.ratio > LARGEST_RATIO:
        raise IronError(
            f'the field is {ellipse.ratio:.1f} times as strong to one side as to the other, at most {LARGEST_RATIO:g} '
            'can be put right: mount the chip further from iron'
        )
    if not STRENGTHS[0] <= ellipse.radius / horizontal <= STRENGTHS[1]:
        raise IronError(
            f'the horizontal field is {ellipse.radius:.0f} uT, at this place the earth has {horizontal:.0f}: there is '
            'iron nearby, or the place is wrong'
        )
    if residual > LARGEST_RESIDUAL:
        raise IronError(
            f'the fields lie {100.0 * residual:.0f} % off an ellipse, allowed are {100.0 * LARGEST_RESIDUAL:g}: turn '
            'on one spot, away from cars and steel'
        )
    return residual * horizontal


def _against_the_gyroscope(circle: np.ndarray, turned: np.ndarray) -> tuple[float, float, float]:
    """(scale, behind, wander) of fields (n, 2) and angles (n,): the compass's angle is -scale x turned + behind."""
    seen = np.unwrap(directions(circle))
    slope, behind = np.polyfit(turned, seen, 1)
    wander = float(np.sqrt(np.mean((seen - slope * turned - behind) ** 2)))
    if wander > LARGEST_WANDER or not 0.8 <= -slope <= 1.25:
        raise IronError(
            f'compass and gyroscope do not turn alike: {-slope:.2f} to 1, and {math.degrees(wander):.1f} deg r.m.s. '
            'apart; the axes of the chip must be those of the IMU'
        )
    return float(-slope), float(behind), wander


def rotation(angle: float) -> np.ndarray:
    """(2, 2) that turns vectors by an angle (rad), left positive."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array(((c, -s), (s, c)))


def _plain(values):
    return tuple(map(float, values))
