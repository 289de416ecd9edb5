"""The estimate as tables and as a picture, and how far a way is from another."""

import csv
import io
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_localization.bags.alignment import local_plane, rmse
from sara_localization.bags.export import CSV_HEADER, CsvWriter, InputTrack, Track, TumWriter
from sara_localization.bags.plots import brought_to, draw_drive
from sara_localization.config.filter_config import FilterConfig
from sara_localization.engine.engine import FilterEngine
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.gps.tangent_plane import TangentPlane
from sara_localization.inputs.data import TwistData


def outputs():
    """A second of driving forward, as the filter gives it."""
    params = {'two_d_mode': True, 'twist0': 't', 'twist0_config': [False] * 6 + [True] * 6 + [False] * 3}
    engine = FilterEngine(FilterConfig.from_params(params), TransformBuffer())
    for k in range(1, 31):
        engine.add_twist(
            'twist0', TwistData(100.0 + k / 30.0, 'base_link', (1.0, 0.0, 0.0), (0.0, 0.0, 0.5), np.eye(6) * 1e-4)
        )
        yield engine.tick(100.0 + k / 30.0)


def test_csv_holds_state_and_standard_deviations():
    file = io.StringIO()
    writer, given_outputs = CsvWriter(file), list(outputs())
    for output in given_outputs:
        writer.write(output)
    rows = list(csv.DictReader(io.StringIO(file.getvalue())))
    assert tuple(rows[0]) == CSV_HEADER and len(rows) == len(given_outputs)
    assert float(rows[-1]['x']) == pytest.approx(given_outputs[-1].state[0], rel=1e-8)
    assert float(rows[-1]['sigma_yaw']) == pytest.approx(math.sqrt(given_outputs[-1].covariance[5, 5]), rel=1e-5)


def test_tum_lines_are_eight_numbers_with_a_unit_quaternion():
    file = io.StringIO()
    writer = TumWriter(file)
    for output in outputs():
        writer.write(output)
    table = np.loadtxt(io.StringIO(file.getvalue()))
    assert table.shape == (30, 8)
    assert (table[:, 4:] ** 2).sum(axis=1) == pytest.approx(np.ones(30), abs=1e-8)
    assert table[-1, 0] == pytest.approx(101.0)


def test_a_drive_is_drawn(tmp_path):
    track, wheels = Track(), InputTrack('odom0')
    for output in outputs():
        track.write(output)
        wheels.add(output.stamp, float(output.state[0]) + 3.0, 1.0, 0.5)
    path = tmp_path / 'drive.png'
    draw_drive(str(path), track, [wheels, InputTrack('silent')], 'a drive')
    assert path.read_bytes().startswith(b'\x89PNG') and path.stat().st_size > 10000


@given(st.floats(-math.pi, math.pi), st.floats(-50.0, 50.0), st.floats(-50.0, 50.0))
def test_alignment_forgives_where_a_way_begins_and_nothing_else(angle, x, y):
    t = np.linspace(0.0, 10.0, 50)
    way = np.column_stack([t, np.sin(t)])
    c, s = math.cos(angle), math.sin(angle)
    moved = way @ np.array([[c, s], [-s, c]]) + (x, y)
    assert rmse(t, moved, t, way) < 1e-9
    table = np.column_stack([t, way, np.zeros(50)])
    begun = brought_to((x, y, angle), table)
    assert (begun[0][0], begun[1][0]) == (x, y)
    assert rmse(t, np.column_stack(begun), t, way) < 1e-9
    assert rmse(t, moved * 1.1, t, way) > 0.05


def test_the_local_plane_is_in_metres():
    plane = local_plane(np.array([60.0, 60.001]), np.array([10.0, 10.001]))
    assert plane[1] == pytest.approx([55.80, 111.41], abs=0.01)


@pytest.mark.parametrize('place', [(-16.8, 180.0), (60.0, 10.0), (0.5, -180.0), (-45.0, 0.0)])
def test_the_local_plane_is_the_earth_s_and_goes_on_over_180_degrees(place):
    latitude, longitude = place[0] + 0.001, (place[1] + 0.002 + 180.0) % 360.0 - 180.0
    plane = local_plane(np.array([place[0], latitude]), np.array([place[1], longitude]))
    assert tuple(plane[1]) == pytest.approx(TangentPlane(*place).forward(latitude, longitude), abs=0.02)


def test_a_way_without_a_yaw_is_in_the_estimate_s_frame_already():
    table = np.column_stack([np.arange(3.0), [0.0, 1.0, 2.0], [5.0] * 3, [math.nan] * 3])
    x, y = brought_to((0.1, 5.1, -1.5), table)
    assert x.tolist() == [0.0, 1.0, 2.0] and y.tolist() == [5.0] * 3
