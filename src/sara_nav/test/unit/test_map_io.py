"""Maps: the image formats, the three modes against the peer, and refusals that name what is wrong."""
import json
import pathlib
import tempfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from sara_nav import map_io

DATA = pathlib.Path(__file__).parents[1] / 'data'
CASES = json.loads((DATA / 'map_images' / 'cases.json').read_text())
images = hnp.arrays(np.uint8, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


def read(content):
    """Pixels of an image that is only in memory."""
    with tempfile.NamedTemporaryFile() as file:
        file.write(content)
        file.flush()
        return map_io.read_image(file.name)


@given(images)
def test_pgm_round_trip(pixels):
    header = b'%d %d\n255\n' % (pixels.shape[1], pixels.shape[0])
    binary = read(b'P5\n# made by a test\n' + header + pixels.tobytes())
    plain = read(b'P2\n' + header + ' '.join(str(v) for v in pixels.ravel()).encode())
    assert (binary == pixels).all() and (plain == pixels).all()


@given(st.binary(max_size=60), st.sampled_from((b'P5', b'P2', b'\x89PNG\r\n\x1a\n', b'')))
def test_a_damaged_image_is_refused_not_a_crash(content, magic):
    try:
        read(magic + content)
    except map_io.MapError:
        pass


def test_values_are_scaled_to_eight_bits():
    assert read(b'P5 2 1 65535\n' + np.array([0, 65535], '>u2').tobytes()).tolist() == [[0, 255]]
    assert read(b'P5 3 1 15\n' + bytes([0, 5, 15])).tolist() == [[0, 85, 255]]


def test_every_case_of_the_peer():
    reference = np.load(DATA / 'costmap_reference.npz')
    assert len(CASES) == 180
    for case in CASES:
        pixels = map_io.read_image(DATA / 'map_images' / case['image'])
        ours = map_io.occupancy(pixels, case['mode'], case['negate'], case['occupied_thresh'], case['free_thresh'])
        theirs = reference['map_%03d' % case['index']].reshape(ours.shape)
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


def test_png_is_read(tmp_path):
    pixels = np.arange(12, dtype=np.uint8).reshape(3, 4) * 20
    Image.fromarray(pixels).save(tmp_path / 'a.png')
    assert (map_io.read_image(tmp_path / 'a.png') == pixels).all()


def test_all_faults_are_said_at_once(tmp_path):
    path = tmp_path / 'bad.yaml'
    path.write_text('image: a.pgm\nresolution: -1\norigin: [0, 0]\nnegate: maybe\noccupied_thresh: 2\nmode: grey\n')
    with pytest.raises(map_io.MapError) as error:
        map_io.load_map(str(path))
    for name in ('resolution is -1', 'origin is [0, 0]', "negate is 'maybe'", 'occupied_thresh is 2',
                 'free_thresh is missing', "mode is 'grey'"):
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
    (tmp_path / 'm.yaml').write_text('image: i.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n'
                                     'occupied_thresh: 0.65\nfree_thresh: 0.196\n')
    with pytest.raises(map_io.MapError, match='i.pgm'):
        map_io.load_map(str(tmp_path / 'm.yaml'))
