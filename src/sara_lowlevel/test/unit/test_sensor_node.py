"""Chips in, frames out: slots, means, calibration, and what faults on I2C do not do."""

import random
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from sara_common.config import ConfigError
from sara_lowlevel.config import FAST_IMU, SLOW_IMU, SensorConfig
from sara_lowlevel.schedule import SLOTS, frame_slots
from sara_lowlevel.sensor.sensor_node import SensorNode

sys.path.insert(0, str(Path(__file__).parent))
from fake_chips import IMU_ADDRESS, SONAR_ADDRESSES, chair  # noqa: E402

BUS = BusDescription.default()
ADDRESSES, (TURN_1, TURN_2) = SensorConfig.of().sonar_addresses, SensorConfig.of().turns
SENSORS = tuple(ADDRESSES)
DISTANCES = {name: (100 + k) / 100 for k, name in enumerate(SENSORS)}  # of the fake chips, m
QUICK = {'settle_time': 0.1, 'calibration_time': 0.5}


def slow(**settings_):
    """The settings of a node that sends the IMU's frames once in a cycle of 0.2 s."""
    return SensorConfig.of(imu_period=0.2, **settings_)


IMU = ('MADGWICK', 'COMPLEMENTARY', 'RANGE_ACCEL', 'IMPACT_GYRO')


class Bench:
    """A sensor node in its 10 ms loop."""

    def __init__(self, config=None, **mpu):
        self.i2c, self.mpu, self.sonars = chair(**mpu)
        self.node = SensorNode(BUS, self.i2c, config or slow(calibrate=False))
        self.tick, self.heard = 0, []

    def run(self, ticks, each=lambda k: None):
        for _ in range(ticks):
            each(self.tick)
            self.call(self.tick / 100)
            self.tick += 1
        return self

    def call(self, t):
        self.i2c.now = t
        frames = self.node.update(t)
        assert len(frames) <= 1
        self.heard += [(int(t * 100 + 0.2500001), *BUS.decode(frame)) for frame in frames]

    def until_running(self):
        while self.node.state != 'running':
            assert self.tick < 5000
            self.run(1)
        return self

    def said(self, name):
        return [values for _, message, values in self.heard if message == name]

    def imu_ticks(self):
        return [k for k, message, _ in self.heard if message in IMU]


