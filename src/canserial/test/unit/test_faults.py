"""Each kind of bad data: dropped, counted by name, over when it is over. Frames are made as the chair makes them."""

import math
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from canserial.reader.config import ReaderConfig
from canserial.reader.plausibility import EncoderGuard, FrozenImu, StuckValue
from canserial.reader.reader import Reader
from canserial.reader.readings import (
    AnglesReading,
    BatteryReading,
    EncoderReading,
    ImpactReading,
    ImuReading,
    JoystickReading,
    ModeReading,
    RangeReading,
)
from canserial.reader.status import status_of
from sara_common.config import ConfigError
from sara_common.diagnostics import ERROR
from sara_common.platforms import chosen

BUS = BusDescription.default()


class Chair:
    """Sends the frames of turns of 0.2 s, at rest, with the noise of the chip; any signal can be overridden."""

    def __init__(self, seed=0, resolution=0.01, **settings):
        self.reader = Reader(ReaderConfig.of(**{'calibration_time': 2.0, 'gain': 1.0, **settings}), BUS)
        self.chance = random.Random(seed)
        self.resolution = resolution
        self.time = 0.0
        self.steps, self.clock = 1000, 0

    def send(self, name, **signals):
        return self.reader.on_frame(BUS.encode(name, self.time, **signals))

    def turn(self, count=1, without=(), gyro=None, acceleration=None, angles=None):
        """Readings of all turns."""
        gauss, readings = self.chance.gauss, []
        for _ in range(count):
            self.time += 0.2
            self.clock += 2000
            readings += self.encoder()
            if 'RANGE_ACCEL' not in without:
                x, y, z = acceleration or (gauss(0.0, 0.06), gauss(0.0, 0.06), gauss(9.81, 0.06))
                readings += self.send('RANGE_ACCEL', **dict.fromkeys(BUS.ranges['RANGE_ACCEL'], 1.0), ax=x, ay=y, az=z)
            if 'COMPLEMENTARY' not in without:
                rx, ry, rz = angles or (gauss(0.0, 0.1), gauss(0.0, 0.1), gauss(0.0, 0.1))
                readings += self.send('COMPLEMENTARY', rx=rx, ry=ry, rz=rz)
            if 'IMPACT_GYRO' not in without:
                rates = gyro or tuple(round(gauss(-0.6, 0.08) / self.resolution) * self.resolution for _ in range(3))
                readings += self.send('IMPACT_GYRO', alarma=0, **dict(zip(('gx', 'gy', 'gz'), rates)))
        return readings

    def encoder(self, wheel='ENCODER_RIGHT'):
        return self.send(wheel, steps=self.steps % 2**32, time=self.clock % 2**32)

    def ready(self):
        self.turn(12)
        assert self.reader.ready and not self.reader.last_fault
        return self


def kinds(readings):
    return {type(reading) for reading in readings}


@pytest.mark.parametrize(
    'name, signals, fault, well',
    [
        ('MODO_PC', {'modoPC': 2}, 'mode_implausible', {'modoPC': 3}),
        ('MODO_PC', {'modoPC': 255}, 'mode_implausible', {'modoPC': 0}),
        ('BATTERY', {'voltage': 40.01}, 'battery_implausible', {'voltage': 24.0}),
        ('BATTERY', {'voltage': 4e6}, 'battery_implausible', {'voltage': 0.0}),
        (
            'JOYSTICK',
            {'velD': 0, 'velI': 0, 'joyx': 1024, 'joyy': 512, 'modo': 1},
            'joystick_implausible',
            {'velD': 0, 'velI': 0, 'joyx': 1023, 'joyy': 0, 'modo': 1},
        ),
        (
            'JOYSTICK',
            {'velD': 0, 'velI': 0, 'joyx': 512, 'joyy': 65535, 'modo': 1},
            'joystick_implausible',
            {'velD': 0, 'velI': 0, 'joyx': 512, 'joyy': 512, 'modo': 0},
        ),
        (
            'JOYSTICK',
            {'velD': 0, 'velI': 0, 'joyx': 512, 'joyy': 512, 'modo': 2},
            'joystick_implausible',
            {'velD': 0, 'velI': 0, 'joyx': 512, 'joyy': 512, 'modo': 3},
        ),
    ],
)
def test_implausible_values_are_not_published(name, signals, fault, well):
    chair = Chair()
    assert chair.send(name, **signals) == []
    assert chair.reader.counters == {fault: 1} and chair.reader.last_fault == {fault: chair.time}
    assert len(chair.send(name, **well)) == 1
    assert chair.reader.counters == {fault: 1}


