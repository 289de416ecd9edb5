"""The offset at rest: its mean, the test of stillness, and how seldom noise alone fails it."""

import random

import pytest

from canserial.calibration.calibration import GyroCalibration
from canserial.calibration.calibration_file import Calibration
from canserial.dbc.bus import BusDescription
from canserial.frame import Frame
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from sara_common.platforms import chosen

CONFIG = ReaderConfig.of()
OFFSET = (-0.49, -0.91, -0.65)
SIGMA = (0.0908, 0.0971, 0.0779)  # of 200 ms means: the larger of the thesis's table 4.5, before and after


def make(duration=20.0, persistent=True):
    return GyroCalibration(duration, CONFIG.still_step, CONFIG.still_drift, CONFIG.max_gap, persistent)


def measure(chance, period, resolution, calibration, offset=OFFSET):
    """Frames at rest, with the noise of their period, until it ends or started over; returns whether it is done."""
    spread = (0.2 / period) ** 0.5
    stamp = 0.0
    while not calibration.ended and not calibration.restarts:
        sample = tuple(round(chance.gauss(o, s * spread) / resolution) * resolution for o, s in zip(offset, SIGMA))
        calibration.add(stamp + chance.uniform(0.0, 0.01), sample)
        stamp += period
    return calibration.done


@pytest.mark.parametrize('period', [0.2, 0.05])
@pytest.mark.parametrize('resolution', [0.01, 0.1])
def test_noise_alone_does_not_fail_it_and_the_mean_is_right(period, resolution):
    chance = random.Random(1)
    for _ in range(60):
        calibration = make()
        assert measure(chance, period, resolution, calibration), calibration.reason
        error = 5.0 * 0.0971 / 10.0 + 0.003  # 5 sigma of the mean of 100; what is left of the rounding
        assert all(abs(a - b) < error for a, b in zip(calibration.offset, OFFSET))
        assert calibration.frames == pytest.approx(20.0 / period, abs=2)
        assert all(a == pytest.approx(b * (0.2 / period) ** 0.5, rel=0.45) for a, b in zip(calibration.sigma, SIGMA))


@pytest.mark.parametrize('period', [0.2, 0.05])
def test_a_false_alarm_is_rarer_than_one_in_ten_thousand_calibrations(period):
    """By the margin: with limits at two thirds, noise still fails fewer than 1 in 50, and normal tails fall off far
    faster.

    5.8 sigma becomes 3.9 and 6.2 becomes 4.1: a factor of more than 1000 in probability.
    """
    chance, failed = random.Random(2), 0
    for _ in range(200):
        calibration = GyroCalibration(20.0, CONFIG.still_step / 1.5, CONFIG.still_drift / 1.5)
        failed += not measure(chance, period, 0.01, calibration)
    assert failed <= 4


def test_rates_that_are_rounded_to_nothing_are_a_calibration_too():
    calibration = make()
    for k in range(101):
        calibration.add(0.2 * k, (0.0, 0.0, 0.1 if k == 50 else 0.0))
    assert calibration.done
    assert calibration.offset == pytest.approx((0.0, 0.0, 0.1 / 101))


@pytest.mark.parametrize('period', [0.2, 0.05])
@pytest.mark.parametrize(
    'motion, reason',
    [
        (lambda t: 3.0 if 8.0 < t < 8.5 else 0.0, 'the gyroscope moved'),
        (lambda t: 0.03 * t, 'the mean of the gyroscope changed'),
        (lambda t: 25.0, 'the chair turns or the gyroscope is faulty'),
    ],
)
def test_motion_starts_it_over_or_ends_it(period, motion, reason):
    for persistent in (True, False):
        calibration = make(persistent=persistent)
        stamp = 0.0
        while not calibration.restarts and not calibration.ended:
            calibration.add(stamp, (0.0, 0.0, motion(stamp)))
            stamp += period
        assert calibration.reason == reason
        assert (calibration.restarts, calibration.gave_up) == ((1, False) if persistent else (0, True))
        assert calibration.offset is None
    assert calibration.elapsed == 0.0


