"""Pedestrians: the published law, paths through a map, and what somebody does who meets the chair."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.platforms import chosen
from sara_sim.chair import SimulatedChair
from sara_sim.config import ChairConfig
from sara_sim.pedestrians import social_force
from sara_sim.pedestrians.pedestrian import CLOSE, Pedestrian, PedestrianConfig
from sara_sim.pedestrians.routes import BODY, RouteError, Routes
from sara_sim.world.obstacles import Body, ObstacleError
from sara_sim.world.world import World

AWAY = Body(-50.0, -50.0, 0.0, 0.54, 0.29, 0.0, 0.0)


def rooms(door=0.8):
    """Two rooms of 3 x 3 m with a door between them; 0.05 m cells."""
    occupied = np.ones((62, 124), bool)
    occupied[1:61, 1:61] = occupied[1:61, 63:123] = False
    half = round(door / 0.1)
    occupied[31 - half : 31 + half, 61:63] = False
    return World(occupied)


def corridor(width=1.5, length=12.0):
    """Along x, from y = 0.05 m on."""
    occupied = np.ones((round(width / 0.05) + 2, round(length / 0.05) + 2), bool)
    occupied[1:-1, 1:-1] = False
    return World(occupied)


def walk(world, people, seconds, chair=lambda _t: AWAY):
    """Let them walk; returns their poses, (steps, people, 3)."""
    for somebody in people:
        world.obstacles.add(somebody)
    poses = []
    for k in range(1, round(seconds * 100) + 1):
        world.obstacles.step(k / 100, chair(k / 100))
        poses.append([somebody.pose(k / 100) for somebody in people])
    return np.array(poses)


def standing(x, y, yaw=0.0):
    return lambda _t: Body(x, y, yaw, 0.54, 0.29, 0.0, 0.0)


def gap(pose, place):
    """m between the chair's body and a disc of 0.25 m."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    dx, dy = place[0] - pose[0], place[1] - pose[1]
    along, across = max(abs(c * dx + s * dy) - 0.54, 0.0), max(abs(c * dy - s * dx) - 0.29, 0.0)
    return math.hypot(along, across) - 0.25


# --- the law ----------------------------------------------------------------------------------------------------------


@given(st.floats(0.3, 4.0), st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_the_interaction_is_that_of_the_paper(far, bearing, vx, vy):
    """With complex numbers instead of components."""
    e, velocity = complex(math.cos(bearing), math.sin(bearing)), complex(vx, vy)
    d = 2.0 * velocity + e
    if abs(d) < 1e-3 or abs(math.pi - abs(np.angle(e / d))) < 1e-6:
        return
    b, theta = 0.35 * abs(d), np.angle(e / d) + 0.005 * 0.35 * abs(d)
    t = d / abs(d)
    left = 1j * t
    expected = (
        -4.5
        * math.exp(-far / b)
        * (math.exp(-((3.0 * b * theta) ** 2)) * t + np.sign(theta) * math.exp(-((2.0 * b * theta) ** 2)) * left)
    )
    found = social_force.interaction((far * e.real, far * e.imag), (vx, vy))
    assert complex(*found) == pytest.approx(expected, abs=1e-9)


def test_alone_they_reach_their_speed_as_the_paper_has_it():
    state, ground = (5.0, 5.0, 0.0, 0.0), social_force.Floor(np.zeros((200, 200), bool), 0.05, 0.0, 0.0)
    ax, ay = social_force.acceleration(state, (1.29, 0.0), np.empty((0, 9)), ground)
    assert ax == pytest.approx(1.29 / 0.54) and ay == 0.0


def test_a_wall_pushes_off_by_its_distance():
    occupied = np.zeros((200, 200), bool)
    occupied[:, 110] = True  # from 5.5 m on
    ground = social_force.Floor(occupied, 0.05, 0.0, 0.0)
    ax, ay = social_force.acceleration((5.3, 5.0, 0.0, 0.0), (0.0, 0.0), np.empty((0, 9)), ground)
    assert ax == pytest.approx(-3.0 * math.exp(-2.0)) and ay == pytest.approx(0.0)


def test_nobody_sees_through_a_wall():
    world = rooms()
    ground = social_force.Floor.of(world)
    other = np.array([[3.6, 0.5, 1.0, 0.0, 0.25, -1.0, -1.0, 0.0, 0.0]])
    alone = social_force.acceleration((2.6, 0.5, 1.0, 0.0), (1.0, 0.0), np.empty((0, 9)), ground)
    assert social_force.acceleration((2.6, 0.5, 1.0, 0.0), (1.0, 0.0), other, ground) == alone
    assert social_force.hidden(ground, 2.6, 0.5, 3.6, 0.5) and not social_force.hidden(ground, 2.6, 1.5, 3.6, 1.5)


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.2, 3.2))
def test_the_nearest_point_of_a_box_and_a_disc(x, y, yaw):
    box = np.array([0.5, -0.2, math.cos(yaw), math.sin(yaw), 0.54, 0.29])
    px, py = social_force.nearest_point(x, y, box)
    u, v = np.meshgrid(np.linspace(-0.54, 0.54, 109), np.linspace(-0.29, 0.29, 59))
    xs, ys = 0.5 + box[2] * u - box[3] * v, -0.2 + box[3] * u + box[2] * v
    assert math.hypot(px - x, py - y) == pytest.approx(float(np.hypot(xs - x, ys - y).min()), abs=0.01)
    disc = np.array([0.5, -0.2, 1.0, 0.0, 0.3, -1.0])
    px, py = social_force.nearest_point(x, y, disc)
    assert math.hypot(px - x, py - y) == pytest.approx(max(math.hypot(x - 0.5, y + 0.2) - 0.3, 0.0), abs=1e-9)


