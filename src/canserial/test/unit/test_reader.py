"""Laws of the reader: what is turned is what comes out, nothing invented, nothing thrown."""

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription, packaged
from canserial.frame import Frame
from canserial.reader.compass_config import CompassConfig
from canserial.reader.config import ReaderConfig
from canserial.reader.faults import KINDS
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
from sara_common.config import ConfigError
from sara_common.platforms import folders, load

BUS = BusDescription.default()
SARA = BusDescription.named('sara')
OFFSET = (-0.49, -0.91, -0.65)


def make(bus=BUS, **settings_):
    # These frames are without noise: what that does is tested in test_faults.py.
    return Reader(
        ReaderConfig.of(**{'gain': 1.0, 'calibration_time': 0.8, 'stuck_time': 1e9, 'frozen_frames': 0, **settings_}),
        bus,
    )


def imu(reader, stamp, gz=OFFSET[2], gx=OFFSET[0], gy=OFFSET[1], roll=0.0):
    """One turn of IMU frames; returns the ImuReadings."""
    readings = []
    for name, values in (
        ('RANGE_ACCEL', {**dict.fromkeys(BUS.ranges['RANGE_ACCEL'], 1.0), 'ax': 0.1, 'ay': -0.2, 'az': 9.81}),
        ('COMPLEMENTARY', {'rx': roll, 'ry': -1.0, 'rz': 12.0}),
        ('IMPACT_GYRO', {'alarma': 0, 'gx': gx, 'gy': gy, 'gz': gz}),
    ):
        readings += reader.on_frame(BUS.encode(name, stamp, **values))
    return [reading for reading in readings if isinstance(reading, ImuReading)]


def calibrated(**settings_):
    reader = make(**settings_)
    for k in range(5):
        assert imu(reader, 100.0 + 0.2 * k) == []
    assert reader.ready
    return reader, 101.0


def test_nothing_before_calibration_then_all_fields_in_si_units():
    reader, t = calibrated()
    [reading] = imu(reader, t, gz=OFFSET[2] + 5.0)
    assert reading.yaw == pytest.approx(math.radians(1.0)), 'the first turn after the calibration is lost'
    reader.set_yaw(0.0, t)
    [reading] = imu(reader, t + 0.2, gz=OFFSET[2] + 10.0, gx=OFFSET[0] + 1.0, roll=2.0)
    assert reading.stamp == t + 0.2
    assert reading.angular_velocity == pytest.approx((math.radians(1.0), 0.0, math.radians(10.0)))
    assert reading.linear_acceleration == pytest.approx((0.1, -0.2, 9.81))
    assert (reading.roll, reading.pitch) == pytest.approx((math.radians(2.0), math.radians(-1.0)))
    assert reading.yaw == pytest.approx(math.radians(2.0))


def test_the_gain_acts_on_rate_and_turn_but_not_on_a_set_yaw():
    reader, t = calibrated(gain=1.08)
    imu(reader, t)
    reader.set_yaw(1.0, t + 0.05)
    [reading] = imu(reader, t + 0.2)
    assert reading.yaw == pytest.approx(1.0)
    [reading] = imu(reader, t + 0.4, gz=OFFSET[2] + 20.0)
    assert reading.angular_velocity[2] == pytest.approx(1.08 * math.radians(20.0))
    assert reading.yaw == pytest.approx(1.0 + 1.08 * math.radians(4.0))


@given(st.lists(st.tuples(st.floats(0.15, 0.25), st.integers(-3000, 3000)), min_size=1, max_size=40))
@settings(max_examples=30)
def test_yaw_is_the_integral_over_the_real_time_between_frames(turns):
    reader, t = calibrated(imu_period=0.2)  # learned from such a jitter, it might take a late frame for a gap
    imu(reader, t)
    angle = 0.0
    for dt, rate in turns:
        t += dt
        imu(reader, t, gz=OFFSET[2] + rate / 100)
        angle += dt * math.radians(rate / 100)
    assert abs(math.remainder(reader.yaw - angle, math.tau)) < 1e-9


