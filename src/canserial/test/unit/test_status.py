"""What /diagnostics says: the frame that does not come by name, what is waited for, what was dropped lately."""

import pytest

from canserial.calibration.iron import Iron
from canserial.dbc.bus import BusDescription
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from canserial.reader.status import EXPECTED, status_of
from sara_common.diagnostics import ERROR, OK, WARN

BUS = BusDescription.default()
SIGNALS = {
    'ENCODER_RIGHT': {'steps': 0, 'time': 0},
    'ENCODER_LEFT': {'steps': 0, 'time': 0},
    'MODO_PC': {'modoPC': 1},
    'RANGE_ACCEL': {**dict.fromkeys(BUS.ranges['RANGE_ACCEL'], 1), 'ax': 0, 'ay': 0, 'az': 9.81},
    'IMPACT_GYRO': {'alarma': 0, 'gx': 0, 'gy': 0, 'gz': 0},
    'COMPLEMENTARY': {'rx': 0, 'ry': 0, 'rz': 0},
    'MADGWICK': {'roll': 0, 'pitch': 0, 'yaw': 0},
    'RANGES_1': dict.fromkeys(BUS.ranges['RANGES_1'], 1),
    'RANGES_2': dict.fromkeys(BUS.ranges['RANGES_2'], 1),
    'BATTERY': {'voltage': 24.0},
    'JOYSTICK': {'velD': 0, 'velI': 0, 'joyx': 512, 'joyy': 512, 'modo': 1},
}
IMU = ('RANGE_ACCEL', 'IMPACT_GYRO', 'COMPLEMENTARY', 'MADGWICK')


def run(reader, start, end, names=tuple(SIGNALS)):
    """All these frames every 0.2 s, with values that are alive."""
    k = round(start * 5)
    while 0.2 * k < end:
        stamp = 0.2 * k
        for name in names:
            signals = dict(SIGNALS[name])
            if 'time' in signals:
                signals['time'] = k * 2000
            if name in IMU:
                key = sorted(signals)[-1]
                signals[key] += 0.01 * (k % 2)
            reader.on_frame(BUS.encode(name, stamp, **signals))
        k += 1


def make(**settings):
    return Reader(ReaderConfig.of(calibration_time=2.0, **settings), BUS)


def without(*names):
    return tuple(name for name in SIGNALS if name not in names)


def test_every_expected_frame_is_of_the_bus_and_tested_here():
    assert set(EXPECTED) - {'COMPASS'} == set(SIGNALS) <= set(BUS.names)
    assert 'COMPASS' in BusDescription.named('+compass').names


def test_nothing_yet_then_calibrating_then_well():
    reader = make()
    status = status_of(reader, 0.0)
    assert (status.level, status.text) == (ERROR, 'waiting for frames')
    run(reader, 0.0, 1.5)
    status = status_of(reader, 1.5)
    assert status.level == WARN and status.text.startswith('calibrating the gyroscope at rest: 1 of 2 s')
    run(reader, 1.6, 5.0)
    status = status_of(reader, 5.0)
    assert (status.level, status.text, status.silent) == (OK, 'publishing', ())
    assert float(status.values['gain']) == reader.gain != 1.0 and 'gyro_offset' in status.values


@pytest.mark.parametrize('name', SIGNALS)
def test_a_frame_that_stops_is_named_with_its_identifier(name):
    reader = make()
    run(reader, 0.0, 10.0)
    run(reader, 10.0, 20.0, without(name))
    status = status_of(reader, 20.0)
    assert status.level == EXPECTED[name].level
    assert status.silent == (name,)
    assert f'silent for 10.2 s: 0x{BUS.id_of(name):X} {name}' in status.text
    assert status.values[f'frame {name}'].startswith('silent')
    run(reader, 20.0, 21.0)
    assert not status_of(reader, 21.0).silent


def test_an_imu_that_stops_while_its_node_lives_may_be_calibrating_itself():
    reader = make()
    run(reader, 0.0, 10.0)
    run(reader, 10.0, 15.0, without(*IMU))
    status = status_of(reader, 15.0)
    assert status.level == ERROR
    assert (
        f'0x{BUS.id_of("IMPACT_GYRO"):X} IMPACT_GYRO' in status.text
        and 'so no imu/data (the sensor node calibrates itself for 30 s' in status.text
    )


def test_a_sensor_node_that_was_just_switched_on_is_waited_for():
    reader = make()
    run(reader, 0.0, 29.0, without(*IMU))
    status = status_of(reader, 29.0)
    assert status.level == WARN
    waited = ', '.join(f'0x{BUS.id_of(name):X} {name}' for name in IMU[:3])
    assert f'waiting for {waited} for 29 s' in status.text
    assert 'calibrates itself for 30 s' in status.text
    run(reader, 29.0, 70.0, without(*IMU))
    assert status_of(reader, 70.0).level == ERROR


