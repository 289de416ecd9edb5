"""The simulated GPS receiver: what a module at a serial port sends, in NMEA 0183 (RMC, GGA, GST, in this order).

It tells the standard deviation that its slow error has (GST), and knows nothing of multipath. The map is a plane that
touches the WGS 84 ellipsoid at its origin, x to true east.
"""

from __future__ import annotations

import datetime
import math
from typing import NamedTuple

from nmea_navsat_driver.sentences import framed
from sara_common.planar import Pose2D, compose
from sara_sim.chips.gps_config import GpsConfig
from sara_sim.chips.gps_errors import GpsError, GpsErrors

ALTITUDE, GEOID = 588.0, 51.5
"""m of the floor above the sea, and of the sea above the ellipsoid."""
SATELLITES, HDOP = 9, 1.0
SEMI_AXIS, FLATTENING = 6378137.0, 1.0 / 298.257223563
"""WGS 84: m, 1."""
KNOT = 1852.0 / 3600.0


class Place(NamedTuple):
    """Of the map's origin: deg."""

    latitude: float
    longitude: float


def on_earth(origin: Place, x: float, y: float) -> Place:
    """The place (deg) of a point of the map (m), to a millimetre within 150 m; not at the poles."""
    latitude = math.radians(origin.latitude)
    sine = math.sin(latitude)
    e2 = FLATTENING * (2.0 - FLATTENING)
    across = SEMI_AXIS / math.sqrt(1.0 - e2 * sine * sine)
    along = across * (1.0 - e2) / (1.0 - e2 * sine * sine)
    north = math.degrees((y - x * x * math.tan(latitude) / (2.0 * across)) / along)
    shrunk = math.cos(math.radians(origin.latitude + north))
    return Place(origin.latitude + north, origin.longitude + math.degrees(x / (across * shrunk)))


class GpsReceiver:
    """One receiver. `sent`: what the last step brought, b'' mostly. `error`: of the last fix. `antenna`: its true place
    (x, y) in the map then, m.

    config: its numbers. seed: its luck. origin: where the map lies. mount: of the antenna in `base_link`. date: (year,
    month, day) at the start.
    """

    def __init__(self, config: GpsConfig, seed: int, origin: Place, mount: Pose2D, date: tuple[int, int, int]):
        self.config, self.sent = config, b''
        self.error: GpsError | None = None
        self.antenna = (0.0, 0.0)
        self._origin, self._mount = origin, mount
        self._errors = GpsErrors(config, seed)
        self._start = datetime.datetime(*date, tzinfo=datetime.UTC)
        self._steps = 0

    def step(self, pose: tuple[float, float, float], velocity: tuple[float, float], time: float) -> None:
        """10 ms on. pose: (x, y, yaw) of `base_link` in the map, m, rad; velocity: forward m/s, turn rad/s; time: s."""
        self.sent = b''
        if self._steps % self.config.steps == 0:
            self.error = self._errors.step()
            self.antenna = compose(pose, self._mount)[:2]
            now = self._start + datetime.timedelta(seconds=time)
            self.sent = b''.join(map(framed, self._epoch(pose, velocity, now)))
        self._steps += 1

    def _epoch(self, pose, velocity, now):
        """The sentences of a fix, without what frames them."""
        clock, date, error = now.strftime('%H%M%S.%f')[:9], now.strftime('%d%m%y'), self.error
        east, north = self._velocity(pose, velocity)
        if not error.has_fix:
            return f'GNRMC,{clock},V,,,,,,,{date},,,N', f'GNGGA,{clock},,,,,0,00,99.9,,,,,,'
        (x, y), sigma = self.antenna, self.config.sigma
        place = on_earth(self._origin, x + error.east, y + error.north)
        where = f'{_angle(place.latitude, 2, "NS")},{_angle(place.longitude, 3, "EW")}'
        course = math.degrees(math.atan2(east, north)) % 360.0
        speed = math.hypot(east, north) / KNOT
        return (
            f'GNRMC,{clock},A,{where},{speed:.3f},{course:.2f},{date},,,A',
            f'GNGGA,{clock},{where},1,{SATELLITES:02d},{HDOP:.1f},{ALTITUDE + error.up:.2f},M,{GEOID:.1f},M,,',
            f'GNGST,{clock},,,,,{sigma:.2f},{sigma:.2f},{2.0 * sigma:.2f}',
        )

    def _velocity(self, pose, velocity):
        """(east, north) m/s of the antenna, as measured."""
        forward, turn = velocity
        x, y = forward - turn * self._mount.y, turn * self._mount.x
        c, s = math.cos(pose[2]), math.sin(pose[2])
        east, north = self.error.velocity
        return c * x - s * y + east, s * x + c * y + north


def _angle(degrees, digits, signs):
    """ddmm.mmmmmm,N: to 2 mm."""
    whole, minutes = divmod(round(abs(degrees) * 60e6), 60_000_000)
    return f'{whole:0{digits}d}{minutes / 1e6:09.6f},{signs[degrees < 0.0]}'
