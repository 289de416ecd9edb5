"""What is drawn over a map: its file, and which cells it changes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_nav.grids.grid import GridGeometry
from sara_nav.maps import edits
from sara_nav.maps.edits import CLEARED, KEEP_OUT, MOST, WALL, Edit, EditsError
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN, GridMap

DOOR = Edit(WALL, (1.0, 0.5), (1.0, 1.5))
PERSON = Edit(CLEARED, (0.2, 0.2), (0.6, 0.7))
STAIRS = Edit(KEEP_OUT, (3.0, 3.0), (2.0, 2.5))


def grid(value=FREE, cells=80, resolution=0.05, x=0.0, y=0.0, yaw=0.0):
    return GridMap(np.full((cells, cells), value, np.int8), GridGeometry(cells, cells, resolution, x, y), yaw)


def changed(grid_map, other):
    """{(column, row)} of the cells that differ."""
    return {(int(column), int(row)) for row, column in zip(*np.nonzero(grid_map.data != other.data))}


def middle_of(grid_map, column, row):
    """The middle of a cell in the map frame, m."""
    g, c, s = grid_map.geometry, math.cos(grid_map.origin_yaw), math.sin(grid_map.origin_yaw)
    u, v = (column + 0.5) * g.resolution, (row + 0.5) * g.resolution
    return g.origin_x + c * u - s * v, g.origin_y + s * u + c * v


# -- the file -------------------------------------------------------------------------------------------------------


def test_what_is_written_is_read(tmp_path):
    path = edits.beside(tmp_path / 'flat.yaml')
    assert path.name == 'flat.edits.yaml' and edits.load(path) == ()
    edits.write(path, [DOOR, PERSON, STAIRS])
    assert edits.load(path) == (DOOR, PERSON, STAIRS)
    edits.write(path, [])
    assert edits.load(path) == () and [held.name for held in tmp_path.iterdir()] == ['flat.edits.yaml']


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(edits.KINDS), *[st.floats(-1e4, 1e4)] * 4), max_size=5))
def test_any_edits_are_kept_to_the_millimetre(tmp_path_factory, drawn):
    path = tmp_path_factory.mktemp('maps') / 'm.edits.yaml'
    kept = [edit for edit in (Edit(kind, (a, b), (c, d)) for kind, a, b, c, d in drawn) if not edit.fault()]
    kept = [edit for edit in kept if abs(edit.a[0] - edit.b[0]) > 0.1 and abs(edit.a[1] - edit.b[1]) > 0.1]
    edits.write(path, kept)
    again = edits.load(path)
    assert [edit.kind for edit in again] == [edit.kind for edit in kept]
    for old, new in zip(kept, again):
        assert np.allclose([*old.a, *old.b], [*new.a, *new.b], rtol=0.0, atol=0.000501)
    edits.write(path, again)
    assert edits.load(path) == again


def test_a_file_by_hand_is_read(tmp_path):
    path = tmp_path / 'm.edits.yaml'
    path.write_text('# mine\nedits:\n- wall: [[0, 1], [2, 1.5]]  # the door\n')
    assert edits.load(path) == (Edit(WALL, (0.0, 1.0), (2.0, 1.5)),)
    path.write_text('edits:\n')
    assert edits.load(path) == ()


@pytest.mark.parametrize(
    'text, words',
    [
        ('edits: [', 'is no YAML'),
        ('- a\n', '`edits` is missing'),
        ('edits: {wall: 1}\n', '`edits` is missing'),
        ('walls: []\n', '`edits` is missing'),
        ('edits:\n- wall\n', "'wall' is no edit"),
        ('edits:\n- {wall: [[0, 0], [1, 1]], free: [[0, 0], [1, 1]]}\n', 'is no edit'),
        ('edits:\n- wall: [[0, 0], [1]]\n', 'is no edit'),
        ('edits:\n- wall: [[0, 0], [true, 1]]\n', 'is no edit'),
        ('edits:\n- wall: [[0, 0], [.nan, 1]]\n', 'must have finite numbers'),
        ('edits:\n- wall: [[0, 0], [1e9, 1]]\n', 'wall'),
        ('edits:\n- lava: [[0, 0], [1, 1]]\n', "'lava' is no kind of edit, allowed are free, wall, keep_out"),
        ('edits:\n- free: [[0, 0], [1, 0]]\n', 'is too small: its sides must be at least 0.05 m'),
        ('edits:\n- wall: [[1, 1], [1, 1]]\n', 'is too small: its length must be at least 0.05 m'),
        ('edits:\n' + '- wall: [[0, 0], [1, 1]]\n' * (MOST + 1), f'there are {MOST + 1} edits, allowed are {MOST}'),
        ('[' * 3000, 'is no YAML'),
        (f'edits:\n- wall: [[0, 0], [1, {"9" * 400}]]\n', 'is no edit'),
        (f'edits:\n- wall: [[0, 0], [1, {"9" * 5000}]]\n', 'is no YAML'),
    ],
    ids=range(17),
)
def test_a_faulty_file_is_refused_in_words(tmp_path, text, words):
    path = tmp_path / 'm.edits.yaml'
    path.write_text(text)
    with pytest.raises(EditsError) as fault:
        edits.load(path)
    assert words in str(fault.value) and str(path) in str(fault.value)


def test_every_fault_is_named_at_once(tmp_path):
    path = tmp_path / 'm.edits.yaml'
    path.write_text('edits:\n- lava: [[0, 0], [1, 1]]\n- free: [[0, 0], [1, 0]]\n')
    with pytest.raises(EditsError, match='lava.*too small'):
        edits.load(path)


def test_what_cannot_be_written_loses_nothing(tmp_path):
    path = tmp_path / 'm.edits.yaml'
    edits.write(path, [DOOR])
    before = path.read_bytes()
    for bad in ([DOOR] * (MOST + 1), [replace(DOOR, b=(math.nan, 0.0))], [replace(DOOR, kind='')]):
        with pytest.raises(EditsError):
            edits.write(path, bad)
    assert path.read_bytes() == before
    with pytest.raises(EditsError, match='cannot be written'):
        edits.write(path / 'below' / 'm.edits.yaml', [DOOR])


def test_a_file_that_cannot_be_read_is_said(tmp_path):
    path = tmp_path / 'm.edits.yaml'
    path.mkdir()
    with pytest.raises(EditsError, match='directory'):
        edits.load(path)


# -- on the map -----------------------------------------------------------------------------------------------------


def test_without_edits_it_is_the_same_map():
    room = grid()
    assert edits.drawn(room, ()) is room and edits.drawn(room, [STAIRS]) is room
    assert not edits.keep_out_mask(room, [DOOR, PERSON]).data.any()


def test_a_person_is_erased_and_the_map_given_stays_as_it_was():
    room = grid(OCCUPIED)
    free = changed(room, edits.drawn(room, [PERSON]))
    # middles from 0.2 to 0.6 m and 0.2 to 0.7 m, and half a cell more on each side
    assert {column for column, _ in free} >= set(range(4, 12)) and {row for _, row in free} >= set(range(4, 14))
    assert free <= {(column, row) for column in range(3, 13) for row in range(3, 15)}
    assert (room.data == OCCUPIED).all()


def test_a_wall_closes_and_later_edits_cover_earlier_ones():
    room = grid(UNKNOWN)
    shown = edits.drawn(room, [DOOR])
    assert set(np.unique(shown.data)) == {UNKNOWN, OCCUPIED}
    for row in range(10, 30):
        assert shown.data[row, 19] == OCCUPIED or shown.data[row, 20] == OCCUPIED
    both = edits.drawn(room, [DOOR, replace(PERSON, a=(0.8, 0.8), b=(1.2, 1.0))])
    assert (both.data[17:19, 17:23] == FREE).all() and both.data[12, 19] == OCCUPIED


@settings(max_examples=60, deadline=None)
@given(st.floats(0.3, 3.7), st.floats(0.3, 3.7), st.floats(0.3, 3.7), st.floats(0.3, 3.7), st.floats(-3.0, 3.0))
def test_nothing_slips_through_a_wall(x0, y0, x1, y1, yaw):
    """Not even over corners: cells on the line's two sides are never neighbours, whatever the map's origin."""
    edit = Edit(WALL, (x0, y0), (x1, y1))
    if edit.fault():
        return
    room = grid(cells=200, x=-3.0, y=-2.0, yaw=yaw)
    cells = changed(room, edits.drawn(room, [edit]))
    # every point of the line that is on the map lies in one of its cells
    g, c, s = room.geometry, math.cos(yaw), math.sin(yaw)
    for share in np.linspace(0.0, 1.0, 200):
        x, y = x0 + share * (x1 - x0) - g.origin_x, y0 + share * (y1 - y0) - g.origin_y
        column, row = int((c * x + s * y) // g.resolution), int((c * y - s * x) // g.resolution)
        if 0 <= column < 200 and 0 <= row < 200:
            assert (column, row) in cells
    for column, row in cells:
        x, y = middle_of(room, column, row)
        along = np.clip(((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / ((x1 - x0) ** 2 + (y1 - y0) ** 2), 0, 1)
        assert math.hypot(x - x0 - along * (x1 - x0), y - y0 - along * (y1 - y0)) <= 0.75 * g.resolution + 1e-9


@pytest.mark.parametrize('yaw', [0.0, 0.5, -2.5])
def test_a_rectangle_lies_along_the_map_frame_however_the_map_lies(yaw):
    room = grid(cells=200, x=-1.0, y=-2.0, yaw=yaw)
    mask = edits.keep_out_mask(room, [STAIRS])
    assert mask.geometry == room.geometry and mask.origin_yaw == yaw
    for column in range(200):
        for row in range(0, 200, 7):
            x, y = middle_of(room, column, row)
            inside = 2.0 - 0.025 <= x <= 3.0 + 0.025 and 2.5 - 0.025 <= y <= 3.0 + 0.025
            near = min(abs(x - 1.975), abs(x - 3.025), abs(y - 2.475), abs(y - 3.025)) < 1e-6
            assert near or (mask.data[row, column] == 100) == inside


def test_what_lies_off_the_map_is_left_out():
    room = grid()
    away = [replace(edit, a=(edit.a[0] + 50.0, edit.a[1]), b=(edit.b[0] + 50.0, edit.b[1])) for edit in (DOOR, PERSON)]
    assert not changed(room, edits.drawn(room, away))
    half = edits.keep_out_mask(room, [replace(STAIRS, a=(3.0, 3.0), b=(9.0, 9.0))])
    assert (half.data[60:, 60:] == 100).all() and not half.data[:59].any()
