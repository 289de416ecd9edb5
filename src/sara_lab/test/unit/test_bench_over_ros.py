"""E1 to E6 over ROS: what is heard of the chips becomes the very results that the experiments have in lockstep."""

import math

import numpy as np
import pytest

from canserial.dbc.bus import BusDescription
from sara_lab.experiments import orientation, registry, rest, sensor_experiments, turns
from sara_lab.experiments.core import Case
from sara_lab.ros.experiments import bench_over_ros

SEED = 3


def minute(calibrated):
    return list(sensor_experiments._frames(sensor_experiments._chair(SEED, calibrated), sensor_experiments.MINUTE_S))


def hears(monkeypatch, answers):
    """Let the bench say `answers[task]()`; returns the list of what it is asked."""
    asked = []

    def heard(task, seed, speed, say, **launch):
        asked.append((task, seed, speed, launch))
        return answers[task]()

    monkeypatch.setattr(bench_over_ros, 'heard', heard)
    return asked


def ran(function):
    return bench_over_ros.run_case(Case(('a', SEED), function, SEED), 4.0, lambda text: None)


def test_a_minute_s_frames_give_the_moments_of_lockstep(monkeypatch):
    asked = hears(monkeypatch, {'before': lambda: minute(False), 'after': lambda: minute(True)})
    result, lockstep = ran(rest.rest_case), rest.rest_case(SEED)
    assert result == lockstep and asked == [('before', SEED, 4.0, {'calibrate': 'false'}), ('after', SEED, 4.0, {})]
    for name in ('E1', 'E2'):
        assert registry.EXPERIMENTS[name].figures(result) == registry.EXPERIMENTS[name].figures(lockstep)


def test_yaw_is_integrated_as_in_lockstep_and_taken_from_read_py(monkeypatch):
    t = np.arange(0.0, 60.0, 0.2)
    hears(monkeypatch, {'after': lambda: minute(True), 'yaw': lambda: (t, np.radians(7.0 - 0.01 * t))})
    result, node = ran(rest.yaw_case), sensor_experiments.yaw_in_the_sensor_node(SEED)
    assert (result['node']['rate'], result['node']['end']) == pytest.approx((node.rate, node.yaw[-1]), abs=1e-9)
    assert (result['pc'][0]['rate'], result['pc'][0]['end']) == pytest.approx((-0.01, -0.01 * t[-1]))
    assert len(registry.EXPERIMENTS['E3'].figures(result)) == 4


def test_turns_give_the_gain(monkeypatch):
    measured = [
        (sign * (angle + 1.0), sign * (angle + 1.0) * 0.92) for sign in (1, -1) for angle in (90.0, 180.0, 270.0, 360.0)
    ]
    hears(monkeypatch, {'turns': lambda: (measured, [(361.0, 361.0 * 0.92), (-361.0, -361.0 * 0.921)])})
    result = ran(turns.case)
    assert result['gain'] == pytest.approx(1.0 / 0.92) and result['marks'][90.0] == pytest.approx(82.8)
    found = registry.EXPERIMENTS['E6'].figures(result)
    assert list(found.values())[-1] == pytest.approx(361.0 * 0.001 / 0.92, abs=1e-6)


def test_frames_give_both_filters_angles(monkeypatch):
    frames, bus = minute(True), BusDescription.default()
    still, turned = np.zeros(len(frames)), np.linspace(0.0, 2 * math.pi, len(frames))
    hears(monkeypatch, {'filters': lambda: [(frames, still), (frames, turned), (frames, -turned)]})
    result, lockstep = ran(orientation.case), orientation.case(SEED)
    listener = orientation.Listener(bus)
    for frame, yaw in zip(frames, still):
        listener.on_frame(frame, yaw)
    assert result['variances']['gyro'] == listener.arrays()['gyro'][:, 1:].var(axis=0, ddof=1).tolist()
    assert set(result) == set(lockstep) - {'trace'}
    assert result['madgwick']['share'] == pytest.approx(
        [result['madgwick']['drift'] / 360.0, -result['madgwick']['drift'] / 360.0], rel=0.02
    )
    for name in ('E4', 'E5'):
        assert set(registry.EXPERIMENTS[name].figures(result)) == set(registry.EXPERIMENTS[name].figures(lockstep))


def test_every_experiment_on_the_bench_has_its_task():
    for name in ('E1', 'E2', 'E3', 'E4', 'E5', 'E6'):
        for case in registry.EXPERIMENTS[name].cases(1):
            assert case.function in (
                rest.rest_case,
                rest.yaw_case,
                orientation.case,
                turns.case,
            ) and registry.EXPERIMENTS[name].over_ros(case.key)