# --- paths ------------------------------------------------------------------------------------------------------------


def test_the_way_leads_through_the_door_and_off_the_walls():
    routes = Routes(rooms())
    way, place, passed = routes.to((5.0, 0.5)), (0.5, 2.5), []
    for _ in range(200):
        place = routes.ahead(way, *place, 0.1)
        passed.append(place)
    assert math.dist(place, (5.0, 0.5)) < 0.1
    assert any(abs(x - 3.1) < 0.1 and abs(y - 1.5) < 0.3 for x, y in passed)
    assert all(0.05 + BODY < y < 3.05 - BODY for _, y in passed)


def test_a_place_in_a_wall_is_refused_and_a_closed_door_has_no_way():
    routes = Routes(rooms(door=0.2))
    for place in ((3.1, 1.0), (0.1, 0.1), (50.0, 1.0)):  # the last is off the map
        with pytest.raises(RouteError, match='nobody can stand'):
            routes.to(place)
    assert routes.left(routes.to((5.0, 0.5)), 0.5, 2.5) == math.inf
    assert routes.ahead(routes.to((5.0, 0.5)), 0.5, 2.5, 0.6) is None
    for places, why in ((((0.5, 2.5), (5.0, 0.5)), 'no way'), (((0.5, 2.5), (3.1, 1.0)), 'nobody can stand')):
        with pytest.raises(ObstacleError, match=why):
            Pedestrian(PedestrianConfig('ann', places), rooms(door=0.2))


def test_on_a_floor_without_a_map_they_walk_wherever_their_places_are():
    world = World.empty()
    somebody = Pedestrian(PedestrianConfig('ann', ((-4.0, 3.0), (5.0, -2.0)), speed=1.2), world)
    poses = walk(world, [somebody], 12.0)
    assert math.dist(poses[-1, 0, :2], (5.0, -2.0)) < 0.6


# --- walking ----------------------------------------------------------------------------------------------------------


def test_they_walk_between_their_places_and_into_no_wall():
    world = rooms()
    routes = Routes(world)
    places = ((0.5, 2.5), (5.0, 0.5), (5.5, 2.5), (0.6, 0.6))
    people = [Pedestrian(PedestrianConfig(f'p{k}', places[k:] + places[:k], k), world, routes) for k in range(3)]
    poses = walk(world, people, 90.0)
    driven = np.hypot(*np.diff(poses[..., :2], axis=0).transpose(2, 0, 1)).sum(0)
    assert (driven > 30.0).all()  # 1.29 m/s but for waiting
    for x, y, _ in poses.reshape(-1, 3)[::7]:
        wall = social_force.nearest_wall(people[0]._floor, float(x), float(y))
        assert math.dist(wall, (x, y)) > 0.15
    for k in range(3):
        assert {j for j, place in enumerate(places) if (np.hypot(*(poses[:, k, :2] - place).T) < 0.5).any()} == set(
            range(4)
        )


def test_the_same_seed_walks_the_same_way_and_the_past_is_kept():
    def once(seed):
        world = rooms()
        somebody = Pedestrian(PedestrianConfig('ann', ((0.5, 2.5), (5.0, 0.5), (0.6, 0.6)), seed), world)
        return walk(world, [somebody], 20.0), somebody

    first, somebody = once(1)
    assert np.array_equal(first, once(1)[0]) and not np.array_equal(first, once(2)[0])
    assert somebody.pose(7.0) == tuple(first[699, 0]) and somebody.pose(-1.0) == (0.5, 2.5, 0.0)
    assert somebody.pose(99.0) == tuple(first[-1, 0])