def test_missing_frames_and_repeated_ones():
    calibration = make(2.0)
    calibration.add(0.0, OFFSET)
    calibration.add(0.2, OFFSET)
    calibration.add(0.2, (99.0, 0.0, 0.0))
    assert calibration.frames == 2, 'the same frame twice'
    calibration.add(5.0, OFFSET)
    assert calibration.reason == 'IMU frames were missing' and calibration.frames == 1


BUS = BusDescription.default()


def frames(stamp, gyro=OFFSET, noise=0.0):
    """What the sensor node sends in a turn; the noise keeps it from being stuck."""
    return (
        BUS.encode('RANGE_ACCEL', stamp, **dict.fromkeys(BUS.ranges['RANGE_ACCEL'], 1), ax=noise, ay=0.0, az=9.81),
        BUS.encode('COMPLEMENTARY', stamp, rx=noise, ry=0.0, rz=0.0),
        BUS.encode('IMPACT_GYRO', stamp, alarma=0, gx=gyro[0] + noise, gy=gyro[1], gz=gyro[2]),
    )


class Chair:
    """A reader and turns of frames at rest or with a rate."""

    def __init__(self, **settings):
        self.reader = Reader(ReaderConfig.of(**{'gain': 1.0, 'calibration_time': 2.0, **settings}), BUS)
        self.time, self.steps = 0.0, 0

    def turn(self, count=1, gyro=OFFSET, steps=0):
        """Turns of 0.2 s; returns the readings of the last."""
        for _ in range(count):
            self.time += 0.2
            self.steps += steps
            self.reader.on_frame(BUS.encode('ENCODER_LEFT', self.time, steps=self.steps, time=round(self.time * 1e4)))
            noise = 0.01 * (round(self.time * 5) % 2)
            readings = [r for f in frames(self.time, gyro, noise) for r in self.reader.on_frame(f)]
        return readings


def test_a_clock_that_went_back_is_no_motion():
    chair = Chair()
    chair.time = 5000.0
    chair.turn(12)
    chair.turn(2, steps=100)
    assert chair.reader.motion(chair.time) == 'a wheel turns'
    chair.time = 1000.0
    chair.turn(1)
    assert chair.reader.motion(chair.time) == '' and chair.reader.calibrate(chair.time) == ''


def test_a_second_calibration_goes_on_beside_the_old_offset_and_then_takes_its_place():
    chair = Chair()
    chair.turn(12)
    old = chair.reader.offset
    assert old == pytest.approx(OFFSET, abs=0.01)
    moved = (OFFSET[0], OFFSET[1], OFFSET[2] + 0.3)
    assert chair.reader.calibrate(chair.time) == ''
    for _ in range(10):
        assert chair.turn(1, moved)[-1].angular_velocity[2] == pytest.approx(0.3 * 3.14159 / 180, rel=1e-3)
        assert chair.reader.offset == old
    chair.turn(2, moved)
    assert chair.reader.offset == pytest.approx(moved, abs=0.01)
    assert chair.turn(1, moved)[-1].angular_velocity[2] == pytest.approx(0.0, abs=1e-9)
    assert not chair.reader.calibrating


@pytest.mark.parametrize(
    'motion, reason',
    [
        ({'steps': 100}, 'the chair moves: a wheel turns'),
        ({'gyro': (5.0, 0.0, 0.0)}, 'the chair moves: the gyroscope moves'),
    ],
)
def test_a_moving_chair_is_not_calibrated(motion, reason):
    chair = Chair()
    chair.turn(12)
    chair.turn(1, **motion)
    assert chair.reader.calibrate(chair.time) == reason
    assert chair.reader.calibration.done, 'the last measurement stays'
    chair.turn(6)
    assert chair.reader.calibrate(chair.time) == ''
    assert 'is being calibrated' in chair.reader.calibrate(chair.time)


@pytest.mark.parametrize(
    'motion, reason', [({'steps': 100}, 'a wheel turned'), ({'gyro': (5.0, 0.0, 0.0)}, 'the gyroscope moved')]
)
def test_a_chair_that_sets_off_during_a_second_calibration_keeps_its_old_offset(motion, reason):
    chair = Chair()
    chair.turn(12)
    old = chair.reader.offset
    chair.reader.calibrate(chair.time)
    chair.turn(5)
    chair.turn(1, **motion)
    assert chair.reader.calibration.gave_up and chair.reader.calibration.reason == reason
    chair.turn(20)
    assert chair.reader.offset == old


