"""What goes out is the mean of what came in, in the frames' units, in the right slots."""

import math

import pytest
from canserial.bus import BusDescription
from hypothesis import given
from hypothesis import strategies as st
from sara_lowlevel.complementary import ComplementaryFilter
from sara_lowlevel.sensor_node import SENSORS, TURN_1, TURN_2, SensorNode

BUS = BusDescription.default()
REST = (0, 0, 16384)


class Sonars:
    """Always the same answers; remembers what was asked."""

    def __init__(self, distance=None):
        self.distance, self.bursts = distance or {name: 100 + i for i, name in enumerate(SENSORS)}, []

    def trigger(self, names):
        self.bursts.append(tuple(names))

    def read(self, name):
        assert name in self.bursts[-1], 'read only what was triggered last'
        return self.distance[name]


def run(ticks, accel=lambda k: REST, gyro=lambda k: (0, 0, 0), sonars=None, impact=lambda k: False):
    node, sonars = SensorNode(BUS), sonars or Sonars()
    return [(k, *BUS.decode(frame)) for k in range(ticks) for frame in node.update(k / 100, accel(k), gyro(k), sonars, impact(k))]


def test_one_cycle_has_every_frame_once_and_a_slot_for_each():
    heard = [(k - 20, name) for k, name, _ in run(40) if k >= 20]
    assert [name for _, name in heard] == ['RANGES_2', 'RANGES_1', 'COMPLEMENTARY', 'RANGE_ACCEL', 'IMPACT_GYRO']
    assert len({k for k, _ in heard}) == len(heard)
    imu = [k for k, name in heard if name in ('COMPLEMENTARY', 'RANGE_ACCEL', 'IMPACT_GYRO')]
    assert imu == [17, 18, 19]


def test_sonars_go_in_two_turns_and_arrive_in_metres():
    sonars = Sonars()
    heard = run(41, sonars=sonars)
    assert sonars.bursts == [TURN_1, TURN_2, TURN_1, TURN_2, TURN_1]
    ranges = {}
    for _, _, values in heard:
        ranges.update({name: value for name, value in values.items() if name in SENSORS})
    assert ranges == pytest.approx({name: distance / 100 for name, distance in sonars.distance.items()})


@given(st.lists(st.integers(-32768, 32767), min_size=20, max_size=20))
def test_the_rate_sent_is_the_mean_of_the_turn(counts):
    heard = run(20, gyro=lambda k: (0, 0, counts[k]))
    (gz,) = [values['gz'] for _, name, values in heard if name == 'IMPACT_GYRO']
    assert gz == pytest.approx(sum(counts) / 20 / 131, abs=0.0051)


def test_constant_samples_arrive_in_si_units():
    heard = run(40, lambda k: (8192, -1638, 16384), lambda k: (131, -262, 13100))
    accel = [values for _, name, values in heard if name == 'RANGE_ACCEL'][-1]
    rates = [values for _, name, values in heard if name == 'IMPACT_GYRO'][-1]
    assert (accel['ax'], accel['ay'], accel['az']) == pytest.approx((4.903, -0.980, 9.807), abs=1e-3)
    assert (rates['gx'], rates['gy'], rates['gz']) == pytest.approx((1.0, -2.0, 100.0))


def test_an_impact_between_frames_is_told_once():
    alarms = [values['alarma'] for _, name, values in run(80, impact=lambda k: k == 25) if name == 'IMPACT_GYRO']
    assert alarms == [0, 1, 0, 0]


def test_yaw_beyond_16_bits_goes_round_and_tilt_stays_at_its_limit():
    heard = run(400, lambda k: (0, 16384, 0), lambda k: (0, 0, 131 * 20))
    angles = [values for _, name, values in heard if name == 'COMPLEMENTARY'][-1]
    assert angles['rx'] == 32.767
    # the filter has turned 20 deg/s over the samples after the first
    assert (angles['rz'] - 20 * 0.01 * 397) % 65.536 == pytest.approx(0.0, abs=0.01) or (angles['rz'] - 20 * 0.01 * 397) % 65.536 > 65.52


@given(st.floats(-30, 30), st.floats(-30, 30), st.floats(0.5, 0.98))
def test_complementary_filter_settles_on_gravity(roll, pitch, weight):
    r, p = math.radians(roll), math.radians(pitch)
    gravity = (-math.sin(p), math.cos(p) * math.sin(r), math.cos(p) * math.cos(r))
    angles = ComplementaryFilter(weight, 0.01)
    angles.update((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    for _ in range(1000):
        angles.update(gravity, (0.0, 0.0, 0.0))
    expected = math.degrees(math.atan2(gravity[1], math.hypot(gravity[0], gravity[2])))
    assert angles.roll == pytest.approx(expected, abs=1e-3)
    assert angles.pitch == pytest.approx(pitch, abs=1e-3)
    assert angles.yaw == 0.0
