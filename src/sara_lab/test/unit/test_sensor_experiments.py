"""E1, E2, E3 and E6 on two chairs (the campaign: three): the thesis's figures come out, what is not them is found."""

import dataclasses
import json

import numpy as np
import pytest
from steady import whole

from sara_lab.experiments import plotting, sensor_report


@pytest.fixture(scope='module')
def chairs():
    return sensor_report.run(range(whole(3, 2)))


def test_the_thesis_figures_come_out(chairs):
    assert sensor_report.verdict(chairs) == []


def test_the_table_has_each_experiment_and_says_what_is_not_reproduced(chairs):
    text = sensor_report.table(chairs)
    for part in ('E1', 'E2', 'E3', 'E6', '-0.9498', '-0.6456', '332.5', 'Not reproduced'):
        assert part in text


def test_json_is_plain(chairs):
    data = json.loads(json.dumps(sensor_report.to_json(chairs)))
    assert [chair['seed'] for chair in data] == list(range(len(chairs)))
    assert data[0]['accel_before']['mean'][0] == pytest.approx(-0.9498, abs=0.05)


def test_a_seed_says_everything(chairs):
    assert sensor_report.to_json(sensor_report.run([1])) == sensor_report.to_json(chairs[1:2])


def test_figures_are_the_thesis_s(chairs, tmp_path, monkeypatch):
    monkeypatch.setitem(plotting.STYLE, 'figure.dpi', 30)
    sensor_report.figures(chairs[0], tmp_path)
    assert len(list(tmp_path.glob('fig_4_*.png'))) == 12


@pytest.mark.parametrize(
    'shift, word', ((np.array((0.1, 0.0, 0.0)), 'accel x before'), (np.array((0.0, 0.0, -0.6)), 'accel z before'))
)
def test_a_wrong_chip_is_found(chairs, shift, word):
    wrong = [
        {
            **chair,
            'rest': {
                **chair['rest'],
                'before': dataclasses.replace(chair['rest']['before'], accel=chair['rest']['before'].accel + shift),
            },
        }
        for chair in chairs
    ]
    assert any(word in fault for fault in sensor_report.verdict(wrong))


def test_a_calibration_that_did_nothing_is_found(chairs):
    lazy = [{**chair, 'rest': {**chair['rest'], 'after': chair['rest']['before']}} for chair in chairs]
    faults = ' '.join(sensor_report.verdict(lazy))
    assert "accelerometer's mean" in faults and "gyroscope's mean" in faults
