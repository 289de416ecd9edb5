"""A receiver's fixes as plain data, and which of them can be used."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sara_localization.gps.grid import HIGHEST, NoPlace, place
from sara_localization.inputs.raw_measurement import Problem

NO_FIX = -1
"""sensor_msgs/NavSatStatus.STATUS_NO_FIX."""
UNKNOWN, KNOWN = 0, 3
"""sensor_msgs/NavSatFix.COVARIANCE_TYPE_*."""
SMALLEST_VARIANCE, LARGEST_VARIANCE = 1e-6, 1e6
"""m2: no receiver knows its place to a millimetre, and one that does not know it within a kilometre has no fix."""
_UNCORRELATED = 1e-9
"""Least eigenvalue of a covariance, of the largest one."""


class FixData(NamedTuple):
    """A place on the earth (sensor_msgs/NavSatFix).

    Attributes:
        stamp: s; frame_id: of the antenna; status: NO_FIX, or what helped to find it.
        latitude, longitude: deg; altitude: m above the ellipsoid.
        covariance: (3, 3) m2 of east, north, up; covariance_type: UNKNOWN, or how it is known.
    """

    stamp: float
    frame_id: str
    status: int
    latitude: float
    longitude: float
    altitude: float
    covariance: np.ndarray
    covariance_type: int = KNOWN


def usable(fix: FixData, zero_altitude: bool, assumed_sigma: float) -> tuple[FixData | None, list[Problem]]:
    """The fix with what is missing in it filled in, None where it must be dropped; and what is wrong with it.

    zero_altitude: altitudes do not count, and may be no number. assumed_sigma: m, horizontally, of a fix that does not
    say how exact it is; twice that in height.
    """
    why = _dropped(fix, zero_altitude)
    if why:
        return None, [why]
    if not math.isfinite(fix.altitude):
        fix = fix._replace(altitude=0.0)
    covariance, problem = _covariance(fix, assumed_sigma, zero_altitude)
    if covariance is None:
        return None, [problem]
    latitude, longitude = place(fix.latitude, fix.longitude)
    fix = fix._replace(latitude=latitude, longitude=longitude, covariance=covariance)
    return fix, [problem] if problem else []


def _dropped(fix, zero_altitude):
    if not (math.isfinite(fix.stamp) and fix.stamp > 0.0):
        return Problem('no_stamp', 'a fix has no time stamp: dropped. Its driver must set header.stamp')
    if fix.status <= NO_FIX:
        return Problem('no_fix', 'the receiver says that it has no fix: such messages are dropped')
    try:
        place(fix.latitude, fix.longitude)
    except NoPlace as error:
        return Problem('bad_place', f'a fix is dropped: {error}')
    if not zero_altitude and not math.isfinite(fix.altitude):
        return Problem(
            'no_altitude',
            f'a fix is dropped: its altitude is {fix.altitude:g}. With zero_altitude: true such fixes are used',
        )
    if math.isfinite(fix.altitude) and abs(fix.altitude) > HIGHEST:
        return Problem('bad_altitude', f'a fix is dropped: its altitude is {fix.altitude:g} m')
    return None


def _covariance(fix, assumed_sigma, zero_altitude):
    """(the covariance to use, what is wrong with the fix's own or None); (None, why) for a fix to be dropped."""
    own = np.array(fix.covariance, dtype=float).reshape(3, 3)
    variances = own.diagonal()
    assumed = np.diag([assumed_sigma**2, assumed_sigma**2, 4.0 * assumed_sigma**2])
    if fix.covariance_type == UNKNOWN or not variances.any():
        return assumed, Problem(
            'no_covariance', f'fixes do not say how exact they are: {assumed_sigma:g} m is assumed (assumed_sigma)'
        )
    if zero_altitude and not variances[2] >= SMALLEST_VARIANCE:  # a fix in the plane has none of its height
        own = np.diag([*variances[:2], LARGEST_VARIANCE])
        variances = own.diagonal()
    huge = variances > LARGEST_VARIANCE  # infinity, too
    if huge[:2].any():
        return None, Problem(
            'huge_covariance',
            f'a fix is dropped: its variance of {variances[:2][huge[:2]].max():g} m2 says that its place is not known',
        )
    if huge[2]:  # the height is not known
        own = np.diag([*variances[:2], LARGEST_VARIANCE])
    if not (np.isfinite(own).all() and variances.min() >= SMALLEST_VARIANCE):
        told = ' '.join(f'{v:g}' for v in variances)
        return assumed, Problem(
            'bad_covariance',
            f'the variances of a fix are {told} m2, allowed are numbers from {SMALLEST_VARIANCE:g}: '
            f'{assumed_sigma:g} m is assumed',
        )
    own = 0.5 * (own + own.T)
    eigenvalues = np.linalg.eigvalsh(own)
    if eigenvalues[0] <= _UNCORRELATED * eigenvalues[2] and np.count_nonzero(own) > 3:
        return np.diag(variances), Problem(
            'bad_correlations', 'the correlations of a fix are impossible: its variances alone are used'
        )
    return own, None
