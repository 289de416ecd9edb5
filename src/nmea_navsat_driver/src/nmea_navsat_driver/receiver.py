"""What a receiver's sentences say: GGA gives the fix, GST its standard deviations, RMC velocity and time (NMEA 0183).

receiver = Receiver(DriverConfig(), report=print)
for message in receiver.on_line(b'$GPGGA,...*hh', now): ...     # Fix, Velocity, TimeReference
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import NamedTuple

from nmea_navsat_driver import fields as read
from nmea_navsat_driver.config import DriverConfig
from nmea_navsat_driver.sentences import Damaged, Sentence, parsed

NO_FIX, FIX, SBAS, GBAS = -1, 0, 1, 2
"""As sensor_msgs/NavSatStatus."""
UNKNOWN, APPROXIMATED, DIAGONAL = 0, 1, 2
"""As sensor_msgs/NavSatFix's covariance types."""
KNOT = 1852.0 / 3600.0
FRESH_S = 3.0
"""For how long a GST holds, s."""
_QUALITIES = {1: FIX, 2: SBAS, 3: FIX, 4: GBAS, 5: GBAS, 9: SBAS}
_NOWHERE = math.nan, math.nan, math.nan


class Fix(NamedTuple):
    """stamp: s, when the sentence came; status: NavSatStatus; latitude, longitude: deg; altitude: m above the
    ellipsoid, NaN if it is not known; variances: m2, east, north, up; covariance_type: of NavSatFix.
    """

    stamp: float
    status: int
    latitude: float
    longitude: float
    altitude: float
    variances: tuple[float, float, float]
    covariance_type: int


class Velocity(NamedTuple):
    """stamp: s; east, north: m/s."""

    stamp: float
    east: float
    north: float


class TimeReference(NamedTuple):
    """stamp: s, of this computer; utc: s since 1970, of the receiver."""

    stamp: float
    utc: float


Message = Fix | Velocity | TimeReference


class Receiver:
    """One receiver. report, inform: called with a sentence when something is wrong (each kind of damage once; each time
    that the receiver has no fix), and when there are fixes (again). `problems`: damaged sentences, counted by kind.

    Receivers that tell their deviations do so behind the fix. The first one after an outage waits for its own, at most
    until the next fix: there are none that still hold.
    """

    def __init__(
        self,
        config: DriverConfig,
        report: Callable[[str], None] = lambda sentence: None,
        inform: Callable[[str], None] = lambda sentence: None,
    ):
        self._config, self._report, self._inform = config, report, inform
        self.problems: Counter[str] = Counter()
        self.fixes = 0
        self.without_since: float | None = None
        self.heard: float | None = None  # s, of the last GGA
        self._found: bool | None = None  # None: nothing has come yet
        self._deviations: tuple[float, tuple[float, float, float]] | None = None
        self._tells = False  # whether there is GST
        self._waiting: tuple[Fix, int, float] | None = None  # for its deviations; quality, HDOP

    def on_line(self, line: bytes, now: float) -> list[Message]:
        """What a line without its end says that came at the time `now` (s); never raises for its bytes."""
        try:
            sentence = parsed(line)
            return [] if sentence is None else self._messages(sentence, now)
        except Damaged as damage:
            self.problems[damage.kind] += 1
            if self.problems[damage.kind] == 1:
                self._report(f'{damage}; further ones are counted only')
            return []

    def _messages(self, sentence: Sentence, now: float) -> list[Message]:
        if sentence.kind == 'GGA':
            return self._gga(sentence.fields, now)
        if sentence.kind == 'RMC':
            return self._rmc(sentence.fields, now)
        if sentence.kind == 'GST':
            sigmas = [read.number(sentence.fields, i, 0.0, 1e6) for i in (6, 5, 7)]
            self._tells = True
            if None not in sigmas and min(sigmas) > 0.0:
                self._deviations = now, tuple(sigmas)
            return self._released(now)
        return []

    def _gga(self, fields, now):
        lost = self.silent(now) or not self._found
        self.heard = now
        quality = read.number(fields, 5, 0, 9)
        latitude, longitude = read.angle(fields, 1, 90.0, 'NS'), read.angle(fields, 3, 180.0, 'EW')
        status = _QUALITIES.get(int(quality or 0), NO_FIX)
        if status == NO_FIX or latitude is None or longitude is None:
            self._has_fix(False, now)
            return [*self._released(now), Fix(now, NO_FIX, *_NOWHERE, (0.0, 0.0, 0.0), UNKNOWN)]
        hdop = read.number(fields, 7, 0.0, 1e3)
        above_sea, geoid = read.number(fields, 8, -1e5, 1e7), read.number(fields, 10, -1e3, 1e3)
        altitude = math.nan if above_sea is None or geoid is None else above_sea + geoid
        waits = self._tells and lost and self._told(now) is None
        found = self._released(now)
        fix = Fix(now, status, latitude, longitude, altitude, (0.0, 0.0, 0.0), UNKNOWN)
        self._waiting = fix, int(quality), hdop or 1.0
        self.fixes += 1
        self._has_fix(True, now)
        return found if waits else [*found, *self._released(now)]

    def silent(self, now: float) -> bool:
        """Whether it has said nothing of its place for FRESH_S, by the time `now` (s)."""
        return self.heard is None or not 0.0 <= now - self.heard <= FRESH_S

    def _released(self, now):
        """The fix that waits, if one does, with what is known of its deviations now."""
        if self._waiting is None:
            return []
        (fix, quality, hdop), self._waiting = self._waiting, None
        variances, kind = self._variances(quality, hdop, now)
        return [fix._replace(variances=variances, covariance_type=kind)]

    def _told(self, now):
        """The deviations that it told and that still hold (m), or None."""
        told = self._deviations
        return told[1] if told is not None and 0.0 <= now - told[0] <= FRESH_S else None

    def _variances(self, quality, hdop, now):
        told = self._told(now)
        if told is not None:
            return tuple(sigma * sigma for sigma in told), DIAGONAL
        sigma = getattr(self._config, f'epe_quality{quality}', self._config.epe_quality1) * hdop
        return (sigma * sigma, sigma * sigma, 4.0 * sigma * sigma), APPROXIMATED

    def _rmc(self, fields, now):
        found: list[Message] = []
        utc = read.utc(fields, 0, 8)
        if utc is not None:
            found.append(TimeReference(now, utc.timestamp()))
        speed, course = read.number(fields, 6, 0.0, 1e4), read.number(fields, 7, 0.0, 360.0)
        if read.text(fields, 1) == 'A' and speed is not None and course is not None:
            v, clockwise = KNOT * speed, math.radians(course)
            found.append(Velocity(now, v * math.sin(clockwise), v * math.cos(clockwise)))
        return found

    def _has_fix(self, has, now):
        """Tell each outage once, and its end."""
        if has == self._found:
            return
        if not has:
            self.without_since = now
            self._report('the receiver has no fix')
        elif self._found is None:
            self._inform('the receiver has a fix')
        else:
            self._inform(f'the receiver has a fix again, after {now - self.without_since:.1f} s without')
        if has:
            self.without_since = None
        self._found = has
