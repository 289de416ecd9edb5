"""The calibration file: what is saved is loaded, half a file never exists, and a bad one is one sentence."""

import os
from contextlib import suppress

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from canserial.calibration.calibration_file import Calibration, CalibrationFileError, load, load_offset, save
from canserial.calibration.iron import Iron

OFFSETS = st.tuples(*[st.floats(-20.0, 20.0)] * 3)
SIGMAS = st.tuples(*[st.floats(0.0, 20.0)] * 3)


@given(
    st.builds(
        Calibration,
        gyro_offset=st.none() | OFFSETS,
        gyro_sigma=st.none() | SIGMAS,
        gyro_frames=st.none() | st.integers(1, 10000),
        gyro_measured=st.none() | st.just('2026-01-02T03:04:05+00:00'),
        gain=st.none() | st.floats(0.5, 2.0),
        gain_error=st.none() | st.floats(0.0, 1.0),
    )
)
@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_saved_is_loaded(tmp_path, calibration):
    if calibration == Calibration():
        return
    save(tmp_path / 'deep' / 'file.yaml', calibration)
    assert load(tmp_path / 'deep' / 'file.yaml') == calibration
    assert os.listdir(tmp_path / 'deep') == ['file.yaml'], 'nothing temporary is left'


def test_it_is_yaml_for_people(tmp_path):
    path = tmp_path / 'c.yaml'
    save(path, Calibration(gyro_offset=(-0.49, -0.91, -0.65), gain=1.08))
    assert yaml.safe_load(path.read_text()) == {'gyro_offset': [-0.49, -0.91, -0.65], 'gain': 1.08}
    assert path.read_text().startswith('# ')


def test_an_update_keeps_the_rest(tmp_path):
    path = tmp_path / 'c.yaml'
    save(path, Calibration(gain=1.1))
    save(path, load(path).updated(gyro_offset=(1.0, 2.0, 3.0)))
    assert load(path) == Calibration(gain=1.1, gyro_offset=(1.0, 2.0, 3.0))


@pytest.mark.parametrize(
    'text, sentence',
    [
        ('', 'is damaged: it holds no fields'),
        ('[1, 2]', 'is damaged: it holds no fields'),
        ('gyro_offset: [-0.49, -0.9', 'is damaged: while parsing'),
        ('\x00\x01', 'is damaged'),
        ('gyro_offset: [0, 0, 0]\nspeed: 3', 'is damaged: it holds speed'),
        ('gyro_offset: [-0.49, -0.91]', r'is implausible: gyro_offset is \(-0.49, -0.91\), allowed are three numbers'),
        ('gyro_offset: [0, 0, 21]', 'is implausible: gyro_offset'),
        ('gyro_offset: [0, 0, .nan]', 'is implausible: gyro_offset'),
        ('gyro_offset: [0, 0, yes]', 'is implausible: gyro_offset'),
        ('gain: 10.8', 'is implausible: gain is 10.8, allowed is 0.5 to 2'),
        ('gain: -1.08\ngyro_frames: 0\ngain_error: -1', 'gyro_frames is 0.*gain is -1.08.*gain_error is -1'),
        ('gyro_offset: !!python/object:os.system {}', 'is damaged'),
    ],
)
def test_a_bad_file_is_an_error_of_one_sentence(tmp_path, text, sentence):
    path = tmp_path / 'c.yaml'
    path.write_text(text)
    with pytest.raises(CalibrationFileError, match=sentence) as raised:
        load(path)
    assert '\n' not in str(raised.value) and str(path) in str(raised.value)


@given(st.binary(max_size=200))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_an_error_or_a_plausible_calibration(tmp_path, content):
    path = tmp_path / 'c.yaml'
    path.write_bytes(content)
    with suppress(CalibrationFileError):
        assert load(path).faults() == []


def test_missing_or_without_an_offset(tmp_path):
    with pytest.raises(FileNotFoundError):
        load(tmp_path / 'none.yaml')
    with pytest.raises(CalibrationFileError, match='there is no calibration file .*none.yaml: measure once'):
        load_offset(tmp_path / 'none.yaml')
    save(tmp_path / 'c.yaml', Calibration(gain=1.1))
    with pytest.raises(CalibrationFileError, match='holds no gyro_offset'):
        load_offset(tmp_path / 'c.yaml')


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / 'c.yaml'
    save(path, Calibration(gain=1.1))

    def full(*_):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr('os.fsync', full)
    with pytest.raises(CalibrationFileError, match='cannot be written: .*No space left'):
        save(path, Calibration(gain=1.2))
    assert load(path).gain == 1.1
    assert os.listdir(tmp_path) == ['c.yaml']


def test_nothing_implausible_is_saved(tmp_path):
    with pytest.raises(CalibrationFileError, match='an implausible calibration is not saved: gain is 5.0'):
        save(tmp_path / 'c.yaml', Calibration(gain=5.0))
    assert os.listdir(tmp_path) == []


IRON = Iron(
    (1.0, -2.0, 3.5), (1.0, 0.1, 0.0, 0.1, 0.9, 0.0, 0.0, 0.0, 1.0), 25.7, 37.1, (0.5, -0.4), (0.01, 0.0), 1.09, 0.6
)


def test_the_compass_s_iron_is_kept_beside_the_rest(tmp_path):
    path = tmp_path / 'c.yaml'
    save(path, Calibration(gain=1.1))
    save(path, load(path).updated(**IRON.fields(), compass_measured='today'))
    assert load(path).iron == IRON and load(path).gain == 1.1
    assert Calibration(gain=1.1).iron is None


@pytest.mark.parametrize(
    'change, sentence',
    [
        ({'compass_matrix': (1.0,) * 8}, 'compass_matrix is'),
        ({'compass_offset': None}, 'compass_offset is None'),
        ({'compass_horizontal': 'strong'}, 'compass_horizontal is'),
        ({'compass_gain': 9.0}, 'compass_gain is 9.0, allowed is 0.5 to 2'),
    ],
)
def test_an_iron_that_cannot_be_is_named(tmp_path, change, sentence):
    with pytest.raises(CalibrationFileError, match=sentence):
        save(tmp_path / 'c.yaml', Calibration(**{**IRON.fields(), **change}))
