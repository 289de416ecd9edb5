"""Calibration: what a drive with a gyroscope tells of track and wheels, exactly without noise, honestly with it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_control.calibration.calibration import calibrate, end_errors, odometry_path, reference_path
from sara_control.calibration.calibration_report import report, yaml_text
from sara_control.calibration.drive_log import DriveLog, LogError
from sara_control.calibration.manoeuvres import ManoeuvreConfig, Manoeuvres, plan
from sara_control.wheels.odometry import Odometry

SEPARATION, RADIUS = 0.525, 0.155
QUICK = ManoeuvreConfig(side=1.0, turns=1, rest=1.5, pause=4.0)


def drive(
    separation=1.28,
    left=0.9925,
    right=1.0075,
    bias=0.0,
    noise=0.0,
    seed=0,
    config=QUICK,
    moves=None,
    steps=64000,
    lag=0.1,
):
    """A DriveLog of a robot with these multipliers, driven by its own wrong odometry: encoders 10 Hz, gyroscope 5 Hz.

    noise: rad/s of a gyroscope sample.
    """
    random = np.random.default_rng(seed)
    odometry = Odometry(SEPARATION, RADIUS, RADIUS, 1)
    true = Odometry(SEPARATION * separation, RADIUS * left, RADIUS * right, 1)
    script = Manoeuvres(config, moves)
    angles, speeds = [0.0, 0.0], [0.0, 0.0]
    wheels, gyro, truth = [], [], []
    edge = math.tau / steps
    heading = 0.0
    for tick in range(200000):
        t = 0.02 * tick
        if tick % 5 == 0:
            counted = [edge * math.floor(angle / edge) for angle in angles]
            odometry.update(*counted, t)
            wheels.append((t, *counted))
            truth.append((true.x, true.y, true.heading))
            if script.done:
                break
        if tick % 10 == 3:
            gyro.append((t, (true.heading - heading) / 0.2 + bias + noise * random.standard_normal()))
            heading = true.heading
        v, w = script.step(t, odometry.x, odometry.y, odometry.heading)
        wanted = [(v - 0.5 * w * SEPARATION) / RADIUS, (v + 0.5 * w * SEPARATION) / RADIUS]
        speeds = [speed + (goal - speed) * 0.02 / (lag + 0.02) for speed, goal in zip(speeds, wanted)]
        speeds = [0.0 if goal == 0.0 and abs(speed) < 1e-3 else speed for speed, goal in zip(speeds, wanted)]
        angles = [angle + 0.02 * speed for angle, speed in zip(angles, speeds)]
        true.update(*angles, t + 0.02)
    else:
        raise AssertionError('the manoeuvres never end')
    return DriveLog(*np.array(wheels).T, *np.array(gyro).T, np.array(truth))


@settings(max_examples=10)
@given(st.floats(0.8, 1.4), st.floats(0.97, 1.03), st.floats(0.97, 1.03), st.floats(-0.01, 0.01))
def test_without_noise_it_is_exact(separation, left, right, bias):
    result = calibrate(drive(separation, left, right, bias, steps=10**9), SEPARATION, RADIUS)
    mean = 0.5 * (left + right)  # which a gyroscope does not tell
    assert (result.left, result.right) == pytest.approx((left / mean, right / mean), abs=1e-5)
    assert result.separation == pytest.approx(separation / mean, rel=1e-5)
    assert result.bias == pytest.approx(bias, abs=1e-5)  # the wheels settle for a while after they count as still


@pytest.mark.parametrize('seed', range(3))
def test_track_28_percent_off_and_a_wheel_1_5_percent_larger(seed):
    log = drive(bias=0.002, noise=0.0013, seed=seed)
    result = calibrate(log, SEPARATION, RADIUS, gyro_scale_sigma=0.0)
    for value, sigma, true in (
        (result.separation, result.separation_sigma, 1.28),
        (result.left, result.left_sigma, 0.9925),
        (result.right, result.right_sigma, 1.0075),
    ):
        assert value == pytest.approx(true, rel=0.01)
        assert abs(value - true) < 4.0 * sigma < 0.04
    nominal = replace(result, separation=1.0, left=1.0, right=1.0).geometry(SEPARATION, RADIUS)
    for judge in (log, replace(log, truth=None)):  # against the truth, and against the gyroscope alone
        runs = end_errors(judge, nominal, result.geometry(SEPARATION, RADIUS), result.bias)
        squares = [run for run in runs if run.way > 2.0]
        turns = [run for run in runs if run.way < 1.0]
        assert len(squares) == 2 and len(turns) == 2
        assert np.median([run.position_before / run.position_after for run in squares]) > 10.0
        assert np.median([run.heading_before / run.heading_after for run in turns]) > 10.0


def test_the_uncertainty_covers_the_error_as_often_as_it_says():
    moves = [('rest', 2.0)] + [
        ('straight', 1.0),
        ('rest', 1.5),
        ('turn', 1.5),
        ('rest', 1.5),
        ('turn', -1.5),
        ('rest', 1.5),
    ] * 3
    clean = drive(steps=10**9, moves=moves)
    random = np.random.default_rng(7)
    off = []
    for _ in range(200):
        noisy = replace(clean, rates=clean.rates + 0.0013 * random.standard_normal(len(clean.rates)))
        result = calibrate(noisy, SEPARATION, RADIUS, gyro_scale_sigma=0.0)
        off.append(((result.separation - 1.28) / result.separation_sigma, (result.right - 1.0075) / result.right_sigma))
    spread = np.sqrt(np.mean(np.square(off), axis=0))
    assert (spread > 0.6).all() and (spread < 1.4).all()


def test_a_gyroscope_that_may_be_wrong_makes_the_track_uncertain_but_not_the_wheels():
    log = drive(noise=0.0013)
    sure, unsure = (calibrate(log, SEPARATION, RADIUS, gyro_scale_sigma=sigma) for sigma in (0.0, 0.02))
    assert unsure.separation_sigma > 0.02 > sure.separation_sigma
    assert unsure.left_sigma == sure.left_sigma


def test_a_length_on_the_floor_sets_the_size_of_both_wheels():
    log = drive(1.2, 1.05, 1.03, steps=10**9)
    legs = np.diff(log.truth[:, :2][[begin for begin, _ in log.rests(RADIUS, 0.5)]], axis=0)
    lengths = np.hypot(*legs.T)
    result = calibrate(log, SEPARATION, RADIUS, leg=float(lengths[lengths > 0.5].mean()), leg_sigma=0.001)
    assert (result.separation, result.left, result.right) == pytest.approx((1.2, 1.05, 1.03), rel=2e-3)


def test_a_gap_in_the_gyroscope_costs_its_stretch_only():
    log = drive(bias=0.001)
    keep = (log.gyro_times < 20.0) | (log.gyro_times > 24.0)
    result = calibrate(replace(log, gyro_times=log.gyro_times[keep], rates=log.rates[keep]), SEPARATION, RADIUS)
    assert (result.separation, result.right) == pytest.approx((1.28, 1.0075), rel=2e-3)


@pytest.mark.parametrize(
    'moves, sentence',
    [
        ([('rest', 2.0), ('turn', 6.0), ('rest', 1.5), ('turn', -6.0), ('rest', 2.0)], '0 straight legs'),
        (
            [('rest', 2.0), ('straight', 1.0), ('rest', 1.5), ('straight', 1.0), ('rest', 2.0)],
            '0.0 rad of turns on the spot',
        ),
        ([('straight', 1.0)], 'rests of 0.5 s or more, at least 2'),
    ],
)
def test_a_drive_that_does_not_tell_is_refused(moves, sentence):
    with pytest.raises(LogError, match=sentence):
        calibrate(drive(moves=moves), SEPARATION, RADIUS)


def test_wheels_the_wrong_way_round_are_named():
    log = drive()
    with pytest.raises(LogError, match='left_wheel and right_wheel'):
        calibrate(replace(log, left=log.right, right=log.left), SEPARATION, RADIUS)


@pytest.mark.parametrize(
    'change, sentence',
    [
        ({'left': np.zeros(3)}, 'arrays of one length'),
        ({'rates': np.full(5, np.nan), 'gyro_times': np.arange(5.0)}, 'must be finite'),
        ({'wheel_times': np.zeros(5)}, 'wheel_times must rise'),
        ({'truth': np.zeros((4, 3))}, 'truth must be'),
    ],
)
def test_bad_arrays_are_named(change, sentence):
    good = dict(
        wheel_times=np.arange(5.0), left=np.zeros(5), right=np.zeros(5), gyro_times=np.arange(5.0), rates=np.zeros(5)
    )
    with pytest.raises(LogError, match=sentence):
        DriveLog(**{**good, **change})


def test_the_report_says_all_of_it():
    log = drive(bias=0.001)
    result = calibrate(log, SEPARATION, RADIUS)
    nominal = replace(result, separation=1.0, left=1.0, right=1.0).geometry(SEPARATION, RADIUS)
    text = report(result, end_errors(log, nominal, result.geometry(SEPARATION, RADIUS), result.bias))
    assert (
        'wheel_separation_multiplier' in text
        and '+-' in text
        and text.count('->') == 5
        and 'mostly one way' not in text
    )
    assert 'mostly one way' in report(replace(result, turned=(6.0, 1.0)), [])
    assert 'divide turn_slip' not in report(replace(result, separation=1.02), [])
    assert 'divide turn_slip (safety_gate, shared_control) by 1.270 (1 where less comes out)' in report(
        replace(result, separation=1.27), []
    ), 'gate and shared control refuse less'
    values = [float(line.split(':')[1].split('#')[0]) for line in yaml_text(result).splitlines()]
    assert values == pytest.approx([result.separation, result.left, result.right], abs=1e-6)


def test_the_manoeuvres_are_a_square_each_way_and_turns_each_way():
    moves = plan(ManoeuvreConfig(side=3.0, rounds=2, turns=1))
    turned = [amount for kind, amount in moves if kind == 'turn']
    assert (
        sum(turned) == pytest.approx(0.0)
        and sum(turn > 0.0 for turn in turned) == sum(turn < 0.0 for turn in turned) == 10
    )
    assert [amount for kind, amount in moves if kind == 'straight'] == [3.0] * 16
    kinds = [kind for kind, _ in moves]
    assert kinds[0] == kinds[-1] == 'rest' and all('rest' in pair for pair in zip(kinds, kinds[1:]))


def test_by_its_own_odometry_the_square_closes():
    log = drive(1.0, 1.0, 1.0)
    nominal = calibrate(log, SEPARATION, RADIUS).geometry(SEPARATION, RADIUS)
    path = odometry_path(log, nominal)
    first = min(index for index, row in enumerate(path) if row[2] > 1.99 * math.pi)
    assert math.hypot(*path[first][:2]) < 0.1


def test_without_the_truth_the_gyroscope_stands_for_it():
    log = drive(1.28, 0.9925, 1.0075, bias=0.01, steps=10**9)
    result = calibrate(log, SEPARATION, RADIUS)
    path = reference_path(replace(log, truth=None), result.geometry(SEPARATION, RADIUS), result.bias)
    assert path[-1] == pytest.approx(log.truth[-1], abs=0.02)


def test_what_no_drive_can_have_is_named():
    assert ManoeuvreConfig.from_params({'side': 2.0, 'turns': 3}) == ManoeuvreConfig(side=2.0, turns=3)
    with pytest.raises(ConfigError) as error:
        ManoeuvreConfig.from_params({'side': 0.0, 'turns': 1.5, 'speed': True, 'rest': math.inf})
    assert [sentence.split()[0] for sentence in error.value.faults] == ['side', 'turns', 'speed', 'rest']
    with pytest.raises(ConfigError) as error:
        ManoeuvreConfig.from_params({'sides': 2.0})
    assert list(error.value.faults) == ['sides is 2.0, but there is no such parameter']
