"""Saving maps: what is written is read back the same, in folders, with thresholds; what cannot be written is said."""

import math
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sara_nav.grids.grid import GridGeometry
from sara_nav.maps import map_io
from sara_nav.maps.map_saver import SaveError, SaverConfig, grey_values, save_map

numbers = st.floats(-1e6, 1e6, allow_nan=False)
resolutions = st.floats(1e-6, 1e3)
shapes = hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=9)


def a_map(data, resolution=0.05, x=-1.0, y=2.0, yaw=0.0):
    data = np.asarray(data, np.int8)
    return map_io.GridMap(data, GridGeometry(data.shape[1], data.shape[0], resolution, x, y), yaw)


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp('saved')


@given(
    data=hnp.arrays(np.int8, shapes, elements=st.sampled_from((-1, 0, 100))),
    resolution=resolutions,
    x=numbers,
    y=numbers,
    yaw=st.floats(-math.pi, math.pi),
    image_format=st.sampled_from(('pgm', 'png')),
)
def test_free_occupied_unknown_come_back_the_same(folder, data, resolution, x, y, yaw, image_format):
    _, description = save_map(
        a_map(data, resolution, x, y, yaw), SaverConfig(str(folder / 'm'), image_format=image_format)
    )
    again = map_io.load_map(description)
    assert (again.data == data).all() and again.origin_yaw == yaw
    assert again.geometry == GridGeometry(data.shape[1], data.shape[0], resolution, x, y)


@given(hnp.arrays(np.int8, shapes), st.sampled_from(('pgm', 'png')))
def test_raw_loses_nothing(folder, data, image_format):
    _, description = save_map(a_map(data), SaverConfig(str(folder / 'raw'), mode='raw', image_format=image_format))
    assert (map_io.load_map(description).data == data).all()


@given(st.integers(1, 100), st.integers(0, 99))
def test_thresholds_say_what_is_black_and_white(occupied, free):
    if free >= occupied:
        return
    values = np.arange(-128, 128).astype(np.int8)
    grey = grey_values(values[None, :], SaverConfig(occupied=occupied, free=free))[0]
    assert (grey == np.where(values >= occupied, 0, np.where((values >= 0) & (values <= free), 254, 205))).all()


def test_the_files_are_those_of_the_ros_format(tmp_path):
    image, description = save_map(a_map([[0, 100], [-1, 50]]), SaverConfig(str(tmp_path / "it's")))
    assert (tmp_path / "it's.pgm").read_bytes() == b'P5\n2 2\n255\n' + bytes([205, 205, 254, 0])
    assert (tmp_path / "it's.yaml").read_text() == (
        "image: 'it''s.pgm'\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\nnegate: 0\noccupied_thresh: "
        '0.65\nfree_thresh: 0.196\n'
    )
    assert (image, description) == (str(tmp_path / "it's.pgm"), str(tmp_path / "it's.yaml"))
    assert sorted(os.listdir(tmp_path)) == ["it's.pgm", "it's.yaml"]


def test_a_pair_in_a_folder_is_found_from_anywhere(tmp_path, monkeypatch):
    (tmp_path / 'maps').mkdir()
    monkeypatch.chdir(tmp_path)
    save_map(a_map([[0, 100]]), SaverConfig('maps/here'))
    assert map_io.load_map('maps/here.yaml').data.tolist() == [[0, 100]]
    os.rename('maps', 'moved')
    assert map_io.load_map('moved/here.yaml').data.tolist() == [[0, 100]]


def test_what_cannot_be_written_is_said_and_leaves_nothing(tmp_path):
    with pytest.raises(SaveError, match='nowhere.*m.pgm cannot be written: No such file'):
        save_map(a_map([[0]]), SaverConfig(str(tmp_path / 'nowhere' / 'm')))
    with pytest.raises(SaveError, match='not finite'):
        save_map(a_map([[0]], yaw=math.nan), SaverConfig(str(tmp_path / 'm')))
    (tmp_path / 'd.yaml').mkdir()
    with pytest.raises(SaveError, match='d.yaml cannot be written'):
        save_map(a_map([[0]]), SaverConfig(str(tmp_path / 'd')))
    assert sorted(os.listdir(tmp_path)) == ['d.pgm', 'd.yaml']


@pytest.mark.parametrize(
    'values,words',
    (
        ({'occupied': 0}, '--occ is 0'),
        ({'occupied': 101}, '--occ is 101'),
        ({'free': -1}, '--free is -1'),
        ({'free': 65}, '--free is 65, allowed is smaller than --occ'),
        ({'name': 'folder/'}, '-f is'),
        ({'image_format': 'gif'}, '--fmt is'),
        ({'mode': 'scale'}, '--mode is'),
    ),
)
def test_bad_options_are_named(values, words):
    with pytest.raises(ValueError, match=words):
        save_map(a_map([[0]]), SaverConfig(**values))