def test_a_lost_frame_of_a_steady_turn_loses_nothing_and_is_counted():
    reader, t = calibrated()
    imu(reader, t, gz=OFFSET[2] + 30.0)
    reader.set_yaw(0.0, t)
    imu(reader, t + 0.4, gz=OFFSET[2] + 30.0)
    assert reader.yaw == pytest.approx(math.radians(12.0))
    assert reader.counters['imu_gaps'] == 1


@pytest.mark.parametrize('delay', [0.0, 0.5])
def test_frames_from_before_set_pose_do_not_pull_the_yaw_back(delay):
    reader, t = calibrated()
    imu(reader, t)
    reader.set_yaw(1.0, t + 1.0 + delay)
    for k in range(1, 5):
        assert imu(reader, t + 0.2 * k, gz=OFFSET[2] + 40.0) == []
    assert reader.yaw == pytest.approx(1.0)
    imu(reader, t + 1.2 + delay, gz=OFFSET[2] + 10.0)
    assert reader.yaw == pytest.approx(1.0 + math.radians(2.0))


def test_what_was_turned_since_a_late_set_pose_is_kept():
    reader, t = calibrated()
    imu(reader, t)
    for k in range(1, 11):
        imu(reader, t + 0.2 * k, gz=OFFSET[2] + 10.0)
    reader.set_yaw(-2.0, t + 1.5)
    assert reader.yaw == pytest.approx(-2.0 + math.radians(5.0))


def test_repeated_frames_and_a_clock_that_went_back_integrate_nothing():
    reader, t = calibrated()
    imu(reader, t)
    for _ in range(3):
        assert imu(reader, t, gz=OFFSET[2] + 50.0) == []
    assert reader.counters['imu_stale'] == 3
    imu(reader, 5.0, gz=OFFSET[2] + 50.0)
    assert reader.yaw == pytest.approx(0.0)
    imu(reader, 5.2, gz=OFFSET[2] + 50.0)
    assert reader.yaw == pytest.approx(math.radians(10.0))


def test_no_imu_reading_from_accelerations_that_stopped_coming():
    reader, t = calibrated()
    silent = BUS.encode('IMPACT_GYRO', t + 5.0, alarma=1, gx=0, gy=0, gz=0)
    assert reader.on_frame(silent) == [ImpactReading(t + 5.0, True)]
    assert reader.counters['imu_without_acceleration'] == 1


@pytest.mark.parametrize('disturb', ['gyro', 'wheel', 'slow turn'])
def test_calibration_starts_over_when_the_chair_moves(disturb):
    reader = make(calibration_time=3.8)
    for k in range(19):
        gz = OFFSET[2] + (3.0 if disturb == 'gyro' and k == 10 else 0.06 * k if disturb == 'slow turn' else 0.0)
        imu(reader, 0.2 * k, gz=gz)
        steps = (2**32 - 5 + (40 if disturb == 'wheel' and k > 10 else 0)) % 2**32
        reader.on_frame(BUS.encode('ENCODER_LEFT', 0.2 * k, steps=steps, time=2000 * k))
    imu(reader, 0.2 * 19, gz=OFFSET[2])
    assert not reader.ready and reader.calibration.restarts >= 1
    for k in range(20, 45):
        imu(reader, 0.2 * k)
    assert reader.ready
    assert reader.calibration.offset == pytest.approx(OFFSET)


def test_encoder_noise_within_the_limit_does_not_start_over_across_the_wrap():
    reader = make(calibration_time=1.8)
    for k in range(10):
        reader.on_frame(BUS.encode('ENCODER_RIGHT', 0.2 * k, steps=(2**32 - 1 + k % 2) % 2**32, time=2000 * k))
        imu(reader, 0.2 * k)
    assert reader.ready