def test_a_range_that_no_sensor_gives_is_dropped_alone():
    chair = Chair()
    sensor, far, *others = BUS.ranges['RANGES_1']
    ones = dict.fromkeys(others, 1.0)
    for measured in (1.0, 655.35, 1.2, 6.51, 1.1):
        chair.time += 0.2
        readings = chair.send('RANGES_1', **ones, **{sensor: measured, far: 6.5})
        assert all(reading.range <= 1.2 or reading.name == far for reading in readings)
    assert {reading.name: reading.range for reading in readings} == {**ones, sensor: 1.1, far: math.inf}
    assert chair.reader.counters == {f'range_implausible_{sensor}': 1, f'range_silent_{sensor}': 1}


@pytest.mark.parametrize(
    'fault, wrong',
    [
        ('gyro_implausible', {'gyro': (0.0, 0.0, 251.5)}),
        ('gyro_implausible', {'gyro': (-300.0, 0.0, 0.0)}),
        ('acceleration_implausible', {'acceleration': (0.0, -21.7, 9.81)}),
    ],
)
def test_beyond_the_chips_range(fault, wrong):
    chair = Chair().ready()
    yaw = chair.reader.yaw
    readings = chair.turn(1, **wrong)
    assert chair.reader.counters[fault] == 1
    for reading in readings:
        if isinstance(reading, ImuReading):
            assert max(map(abs, reading.angular_velocity)) < 0.1 and max(map(abs, reading.linear_acceleration)) < 21.6
    if fault == 'gyro_implausible':
        assert kinds(readings).isdisjoint({ImuReading, ImpactReading})
    assert ImuReading in kinds(chair.turn(1))
    assert abs(chair.reader.yaw - yaw) < 0.01


def test_an_impact_that_is_no_flag():
    chair = Chair().ready()
    assert chair.send('IMPACT_GYRO', alarma=2, gx=0.0, gy=0.0, gz=0.0) == []
    assert chair.reader.counters == {'gyro_implausible': 1}


def test_angles_beyond_a_right_angle():
    """16 bits of millidegrees cannot say it; the bus of another robot can."""

    class Wide:
        names, declares, ranges = BUS.names, BUS.declares, BUS.ranges

        @staticmethod
        def decode(frame):
            return 'COMPLEMENTARY', {'rx': 90.5, 'ry': 0.0, 'rz': 0.0}

    reader = Reader(ReaderConfig.of(), Wide)
    assert reader.on_frame(BUS.encode('BATTERY', 1.0, voltage=24)) == []
    assert reader.counters == {'angles_implausible': 1}


@pytest.mark.parametrize(
    'fault, stuck, gone',
    [
        ('gyro_stuck', {'gyro': (-0.49, -0.91, 12.0)}, ImuReading),
        ('acceleration_stuck', {'acceleration': (0.1, 0.2, 9.8)}, ImuReading),
        ('angles_stuck', {'angles': (1.0, 2.0, 3.0)}, AnglesReading),
    ],
)
def test_a_stuck_sensor_is_not_published_and_comes_back(fault, stuck, gone):
    chair = Chair().ready()
    assert gone in kinds(chair.turn(20, **stuck)), 'four seconds of equal values are given the benefit of the doubt'
    chair.turn(15, **stuck)
    assert gone not in kinds(chair.turn(20, **stuck))
    assert chair.reader.counters[fault] >= 20
    if fault == 'gyro_stuck':
        assert ImpactReading in kinds(chair.turn(1, **stuck)), 'the impact does not come from the gyroscope'
    assert gone in kinds(chair.turn(1))


STILL = {'gyro': (-0.49, -0.91, 12.0), 'acceleration': (0.1, 0.2, 9.8)}


def frozen(readings):
    return [reading.frozen for reading in readings if isinstance(reading, ImuReading)]


def test_an_imu_whose_six_axes_are_the_same_in_three_frames_is_frozen_until_one_changes():
    chair = Chair().ready()
    assert frozen(chair.turn(5, **STILL)) == [False, False, True, True, True]
    assert chair.reader.imu_frozen and chair.reader.counters['imu_frozen'] == 3
    assert status_of(chair.reader, chair.time).level == ERROR
    assert 'the IMU is frozen' in status_of(chair.reader, chair.time).text
    assert ImpactReading in kinds(chair.turn(1, **STILL)), 'the impact does not come from these registers'
    assert frozen(chair.turn(1)) == [False] and not chair.reader.imu_frozen


