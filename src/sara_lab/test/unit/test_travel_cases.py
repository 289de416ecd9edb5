"""What journeys are drawn from: hard but fair pairs, boxes that leave a way, people who keep out of walls; and the
body's connectivity.
"""

import math

import numpy as np
import pytest

from sara_common.platforms import chosen
from sara_lab.journeys import travel_cases
from sara_lab.judge import gaps
from sara_lab.judge.body_space import HEADINGS, BodySpace
from sara_sim.world.world import World

BODY = chosen().size


def rooms(door):
    """Two rooms of 3 x 3 m with a door of so many m in the wall between them; 0.05 m cells."""
    occupied = np.ones((62, 124), bool)
    occupied[1:61, 1:61] = occupied[1:61, 63:123] = False
    half = round(door / 0.1)
    occupied[31 - half : 31 + half, 61:63] = False
    return occupied


@pytest.mark.parametrize('door, passes', ((0.8, True), (0.7, True), (0.6, False), (0.4, False)))
def test_a_body_of_0_58_m_passes_doors_that_leave_it_its_margin(door, passes):
    space = BodySpace(rooms(door), 0.05, (0.0, 0.0), chosen().size, 0.03)
    assert space.connected((1.5, 1.5, 0.0), (4.6, 1.6, math.pi / 2)) == passes
    assert space.connected((1.5, 1.5, 0.0), (1.0, 1.4, 2.0)) and not space.connected((1.5, 1.5, 0.0), (0.2, 0.2, 0.0))
    assert not space.connected((1.5, 1.5, 0.0), (-3.0, 1.0, 0.0))


def test_a_dead_end_too_narrow_to_turn_in_is_left_backwards():
    occupied = np.ones((40, 100), bool)
    occupied[1:39, 1:39] = False  # a room of 1.9 m
    occupied[12:26, 39:90] = False  # and a passage 0.70 m wide, closed at its end
    space = BodySpace(occupied, 0.05, (0.0, 0.0), chosen().size, 0.03)
    assert space.connected((1.0, 0.95, 0.0), (3.5, 0.95, 0.0)) and space.connected(
        (3.5, 0.95, 0.0), (3.5, 0.95, math.pi)
    )
    closed = occupied.copy()
    closed[12:26, 39] = True
    alone = BodySpace(closed, 0.05, (0.0, 0.0), chosen().size, 0.03)
    assert not alone.connected((3.5, 0.95, 0.0), (3.5, 0.95, math.pi))


def test_other_things_keep_their_own_distance():
    occupied, things = np.zeros((60, 60), bool), np.zeros((60, 60), bool)
    things[:, 30] = True
    things[12:48, 30] = False  # an opening of 1.80 m
    assert BodySpace(occupied, 0.05, (0.0, 0.0), chosen().size, 0.0, (things, 0.5)).connected(
        (0.7, 1.5, 0.0), (2.3, 1.5, 0.0)
    )
    assert not BodySpace(occupied, 0.05, (0.0, 0.0), chosen().size, 0.0, (things, 0.7)).connected(
        (0.7, 1.5, 0.0), (2.3, 1.5, 0.0)
    )


def test_where_the_body_is_free_the_simulator_finds_no_overlap():
    occupied = rooms(0.8)
    space, world, random = (
        BodySpace(occupied, 0.05, (0.0, 0.0), chosen().size, 0.03),
        World(occupied),
        np.random.default_rng(2),
    )
    for k, row, column in np.argwhere(space.free)[random.integers(np.count_nonzero(space.free), size=300)]:
        assert (
            gaps.at(world, (0.05 * (column + 0.5), 0.05 * (row + 0.5), 2.0 * math.pi * k / HEADINGS), chosen().size)
            >= 0.03 - 1e-6
        )
    blocked = np.argwhere(~space.free)
    for k, row, column in blocked[random.integers(len(blocked), size=300)]:
        assert (
            gaps.at(world, (0.05 * (column + 0.5), 0.05 * (row + 0.5), 2.0 * math.pi * k / HEADINGS), chosen().size)
            < 0.03 * math.sqrt(2.0) + 1e-6
        )


@pytest.mark.parametrize('name', ('flat', 'hall'))
def test_pairs_are_fair_and_always_the_same(name):
    pairs = travel_cases.pairs(name)
    assert len(set(pairs)) == travel_cases.PAIRS
    world = World.from_yaml(travel_cases.map_file(name))
    for pair in pairs:
        assert min(gaps.at(world, pose, chosen().size) for pose in (pair.start, pair.goal)) >= travel_cases.PAIR_GAP
        assert (
            pair.way >= math.dist(pair.start[:2], pair.goal[:2]) - 0.1
            and math.dist(pair.start[:2], pair.goal[:2]) >= travel_cases.NEAREST
        )
    yaws = np.array([pose[2] for pair in pairs for pose in (pair.start, pair.goal)])
    assert len(np.unique(np.floor(yaws / (math.pi / 2)))) == 4  # into all quarters
    travel_cases.pairs.cache_clear()
    assert travel_cases.pairs(name) == pairs


def test_boxes_stand_free_and_leave_room_and_a_way():
    boxes, world = travel_cases.boxes('flat'), World.from_yaml(travel_cases.map_file('flat'))
    assert len(boxes) == travel_cases.BOXES
    for box in boxes:
        assert not world.overlaps(*box.at, box.yaw, *box.size) and all(
            travel_cases.BOX_SIZE[0] <= side <= travel_cases.BOX_SIZE[1] for side in box.size
        )
        world.obstacles.add(box)
    space = travel_cases._space('flat', boxes)
    for pair in travel_cases.pairs('flat'):
        assert min(gaps.at(world, pose, chosen().size) for pose in (pair.start, pair.goal)) >= travel_cases.PAIR_GAP
        assert space.connected(pair.start, pair.goal)


@pytest.mark.parametrize('number', (0, 1, 2))
def test_people_walk_through_no_wall_and_begin_away_from_the_chair(number):
    people, world = travel_cases.people('flat', number), World.from_yaml(travel_cases.map_file('flat'))
    assert len(people) == travel_cases.PEOPLE and people == travel_cases.people('flat', number) != travel_cases.people(
        'flat', number + 1
    )
    start = travel_cases.pairs('flat')[number].start
    for person in people:
        assert math.dist(person.pose(0.0)[:2], start[:2]) >= travel_cases.PERSON_AWAY
        for t in np.arange(0.0, 120.0, 0.1):
            assert gaps.at(world, person.pose(float(t)), (1e-6, 1e-6)) > person.radius
