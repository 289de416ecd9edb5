"""Maps: the three modes against the peer, and refusals that name what is wrong."""

import json
import pathlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from sara_common.grids.images import read_image
from sara_nav.maps import map_io

DATA = pathlib.Path(__file__).parents[1] / 'data'
CASES = json.loads((DATA / 'map_images' / 'cases.json').read_text())
BARE = 'resolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n'
images = hnp.arrays(np.uint8, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


def test_every_case_of_the_peer():
    reference = np.load(DATA / 'costmap_reference.npz')
    assert len(CASES) == 180
    for case in CASES:
        pixels = read_image(DATA / 'map_images' / case['image'])
        ours = map_io.occupancy(pixels, case['mode'], case['negate'], case['occupied_thresh'], case['free_thresh'])
        theirs = reference[f'map_{case["index"]:03}'].reshape(ours.shape)
        assert (ours == theirs).all(), case


@given(images)
def test_the_bottom_row_comes_first_and_black_is_occupied(pixels):
    data = map_io.occupancy(pixels, 'trinary', False, 0.65, 0.196)
    assert ((data[::-1] == 100) == ((255.0 - pixels) / 255.0 > 0.65)).all()
    assert set(np.unique(data)) <= {-1, 0, 100}


def test_a_map_is_loaded_whole():
    grid_map = map_io.load_map(str(DATA / 'room.yaml'))
    assert grid_map.data.shape == (160, 160) and grid_map.data.dtype == np.int8
    assert (grid_map.geometry.origin_x, grid_map.geometry.resolution) == (-1.0, 0.05)
    assert grid_map.data[0, 0] == 100 and grid_map.data[20, 20] == 0 and grid_map.data[5, 150] == -1


@pytest.mark.parametrize('ending', ('pgm', 'png', 'bmp'))
def test_every_format_gives_the_same_map(tmp_path, ending):
    pixels = np.array([[0, 60, 100, 255], [254, 205, 0, 250], [10, 240, 150, 90]], np.uint8)
    Image.fromarray(pixels).save(tmp_path / ('a.' + ending))
    assert (read_image(tmp_path / ('a.' + ending)) == pixels).all()
    (tmp_path / 'a.yaml').write_text(f'image: a.{ending}\n{BARE}')
    grid_map = map_io.load_map(str(tmp_path / 'a.yaml'))
    assert grid_map.data.tolist() == [[100, 0, -1, -1], [0, -1, 100, 0], [100, 100, -1, 0]]
    assert grid_map.geometry.shape == (3, 4) and grid_map.geometry.resolution == 0.05


def test_a_spectrum_in_every_mode(tmp_path):
    """All 256 shades with thresholds 0.65 and 0.1: 90 are occupied, 26 free, 140 between, as in the peer's own test."""
    Image.fromarray(np.arange(256, dtype=np.uint8).reshape(16, 16)).save(tmp_path / 's.png')
    pixels = read_image(tmp_path / 's.png')
    trinary, scale, raw = (map_io.occupancy(pixels, mode, False, 0.65, 0.1) for mode in map_io.MODES)
    assert [(trinary == value).sum() for value in (100, 0, -1)] == [90, 26, 140]
    assert [(scale == 100).sum(), (scale == 0).sum(), ((scale > 0) & (scale < 100)).sum()] == [90, 26, 140]
    assert sorted(raw.ravel().tolist()) == list(range(-128, 128))


@given(images, st.sampled_from(map_io.MODES))
def test_a_picture_of_three_equal_channels_is_grey(pixels, mode):
    colours = np.repeat(pixels[:, :, None], 3, axis=2)
    assert (
        map_io.occupancy(colours, mode, False, 0.65, 0.196) == map_io.occupancy(pixels, mode, False, 0.65, 0.196)
    ).all()


@given(images, st.sampled_from(map_io.MODES))
def test_negate_turns_black_and_white_round(pixels, mode):
    assert (
        map_io.occupancy(pixels, mode, True, 0.65, 0.196) == map_io.occupancy(255 - pixels, mode, False, 0.65, 0.196)
    ).all()


def test_alpha_counts_in_trinary_and_hides_in_scale():
    pixels = np.array([[[120, 120, 120, 0], [120, 120, 120, 255], [0, 0, 0, 0]]], np.uint8)
    assert map_io.occupancy(pixels, 'scale', False, 0.65, 0.1).tolist() == [[-1, 77, 100]]
    assert map_io.occupancy(pixels, 'trinary', False, 0.65, 0.1).tolist() == [[-1, -1, 100]]
    assert map_io.occupancy(pixels, 'raw', False, 0.65, 0.1).tolist() == [[120, 120, 0]]


def test_numbers_may_be_written_as_the_peer_reads_them(tmp_path):
    """YAML 1.1 takes 5e-2 for a word; yaml-cpp, and so the peer, for a number."""
    (tmp_path / 'm.yaml').write_text(
        'image: a.pgm\nresolution: 5e-2\norigin: [-1e1, 2, .5]\nnegate: 1\n'
        'occupied_thresh: 1\nfree_thresh: 0\nmode: raw\nwidth: 3\n'
    )
    description = map_io.load_description(str(tmp_path / 'm.yaml'))
    assert (description.resolution, description.origin) == (0.05, (-10.0, 2.0, 0.5))
    assert description.negate is True and description.mode == 'raw' and description.unknown_keys == ('width',)
    assert description.image == str(tmp_path / 'a.pgm')


@pytest.mark.parametrize(
    'line,name',
    (
        ('resolution: 0', 'resolution is 0.0'),
        ('resolution: .inf', 'resolution is inf'),
        ('resolution: nan', 'resolution is nan'),
        ('resolution: true', 'resolution is True'),
        ('resolution: [1]', 'resolution is'),
        ('origin: [0, 0, .nan]', 'origin is'),
        ('origin: here', "origin is 'here'"),
        ('origin: [0, 0, 0, 0]', 'origin is'),
        ('negate: 2', 'negate is 2'),
        ('occupied_thresh: -0.1', 'occupied_thresh is -0.1'),
        ('free_thresh: 65', 'free_thresh is 65'),
        ('free_thresh: 0.7', 'free_thresh is 0.7, allowed is occupied_thresh'),
        ('mode: [raw]', 'mode is'),
        ('image: 3', 'image is 3'),
        ("image: ''", "image is ''"),
    ),
)
def test_each_bad_key_is_named(tmp_path, line, name):
    key = line.split(':')[0]
    kept = [entry for entry in ('image: a.pgm\n' + BARE).splitlines() if not entry.startswith(key)]
    path = tmp_path / 'bad.yaml'
    path.write_text('\n'.join([*kept, line]))
    with pytest.raises(map_io.MapError) as error:
        map_io.load_map(str(path))
    assert name in str(error.value) and 'missing' not in str(error.value)


@pytest.mark.parametrize('key', ('image', 'resolution', 'origin', 'negate', 'occupied_thresh', 'free_thresh'))
def test_each_missing_key_is_named(tmp_path, key):
    path = tmp_path / 'bad.yaml'
    path.write_text('\n'.join(e for e in ('image: a.pgm\n' + BARE).splitlines() if not e.startswith(key)))
    with pytest.raises(map_io.MapError, match=f'{key} is missing') as error:
        map_io.load_map(str(path))
    assert str(error.value).count(';') == 0


def test_what_is_missing_is_told_apart(tmp_path):
    with pytest.raises(map_io.MissingFile, match='nowhere.yaml does not exist'):
        map_io.load_map(str(tmp_path / 'nowhere.yaml'))
    (tmp_path / 'm.yaml').write_text('image: foo\n' + BARE)
    with pytest.raises(map_io.ImageError, match='foo does not exist'):
        map_io.load_map(str(tmp_path / 'm.yaml'))


def test_all_faults_are_said_at_once(tmp_path):
    path = tmp_path / 'bad.yaml'
    path.write_text('image: a.pgm\nresolution: -1\norigin: [0, 0]\nnegate: maybe\noccupied_thresh: 2\nmode: grey\n')
    with pytest.raises(map_io.MapError) as error:
        map_io.load_map(str(path))
    for name in (
        'resolution is -1',
        'origin is [0, 0]',
        "negate is 'maybe'",
        'occupied_thresh is 2',
        'free_thresh is missing',
        "mode is 'grey'",
    ):
        assert name in str(error.value)


@pytest.mark.parametrize('text', ['just words', '[1, 2]', 'a: [', ''])
def test_what_is_not_a_map_is_refused(tmp_path, text):
    path = tmp_path / 'bad.yaml'
    path.write_text(text)
    with pytest.raises(map_io.MapError, match='bad.yaml'):
        map_io.load_map(str(path))


@pytest.mark.parametrize('content', [None, b'', b'P5 3 3 255\nab', b'nonsense'])
def test_images_that_cannot_be_read_are_named(tmp_path, content):
    if content is not None:
        (tmp_path / 'i.pgm').write_bytes(content)
    (tmp_path / 'm.yaml').write_text(
        'image: i.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n'
    )
    with pytest.raises(map_io.MapError, match='i.pgm'):
        map_io.load_map(str(tmp_path / 'm.yaml'))