@pytest.mark.parametrize('madgwick', [True, False])
@pytest.mark.parametrize('period', [0.2, 0.05])
def test_no_two_frames_share_a_slot_and_each_name_has_its_rate(period, madgwick):
    slots = frame_slots(period, madgwick)
    cycles = round(0.2 / period)
    names = [*IMU] if madgwick else [*IMU[1:]]
    assert sorted(slots.values()) == sorted(
        ['RANGES_1', 'RANGES_2'] + cycles * names
    )  # a dict of slots: as many as it has frames
    for name in names:
        at = sorted(slot for slot, message in slots.items() if message == name)
        assert [b - a for a, b in zip(at, at[1:] + [at[0] + SLOTS])] == [SLOTS // cycles] * cycles


@pytest.mark.parametrize('period', [0.2, 0.05])
def test_a_cycle_on_the_bus_is_the_plan(period):
    bench = Bench(SensorConfig.of(calibrate=False, imu_period=period)).run(200)
    cycle = {k - 180: name for k, name, _ in bench.heard if k >= 180}
    assert cycle == frame_slots(period)
    assert bench.node.counts.keys() <= {'chip starts'}


def test_sonars_go_in_two_turns_and_arrive_in_metres():
    bench = Bench().run(61)
    when = {
        name: [round(t, 2) for t in bench.sonars[address].triggers] for name, address in zip(SENSORS, SONAR_ADDRESSES)
    }
    assert all(when[name] == [0.0, 0.2, 0.4, 0.6] for name in TURN_1) and all(
        when[name] == [0.1, 0.3, 0.5] for name in TURN_2
    )
    ranges = {name: value for _, _, values in bench.run(60).heard for name, value in values.items() if name in SENSORS}
    assert ranges == pytest.approx(DISTANCES)


@pytest.mark.parametrize('deaf', [True, False])
def test_a_ranger_that_is_still_ranging_is_asked_again(deaf):
    bench = Bench()
    for sonar in bench.sonars.values():
        sonar.deaf = deaf
    # Started in slots 2 and 12 because those calls came late: 66 ms are over in slots 9 and 19 only.
    for k in range(61):
        if k % 20 not in (0, 1, 10, 11):
            bench.call(k / 100)
    assert all(
        value != 655.35 for name in ('RANGES_1', 'RANGES_2') for values in bench.said(name) for value in values.values()
    )


def test_a_dead_ranger_is_neither_free_space_nor_an_old_distance():
    bench = Bench().run(100)
    sensor, *others = BUS.ranges['RANGES_1']
    address = ADDRESSES[sensor]
    del bench.i2c.devices[address]
    heard = len(bench.said('RANGES_1'))
    bench.run(60)
    new = bench.said('RANGES_1')[heard + 1 :]
    assert new and all(values == {**{name: DISTANCES[name] for name in others}, sensor: 655.35} for values in new)
    assert bench.node.rangers.counts[sensor] >= 3
    bench.i2c.devices[address] = bench.sonars[address]
    assert bench.run(60).said('RANGES_1')[-1][sensor] == DISTANCES[sensor]


def test_no_echo_and_nonsense_from_a_ranger():
    bench = Bench()
    sensors = BUS.ranges['RANGES_1'][:3]
    for sensor, distance in zip(sensors, (0, 601, 600), strict=True):
        bench.sonars[ADDRESSES[sensor]].distance = distance
    values = bench.run(60).said('RANGES_1')[-1]
    assert [values[sensor] for sensor in sensors] == pytest.approx([0.0, 655.35, 6.0])


@settings(max_examples=25)
@given(st.lists(st.integers(-32768, 32767), min_size=20, max_size=20), st.sampled_from([0.2, 0.05]))
def test_the_rate_sent_is_the_mean_of_the_turn_and_the_acceleration_the_newest_sample(counts, period):
    bench = Bench(SensorConfig.of(calibrate=False, imu_period=period)).run(200)
    bench.mpu.motion = lambda k: (0, 0, -counts[bench.tick % 20] // 2, 0, 0, counts[bench.tick % 20])
    bench.heard.clear()
    bench.run(40)
    length = round(period * 100)
    for k, name, values in bench.heard:
        if name == 'IMPACT_GYRO' and k >= 220:
            window = [counts[j % 20] for j in range(k - length + 1, k + 1)]
            assert values['gz'] == pytest.approx(min(max(sum(window) / length / 131, -327.67), 327.67), abs=0.0051)
        if name == 'RANGE_ACCEL':
            newest = min(max(16384 + -counts[k % 20] // 2, -32768), 32767)
            assert values['az'] == pytest.approx(newest * 9.80665 / 16384, abs=0.00051)


def test_tenths_where_the_bus_says_so():
    class Tenths:
        """The default bus, with the rates of the thesis's last firmware."""

        ranges = BUS.ranges

        def encode(self, name, **values):
            return name, values

        def resolution(self, name, signal):
            return 0.1 if name == 'IMPACT_GYRO' else 0.001

        names = ()

    bench = Bench(bias=(0, 0, 0, 0, 0, 32767))
    node, heard = SensorNode(Tenths(), bench.i2c, slow(calibrate=False)), []
    for k in range(100):
        bench.i2c.now = k / 100
        heard += node.update(k / 100)
    assert dict(heard)['IMPACT_GYRO']['gz'] == pytest.approx(32767 / 131)


@settings(max_examples=60)
@given(
    st.tuples(*[st.integers(-3000, 3000)] * 3, *[st.integers(-2600, 2600)] * 3),
    st.tuples(*[st.integers(-20000, 20000)] * 3),
)
def test_calibration_leaves_at_most_half_a_register_step(bias, factory):
    bench = Bench(slow(**QUICK), bias=bias, factory=factory).until_running()
    bench.mpu.read(0x3B, 6, bench.tick)
    accel, gyro = bench.node.imu.sample()[:3], bench.node.imu.sample()[3:]
    assert all(abs(a - ideal) <= 8 for a, ideal in zip(accel, (0, 0, 16384))) and all(abs(g) <= 2 for g in gyro)
    held = bench.node.imu.offsets()
    assert all((now ^ old) & 1 == 0 for now, old in zip(held[0], factory)) and held == bench.node.offsets


def test_the_thesis_times_of_the_calibration():
    bench = Bench(slow()).run(25)
    assert bench.node.state == 'settling'
    bench.run(1000)
    assert bench.node.state == 'calibrating'
    bench.run(1995)
    assert bench.node.state == 'calibrating' and bench.imu_ticks() == []
    assert len(bench.said('RANGES_1')) > 140  # the ranges do not wait for it
    bench.run(50)
    assert bench.node.state == 'running' and bench.imu_ticks()


def test_calibration_starts_over_when_the_chair_moves_and_the_button_repeats_it():
    bench = Bench(slow(**QUICK), bias=(0, 0, 0, 400, 0, 0))
    bench.mpu.motion = lambda k: (0, 0, 0, 0, 0, 400 if k < 100 and k // 40 % 2 else 0)
    bench.until_running()
    assert bench.node.counts['not still'] >= 1 and bench.node.imu.sample()[3:] == (0, 0, 0)
    bench.mpu.bias = (0, 0, 0, 400, 200, 0)
    bench.node.recalibrate()
    assert bench.node.state == 'settling'
    heard = len(bench.imu_ticks())
    bench.until_running()
    assert len(bench.imu_ticks()) == heard and bench.node.imu.sample()[3:] == (0, 0, 0)


def test_an_imu_on_its_side_is_not_calibrated_away():
    bench = Bench(slow(**QUICK), bias=(16000, 0, -16384, 0, 0, 0)).run(500)
    assert bench.node.state == 'calibrating' and 'refused' in bench.node.reason and bench.imu_ticks() == []


@pytest.mark.parametrize('period', [FAST_IMU, SLOW_IMU])
def test_an_impact_is_told_in_three_frames_for_one_may_get_lost(period):
    bench = Bench(SensorConfig.of(calibrate=False, imu_period=period)).run(205)
    bench.mpu.impact = True
    start = len(bench.said('IMPACT_GYRO'))
    assert [values['alarma'] for values in bench.run(100).said('IMPACT_GYRO')[start:]][:5] == [1, 1, 1, 0, 0]


def test_an_impact_is_not_told_anew_when_the_imu_was_away_after_it():
    bench = Bench(slow(calibrate=False, **QUICK)).run(205)
    bench.mpu.impact = True
    bench.run(20)
    bench.node.recalibrate()
    assert sum(values['alarma'] for values in bench.until_running().run(200).said('IMPACT_GYRO')) == 1


def test_impacts_that_go_on_are_told_until_two_frames_after_the_last():
    bench = Bench().run(205)
    start = len(bench.said('IMPACT_GYRO'))
    bench.run(60, lambda k: setattr(bench.mpu, 'impact', True)).mpu.impact = False
    assert [values['alarma'] for values in bench.run(100).said('IMPACT_GYRO')[start:]] == [1, 1, 1, 1, 1, 0, 0, 0]


def test_a_blow_that_shakes_a_plug_is_told_once_the_chip_answers_again():
    bench, once = Bench().run(205), iter([True])
    bench.mpu.impact, bench.i2c.fails = True, lambda: next(once, False)
    start = len(bench.said('IMPACT_GYRO'))
    bench.run(100)
    assert bench.node.counts['I2C errors'] == 1
    assert sum(values['alarma'] for values in bench.said('IMPACT_GYRO')[start:]) == 3


def test_yaw_beyond_16_bits_goes_round_and_tilt_stays_at_its_limit():
    bench = Bench(bias=(0, 16384, -16384, 0, 0, 2620)).run(500)
    angles = bench.said('COMPLEMENTARY')[-1]
    assert angles['rx'] == 32.767 and bench.said('MADGWICK')[-1]['roll'] == 32.767
    assert abs(bench.node.filter.yaw) > 65.536
    assert (angles['rz'] - bench.node.filter.yaw + 10) % 65.536 - 10 == pytest.approx(0.0, abs=0.8)


def test_a_late_call_does_not_shift_the_phases():
    bench = Bench().run(100)
    for k in (118, 119, 160):  # 18 slots slept through, then 40
        bench.call(k / 100)
    assert bench.node.missed == 18 + 40
    bench.tick = 161
    bench.run(60)  # what was late goes out one to a slot
    bench.heard.clear()
    bench.run(19 + 20)
    assert {k % 20: name for k, name, _ in bench.heard} == frame_slots(0.2)


@given(st.lists(st.floats(-0.0024, 0.0074), min_size=140, max_size=140))
@settings(max_examples=20)
def test_jitter_of_the_calls_changes_nothing(jitter):
    bench = Bench()
    bench.call(0.0)
    for k in range(1, 140):
        bench.call(k / 100 + jitter[k])
    assert {k % 20: name for k, name, _ in bench.heard[-12:]} == frame_slots(0.2) and bench.node.missed == 0


def test_a_clock_that_goes_back_begins_anew():
    bench = Bench().run(150)
    bench.tick = 0
    bench.heard.clear()
    assert bench.run(100).imu_ticks() and bench.node.state == 'running'


# --- faults on I2C ---------------------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.floats(0.0005, 0.3))
def test_random_faults_never_raise_never_send_what_is_old_and_are_survived(seed, rate):
    luck = random.Random(seed)
    bench = Bench(slow(settle_time=0.1, calibration_time=0.3, retry_period=0.2))
    bench.mpu.motion = lambda k: (
        (bench.tick % 50, 0, 0, 0, 0, 40 * (bench.tick % 50)) if bench.node.state == 'running' else (0,) * 6
    )
    bench.i2c.fails = lambda: luck.random() < rate and bench.tick < 1500
    bench.run(1500)
    for k, name, values in bench.heard:
        if name == 'RANGE_ACCEL':  # the sample of this very slot
            assert values['ax'] == pytest.approx(k % 50 * 9.80665 / 16384, abs=0.006)
        if name == 'IMPACT_GYRO':  # the whole turn before, and nothing else
            window = [40 * (j % 50) / 131 for j in range(k - 19, k + 1)]
            assert values['gz'] == pytest.approx(sum(window) / 20, abs=0.02)
        for sensor, value in values.items():
            if sensor in SENSORS:
                assert value in (655.35, DISTANCES[sensor])
    bench.run(400)
    assert bench.node.state == 'running'
    heard = len(bench.imu_ticks())
    assert len(bench.run(40).imu_ticks()) - heard == 8


def test_one_error_costs_one_turn_and_no_reset():
    bench = Bench().run(205)
    resets = bench.mpu.resets
    once = iter([True])
    bench.i2c.fails = lambda: next(once, False)
    bench.run(100)
    assert bench.mpu.resets == resets and bench.node.counts['I2C errors'] == 1
    sent = [k for k in bench.imu_ticks() if k >= 205]
    assert sent and sent[0] == 236  # the turn of the error is not sent, the next one is


def test_a_chip_that_lost_its_supply_is_started_again_with_its_offsets():
    bench = Bench(slow(**QUICK), bias=(500, 0, 0, 80, 0, 0), factory=(7, -3, 11)).until_running().run(100)
    offsets = bench.node.offsets
    bench.mpu.power_up()
    before = bench.tick
    bench.run(100)
    late = [(k, values) for k, name, values in bench.heard if name == 'IMPACT_GYRO' and k >= before]
    assert late and all(abs(values['gx']) < 0.02 for _, values in late) and late[0][0] - before > 20
    assert bench.node.imu.offsets() == offsets and bench.node.state == 'running' and bench.node.counts['ChipError'] == 1


def test_a_chip_of_another_make_or_none_is_a_fault_and_the_ranges_go_on():
    bench = Bench()
    bench.mpu.registers[0x75] = 0x70
    bench.run(300)
    assert bench.node.state == 'fault' and 'WHO_AM_I' in bench.node.reason and bench.imu_ticks() == []
    assert len(bench.said('RANGES_1')) == 15 and bench.node.counts['ChipError'] == 3
    del bench.i2c.devices[IMU_ADDRESS]
    assert bench.run(200).node.state == 'fault'
    bench.mpu.registers[0x75] = 0x68
    bench.i2c.devices[IMU_ADDRESS] = bench.mpu
    assert bench.run(200).node.state == 'running'


def test_bad_settings_are_named_all_at_once():
    with pytest.raises(ConfigError) as error:
        SensorConfig.of(
            imu_period=0.1, imu_address=3, madgwick=1, sonar_addresses=(0x70,), complementary_weight=1.0, settle_time=-1
        )
    for name in ('imu_period', 'imu_address', 'madgwick', 'sonar_addresses', 'complementary_weight', 'settle_time'):
        assert name in str(error.value)