def test_what_a_frozen_imu_did_not_see_opens_the_variance_of_the_yaw_until_it_is_set():
    """From the turn on in which the registers may have come to stand: seven of 0.2 s, 1 rad/s."""
    chair = Chair().ready()
    assert not chair.reader.yaw_doubtful
    chair.turn(5, **STILL)
    assert chair.reader.yaw_doubtful
    for _ in range(2):
        [reading] = [reading for reading in chair.turn(1) if isinstance(reading, ImuReading)]
        assert reading.yaw_variance == pytest.approx(1.4**2)
    chair.turn(30, **STILL)
    assert chair.turn(1)[-1].yaw_variance == pytest.approx(math.pi**2 / 3.0), 'a circle has no more'
    chair.reader.set_yaw(1.0, chair.time)
    assert chair.turn(1)[-1].yaw_variance == 0.0 and not chair.reader.yaw_doubtful
    chair.turn(5, **STILL)
    chair.reader.set_yaw(1.0, chair.time)
    assert chair.turn(1)[-1].yaw_variance == pytest.approx(0.2**2), 'what was turned before is known'


def test_a_long_gap_opens_the_variance_of_the_yaw_too_and_a_short_one_does_not():
    chair = Chair().ready()
    chair.turn(3, without=('IMPACT_GYRO',))
    assert chair.turn(1)[-1].yaw_variance == 0.0
    chair.turn(5, without=('IMPACT_GYRO',))
    assert chair.turn(1)[-1].yaw_variance == pytest.approx(1.2**2)


def test_frozen_frames_of_0_is_never():
    chair = Chair(frozen_frames=0).ready()
    assert frozen(chair.turn(20, **STILL)) == [False] * 20


@pytest.mark.parametrize('frames', [1, -1, 2.5, True])
def test_frames_that_cannot_tell_are_no_setting(frames):
    with pytest.raises(ConfigError, match='frozen_frames'):
        ReaderConfig.of(frozen_frames=frames)


@pytest.mark.parametrize('seed', range(3))
@pytest.mark.parametrize('period', [0.2, 0.05])
def test_a_living_imu_at_rest_is_never_frozen(seed, period):
    """With the thesis's smallest sigmas, rates in tenths of deg/s, a tenth of the frames lost and a tenth twice."""
    chance, watch = random.Random(seed), FrozenImu(3)
    for k in range(20_000):
        gyro = tuple(round(chance.gauss(0.0, 0.0734 * (0.2 / period) ** 0.5) / 0.1) for _ in range(3))
        acceleration = tuple(round(chance.gauss(0.0, sigma) / 0.001) for sigma in (0.0576, 0.0365, 0.0476))
        came = chance.random() < 0.9
        for repeated in range(1 + (chance.random() < 0.1)):
            assert not watch.add(period * k + 0.01 * repeated, gyro, acceleration if came else None, period)


@given(st.sampled_from([0.2, 0.05]), st.lists(st.booleans(), max_size=5))
def test_a_frozen_imu_is_named_by_the_third_frame_that_is_whole(period, lost):
    """With the turn in which its registers came to stand that is within four turns, 0.8 s."""
    watch, whole = FrozenImu(3), 0
    watch.add(0.0, (1, 1, 1), (1, 1, 1), period)
    watch.add(period, (1, 1, 2), (2, 2, 2), period)
    for k, loss in enumerate([*lost, False, False, False], 2):
        whole += not loss
        assert watch.add(period * k, (2, 2, 2), None if loss else (2, 2, 2), period) == (whole >= 3)
    assert watch.since == pytest.approx(0.0)
    assert not watch.add(period * (k + 1), (2, 2, 3), (2, 2, 2), period)


def test_a_stuck_madgwick_filter():
    chair = Chair()
    for _ in range(40):
        chair.time += 0.2
        readings = chair.send('MADGWICK', roll=1.0, pitch=2.0, yaw=3.0)
    assert readings == [] and chair.reader.counters['madgwick_stuck'] > 5
    chair.time += 0.2
    assert len(chair.send('MADGWICK', roll=1.0, pitch=2.0, yaw=3.001)) == 1


