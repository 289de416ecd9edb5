"""UTM and local cartesian coordinates: printed values, there and back, edges, the equator, poles."""

import math

import numpy as np
import pytest
from steady import whole

from sara_localization.gps.grid import NoPlace
from sara_localization.gps.tangent_plane import TangentPlane
from sara_localization.gps.utm import Utm, Zone

POINTS = whole(100_080, 2_400)
A, F = 6378137.0, 1.0 / 298.257223563


@pytest.mark.parametrize(
    'place, zone, expected, convergence',
    [
        ((51.423964, 5.494271), Zone(31, True), (673409.989, 5699924.709), 1.950),
        ((-43.530955, 172.636645), Zone(59, False), (632246.802, 5178919.718), -1.127),
    ],
)
def test_printed_values(place, zone, expected, convergence):
    assert Zone.of(*place) == zone
    grid = Utm(zone)
    assert np.abs(np.subtract(grid.forward(*place), expected)).max() <= 0.5e-3
    assert math.degrees(grid.convergence(*place)) == pytest.approx(convergence, abs=0.5e-3)


@pytest.mark.parametrize(
    'place, number',
    [
        ((0.0, -180.0), 1),
        ((0.0, 180.0), 1),
        ((0.0, 179.999), 60),
        ((0.0, math.nextafter(180.0, 0.0)), 60),
        ((0.0, 5.999), 31),
        ((0.0, 6.0), 32),
        ((60.0, 4.0), 32),  # Norway
        ((64.0, 4.0), 31),
        ((78.0, 8.9), 31),  # Svalbard
        ((78.0, 9.0), 33),
        ((78.0, 32.9), 35),
        ((78.0, 33.0), 37),
        ((40.0, 359.0), 30),
    ],
)
def test_zones(place, number):
    assert Zone.of(*place).number == number
    assert str(Zone.of(-1.0, place[1])) == f'{Zone.of(-1.0, place[1]).number} south'


@pytest.mark.parametrize('text, zone', [('31U', Zone(31, True)), (' 1c', Zone(1, False)), ('59GMQ', Zone(59, False))])
def test_a_zone_s_text_is_its_number_and_a_band_letter(text, zone):
    assert Zone.from_text(text) == zone


@pytest.mark.parametrize('text', ['', '31', 'U', '0N', '61N', '31I', '31O', '311U', '-1N', 'nonsense'])
def test_what_is_no_zone_is_refused(text):
    with pytest.raises(NoPlace, match='is no UTM zone'):
        Zone.from_text(text)


