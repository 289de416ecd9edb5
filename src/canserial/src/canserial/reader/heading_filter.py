"""The heading from the gyroscope and the magnetic field: an extended Kalman filter.

State x = (yaw, gyro's offset b, gyro's scale error e, what is left of the hard iron h, what the right and the left
motor add at full effort m_right, m_left: three each); rad, rad/s, -, uT. The yaw follows the rate w,
yaw' = (1 + e) w - b. A levelled, calibrated field is

    z = (H cos(north - yaw), H sin(north - yaw), -D) + h + u_right m_right + u_left m_left + what a place adds,

with H and D the earth's field, horizontal and down, and u the motors' efforts. What a place adds (steel, cables) stays
while the robot does, so ten fields of one place say no more than one. A field therefore counts by the share of a new
place that was reached since the last: its variance is that of a place divided by the share. Coming to rest counts as
a new place, for the motors add nothing there. While a robot stands, its rate is zero and what the gyroscope says is its
offset.
"""

from __future__ import annotations

import math

import numpy as np

from canserial.calibration.iron import Iron
from canserial.reader.compass_config import CompassConfig
from sara_common.planar import wrap_exact
from sara_common.repeatable import times

YAW, OFFSET, SCALE, IRON, RIGHT, LEFT = 0, 1, 2, slice(3, 6), slice(6, 9), slice(9, 12)
STATES = 12
GATE = 11.3
"""Chi-squared of three degrees of freedom, 1 in 100."""
SCALE_SIGMA, IRON_SIGMA = 0.001, 0.2
"""Of the gyroscope's scale by the turns of a calibration; uT of its centre."""
OFFSET_SIGMA = math.radians(0.01)
"""rad/s that a calibration at rest leaves."""
RATE_NOISE = math.radians(0.147)
"""rad/s of a mean over 0.05 s (thesis, table 4.5, times 2)."""
RATE_PERIOD = 0.05
MOTOR_SIGMA = 1.0
"""uT at full effort that turns on the spot do not show."""
MOTOR_WANDER = 0.02
"""uT per root of a rad that the wheels roll: efforts are not currents."""
IRON_WANDER = 0.01
"""uT per root of a second."""
ANY_YAW = math.pi**2 / 3.0
"""rad2, of a yaw that may be any."""
FIELD_NOISE = 0.3
"""uT of a measurement."""


