"""Rays and contacts against geometry that can be worked out by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_sim.world.rays import Cone
from sara_sim.world.world import World, WorldError

CONE = Cone(math.radians(30), 13, math.cos(math.radians(60)), 6.0)


def wall_at(x, size=200):
    """10 x 10 m with everything beyond x occupied, 0.05 m cells."""
    occupied = np.zeros((size, size), bool)
    occupied[:, round(x / 0.05) :] = True
    return World(occupied)


@given(st.floats(0.5, 3.9), st.floats(3.0, 7.0), st.floats(-0.5, 0.5))
def test_a_flat_wall_is_as_far_as_its_nearest_point(x, y, axis):
    distance = wall_at(5.0).sonar(x, y, axis, CONE)
    assert distance == pytest.approx(5.0 - x, rel=0.005)


@pytest.mark.parametrize('steep, heard', [(0, True), (30, True), (55, True), (65, False), (80, False)])
def test_steep_walls_give_nothing_back(steep, heard):
    assert math.isfinite(wall_at(5.0).sonar(4.0, 5.0, math.radians(steep), CONE)) == heard


@pytest.mark.parametrize('turn', [20, 45, 70])
def test_walls_across_the_grid_have_their_true_direction(turn):
    rows, columns = np.mgrid[0:200, 0:200]
    nx, ny = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    occupied = ((columns + 0.5) * nx + (rows + 0.5) * ny) * 0.05 > 5.0 * (nx + ny) + 1.0
    world = World(occupied)
    for steep, heard in ((0, True), (40, True), (-40, True), (72, False), (-72, False)):
        distance = world.sonar(5.0, 5.0, math.radians(turn + steep), CONE)
        assert math.isfinite(distance) == heard
        if steep == 0:
            assert distance == pytest.approx(1.0, abs=0.06)


def test_nothing_beyond_the_limit_nor_the_map():
    assert wall_at(9.0).sonar(1.0, 5.0, 0.0, CONE) == math.inf
    assert World.empty().sonar(0.0, 0.0, 1.0, CONE) == math.inf


@given(st.floats(-1, 6), st.floats(-1, 6), st.floats(-7, 7), st.integers(0, 2**20))
def test_overlap_is_what_points_say(x, y, yaw, seed):
    """A rectangle overlaps a cell exactly when some point of the cell lies in it: points on a fine grid may only miss
    slivers.
    """
    random = np.random.default_rng(seed)
    occupied = np.zeros((100, 100), bool)
    cells = random.integers(0, 100, (20, 2))
    occupied[cells[:, 0], cells[:, 1]] = True
    fine = np.linspace(0.0, 0.05, 11)
    px = (cells[:, 1, None, None] * 0.05 + fine[None, :, None]) - x
    py = (cells[:, 0, None, None] * 0.05 + fine[None, None, :]) - y
    c, s = math.cos(yaw), math.sin(yaw)
    along, across = np.abs(c * px + s * py), np.abs(c * py - s * px)
    world = World(occupied)
    answer = world.overlaps(x, y, yaw, 1.08, 0.58)
    if np.any((along < 0.54) & (across < 0.29)):
        assert answer
    elif not np.any((along < 0.546) & (across < 0.296)):
        assert not answer


def test_reads_a_map_with_row_0_on_top(tmp_path):
    pixels = np.full((20, 40), 254, np.uint8)
    pixels[0, 39] = 0  # top right: highest y
    pixels[5, 5] = 205  # unknown
    (tmp_path / 'room.pgm').write_bytes(b'P5\n40 20\n255\n' + pixels.tobytes())
    path = tmp_path / 'room.yaml'
    path.write_text(
        'image: room.pgm\nresolution: 0.05\norigin: [-1.0, -0.5, 0.0]\n'
        'negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n'
    )
    world = World.from_yaml(path)
    assert np.argwhere(world.occupied).tolist() == [[19, 39]]
    assert world.origin == (-1.0, -0.5)
    assert world.overlaps(0.975, 0.475, 0.0, 0.01, 0.01)


def test_colours_are_averaged(tmp_path):
    pixels = np.full((20, 40, 3), 254, np.uint8)
    pixels[0, 39] = 0, 120, 0  # 40 on average
    pixels[5, 5] = 254, 254, 0
    (tmp_path / 'room.ppm').write_bytes(b'P6\n40 20\n255\n' + pixels.tobytes())
    (tmp_path / 'room.yaml').write_text('image: room.ppm\nresolution: 0.05\norigin: [0, 0, 0]')
    assert np.argwhere(World.from_yaml(tmp_path / 'room.yaml').occupied).tolist() == [[19, 39]]


@pytest.mark.parametrize(
    'text, names',
    [
        ('[]', ['parameters']),
        ('image: a.pgm\nresolution: -1\norigin: [0, 0]', ['resolution', 'origin']),
        ('image: none.pgm\nresolution: 0.05\norigin: [0, 0, 0]', ['image']),
        (
            'image: a.pgm\nresolution: .nan\norigin: [0, 0, 1]\nnegate: 7\noccupied_thresh: 3\nmode: odd',
            ['resolution', 'origin', 'negate', 'occupied_thresh', 'mode'],
        ),
    ],
)
def test_bad_maps_are_named(tmp_path, text, names):
    path = tmp_path / 'bad.yaml'
    path.write_text(text)
    with pytest.raises(WorldError) as error:
        World.from_yaml(path)
    assert all(name in str(error.value) for name in names)