def test_a_stuck_gyroscope_is_not_calibrated():
    chair = Chair(calibration_time=20.0)
    chair.turn(200, gyro=(-0.49, -0.91, -0.65))
    assert not chair.reader.ready
    assert chair.reader.calibration.reason == 'the gyroscope is stuck'


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('period', [0.2, 0.05])
def test_rates_in_tenths_are_never_stuck(seed, period):
    """At rest, rounded to 0.1 deg/s, with the thesis's smallest sigma on all three axes, on the middle of a step."""
    chance, stuck, longest, run, last = random.Random(seed), StuckValue(5.0), 0, 0, None
    for k in range(20_000):
        value = tuple(round(chance.gauss(0.0, 0.0734 * (0.2 / period) ** 0.5) / 0.1) for _ in range(3))
        assert not stuck.add(period * k, value)
        run, last = run + 1 if value == last else 1, value
        longest = max(longest, run)
    assert longest < 10, 'the frames that stuck needs in any case are not reached by chance'


def test_equal_values_across_a_silence_are_no_proof():
    stuck = StuckValue(5.0)
    assert not any(stuck.add(60.0 * k, 1.0) for k in range(8))


@pytest.mark.parametrize('acceleration', [(0.0, 0.0, 0.0), (0.0, 0.0, 19.6), (9.0, 0.0, 9.81)])
def test_a_chair_at_rest_that_does_not_feel_gravity(acceleration):
    chair = Chair().ready()
    x, y, z = acceleration
    readings = []
    for k in range(30):
        readings = chair.turn(1, acceleration=(x, y, z + 0.01 * (k % 2)))
    assert ImuReading not in kinds(readings)
    assert chair.reader.counters['acceleration_not_gravity'] > 10
    chair.turn(8)
    assert ImuReading in kinds(chair.turn(1))


def test_a_chip_that_is_not_calibrated_and_a_ramp_are_gravity():
    """Table 4.1: -0.9498, -0.0752, 9.5638 m/s2 before the calibration; a ramp of 10 deg turns gravity but keeps its
    norm.
    """
    chair = Chair().ready()
    for k in range(100):
        chair.turn(1, acceleration=(-0.9498 + 0.01 * (k % 2), -0.0752, 9.5638))
    for k in range(100):
        chair.turn(1, acceleration=(9.81 * math.sin(0.17), 0.01 * (k % 2), 9.81 * math.cos(0.17)))
    assert not chair.reader.last_fault


def test_while_it_moves_the_norm_says_nothing():
    chair = Chair().ready()
    for k in range(50):
        chair.steps += 2000
        chair.turn(1, acceleration=(3.0 + 0.01 * (k % 2), 0.0, 12.0))
    assert 'acceleration_not_gravity' not in chair.reader.counters


FASTEST = ReaderConfig.of().max_wheel_speed / math.tau * chosen().wheels.steps_per_turn * 0.2  # steps in a turn


def test_an_encoder_jump_is_dropped_and_forgotten():
    chair = Chair().ready()
    good = chair.steps
    chair.steps += round(1.1 * FASTEST)
    assert EncoderReading not in kinds(chair.turn(1))
    assert chair.reader.counters['encoder_jumped'] == 1
    chair.steps = good
    [reading] = [r for r in chair.turn(1) if isinstance(r, EncoderReading)]
    assert reading.steps == good
    assert 'encoder_restarts' not in chair.reader.counters


def test_the_fastest_wheel_is_believed_across_the_wrap_and_over_lost_frames():
    chair = Chair()
    chair.steps = 2**32 - round(5 * FASTEST)
    chair.clock = 2**32 - 4000
    chair.turn(1)
    for turns in (1, 1, 5, 1):
        for _ in range(turns):
            chair.time += 0.2
            chair.clock += 2000
            chair.steps += round(0.99 * FASTEST)
        assert len(chair.encoder()) == 1
    assert not chair.reader.counters


def test_a_motor_node_that_was_started_anew_is_believed_from_its_second_frame():
    chair = Chair().ready()
    chair.steps, chair.clock = 5, 0
    assert EncoderReading not in kinds(chair.turn(1))
    assert EncoderReading in kinds(chair.turn(1))
    assert EncoderReading in kinds(chair.turn(1))
    assert chair.reader.counters['encoder_clock_jumped'] + chair.reader.counters['encoder_clock_stuck'] == 1
    assert chair.reader.counters['encoder_restarts'] == 1


def test_a_real_jump_of_the_steps_alone_is_believed_from_its_second_frame():
    chair = Chair().ready()
    chair.steps += 2**31
    assert EncoderReading not in kinds(chair.turn(1))
    assert EncoderReading in kinds(chair.turn(1))
    assert chair.reader.counters['encoder_jumped'] == 1


