"""What the map does not show: heard by the sonars, touched by the body, where it should be at its time."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from sara_common.platforms import chosen
from sara_sim.chair import SimulatedChair
from sara_sim.config import ChairConfig
from sara_sim.world.obstacles import LOOPS, Obstacle, Obstacles
from sara_sim.world.rays import Cone
from sara_sim.world.world import World, WorldError

CONE = Cone(math.radians(30), 13, math.cos(math.radians(60)), 6.0)
SURE = ChairConfig.of(sonar_lost=0.0, frame_loss=0.0)


def floor(*things, size=200):
    return World(np.zeros((size, size), bool), obstacles=things)


@given(st.floats(1.0, 4.0), st.floats(0.1, 0.5), st.floats(-math.pi, math.pi))
def test_a_disc_is_as_far_as_its_surface_in_every_direction(distance, radius, axis):
    x, y = 5.0 + distance * math.cos(axis), 5.0 + distance * math.sin(axis)
    heard = floor(Obstacle(radius=radius, at=(x, y))).sonar(5.0, 5.0, axis, CONE)
    assert heard == pytest.approx(distance - radius, abs=1e-9)


@given(st.floats(1.0, 4.0), st.floats(-0.5, 0.5), st.floats(-math.pi, math.pi))
def test_a_box_is_as_far_as_its_side(distance, turned, axis):
    """Facing the sonar; then turned about the point where the axis meets it, and large: the nearest ray wins."""
    away = distance + 2.0
    x, y = 5.0 + away * math.cos(axis), 5.0 + away * math.sin(axis)
    heard = floor(Obstacle(size=(4.0, 0.4), at=(x, y), yaw=axis)).sonar(5.0, 5.0, axis, CONE)
    assert heard == pytest.approx(distance, abs=1e-9)


def test_a_disc_beside_the_cone_is_not_heard_and_a_wall_hides_what_is_behind():
    assert floor(Obstacle(radius=0.2, at=(5.0, 7.0))).sonar(5.0, 5.0, 0.0, CONE) == math.inf
    occupied = np.zeros((200, 200), bool)
    occupied[:, 140:144] = True
    world = World(occupied, obstacles=[Obstacle(radius=0.3, at=(9.0, 5.0))])
    assert world.sonar(5.0, 5.0, 0.0, CONE) == pytest.approx(2.0, abs=0.05)
    world.obstacles.add(Obstacle('near', radius=0.3, at=(6.5, 5.0)))
    assert world.sonar(5.0, 5.0, 0.0, CONE) == pytest.approx(1.2)
    world.obstacles.remove('near')
    assert world.sonar(5.0, 5.0, 0.0, CONE) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize('turn, heard', [(0, True), (50, True), (75, False), (-75, False)])
def test_steep_boxes_give_nothing_back(turn, heard):
    thing = Obstacle(size=(8.0, 0.02), at=(7.0, 5.0), yaw=math.radians(90 + turn))
    distance = floor(thing).sonar(5.0, 5.0, 0.0, CONE)
    assert math.isfinite(distance) == heard


@given(
    st.floats(-2, 2),
    st.floats(-2, 2),
    st.floats(-4, 4),
    st.booleans(),
    st.floats(-4, 4),
    st.floats(0.1, 1.0),
    st.floats(0.1, 1.0),
)
def test_overlap_is_what_points_say(x, y, yaw, disc, turned, length, width):
    thing = (
        Obstacle(radius=length, at=(0.0, 0.0))
        if disc
        else Obstacle(size=(2 * length, 2 * width), at=(0.0, 0.0), yaw=turned)
    )
    met = bool(floor(thing).meets(x, y, yaw, 1.08, 0.58).any())
    grid = np.linspace(-1, 1, 81)
    px, py = np.meshgrid(grid * 0.54, grid * 0.29)
    c, s = math.cos(yaw), math.sin(yaw)
    px, py = x + c * px - s * py, y + s * px + c * py
    if disc:
        depth = length - np.hypot(px, py)
    else:
        c, s = math.cos(turned), math.sin(turned)
        depth = np.minimum(length - np.abs(c * px + s * py), width - np.abs(c * py - s * px))
    if depth.max() > 0.0:
        assert met
    elif depth.max() < -0.02:
        assert not met


# --- where they are ---------------------------------------------------------------------------------------------------

SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))


@pytest.mark.parametrize(
    'loop, t, place',
    [
        ('once', 0.0, (0, 0)),
        ('once', 5.0, (0, 0)),
        ('once', 7.0, (2, 0)),
        ('once', 8.0, (2, 1)),
        ('once', 99.0, (0, 2)),
        ('around', 12.0, (0, 1)),
        ('around', 14.0, (1, 0)),
        ('around', 5.0 + 8 * 1000, (0, 0)),
        ('back', 11.5, (0.5, 2)),
        ('back', 13.5, (2, 1.5)),
        ('back', 5.0 + 12, (0, 0)),
        ('back', 5.0 + 12 * 7 + 1, (1, 0)),
    ],
)
def test_a_walk(loop, t, place):
    walker = Obstacle(radius=0.2, path=SQUARE, speed=1.0, start=5.0, loop=loop)
    assert walker.pose(t)[:2] == pytest.approx(place)


@given(st.sampled_from(LOOPS), st.floats(0, 1e4), st.floats(0.001, 1.0))
def test_nobody_walks_faster_than_their_speed(loop, t, dt):
    walker = Obstacle(radius=0.2, path=SQUARE, speed=1.3, start=5.0, loop=loop)
    (ax, ay, _), (bx, by, _) = walker.pose(t), walker.pose(t + dt)
    assert math.hypot(bx - ax, by - ay) <= 1.3 * dt + 1e-6


def test_it_is_there_only_in_its_time():
    things = Obstacles([Obstacle(radius=0.2, at=(1, 1), appears=2.0, disappears=3.0)])
    seen = []
    for t in (0.0, 1.99, 2.0, 2.5, 3.0, 9.0):
        things.move_to(t)
        seen.append(len(things.shapes))
    assert seen == [0, 0, 1, 1, 0, 0]


# --- with the chair ---------------------------------------------------------------------------------------------------


def test_the_chair_hears_what_appears_in_front_of_it(pilot):
    world = floor(Obstacle('box', size=(0.5, 2.0), at=(7.0, 5.0), appears=2.0))
    flight = pilot(SimulatedChair(world, 1, (5.0, 5.0, 0.0), config=SURE)).drive(0, 0, 4.0)
    sensor = min(chosen().sonars, key=lambda name: abs(chosen().sonars[name].yaw))
    message = next(name for name, sensors in BusDescription.default().ranges.items() if sensor in sensors)
    before, after = flight.values(message, sensor)[:8], flight.values(message, sensor, since=2.5)
    assert np.all(before == 0.0) and after == pytest.approx(1.75 - chosen().sonars[sensor].x, abs=0.05)


def test_a_thing_in_the_way_stops_the_chair_as_a_wall_does(pilot):
    for thing in (Obstacle(radius=0.3, at=(7.0, 5.0)), Obstacle(size=(0.6, 0.6), at=(7.0, 5.0))):
        chair = SimulatedChair(floor(thing), 1, (5.0, 5.0, 0.0), config=SURE)
        pilot(chair).drive(3.0, 3.0, 6.0)
        assert chair.contacts == 1 and chair.pose[0] == pytest.approx(6.7 - 0.5 * SURE.length, abs=0.02)


def test_who_walks_into_the_chair_is_a_contact_and_does_not_hold_it(pilot):
    ann = Obstacle('ann', radius=0.25, path=((8.0, 5.0), (5.6, 5.0)), speed=1.0, loop='once')
    chair = SimulatedChair(floor(ann), 1, (5.0, 5.0, 0.0), config=SURE)
    flight = pilot(chair).drive(0.0, 0.0, 3.0)
    assert chair.contacts == 1 and chair.drive.touching and chair.pose[0] == 5.0
    flight.drive(2.0, 2.0, 1.0)
    assert chair.pose[0] == pytest.approx(5.0, abs=1e-6), 'it may not press on'
    flight.drive(-2.0, -2.0, 3.0)
    assert chair.pose[0] < 4.5 and not chair.drive.touching and chair.contacts == 1


def test_same_seed_same_walkers_same_bytes(pilot):
    def run():
        ann = Obstacle('ann', radius=0.25, path=((8.0, 5.0), (6.0, 4.0)), speed=0.7, loop='back')
        flight = pilot(SimulatedChair(floor(ann), 3, (5.0, 5.0, 0.0)))
        return flight.drive(1.0, 0.6, 5.0).raw

    assert run() == run()


def test_cannot_start_in_an_obstacle():
    with pytest.raises(WorldError, match='start'):
        SimulatedChair(floor(Obstacle(radius=0.3, at=(5.0, 5.0))), 0, (5.2, 5.0, 0.0))
