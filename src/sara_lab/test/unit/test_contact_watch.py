"""Contacts and whose doing they are: somebody walks into a standing chair, the chair drives into somebody, into a box,
into a wall.
"""

import math

import numpy as np
import pytest

from sara_common.platforms import chosen
from sara_lab.judge.contact_watch import ContactWatch, towards
from sara_sim.chair import SimulatedChair
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.world import World

FRONT = 0.5 * chosen().body.length


def watched(obstacles=(), push=0.0, seconds=6.0, world=None):
    """The contacts of a chair at the origin whose joystick is pushed so far ahead (of 512)."""
    world = world or World.empty()
    for obstacle in obstacles:
        world.obstacles.add(obstacle)
    chair, watch = SimulatedChair(world, 0), ContactWatch()
    chair.joystick = (512, 512 + push)
    for _ in range(round(100 * seconds)):
        watch.before(chair)
        chair.step()
        watch.after(chair)
    assert len(watch.contacts) == chair.contacts
    return watch.contacts


def test_somebody_who_walks_into_a_standing_chair_is_to_blame():
    (contact,) = watched([Obstacle('person 1', radius=0.25, path=((3.0, 0.0), (FRONT + 0.16, 0.0)), speed=1.0)])
    assert contact.what == 'person 1' and contact.approach == 0.0 and contact.blameless


def test_a_chair_that_drives_into_somebody_who_walks_is_to_blame():
    (contact,) = watched(
        [Obstacle('person 1', radius=0.25, path=((3.0, 0.0), (FRONT + 0.36, 0.0)), speed=0.5)], push=300
    )
    assert contact.approach > 0.1 and not contact.blameless


def test_what_stands_is_never_to_blame():
    (contact,) = watched([Obstacle('box 1', size=(0.4, 0.4), at=(1.2, 0.0))], push=300)
    assert contact.what == 'box 1' and contact.approach > 0.1 and not contact.blameless


def test_a_wall_is_the_map():
    occupied = np.zeros((80, 80), bool)
    occupied[:, 70:] = True
    (contact,) = watched(push=300, world=World(occupied, 0.05, (-2.0, -2.0)))
    assert contact.what == 'the map' and contact.approach > 0.1 and not contact.blameless


@pytest.mark.parametrize(
    'pose, velocity, place, speed',
    (
        ((0.0, 0.0, 0.0), (0.4, 0.0), (2.0, 0.0), 0.4),
        ((0.0, 0.0, 0.0), (0.4, 0.0), (-2.0, 0.0), -0.4),
        ((0.0, 0.0, 0.0), (0.4, 0.0), (0.0, 2.0), 0.0),
        ((1.0, 1.0, math.pi / 2), (0.4, 0.0), (1.0, 3.0), 0.4),
        ((0.0, 0.0, 0.0), (0.0, 0.5), (FRONT, 2.0), 0.5 * FRONT),
        ((0.0, 0.0, 0.0), (0.0, 0.5), (FRONT, -2.0), -0.5 * FRONT),
        ((0.0, 0.0, 0.0), (-0.3, 0.0), (-1.0, 0.1), 0.3),
    ),
)
def test_the_speed_towards_a_place_is_that_of_the_nearest_point_of_the_body(pose, velocity, place, speed):
    assert towards(pose, velocity, place) == pytest.approx(speed, abs=1e-9)
