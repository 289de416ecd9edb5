"""Named places: what is written is read again, comments stay, faults and unknown names are said, and the maps' own can
be turned about at.
"""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from sara_bringup.paths import share
from sara_nav.maps import map_io, places
from sara_nav.maps.places import Place, PlacesError

TURNING_RADIUS = 0.76
"""m; nearer to a wall the safety gate does not let the chair turn in place."""
HAND = """# ours
places:
    # downstairs
    kitchen: [1.0, 2.0, 90.0]     # by the window
    hall: [0, 0, 0]

other: 1   # somebody else's
"""
NAMES = st.from_regex(r'[A-Za-z][A-Za-z0-9_-]{0,8}', fullmatch=True)
POSES = st.tuples(st.floats(-99.0, 99.0), st.floats(-99.0, 99.0), st.floats(-3.1, 3.1))


@pytest.fixture(name='file')
def hand_written(tmp_path):
    path = tmp_path / 'house.places.yaml'
    path.write_text(HAND)
    return path


@given(st.dictionaries(NAMES, POSES, max_size=6))
def test_what_is_written_is_read(tmp_path_factory, wanted):
    path = tmp_path_factory.mktemp('places') / 'a.places.yaml'
    for name, pose in wanted.items():
        places.write(path, Place(name, *pose))
    read = places.load(path) if wanted else {}
    assert list(read) == list(wanted)
    for name, (x, y, yaw) in wanted.items():
        assert (read[name].x, read[name].y, read[name].yaw) == pytest.approx((x, y, yaw), abs=1.1e-3)


def test_adding_and_moving_leave_the_rest_as_it_was(file):
    assert places.write(file, Place('stairs', 4.0, 5.0, math.pi / 2)) is False
    assert places.write(file, Place('kitchen', 1.5, 2.5, -math.pi / 2)) is True
    assert file.read_text() == HAND.replace('kitchen: [1.0, 2.0, 90.0] ', 'kitchen: [1.500, 2.500, -90.0] ').replace(
        '    hall: [0, 0, 0]\n', '    hall: [0, 0, 0]\n    stairs: [4.000, 5.000, 90.0]\n'
    )
    assert [entry.name for entry in file.parent.iterdir()] == [file.name], 'nothing else is left there'


def test_the_first_place_of_an_empty_list(tmp_path):
    path = tmp_path / 'a.places.yaml'
    path.write_text('places: {}\n')
    places.write(path, Place('here', 1.0, 2.0, 0.0))
    assert places.load(path) == {'here': Place('here', 1.0, 2.0, 0.0)}


@pytest.mark.parametrize(
    'text',
    ('places: {kitchen: [1, 2, 3]}\n', '{places: {a: [1, 2, 3]}}\n', 'places:\n  a:\n    - 1\n    - 2\n    - 3\n'),
)
def test_a_file_of_another_form_is_not_touched_where_it_would_be_broken(tmp_path, text):
    path = tmp_path / 'a.places.yaml'
    path.write_text(text)
    before = places.load(path)
    try:
        places.write(path, Place('a', 7.0, 8.0, 0.0))
    except PlacesError as error:
        assert 'by hand' in str(error) and 'a: [7.000, 8.000, 0.0]' in str(error)
        assert path.read_text() == text
    else:
        assert places.load(path) == {**before, 'a': Place('a', 7.0, 8.0, 0.0)}