class HeadingFilter:
    """`x`, `P`: state and covariance, None before the first field."""

    def __init__(self, iron: Iron, config: CompassConfig, gain: float) -> None:
        """gain: that of the rates."""
        self._iron, self._config, self._scale = iron, config, iron.gain / gain - 1.0
        motors = 0.5 * np.array((*iron.motors, 0.0))
        self._motors = np.concatenate((motors, -motors))  # turning left, the left wheel rolls backward
        self._motor_sigma = MOTOR_SIGMA + float(np.abs(motors).max())
        self.x: np.ndarray | None = None
        self.P: np.ndarray | None = None
        self._share, self._still = 0.0, True

    @property
    def started(self) -> bool:
        """Whether there is a heading."""
        return self.x is not None

    @property
    def yaw(self) -> float:
        """rad, in (-pi, pi]."""
        return wrap_exact(float(self.x[YAW]))

    @property
    def yaw_variance(self) -> float:
        """rad2, with the calibration's constant error."""
        return min(float(self.P[YAW, YAW]) + math.radians(self._iron.yaw_sigma) ** 2, ANY_YAW)

    def rate(self, measured: float) -> float:
        """The yaw rate without the gyroscope's errors, rad/s."""
        return (1.0 + float(self.x[SCALE])) * measured - float(self.x[OFFSET])

    def predict(self, dt: float, rate: float, rolled: float, still: bool, unseen: float = 0.0) -> None:
        """Go on by dt (s) at the measured rate (rad/s), while the wheels rolled so many rad; still: the robot stands.
        unseen: rad2 that the yaw's variance grows by, for what the gyroscope missed.
        """
        if self.x is None:
            return
        x, P = self.x, self.P
        if still:
            self._rest(rate)
            P, turn = self.P, 0.0
            self._share += 0.0 if self._still else 1.0  # without the motors' field a place is another one
        else:
            turn = self.rate(rate) * dt
            x[YAW] += turn
            F = np.eye(STATES)
            F[YAW, OFFSET], F[YAW, SCALE] = -dt, rate * dt
            self.P = P = F @ P @ F.T
            P[YAW, YAW] += RATE_NOISE**2 * RATE_PERIOD * dt
        self._still = still
        P[YAW, YAW] += unseen
        P[OFFSET, OFFSET] += self._config.compass_drift**2 * dt
        wander = (IRON_WANDER**2 * dt,) * 3 + (MOTOR_WANDER**2 * rolled,) * 6
        P[range(3, STATES), range(3, STATES)] += wander
        config = self._config
        self._share += rolled / config.compass_place_roll + abs(turn) / config.compass_place_turn

    def _rest(self, rate: float) -> None:
        """The rate of a robot that stands: the offset, measured."""
        P = self.P
        gain = P[:, OFFSET] / (P[OFFSET, OFFSET] + RATE_NOISE**2)
        self.x += gain * (rate - self.x[OFFSET])
        self.P = P - np.outer(gain, P[OFFSET])

    def begin(self, field: tuple[float, float, float], seen: float) -> None:
        """Take the yaw of a levelled field, uT. seen: uT2, what is seen of the place's disturbance."""
        self.x = np.zeros(STATES)
        self.x[YAW] = self._config.compass_north - math.atan2(field[1], field[0])
        self.x[SCALE] = self._scale
        self.x[6:] = self._motors
        sigmas = (
            math.sqrt(self._config.compass_place_sigma**2 + seen) / self._iron.horizontal,
            OFFSET_SIGMA,
            SCALE_SIGMA,
            *(IRON_SIGMA,) * 3,
            *(self._motor_sigma,) * 6,
        )
        self.P = np.diag(np.square(sigmas))
        self._share = 0.0

    def correct(
        self, field: tuple[float, float, float], ahead: float, efforts: tuple[float, float], seen: float
    ) -> bool:
        """A levelled field, uT, that was measured when the yaw was `ahead` (rad) of the filter's; efforts: of the
        right and left motor, -1..1; seen: as in `begin`. False, and nothing is learned, where it contradicts the yaw.
        """
        angle = self._config.compass_north - float(self.x[YAW]) - ahead
        ahead_x, ahead_y = self._iron.horizontal * math.cos(angle), self._iron.horizontal * math.sin(angle)
        y = np.array(field) - (ahead_x, ahead_y, -self._iron.down) - self.added(efforts)
        J, same = np.zeros((3, STATES)), np.eye(3)
        J[:2, YAW] = ahead_y, -ahead_x
        J[:, IRON], J[:, RIGHT], J[:, LEFT] = same, efforts[0] * same, efforts[1] * same
        PJ = self.P @ J.T
        S = J @ PJ
        if y @ np.linalg.solve(S + self._config.compass_gate_sigma**2 * same, y) > GATE:
            return False
        share, self._share = min(self._share, 1.0), 0.0
        if share > 0.0:
            place = self._config.compass_place_sigma**2 + seen
            K = np.linalg.solve(S + (place / share + FIELD_NOISE**2) * same, PJ.T).T
            self.x += times(K, y)
            P = self.P - K @ PJ.T
            self.P = 0.5 * (P + P.T)
        return True

    def added(self, efforts: tuple[float, float]) -> np.ndarray:
        """(3,) uT that the motors and what is left of the hard iron add."""
        if self.x is None:
            return np.zeros(3)
        return self.x[IRON] + efforts[0] * self.x[RIGHT] + efforts[1] * self.x[LEFT]


def effort(speed: float) -> float:
    """-1..1 of a motor whose wheel turns at this speed (rad/s): much of the current is friction."""
    return speed / (1.0 + abs(speed))
