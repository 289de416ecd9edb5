"""Images: every format gives the same pixels, and damaged ones are refused by name."""

import contextlib
import io
import tempfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from sara_common.grids.images import ImageError, read_image

images = hnp.arrays(np.uint8, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


def read(content):
    """Pixels of an image that is only in memory."""
    with tempfile.NamedTemporaryFile() as file:
        file.write(content)
        file.flush()
        return read_image(file.name)


@given(images)
def test_pgm_round_trip(pixels):
    header = b'%d %d\n255\n' % (pixels.shape[1], pixels.shape[0])
    binary = read(b'P5\n# made by a test\n' + header + pixels.tobytes())
    plain = read(b'P2\n' + header + ' '.join(str(v) for v in pixels.ravel()).encode())
    assert (binary == pixels).all() and (plain == pixels).all()


@given(
    images,
    st.lists(st.sampled_from((b' ', b'\n', b'\t', b' # of a comment 7 7\n', b'\n#\n\n')), min_size=3, max_size=3),
    st.sampled_from((0, 1, 3)),
)
def test_a_binary_pgm_is_what_pillow_reads(pixels, gaps, more):
    numbers = (b'%d' % pixels.shape[1], b'%d' % pixels.shape[0], b'255')
    content = (
        b'P5' + b''.join(gap + number for gap, number in zip(gaps, numbers)) + b'\n' + pixels.tobytes() + more * b'x'
    )
    with Image.open(io.BytesIO(content)) as image:
        assert (read(content) == np.asarray(image)).all()


@given(st.binary(max_size=60), st.sampled_from((b'P5', b'P2', b'\x89PNG\r\n\x1a\n', b'')))
def test_a_damaged_image_is_refused_not_a_crash(content, magic):
    with contextlib.suppress(ImageError):
        read(magic + content)


def test_values_are_scaled_to_eight_bits():
    assert read(b'P5 2 1 65535\n' + np.array([0, 65535], '>u2').tobytes()).tolist() == [[0, 255]]
    assert read(b'P5 3 1 15\n' + bytes([0, 5, 15])).tolist() == [[0, 85, 255]]


@pytest.mark.parametrize('mode,channels', (('1', 2), ('L', 2), ('P', 3), ('RGB', 3), ('LA', 4), ('RGBA', 4)))
def test_every_kind_of_png_becomes_grey_or_colours(tmp_path, mode, channels):
    image = Image.new('L', (3, 2), 255).convert(mode)
    image.save(tmp_path / 'k.png')
    pixels = read_image(tmp_path / 'k.png')
    assert pixels.shape == ((2, 3) if channels == 2 else (2, 3, channels)) and (pixels == 255).all()


def test_every_kind_of_image_gives_the_same(tmp_path):
    pixels = np.random.default_rng(0).integers(0, 256, (13, 29), np.uint8)
    raw = pixels.tobytes()
    heads = {
        'plain.pgm': b'P5\n29 13\n255\n',
        'comment.pgm': b'P5 # made by hand\n# twice\n29\t13\n#\n255\n',
        'one_line.pgm': b'P5 29 13 255 ',
    }
    for name, head in heads.items():
        (tmp_path / name).write_bytes(head + raw)
    (tmp_path / 'text.pgm').write_text('P2\n29 13\n255\n' + ' '.join(map(str, pixels.ravel())) + '\n')
    Image.fromarray(pixels).save(tmp_path / 'picture.png')
    for name in (*heads, 'text.pgm', 'picture.png'):
        np.testing.assert_array_equal(read_image(tmp_path / name), pixels, err_msg=name)


def test_images_that_are_none_are_named(tmp_path):
    for name, data in (
        ('short.pgm', b'P5\n29 13\n255\n123'),
        ('empty.pgm', b''),
        ('huge.pgm', b'P5 0 0 255 '),
        ('noise.png', bytes(range(256))),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ImageError, match=f'{name} cannot be read'):
            read_image(tmp_path / name)
    with pytest.raises(ImageError, match='nowhere.pgm does not exist'):
        read_image(tmp_path / 'nowhere.pgm')
