"""Gazebo's worlds as obstacles, and obstacles drawn into cells."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_sim.world.drawn import draw
from sara_sim.world.obstacles import Obstacle
from sara_sim.world.sdf import read_sdf
from sara_sim.world.world import WorldError

BOX = '<geometry><box><size>{}</size></box></geometry>'
CYLINDER = '<geometry><cylinder><radius>{}</radius><length>{}</length></cylinder></geometry>'


def model(shape, name='m', pose='', link='', collision=''):
    """A <model> of one link and one collision, each with a pose."""
    poses = [f'<pose>{text}</pose>' if text else '' for text in (pose, link, collision)]
    return (
        f'<model name="{name}"><static>true</static>{poses[0]}<link name="l">{poses[1]}'
        f'<collision name="c">{poses[2]}{shape}</collision><visual name="v">{BOX.format("9 9 9")}</visual>'
        '</link></model>'
    )


def world_file(folder, *parts):
    """A .world file that holds the parts."""
    path = folder / 'some.world'
    path.write_text(f'<?xml version="1.0"?><sdf version="1.6"><world name="w">{"".join(parts)}</world></sdf>')
    return path


def only(scene):
    """The one shape of a Scene with which nothing is wrong."""
    assert scene.left_out == () and len(scene.shapes) == 1
    return scene.shapes[0]


def test_poses_of_model_link_and_collision_are_chained(tmp_path):
    quarter = f'0 0 0 0 0 {math.pi / 2}'
    path = world_file(
        tmp_path, model(BOX.format('2 0.5 1'), pose='1 2 0 0 0 0', link=quarter, collision='1 0 0.5 0 0 0')
    )
    box = only(read_sdf(path))
    assert box.at == pytest.approx((1.0, 3.0)) and box.size == (2.0, 0.5) and box.yaw == pytest.approx(math.pi / 2)


@given(st.floats(-4, 4), st.floats(-4, 4), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_a_turned_model_turns_what_is_in_it_as_the_plane_does(tmp_path_factory, x, y, yaw, turn):
    pose = f'{x} {y} 0 0 0 {yaw}'
    path = world_file(tmp_path_factory.mktemp('w'), model(BOX.format('1 1 1'), pose=pose, link=f'2 -1 0 0 0 {turn}'))
    box = only(read_sdf(path))
    c, s = math.cos(yaw), math.sin(yaw)
    assert box.at == pytest.approx((x + 2 * c + s, y + 2 * s - c), abs=1e-6)
    assert math.remainder(box.yaw - yaw - turn, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)


def test_nested_models_and_a_pose_in_degrees(tmp_path):
    inner = model(CYLINDER.format(0.2, 1.0), name='inner', pose='1 0 0 0 0 0')
    outer = f'<model name="outer"><pose degrees="true">0 0 0 0 0 90</pose>{inner}</model>'
    disc = only(read_sdf(world_file(tmp_path, outer)))
    assert disc.radius == 0.2 and disc.at == pytest.approx((0.0, 1.0)) and disc.name == 'outer/inner/l/c'


def test_lying_boxes_and_cylinders_have_the_outline_of_their_sides(tmp_path):
    fallen = f'0 0 0.3 0 {math.pi / 2} 0'  # its length is where its x axis was
    box = only(read_sdf(world_file(tmp_path, model(BOX.format('0.4 0.6 2'), pose=fallen))))
    assert sorted(box.size) == pytest.approx([0.6, 2.0])
    log = only(read_sdf(world_file(tmp_path, model(CYLINDER.format(0.2, 3.0), pose=fallen))))
    assert log.size == pytest.approx((0.4, 3.0)) and abs(math.sin(log.yaw)) == pytest.approx(1.0)


def test_what_hangs_high_and_what_is_floor_do_not_hinder(tmp_path):
    lintel, sill = model(BOX.format('1 1 0.5'), pose='0 0 2.2 0 0 0'), model(BOX.format('1 1 0.04'), pose='0 0 0 0 0 0')
    plane = model('<geometry><plane><size>100 100</size></plane></geometry>')
    path = world_file(tmp_path, lintel, sill, plane)
    assert read_sdf(path).shapes == () and read_sdf(path).left_out == ()
    assert len(read_sdf(path, height=2.5).shapes) == 1


def test_what_cannot_be_read_is_named(tmp_path):
    mesh = '<geometry><mesh><uri>model://chair.dae</uri></mesh></geometry>'
    tilted = model(BOX.format('1 1 1'), name='ramp', pose='0 0 0 0 0.3 0')
    actor, include = '<actor name="walker"/>', '<include><uri>model://sofa</uri></include>'
    found = read_sdf(world_file(tmp_path, model(mesh, name='armchair'), tilted, actor, include))
    assert found.shapes == () and len(found.left_out) == 4
    for word in ('armchair/l/c: a mesh', 'ramp/l/c: a box that is tilted', 'actor walker', 'model://sofa'):
        assert any(word in sentence for sentence in found.left_out), word


def test_included_models_and_the_state_that_moves_them(tmp_path):
    folder = tmp_path / 'models' / 'pillar'
    folder.mkdir(parents=True)
    (folder / 'model.sdf').write_text(f'<sdf version="1.6">{model(CYLINDER.format(0.1, 2), pose="5 5 0 0 0 0")}</sdf>')
    include = '<include><uri>model://pillar</uri>{}</include>'
    as_in_file = only(read_sdf(world_file(tmp_path, include.format('')), [tmp_path / 'models']))
    placed = include.format('<name>p</name><pose>1 2 0 0 0 0</pose>')
    moved = only(read_sdf(world_file(tmp_path, placed), [tmp_path / 'models']))
    state = '<state><model name="p"><pose>3 4 0 0 0 0</pose></model></state>'
    saved = only(read_sdf(world_file(tmp_path, placed, state), [tmp_path / 'models']))
    assert (as_in_file.at, moved.at, saved.at) == ((5.0, 5.0), (1.0, 2.0), (3.0, 4.0))
    assert only(read_sdf(folder / 'model.sdf')).at == (5.0, 5.0)


def test_a_model_that_includes_itself_ends_in_words(tmp_path):
    (tmp_path / 'loop').mkdir()
    include = '<include><uri>model://loop</uri></include>'
    (tmp_path / 'loop' / 'model.sdf').write_text(f'<sdf version="1.6"><model name="loop">{include}</model></sdf>')
    with pytest.raises(WorldError, match='includes itself'):
        read_sdf(world_file(tmp_path, include))


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', 'cannot be read'),
        ('<sdf><world>', 'cannot be read'),
        ('<robot/>', 'begins with <robot>'),
        ('<sdf version="1.6"/>', 'neither <world> nor <model>'),
        (f'<sdf><world>{model(BOX.format("1 x 1"))}</world></sdf>', "'1 x 1' is given, allowed are 3 finite numbers"),
        (f'<sdf><world>{model(BOX.format("1 -2 1"))}</world></sdf>', 'lengths above 0 m'),
        (f'<sdf><world>{model(CYLINDER.format("nan", 1))}</world></sdf>', 'radius'),
        (f'<sdf><world>{model(CYLINDER.format(0, 1))}</world></sdf>', 'radius is 0'),
        (f'<sdf><world>{model(BOX.format("1 1 1"), pose="1 2 3")}</world></sdf>', 'allowed are 6 finite numbers'),
    ],
)
def test_bad_files_are_told_in_words(tmp_path, text, words):
    path = tmp_path / 'bad.world'
    path.write_text(text)
    with pytest.raises(WorldError, match=words):
        read_sdf(path)


def test_a_file_that_is_not_there_is_told_in_words(tmp_path):
    with pytest.raises(WorldError, match='cannot be read'):
        read_sdf(tmp_path / 'none.world')


@pytest.mark.parametrize(
    'shape',
    [
        Obstacle(radius=0.02, at=(0.5, 0.5)),
        Obstacle(radius=0.035, at=(0.5, 0.5)),
        Obstacle(size=(0.05, 0.05), at=(0.5, 0.5), yaw=math.pi / 4),
    ],
)
def test_nothing_vanishes_between_the_middles_of_cells(shape):
    grid = np.zeros((20, 20), bool)
    draw(grid, 0.05, (0.0, 0.0), [shape])
    assert grid.sum() == 1 and grid[9:11, 9:11].any()
    draw(grid, 0.05, (5.0, 5.0), [shape])
    assert grid.sum() == 1, 'one off the grid is not drawn'


def test_shapes_are_drawn_as_large_as_they_are_and_thin_ones_as_a_cell():
    cells = np.zeros((40, 60), bool)
    draw(cells, 0.05, (0.0, 0.0), [Obstacle(size=(1.0, 0.5), at=(1.5, 1.0))])
    assert np.count_nonzero(cells) == 20 * 10 and cells[15:25, 20:40].all()
    thin = np.zeros((40, 60), bool)
    draw(thin, 0.05, (0.0, 0.0), [Obstacle(size=(2.0, 0.001), at=(1.5, 1.0), yaw=0.4)])
    columns = np.flatnonzero(thin.any(axis=0))
    assert np.array_equal(columns, np.arange(columns[0], columns[-1] + 1)) and len(columns) > 35
    disc = np.zeros((40, 60), bool)
    draw(disc, 0.05, (0.0, 0.0), [Obstacle(radius=0.6, at=(1.5, 1.0)), Obstacle(radius=0.5, at=(-9.0, 1.0))])
    assert np.count_nonzero(disc) * 0.05**2 == pytest.approx(math.pi * 0.6**2, rel=0.02)
