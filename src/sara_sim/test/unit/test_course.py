"""What stands, slopes and walks on a map, from a file: the example, and every fault named."""

import math
from pathlib import Path

import numpy as np
import pytest

from sara_sim.pedestrians import course
from sara_sim.pedestrians.pedestrian import Pedestrian
from sara_sim.world.obstacles import ObstacleError
from sara_sim.world.world import World

EXAMPLE = Path(__file__).resolve().parents[2] / 'config' / 'people.yaml'


def test_the_example_loads():
    things, ramps, pedestrians, thresholds = course.load(EXAMPLE)
    assert [thing.name for thing in things] == ['table', 'suitcase', 'ann'] and things[0].yaw == pytest.approx(
        math.radians(20)
    )
    assert thresholds == [] and ramps[0].slope == pytest.approx(math.radians(4))
    assert [somebody.name for somebody in pedestrians] == ['eva', 'max'] and pedestrians[1].notices == 1.0


def test_a_course_is_put_on_a_world():
    world = World(np.zeros((200, 240), bool))
    course.load(EXAMPLE).put_on(world)
    assert [thing.name for thing in world.obstacles.all] == ['table', 'suitcase', 'ann', 'eva', 'max']
    assert len(world.ramps) == 1 and isinstance(world.obstacles.all[3], Pedestrian)


def test_thresholds_are_put_on_a_world(tmp_path):
    path, world = tmp_path / 'sill.yaml', World(np.zeros((200, 240), bool))
    path.write_text('thresholds: [{x: 6, y: 5, length: 0.1, width: 1.2, yaw_deg: 90, height: 0.02}]')
    course.load(path).put_on(world)
    assert world.thresholds[0].under(6.0, 5.0, 0.15)[0] == 0.02 and world.thresholds[0].yaw == math.pi / 2


@pytest.mark.parametrize(
    'text, words',
    [
        ('[]', ['obstacles, ramps, pedestrians']),
        ('walls: []', ['obstacles, ramps, pedestrians']),
        ('obstacles: 3', ['list']),
        ('obstacles: [3]', ['entry 1']),
        ('obstacles: [{name: a}]', ['either radius', 'either at']),
        ('obstacles: [{radius: .2, at: [1, 2], yaw_deg: x}]', ['yaw_deg']),
        (
            'obstacles: [{radius: -1, path: [[1, 1], [1, 1]], speed: 0, loop: never}]',
            ['radius is', 'path is', 'speed is', 'loop is'],
        ),
        ('obstacles: [{radius: .2, at: [1, 2], colour: red}]', ['colour']),
        ('obstacles: [{size: [1], at: [1, .nan]}]', ['size is', 'at is']),
        ('ramps: [{x: 0, y: 0, length: 1, width: 1, yaw: 0, slope_deg: 45}]', ['slope is']),
        ('thresholds: [{x: 0, y: 0, length: 1, width: 1, yaw: 0, height: 0.2}]', ['height is']),
        ('pedestrians: [{name: a}]', ['places']),
        (
            'pedestrians: [{name: a, places: [[1, 1]], seed: -1, speed: 0, notices: .nan, waits: [3, 1], radius: 0}]',
            ['places are', 'seed is', 'speed is', 'notices is', 'waits are', 'radius is'],
        ),
        ('obstacles: [', ['cannot be read']),
    ],
)
def test_bad_files_are_named(tmp_path, text, words):
    path = tmp_path / 'bad.yaml'
    path.write_text(text)
    with pytest.raises(ObstacleError) as error:
        course.load(path)
    assert all(word in str(error.value) for word in words)


def test_a_file_that_is_not_there_is_named():
    with pytest.raises(ObstacleError, match='nowhere'):
        course.load('/nowhere/people.yaml')