def test_a_clock_that_stands_still_is_named_and_the_frames_are_not_published_however_long():
    chair = Chair().ready()
    for _ in range(50):
        chair.time += 0.1
        assert chair.encoder() == []
    assert chair.reader.counters == {'encoder_clock_stuck': 50}
    chair.clock += 50_000
    assert len(chair.encoder()) == 1, 'the clock went on unseen'


def test_repeated_and_late_frames_are_not_published():
    chair = Chair().ready()
    late = [(chair.steps, chair.clock - 3000), (chair.steps, chair.clock - 2000), (chair.steps, chair.clock)]
    for steps, clock in late:
        chair.time += 0.001
        assert chair.send('ENCODER_RIGHT', steps=steps, time=clock) == []
    assert chair.reader.counters == {'encoder_clock_stuck': 3}
    assert EncoderReading in kinds(chair.turn(1))


@given(
    st.lists(st.tuples(st.floats(0.05, 0.5), st.floats(-1.0, 1.0)), min_size=1, max_size=50),
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**32 - 1),
)
def test_every_motion_a_wheel_can_make_is_believed(motion, steps, clock):
    guard = EncoderGuard(100_000.0, 20)
    stamp, exact = 0.0, float(steps)
    assert guard.check(stamp, steps, clock) is None
    for dt, part in motion:
        ticks = round(dt * 1e4)
        stamp, clock, exact = stamp + dt, (clock + ticks) % 2**32, exact + part * 10.0 * ticks
        assert guard.check(stamp, round(exact) % 2**32, clock) is None
    assert guard.restarts == 0


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1)), max_size=20))
def test_after_any_rubbish_a_wheel_is_believed_again_within_two_frames(rubbish):
    guard = EncoderGuard(100_000.0, 20)
    for k in range(5):
        guard.check(0.1 * k, 0, 1000 * k)
    for k, (steps, clock) in enumerate(rubbish, 5):
        guard.check(0.1 * k, steps, clock)
    k = 5 + len(rubbish)
    answers = [guard.check(0.1 * (k + i), 500 * i, 10_000_000 + 1000 * (k + i)) for i in range(14)]
    assert answers[-1] is None, 'after what looked like an old frame it takes a second more'


def test_a_gap_is_counted_and_after_a_long_one_the_yaw_is_doubted_until_it_is_set():
    chair = Chair().ready()
    chair.turn(2, without=('IMPACT_GYRO',))
    chair.turn(1)
    assert chair.reader.counters['imu_gaps'] == 1 and not chair.reader.yaw_doubtful
    chair.turn(30, without=('IMPACT_GYRO',))
    chair.turn(1)
    assert chair.reader.counters['imu_long_gaps'] == 1 and chair.reader.yaw_doubtful
    chair.reader.set_yaw(0.0, chair.time)
    assert not chair.reader.yaw_doubtful


@pytest.mark.parametrize(
    'silent, fault', [('RANGE_ACCEL', 'imu_without_acceleration'), ('COMPLEMENTARY', 'imu_without_angles')]
)
def test_what_a_silent_sensor_said_last_is_not_used_for_long(silent, fault):
    chair = Chair().ready()
    assert ImuReading in kinds(chair.turn(4, without=(silent,)))
    chair.turn(2, without=(silent,))
    assert ImuReading not in kinds(chair.turn(10, without=(silent,)))
    assert chair.reader.counters[fault] >= 10
    assert ImuReading in kinds(chair.turn(1))


def test_noise_alone_makes_no_fault():
    for seed, resolution in ((1, 0.01), (2, 0.1)):
        chair = Chair(seed, resolution).ready()
        chair.turn(2000)
        assert not chair.reader.counters, chair.reader.counters


def test_all_types_of_readings_come_from_good_frames():
    chair = Chair().ready()
    readings = (
        chair.turn(1)
        + chair.encoder('ENCODER_LEFT')
        + chair.send('MODO_PC', modoPC=1)
        + chair.send('BATTERY', voltage=24)
        + chair.send('JOYSTICK', velD=0, velI=0, joyx=512, joyy=512, modo=1)
    )
    assert kinds(readings) >= {
        AnglesReading,
        BatteryReading,
        EncoderReading,
        ImpactReading,
        ImuReading,
        JoystickReading,
        ModeReading,
        RangeReading,
    } - {RangeReading}