def test_two_who_meet_head_on_in_a_corridor_pass_each_other():
    world = corridor()
    ends = ((1.0, 0.8), (11.0, 0.8))
    people = [
        Pedestrian(PedestrianConfig(f'p{k}', ends[::step], speed=1.2, waits=(60.0, 60.0)), world)
        for k, step in enumerate((1, -1))
    ]
    poses = walk(world, people, 14.0)
    assert math.dist(poses[-1, 0, :2], ends[1]) < 0.6 and math.dist(poses[-1, 1, :2], ends[0]) < 0.6
    assert np.hypot(*(poses[:, 0, :2] - poses[:, 1, :2]).T).min() > 0.45


@pytest.mark.parametrize('notices, touches', ((math.inf, False), (1.0, False), (0.0, True)))
def test_who_notices_the_chair_walks_round_it(notices, touches):
    """It stands across a corridor of 2 m, 0.6 m of which are free."""
    world = corridor(2.0)
    config = PedestrianConfig(
        'ann', ((1.0, 0.9), (11.0, 0.9)), speed=1.2, notices=notices, waits=(60.0, 60.0), radius=0.2
    )
    somebody, chair = Pedestrian(config, world), (6.0, 0.6, math.pi / 2)
    poses = walk(world, [somebody], 14.0, standing(*chair))
    assert (min(gap(chair, place) for place in poses[:, 0].tolist()) < -0.05) == touches
    assert math.dist(poses[-1, 0, :2], (11.0, 0.9)) < 0.6


def test_who_waits_for_the_chair_begins_once_it_is_near():
    config = PedestrianConfig('ann', ((3.0, 0.8), (9.0, 0.8)), waits=(60.0, 60.0), starts_within=2.0)
    somebody = Pedestrian(config, corridor())
    far, near = standing(0.8, 0.8, 0.0), standing(1.2, 0.8, 0.0)
    poses = walk(corridor(), [somebody], 12.0, lambda t: far(t) if t < 3.0 else near(t))[:, 0, 0]
    assert abs(poses[299] - 3.0) < 0.05 and poses[400] > 3.2 and poses[-1] > 8.0
    for within in (0.0, -1.0, math.nan, True, 'near'):
        with pytest.raises(ObstacleError, match='starts_within is'):
            PedestrianConfig('ann', ((3.0, 0.8), (9.0, 0.8)), starts_within=within)


def test_who_finds_the_door_barred_goes_elsewhere():
    world = rooms()
    places = ((2.0, 1.5), (5.0, 1.5), (0.6, 0.6))
    somebody = Pedestrian(PedestrianConfig('ann', places, 3, waits=(1.0, 1.0)), world)
    chair = (3.1, 1.5, 0.0)
    poses = walk(world, [somebody], 40.0, standing(*chair))
    assert (np.hypot(*(poses[:, 0, :2] - places[2]).T) < 0.5).any()
    assert (poses[:, 0, 0] < 3.1).all() and min(gap(chair, place) for place in poses[:, 0].tolist()) > 0.0


@settings(max_examples=20)
@given(st.integers(0, 1000), st.floats(-0.5, 0.5), st.floats(-1.0, 1.0))
def test_who_has_room_is_not_run_over(seed, v, w):
    """A chair that drives on and on, in the open: they step back from it."""
    world = World(np.zeros((240, 240), bool))
    random = np.random.default_rng(seed)
    places = tuple(tuple(place) for place in random.uniform(4.0, 8.0, (4, 2)).tolist())
    somebody = Pedestrian(PedestrianConfig('ann', places, seed), world)
    pose, least = [6.0, 6.0, 0.0], math.inf
    if gap(pose, places[0]) < CLOSE:
        return
    world.obstacles.add(somebody)
    for k in range(1, 2001):
        pose = [pose[0] + 0.01 * v * math.cos(pose[2]), pose[1] + 0.01 * v * math.sin(pose[2]), pose[2] + 0.01 * w]
        world.obstacles.step(k / 100, Body(*pose, 0.54, 0.29, v, w))
        least = min(least, gap(pose, somebody.pose(k / 100)))
    assert least > 0.0


def test_the_chair_is_one_whom_they_see():
    world = corridor(2.0)
    config = PedestrianConfig('ann', ((1.0, 1.0), (11.0, 1.0)), speed=1.2, waits=(60.0, 60.0))
    world.obstacles.add(Pedestrian(config, world))
    chair = SimulatedChair(world, 0, (6.0, 0.7, 0.0), config=ChairConfig.of(sonar_lost=0.0))
    left, heard = min(chosen().sonars, key=lambda name: abs(chosen().sonars[name].yaw - math.pi / 2)), []
    for _ in range(1400):
        chair.step()
        heard.append(chair.box.acoustics.echo(left))
    assert chair.contacts == 0 and world.obstacles.all[0].pose(14.0)[0] > 10.0
    assert heard[0] > 0.9 and min(heard) < 0.7  # the wall beside it; who passes between
