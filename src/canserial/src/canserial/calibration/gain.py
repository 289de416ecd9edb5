"""The gain k of the turned angle, from turns of known size (thesis table 4.11).

A gyroscope's scale error is a straight line through the origin: true = k measured. With n pairs, least squares gives

    k = sum(t m) / sum(m^2),   s(k) = sqrt(sum((t - k m)^2) / ((n - 1) sum(m^2)))

The residuals t - k m show whether it is a line at all: an angle that was misread stands out. Turning both ways cancels
what an error of the offset adds, for that has the same sign in both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from canserial.calibration.calibration_file import GAIN_LIMITS

ANGLES = (90.0, 180.0, 270.0, 360.0)  # deg, table 4.11
SMALLEST = 10.0  # deg; the reading error of the user would drown the scale error of a smaller turn


class GainError(ValueError):
    """One sentence: why these turns give no gain."""


@dataclass(frozen=True)
class GainResult:
    """gain: k. error: its standard error. rows: (true, measured, k measured) per turn, deg."""

    gain: float
    error: float
    rows: tuple

    @property
    def residuals(self) -> tuple[float, ...]:
        """true - k measured of each turn, deg."""
        return tuple(true - corrected for true, _, corrected in self.rows)

    @property
    def worst(self) -> float:
        """The largest residual without its sign, deg."""
        return max(map(abs, self.residuals))

    def table(self) -> list[str]:
        """The lines of the table: true, measured, after k, left over."""
        lines = [f'{"true":>8} {"measured":>9} {"after k":>8} {"left":>7}   deg']
        lines += [
            f'{true:8.1f} {measured:9.2f} {corrected:8.2f} {true - corrected:+7.2f}'
            for true, measured, corrected in self.rows
        ]
        return [*lines, f'k = {self.gain:.4f} +- {self.error:.4f}']


class GainProcedure:
    """Collects pairs of true and measured angles.

    angles: deg, the turns to be made, each counted from the start, left positive (default: table 4.11's, both ways).
    max_residual: deg, more says that an angle was misread or that the scale error is no straight line.
    """

    def __init__(
        self, angles: Sequence[float] = (*ANGLES, *(-angle for angle in ANGLES)), max_residual: float = 5.0
    ) -> None:
        angles = tuple(angles)
        wrong = [angle for angle in angles if not (math.isfinite(angle) and abs(angle) >= SMALLEST)]
        if wrong:
            raise GainError(
                f'angles hold {wrong}, allowed are {SMALLEST:g} deg and more, and negative ones to the right'
            )
        if len(angles) < 2:
            raise GainError(f'angles are {angles}, allowed are two and more')
        self.angles = angles
        self.max_residual = max_residual
        self._pairs = []

    @property
    def next_angle(self) -> float | None:
        """The turn to be made next, deg, or None after the last."""
        return self.angles[len(self._pairs)] if len(self._pairs) < len(self.angles) else None

    def add(self, true: float, measured: float) -> None:
        """A turn (deg, left positive): its true angle and what the gyroscope says without gain.

        Raises GainError if the two cannot belong together; then the pair is not kept.
        """
        if not (math.isfinite(true) and math.isfinite(measured)):
            raise GainError(f'a turn of {true} deg measured as {measured} deg')
        low, high = GAIN_LIMITS
        if not abs(true) >= SMALLEST or not low <= (true / measured if measured else math.inf) <= high:
            raise GainError(
                f'a turn of {true:g} deg was measured as {measured:.1f} deg, which no scale error explains: '
                'wrong angle, wrong direction or more than was asked for'
            )
        self._pairs.append((float(true), float(measured)))

    def result(self) -> GainResult:
        """The GainResult. Raises GainError with fewer than two turns or when they lie on no straight line."""
        if len(self._pairs) < 2:
            raise GainError(f'{len(self._pairs)} turns give no gain: two and more are needed')
        square = sum(measured * measured for _, measured in self._pairs)
        gain = sum(true * measured for true, measured in self._pairs) / square
        rows = tuple((true, measured, gain * measured) for true, measured in self._pairs)
        rest = sum((true - corrected) ** 2 for true, _, corrected in rows)
        result = GainResult(gain, math.sqrt(rest / (len(rows) - 1) / square), rows)
        if result.worst > self.max_residual:
            true, measured, corrected = max(rows, key=lambda row: abs(row[0] - row[2]))
            raise GainError(
                f'the turn of {true:g} deg (measured {measured:.1f}, after k {corrected:.1f}) lies '
                f'{abs(true - corrected):.1f} deg off the line, allowed is {self.max_residual:g}: repeat the turns'
            )
        return result