def test_ranges_are_the_median_of_three_in_the_words_of_rep_117():
    reader = make()
    answers, raw = [], []
    sensor, *others = BUS.ranges['RANGES_1']
    ones = dict.fromkeys(others, 1)
    for k, measured in enumerate((1.0, 2.0, 1.1, 0.0, 0.0, 0.1, 0.1, 3.0)):
        readings = reader.on_frame(BUS.encode('RANGES_1', 0.2 * k, **ones, **{sensor: measured}))
        answers += [reading.range for reading in readings if reading.name == sensor]
        raw += [reading.raw for reading in readings if reading.name == sensor]
    assert raw == pytest.approx(
        [1.1, math.inf, math.inf, -math.inf, -math.inf, math.inf]
    )  # beyond 2.5 m nothing is heard
    assert answers == pytest.approx([1.1, 2.0, math.inf, math.inf, -math.inf, -math.inf])
    assert reader.on_frame(BUS.encode('RANGES_1', 60.0, **ones, **{sensor: 1})) == []


@pytest.mark.parametrize('robot', folders())
def test_the_ranges_of_every_sensor_come(robot):
    platform = load(robot)
    bus = BusDescription.of(platform)
    reader, names = make(bus), []
    for k in range(3):
        for name, sensors in bus.ranges.items():
            others = set(bus.signals(name)) - set(sensors)
            frame = bus.encode(name, 0.2 * k, **dict.fromkeys(sensors, 1.5), **dict.fromkeys(others, 0.0))
            for reading in reader.on_frame(frame):
                assert isinstance(reading, RangeReading) and reading.range == 1.5
                names.append(reading.name)
    assert sorted(names) == sorted(platform.sonars)


@pytest.mark.parametrize('period, phase', [(0.05, 0.0), (0.05, 0.02), (0.05, 0.049), (0.2, 0.03)])
def test_a_range_in_the_imu_frames_comes_once_for_each_measurement_however_often_the_imu_frames_come(period, phase):
    """SARA's SJO, driving at 0.25 m/s towards a wall: no step may look faster than a third more, or it would be an
    approach.
    """
    reader, readings = make(SARA), []
    for k in range(round(10.0 / period)):
        t = k * period
        measured = 0.2 * math.floor((t + phase) / 0.2)
        frame = SARA.encode('RANGE_ACCEL', t + 1e-3 * (k % 3), SJO=round(2.4 - 0.2 * measured, 2), ax=0, ay=0, az=9.81)
        readings += [reading for reading in reader.on_frame(frame) if isinstance(reading, RangeReading)]
    stamps, raw = [reading.stamp for reading in readings], [reading.raw for reading in readings]
    steps = [b - a for a, b in zip(stamps, stamps[1:])]
    assert len(readings) == pytest.approx(48, abs=2) and max(steps) < 0.26
    assert max((a - b) / step for a, b, step in zip(raw, raw[1:], steps)) < 0.2 * 4.0 / 3.0 + 0.02


def test_a_measurement_that_stays_the_same_still_comes_five_times_a_second():
    reader = make(SARA)
    readings = [
        reading
        for k in range(200)
        for reading in reader.on_frame(SARA.encode('RANGE_ACCEL', 0.05 * k, SJO=1.5, ax=0, ay=0, az=9.81))
        if isinstance(reading, RangeReading)
    ]
    assert len(readings) == 48 and {reading.raw for reading in readings} == {1.5}


def test_the_other_frames():
    reader = make()
    assert reader.on_frame(BUS.encode('ENCODER_LEFT', 1.0, steps=7, time=9)) == [EncoderReading(1.0, 1, 7, 9)]
    assert reader.on_frame(BUS.encode('MODO_PC', 1.0, modoPC=3)) == [ModeReading(1.0, 3)]
    assert reader.on_frame(BUS.encode('BATTERY', 1.0, voltage=24.5)) == [BatteryReading(1.0, 24.5)]
    joystick = {'velD': 2.0, 'velI': -2.0, 'modo': 1}
    [reading] = reader.on_frame(BUS.encode('JOYSTICK', 1.0, joyx=1023, joyy=540, **joystick))
    assert reading == JoystickReading(1.0, -1.0, 0.0, 1, pytest.approx(2.0, abs=0.01), pytest.approx(-2.0, abs=0.01))
    assert reader.on_frame(BUS.encode('JOYSTICK', 1.0, joyx=1024, joyy=540, **joystick)) == []
    for name, signals, source in (
        ('MADGWICK', ('roll', 'pitch', 'yaw'), 'madgwick'),
        ('COMPLEMENTARY', ('rx', 'ry', 'rz'), 'complementary'),
    ):
        [reading] = reader.on_frame(BUS.encode(name, 1.0, **dict(zip(signals, (1.0, -2.0, 30.0)))))
        assert reading == AnglesReading(1.0, source, *map(math.radians, (1.0, -2.0, 30.0)))