@pytest.mark.parametrize(
    'text, words',
    (
        ('places:\n  a: [1, 2]\n  b: [1, .nan, 3]\n', 'a holds [1, 2], allowed are three finite numbers'),
        ('places:\n  a: [1, 2]\n  b: [1, .nan, 3]\n', 'b holds'),
        ('places:\n  a: [1, true, 3]\n', 'a holds'),
        ('places:\n  7: [1, 2, 3]\n', '7 is no name'),
        ('places:\n  -x: [1, 2, 3]\n', "'-x' is no name"),
        ('a: 1\n', '`places` is missing'),
        ('', '`places` is missing'),
        ('places: [1]\n', '`places` is missing'),
        (f'places:\n  a: [1, 2, {"9" * 400}]\n', 'a holds'),
        (f'places:\n  a: [1, 2, {"9" * 5000}]\n', 'is no YAML'),
        ('places:\n  a: [1, 2, 2021-99-99]\n', 'is no YAML'),
        ('a: [', 'is no YAML'),
        ('[' * 3000, 'is no YAML'),
        (b'\xff\xfe', 'is no YAML'),
    ),
    ids=range(14),
)
def test_faults_are_named_and_the_file_stays_as_it_is(tmp_path, text, words):
    path = tmp_path / 'a.places.yaml'
    written = text if isinstance(text, bytes) else text.encode()
    path.write_bytes(written)
    for use in (places.load, lambda file: places.write(file, Place('b', 1.0, 2.0, 0.0))):
        with pytest.raises(PlacesError) as error:
            use(path)
        assert words in str(error.value) and str(path) in str(error.value)
    assert path.read_bytes() == written


def test_a_file_that_is_not_there_is_said(tmp_path):
    with pytest.raises(PlacesError, match='--here NAME'):
        places.load(tmp_path / 'none.places.yaml')
    (tmp_path / 'file').touch()
    with pytest.raises(PlacesError, match='cannot be written'):
        places.write(tmp_path / 'file' / 'a.places.yaml', Place('a', 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    'name, words',
    (('kitchn', 'did you mean kitchen'), ('KITCHE', 'did you mean kitchen'), ('zzz', 'there are kitchen, hall')),
)
def test_an_unknown_name_gets_near_ones(file, name, words):
    with pytest.raises(PlacesError, match=words):
        places.find(places.load(file), name, file)


def test_names_are_found_whatever_their_case_unless_two_differ_by_it_alone():
    first, second = Place('Den', 1.0, 0.0, 0.0), Place('den', 2.0, 0.0, 0.0)
    assert places.find({'Den': first}, 'den') is first
    assert places.find({'Den': first, 'den': second}, 'den') is second
    with pytest.raises(PlacesError, match='Den or den'):
        places.find({'Den': first, 'den': second}, 'DEN')
    with pytest.raises(PlacesError, match='empty'):
        places.find({}, 'den')


@pytest.mark.parametrize('numbers', (('1', '2', 'x'), ('1', 'nan', '0'), ('inf', '0', '0')))
def test_a_pose_that_is_none_is_refused(numbers):
    assert places.pose('1', '-2.5', '270') == Place('', 1.0, -2.5, pytest.approx(-math.pi / 2))
    with pytest.raises(PlacesError, match='three finite numbers'):
        places.pose(*numbers)


@pytest.mark.parametrize('name', ('1a', '-a', '', 'a b', 'a:b'))
def test_a_name_that_is_none_is_refused(tmp_path, name):
    with pytest.raises(PlacesError, match='is no name'):
        places.write(tmp_path / 'a.places.yaml', Place(name, 0.0, 0.0, 0.0))


MAPS = sorted(path.name.removesuffix('.places.yaml') for path in (share() / 'maps').glob('*.places.yaml'))


@pytest.mark.parametrize('name', MAPS)
def test_the_chair_can_turn_about_at_the_places_of_our_maps(name):
    files = [path.stem for path in (share() / 'maps').glob('*.yaml') if '.places' not in path.name]
    assert sorted(stem for stem in files if not stem.endswith('_world')) == MAPS, 'worlds beside maps have none'
    grid = map_io.load_map(str(share() / 'maps' / f'{name}.yaml'))
    free = grid.geometry.resolution * ndimage.distance_transform_edt(grid.data == map_io.FREE)
    for place in places.load(places.beside(share() / 'maps' / f'{name}.yaml')).values():
        column, row = grid.geometry.to_cell(place.x, place.y)
        assert free[row, column] > TURNING_RADIUS, place