def test_frames_that_may_never_come_are_not_missed():
    reader = make()
    run(reader, 0.0, 10.0, without('MADGWICK', 'JOYSTICK'))
    assert status_of(reader, 10.0).level == OK
    reader = make()
    run(reader, 0.0, 10.0, without('ENCODER_LEFT', 'BATTERY'))
    status = status_of(reader, 10.0)
    never = ', '.join(f'0x{BUS.id_of(name):X} {name}' for name in ('ENCODER_LEFT', 'BATTERY'))
    assert status.level == ERROR and f'never came: {never}' in status.text


def test_what_was_dropped_lately_is_told_and_then_only_counted():
    reader = make()
    run(reader, 0.0, 5.0)
    reader.on_frame(BUS.encode('MODO_PC', 5.0, modoPC=7))
    status = status_of(reader, 5.0)
    assert status.level == WARN and 'dropped lately: mode frames (modoPC) of an unknown mode (1)' in status.text
    run(reader, 5.0, 20.0)
    status = status_of(reader, 20.0)
    assert status.level == OK and status.values['mode_implausible'] == 1


def test_a_doubtful_yaw_and_an_empty_battery():
    reader = make(battery_empty=24.5, battery_full=25.5)
    run(reader, 0.0, 5.0)
    run(reader, 5.0, 8.0, without('IMPACT_GYRO'))
    run(reader, 8.0, 25.0)
    status = status_of(reader, 25.0)
    assert status.level == WARN
    assert 'the chair may have turned unseen: give its yaw on /set_pose' in status.text
    assert 'the battery is empty: 24.0 V' in status.text
    reader.set_yaw(0.0, 25.0)
    assert 'unseen' not in status_of(reader, 25.0).text


def test_in_the_fast_mode_silence_is_judged_by_seconds():
    reader = make(imu_period=0.05)
    run(reader, 0.0, 10.0)
    assert not status_of(reader, 10.7).silent
    assert 'IMPACT_GYRO' in status_of(reader, 11.2).silent


@pytest.mark.parametrize(
    'name, kind',
    [
        ('IMPACT_GYRO', 'rates (IMPACT_GYRO)'),
        ('RANGE_ACCEL', 'accelerations (RANGE_ACCEL)'),
        ('COMPLEMENTARY', 'angles (COMPLEMENTARY)'),
    ],
)
def test_frames_that_come_but_say_always_the_same_are_no_imu(name, kind):
    reader = make()
    run(reader, 0.0, 10.0)
    for k in range(50, 100):
        run(reader, 0.2 * k, 0.2 * k + 0.1, without(name))
        reader.on_frame(BUS.encode(name, 0.2 * k, **SIGNALS[name]))
    status = status_of(reader, 20.0)
    assert status.level == ERROR and not status.silent
    assert 'no imu/data for' in status.text and f'{kind} that are always the same' in status.text
    assert 'imu_restarts' not in reader.counters


def test_of_many_kinds_the_newest_are_told():
    reader = make()
    run(reader, 0.0, 5.0)
    for name in ('RANGES_1', 'RANGES_2'):
        reader.on_frame(BUS.encode(name, 5.0, **dict.fromkeys(BUS.ranges[name], 600.0)))
    reader.on_frame(BUS.encode('MODO_PC', 5.5, modoPC=7))
    text = status_of(reader, 5.6).text
    kinds = len(BUS.ranges['RANGES_1']) + len(BUS.ranges['RANGES_2']) + 1
    assert 'unknown mode (1), ' in text and text.endswith(f', and {kinds - 4} more')


def test_the_compass_says_what_it_waits_for():
    bus = BusDescription.named('+compass')
    reader = Reader(ReaderConfig.of(calibration_time=2.0), bus)
    run(reader, 0.0, 4.0)
    assert '0x207 COMPASS' in status_of(reader, 4.0).text and status_of(reader, 4.0).level == WARN
    reader.on_frame(bus.encode('COMPASS', 4.0, mx=0.0, my=25.7, mz=-37.1))
    assert 'the compass is not calibrated (calibrate_compass)' in status_of(reader, 4.0).text
    identity = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    reader.compass.iron = Iron((0.0, 0.0, 0.0), identity, 25.7, 37.1, gain=1.08)
    assert 'waits for 2 s at rest' in status_of(reader, 4.0).text
    compass(bus, reader, 4.0, 9.0, 0.0)
    status = status_of(reader, 9.0)
    assert (status.level, status.text) == (OK, 'publishing') and status.values['heading'].endswith('deg')
    compass(bus, reader, 9.0, 24.0, 20.0)
    status = status_of(reader, 24.0)
    assert status.level == WARN and "the field is not the earth's for 15 s" in status.text
    assert 'steel or a current is near' in status.text


def compass(bus, reader, start, end, steel):
    """All frames, and fields that noise and steel (uT) change."""
    for k in range(round(5 * start), round(5 * end)):
        run(reader, 0.2 * k, 0.2 * k + 0.1)
        for late in (0.01, 0.11):
            noise = 0.05 * (k % 3) + late
            stamp = 0.2 * k + late
            reader.on_frame(bus.encode('COMPASS', stamp, mx=noise, my=25.7 + steel, mz=-37.1 + noise))