@pytest.mark.parametrize('name', packaged())
def test_a_mode_is_read_where_the_bus_has_it(name):
    bus, held = BusDescription.named(name), name == 'sara_assisted'
    reader, joystick = Reader(ReaderConfig.of(), bus), {'velD': 0, 'velI': 0, 'joyx': 512, 'joyy': 1023}
    for mode in range(6):
        known = mode in (0, 1, 3) or held and mode == 2
        assert [r.mode for r in reader.on_frame(bus.encode('MODO_PC', 1.0, modoPC=mode))] == [mode] * known
        readings = reader.on_frame(bus.encode('JOYSTICK', 1.0, modo=mode, **joystick))
        assert [(reading.mode, reading.forward) for reading in readings] == [(mode, 1.0)] * known
    dropped = 2 + (not held)
    assert reader.counters == {'mode_implausible': dropped, 'joystick_implausible': dropped}


def test_what_is_dropped_is_counted_by_kind():
    reader = make()
    reader.on_frame(Frame(0x7FF, bytes(8)))
    known = BUS.id_of('ENCODER_RIGHT')
    reader.on_frame(Frame(known, bytes(7)))
    for stamp in (math.nan, math.inf, -1.0, 2.0**32):
        assert reader.on_frame(Frame(known, bytes(8), stamp)) == []
    reader.set_yaw(math.nan, 0.0)
    reader.set_yaw(0.0, -1.0)
    assert dict(reader.counters) == {
        'unknown_id': 1,
        'bad_length': 1,
        'stamp_implausible': 4,
        'set_pose_implausible': 2,
    }
    assert reader.counters.keys() <= KINDS.keys()


def test_configuration_faults_are_named_all_at_once():
    with pytest.raises(
        ConfigError, match="gain is -1.*imu_period is 'fast'.*calibration is 'none', allowed are 'measure' and 'saved'"
    ):
        ReaderConfig.of(gain=-1, imu_period='fast', calibration='none')
    with pytest.raises(ConfigError, match='range_min.*battery_empty is 20 and battery_full None'):
        ReaderConfig.of(range_min=3.0, battery_empty=20)


def test_gyro_variances_are_those_of_the_table_in_radians():
    degrees = ReaderConfig.of(thesis_covariances=True).variances[1]
    assert ReaderConfig.of().variances[1] == pytest.approx(
        [math.radians(1) ** 2 * value for value in degrees], rel=0.03
    )


def test_the_yaw_at_start_is_a_setting():
    reader, t = calibrated(initial_yaw=2.0)
    assert imu(reader, t)[0].yaw == 2.0


def test_the_commented_file_holds_the_defaults():
    path = Path(__file__).resolve().parents[2] / 'config' / 'read.yaml'
    content = yaml.safe_load(path.read_text())
    of_the_node = {'imu_frame', 'map_frame', 'calibration_file', 'save_calibration'}
    compass = {name: content.pop(name) for name in CompassConfig.__dataclass_fields__}
    assert (
        ReaderConfig.of(**{name: value for name, value in content.items() if name not in of_the_node})
        == ReaderConfig.of()
    )
    assert compass.pop('compass_north') == pytest.approx(math.pi / 2.0)
    assert CompassConfig(**compass) == CompassConfig()
    text = path.read_text()
    for name in {*ReaderConfig.__dataclass_fields__, *of_the_node, 'dbc'}:
        assert f'{name}: ' in text, f'{name} is not described'