@pytest.mark.parametrize('motion', [{'steps': 100}, {'gyro': (0.0, 0.0, 30.0)}])
def test_a_chair_that_moved_during_the_first_calibration_may_have_turned_unseen(motion):
    chair = Chair()
    chair.turn(5)
    assert not chair.reader.yaw_doubtful
    chair.turn(1, **motion)
    assert chair.reader.yaw_doubtful
    chair.turn(14)
    assert chair.reader.ready and chair.reader.yaw_doubtful
    chair.reader.set_yaw(1.0, chair.time)
    assert not chair.reader.yaw_doubtful


def test_no_second_calibration_without_rates():
    chair = Chair()
    chair.turn(12)
    assert chair.reader.calibrate(chair.time + 5.0) == 'no rates (IMPACT_GYRO) come'
    assert Chair().reader.calibrate(0.0).startswith('the gyroscope is being calibrated')


def test_a_sensor_node_that_comes_back_from_its_own_calibration_is_measured_anew():
    for calibration in ('measure', 'saved'):
        chair = Chair()
        if calibration == 'saved':
            chair.reader = Reader(ReaderConfig.of(gain=1.0, calibration='saved'), BUS, Calibration(gyro_offset=OFFSET))
        chair.turn(12)
        assert chair.reader.ready
        for _ in range(150):  # 30 s of ranges alone
            chair.time += 0.2
            chair.reader.on_frame(BUS.encode('RANGES_1', chair.time, **dict.fromkeys(BUS.ranges['RANGES_1'], 1)))
        chair.turn(1, (0.0, 0.0, 0.0))
        assert chair.reader.counters['imu_restarts'] == 1
        assert chair.reader.yaw_doubtful
        assert chair.reader.ready == (calibration == 'saved')
        chair.turn(11, (0.0, 0.0, 0.0))
        assert chair.reader.offset == pytest.approx(OFFSET if calibration == 'saved' else (0.0, 0.0, 0.0), abs=0.01)


def test_saved_needs_an_offset_and_gives_readings_at_once():
    for stored in (None, Calibration(gain=1.1)):
        with pytest.raises(ValueError, match='no saved offset'):
            Reader(ReaderConfig.of(calibration='saved'), BUS, stored)
    chair = Chair()
    chair.reader = Reader(ReaderConfig.of(calibration='saved'), BUS, Calibration(gyro_offset=OFFSET))
    assert chair.turn(1)[-1].angular_velocity[2] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    'given, stored, gain', [(1.2, 1.1, 1.2), (None, 1.1, 1.1), (None, None, None), (1.2, None, 1.2)]
)
def test_the_gain_is_the_given_one_else_the_files_else_the_platforms(given, stored, gain):
    gain = gain or chosen().parameters('read')['default_gain']
    assert Reader(ReaderConfig.of(gain=given), BUS, Calibration(gain=stored)).gain == gain


@pytest.mark.parametrize('period', [0.2, 0.05, 0.1])
def test_the_period_is_learned_or_fixed(period):
    for setting in ('auto', 0.2):
        reader = Reader(ReaderConfig.of(imu_period=setting), BUS)
        chance = random.Random(4)
        for k in range(40):
            for frame in frames(period * k + chance.uniform(0.0, 0.01), noise=0.01 * (k % 2)):
                reader.on_frame(frame)
        assert reader.period == pytest.approx(period if setting == 'auto' else 0.2)


def test_repeated_frames_do_not_change_the_period():
    reader = Reader(ReaderConfig.of(calibration_time=1.0), BUS)
    for k in range(60):
        for frame in frames(0.2 * k, noise=0.01 * (k % 2)) * 2:
            reader.on_frame(frame)
    assert reader.period == pytest.approx(0.2)
    assert 'imu_gaps' not in reader.counters and reader.counters['imu_stale'] > 40


def test_two_lost_frames_of_the_fast_mode_are_a_gap_once_the_mode_is_known():
    reader = Reader(ReaderConfig.of(calibration_time=1.0), BUS)
    for k in [*range(40), 42, 43]:
        for frame in frames(0.05 * k, noise=0.01 * (k % 2)):
            assert isinstance(frame, Frame)
            reader.on_frame(frame)
    assert reader.counters['imu_gaps'] == 1