def test_there_and_back_in_every_zone_over_both_hemispheres_and_beyond_edges():
    rng, worst = np.random.default_rng(0), 0.0
    for number in range(1, 61):
        for north in (True, False):
            zone = Zone(number, north)
            grid = Utm(zone)
            latitudes = rng.uniform(0.0 if north else -80.0, 84.0 if north else 0.0, POINTS // 120)
            for latitude, along in zip(latitudes.tolist(), rng.uniform(-4.4, 4.4, POINTS // 120).tolist()):
                longitude = math.remainder(zone.meridian + along, 360.0)
                back = grid.inverse(*grid.forward(latitude, longitude))
                worst = max(worst, abs(back[0] - latitude), abs(math.remainder(back[1] - longitude, 360.0)))
    assert worst <= 1e-8


def test_coordinates_go_on_over_the_equator_and_over_the_edge_of_a_zone():
    for zone in (Zone(31, True), Zone(31, False)):
        grid = Utm(zone)
        south, north = grid.forward(-1e-7, 3.5), grid.forward(1e-7, 3.5)
        assert math.dist(south, north) < 0.05
        assert grid.inverse(*south)[0] == pytest.approx(-1e-7, abs=1e-11)
        assert math.dist(grid.forward(10.0, 6.0 - 1e-7), grid.forward(10.0, 6.0 + 1e-7)) < 0.05


def test_the_convergence_is_the_direction_of_the_meridian_on_the_grid():
    grid = Utm(Zone(31, True))
    for place in ((51.0, 5.5), (-30.0, 1.0), (70.0, 0.5)):
        (x, y), (east, north) = grid.forward(*place), grid.forward(place[0] + 1e-5, place[1])
        assert grid.convergence(*place) == pytest.approx(-math.atan2(east - x, north - y), abs=1e-6)


@pytest.mark.parametrize(
    'call, why',
    [
        (lambda: Zone.of(84.0, 0.0), 'too near to a pole'),
        (lambda: Zone.of(-80.1, 0.0), 'too near to a pole'),
        (lambda: Zone.from_text('Z'), 'at a pole'),
        (lambda: Utm(Zone(31, True)).forward(90.0, 0.0), 'too near to a pole'),
        (lambda: Utm(Zone(31, True)).forward(0.0, 12.0), 'too far from UTM zone 31 north'),
        (lambda: Utm(Zone(31, True)).forward(0.0, 120.0), 'too far from UTM zone 31 north'),
        (lambda: Utm(Zone(31, True)).forward(91.0, 0.0), 'latitude is 91'),
        (lambda: Utm(Zone(31, True)).forward(math.nan, 0.0), 'latitude is nan'),
        (lambda: Utm(Zone(31, True)).forward(0.0, math.inf), 'longitude is inf'),
        (lambda: Utm(Zone(31, True)).inverse(-1.0, 0.0), 'easting -1 m'),
        (lambda: Utm(Zone(31, True)).inverse(5e5, 1e9), 'beyond the poles'),
        (lambda: Utm(Zone(31, True)).inverse(math.nan, 0.0), 'not finite'),
        (lambda: TangentPlane(90.0, 0.0), 'too near to a pole'),
        (lambda: TangentPlane(45.0, 0.0).forward(-90.0, 0.0), 'too near to a pole'),
        (lambda: TangentPlane(45.0, 0.0).forward(-45.0, 180.0), 'other side of the earth'),
        (lambda: TangentPlane(45.0, 0.0).forward(45.0, 30.0), 'too far'),
        (lambda: TangentPlane(45.0, 0.0).inverse(2e6, 0.0), 'too far'),
        (lambda: TangentPlane(45.0, 0.0).inverse(0.0, 0.0, math.nan), 'no place'),
    ],
)
def test_what_cannot_be_converted_is_refused_in_words(call, why):
    with pytest.raises(NoPlace, match=why):
        call()


def _earth_centred(latitude, longitude, altitude):
    """Coordinates from the earth's centre, of the textbook."""
    e2, sine = F * (2.0 - F), math.sin(math.radians(latitude))
    across = A / math.sqrt(1.0 - e2 * sine * sine)
    level = (across + altitude) * math.cos(math.radians(latitude))
    turn = math.radians(longitude)
    return np.array([level * math.cos(turn), level * math.sin(turn), (across * (1.0 - e2) + altitude) * sine])


@pytest.mark.parametrize('origin', [(0.0, 0.0), (48.1, 11.6), (-33.9, 151.2), (84.9, -100.0), (10.0, 180.0)])
def test_the_tangent_plane_is_that_of_the_textbook_and_its_inverse_is_exact(origin):
    rng, plane = np.random.default_rng(1), TangentPlane(*origin)
    latitude, longitude = map(math.radians, origin)
    east = np.array([-math.sin(longitude), math.cos(longitude), 0.0])
    up = np.array(
        [math.cos(latitude) * math.cos(longitude), math.cos(latitude) * math.sin(longitude), math.sin(latitude)]
    )
    for _ in range(300):
        place = origin[0] + rng.uniform(-2.0, 2.0), origin[1] + rng.uniform(-2.0, 2.0), rng.uniform(-100.0, 5000.0)
        away = _earth_centred(*place) - _earth_centred(*origin, 0.0)
        x, y = plane.forward(*place)
        assert (x, y) == pytest.approx((away @ east, away @ np.cross(up, east)), abs=1e-5)
        back = plane.inverse(x, y, place[2])
        assert abs(back[0] - place[0]) < 1e-8 and abs(math.remainder(back[1] - place[1], 360.0)) < 1e-8
