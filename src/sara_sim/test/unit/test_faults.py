"""Every fault: what comes out of the chair while it happens, and that it leaves no trace."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from sara_common.platforms import chosen
from sara_lowlevel.config import SensorConfig
from sara_sim.chair import SimulatedChair
from sara_sim.config import ChairConfig
from sara_sim.faults.faults import FAULTS, FaultError, build, describe
from sara_sim.world.world import World

SONARS = chosen().sonars
BUS = BusDescription.default()
SURE = ChairConfig.of(frame_loss=0.0, sonar_lost=0.0)


def room():
    occupied = np.zeros((120, 120), bool)
    occupied[[0, -1], :] = occupied[:, [0, -1]] = True
    return World(occupied)


@pytest.fixture
def flight(pilot):
    return pilot(SimulatedChair(room(), 5, (3.0, 3.0, 0.0), config=SURE))


def count(flight, name, since):
    return len(flight.times(name, since))


# --- names and arguments ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    'name, arguments, words',
    [
        ('frames_lost', {}, ['frames_lost', 'frames_dropped']),
        ('frames_dropped', {'probability': 2}, ['probability is 2']),
        ('frames_dropped', {'ids': [-1]}, ['ids is']),
        ('frames_dropped', {'direction': 'up', 'duration': 0}, ['direction is', 'duration is']),
        ('frames_dropped', {'probabilty': 0.1}, ['probabilty', 'probability']),
        ('sonar_stuck', {}, ['sensor is missing', 'range is missing']),
        ('sonar_stuck', {'sensor': '', 'range': 9}, ['sensor is', 'range is']),
        ('sonar_silent', {'sensor': 'SXX'}, ['sensor is', ', '.join(SONARS)]),
        ('wheel_slip', {'radius': 0, 'factor': 'a'}, ['radius is', 'factor is']),
        ('joystick_grabbed', {'x': 1024, 'y': 0.5}, ['x is', 'y is']),
        ('push', {'forward': math.nan}, ['forward is']),
        ('node_silent', {'node': True}, ['node is']),
        ('frames_corrupted', {'bits': 0}, ['bits is']),
        (7, {}, ['no fault 7']),
    ],
)
def test_what_is_wrong_is_named(flight, name, arguments, words):
    with pytest.raises(FaultError) as error:
        flight.chair.faults.add(name, **arguments)
    assert all(word in str(error.value) for word in words)
    assert not flight.chair.faults.active and flight.chair.faults.list() == []


def test_a_frame_that_does_not_exist_is_named(flight):
    with pytest.raises(FaultError, match='GYROS'):
        flight.chair.faults.add('frames_dropped', ids=['GYROS'])
    with pytest.raises(FaultError, match='no fault'):
        flight.chair.faults.clear('nothing')


@given(
    st.sampled_from(sorted(FAULTS)),
    st.dictionaries(
        st.sampled_from(
            ['probability', 'ids', 'direction', 'duration', 'sensor', 'range', 'wheel', 'node', 'x', 'sigma', 'voltage']
        ),
        st.one_of(
            st.none(),
            st.booleans(),
            st.integers(),
            st.floats(),
            st.text(max_size=5),
            st.lists(st.integers(), max_size=3),
        ),
    ),
)
def test_any_arguments_make_a_fault_or_a_fault_error(name, arguments):
    try:
        fault = build(name, arguments)
    except FaultError:
        return
    assert fault.name == name


def test_all_are_described():
    text = describe()
    assert all(f'\n{name}: ' in f'\n{text}' for name in FAULTS) and 'required' in text


# --- frames -----------------------------------------------------------------------------------------------------------


def test_frames_dropped_for_a_while_and_only_those(flight):
    flight.drive(0, 0, 2.0)
    flight.chair.faults.add('frames_dropped', ids=[BUS.id_of('IMPACT_GYRO'), 'RANGE_ACCEL'], duration=2.0)
    flight.drive(0, 0, 4.0)
    gap = lambda name: np.diff(flight.times(name)).max()
    gone = 2.0 + SensorConfig.of().imu_period
    assert gap('IMPACT_GYRO') == pytest.approx(gone, abs=0.2) and gap('RANGE_ACCEL') == pytest.approx(gone, abs=0.2)
    assert gap('COMPLEMENTARY') < 0.25 and gap('ENCODER_RIGHT') < 0.15
    assert count(flight, 'IMPACT_GYRO', 4.1) >= 9 and not flight.chair.faults.active


def test_frames_dropped_by_chance(flight):
    flight.chair.faults.add('frames_dropped', probability=0.3, direction='to_pc')
    flight.drive(0, 0, 60.0)
    assert count(flight, 'ENCODER_LEFT', 0.0) == pytest.approx(0.7 * 600, rel=0.08)
    assert flight.chair.counts['frames_dropped'] > 0


def test_commands_dropped_stop_the_chair_and_nothing_is_missing_the_other_way(flight):
    flight.drive(2.0, 2.0, 2.0)
    assert flight.chair.velocity[0] > 0.2
    flight.chair.faults.add('frames_dropped', direction='from_pc')
    flight.drive(2.0, 2.0, 1.0)
    assert abs(flight.chair.velocity[0]) < 1e-2 and flight.chair.motor.counts['commands stopped'] == 1
    assert np.diff(flight.times('ENCODER_RIGHT')).max() < 0.15


def test_frames_delayed(flight):
    flight.drive(0, 0, 1.0)
    flight.chair.faults.add('frames_delayed', delay=0.5, ids=['ENCODER_RIGHT'])
    flight.drive(0, 0, 3.0)
    age = [
        time - signals['time'] * 1e-4 for time, name, signals in flight.heard if name == 'ENCODER_RIGHT' and time > 2.0
    ]
    assert min(age) >= 0.5 and max(age) <= 0.511
    assert [frame.time for frame in flight.raw] == sorted(frame.time for frame in flight.raw)


def test_frames_duplicated(flight):
    flight.chair.faults.add('frames_duplicated', ids=[BUS.id_of('ENCODER_RIGHT')], direction='to_pc')
    flight.drive(0, 0, 3.0)
    stamps = flight.values('ENCODER_RIGHT', 'time')
    assert np.all(stamps[0::2] == stamps[1::2]) and len(set(stamps)) == len(stamps) // 2 > 25
    assert len(set(flight.values('ENCODER_LEFT', 'time'))) == count(flight, 'ENCODER_LEFT', 0.0)


@pytest.mark.parametrize('bits', (1, 3, 64))
def test_frames_corrupted(pilot, bits):
    def raw(**fault):
        chair = SimulatedChair(room(), 5, (3.0, 3.0, 0.0), config=SURE)
        if fault:
            chair.faults.add('frames_corrupted', **fault)
        return [frame for _ in range(300) for frame in chair.step()]

    flipped = set()
    clean, dirty = raw(), raw(bits=bits, direction='to_pc')
    assert len(clean) == len(dirty) > 100
    for one, other in zip(clean, dirty):
        assert (one.id, one.time, len(one.data)) == (other.id, other.time, len(other.data))
        flipped.add(bin(int.from_bytes(one.data, 'big') ^ int.from_bytes(other.data, 'big')).count('1'))
    assert max(flipped) == bits


def test_the_adapter_unplugged(flight):
    flight.drive(2.0, 2.0, 2.0)
    flight.chair.faults.add('adapter_unplugged', duration=1.0)
    assert not flight.chair.plugged
    flight.drive(2.0, 2.0, 0.9)
    assert flight.times('ENCODER_RIGHT').max() <= 2.0 and abs(flight.chair.velocity[0]) < 1e-2
    flight.drive(2.0, 2.0, 1.0)
    assert flight.chair.plugged and flight.times('ENCODER_RIGHT').max() > 3.5
    assert flight.chair.counts['frames lost, unplugged'] > 50


def test_by_hand_and_by_fault_it_is_plugged_only_when_neither_holds_it_out(flight):
    chair = flight.chair
    chair.plugged = False
    chair.faults.add('adapter_unplugged')
    chair.faults.clear()
    assert not chair.plugged
    chair.plugged = True
    chair.faults.add('adapter_unplugged')
    assert not chair.plugged
    chair.faults.clear('adapter_unplugged')
    assert chair.plugged


# --- sensors ----------------------------------------------------------------------------------------------------------

FRAME_OF = {sensor: name for name, sensors in BUS.ranges.items() for sensor in sensors}


@pytest.mark.parametrize('sensor', SONARS)
def test_a_sonar_stuck(flight, sensor):
    flight.chair.faults.add('sonar_stuck', sensor=sensor, range=0.77)
    flight.drive(0, 0, 2.0)
    assert np.all(flight.values(FRAME_OF[sensor], sensor, since=0.5) == 0.77)
    others = [name for name in SONARS if name != sensor]
    assert all(not np.any(flight.values(FRAME_OF[name], name, since=0.5) == 0.77) for name in others)
    flight.chair.faults.clear()
    flight.drive(0, 0, 1.0)
    assert not np.any(flight.values(FRAME_OF[sensor], sensor, since=2.5) == 0.77)


@pytest.mark.parametrize('sensor', SONARS)
def test_a_sonar_noisy(flight, sensor):
    flight.chair.faults.add('sonar_noisy', sensor=sensor, sigma=0.2)
    flight.drive(0, 0, 30.0)
    spread = {name: np.std(flight.values(FRAME_OF[name], name, since=1.0)) for name in SONARS}
    assert spread.pop(sensor) == pytest.approx(0.2, rel=0.25) and max(spread.values()) < 0.02


@pytest.mark.parametrize('sensor', SONARS)
def test_a_sonar_silent_is_told_as_such_and_comes_back(flight, sensor):
    flight.chair.faults.add('sonar_silent', sensor=sensor, duration=2.0)
    flight.drive(0, 0, 2.0)
    assert np.all(flight.values(FRAME_OF[sensor], sensor, since=0.7) == 655.35)
    flight.drive(0, 0, 1.5)
    assert np.all(flight.values(FRAME_OF[sensor], sensor, since=2.7) < 6.0)


def test_the_imu_stuck(flight):
    flight.drive(0, 0, 1.0)
    flight.chair.faults.add('imu_stuck')
    flight.drive(1.0, -1.0, 3.0)
    assert abs(flight.chair.velocity[1]) > 0.1
    assert (
        len(set(flight.values('IMPACT_GYRO', 'gz', since=1.5))) == 1
        and len(set(flight.values('RANGE_ACCEL', 'ax', since=1.5))) == 1
    )


def test_the_imu_noisy(flight):
    def sigmas():
        samples = []
        for _ in range(1000):
            flight.chair.step()
            samples.append(flight.chair.box.imu.counts)
        return np.std(samples, axis=0) / ([16384 / 9.80665] * 3 + [131.0] * 3)

    quiet = sigmas()
    flight.chair.faults.add('imu_noisy', accel_sigma=2.0, gyro_sigma=20.0)
    np.testing.assert_allclose(sigmas(), np.hypot(quiet, [2.0] * 3 + [20.0] * 3), rtol=0.1)
    flight.chair.faults.clear()
    np.testing.assert_allclose(sigmas(), quiet, rtol=0.15)


def test_the_imu_silent_sends_no_imu_frames_and_is_started_again(flight):
    flight.drive(0, 0, 2.0)
    flight.chair.faults.add('imu_silent', duration=3.0)
    flight.drive(0, 0, 3.0)
    assert flight.times('IMPACT_GYRO').max() < 2.25 and flight.chair.sensors.state == 'fault'
    assert np.diff(flight.times('RANGES_1')).max() < 0.25
    flight.drive(0, 0, 3.0)
    assert flight.chair.sensors.state == 'running' and count(flight, 'IMPACT_GYRO', 7.0) >= 4


@pytest.mark.parametrize(
    'wheel, still, moving', [('right', 'ENCODER_RIGHT', 'ENCODER_LEFT'), ('left', 'ENCODER_LEFT', 'ENCODER_RIGHT')]
)
def test_an_encoder_frozen_counts_on_from_where_it_stood(flight, wheel, still, moving):
    flight.drive(1.0, 1.0, 1.0)
    flight.chair.faults.add('encoder_frozen', wheel=wheel, duration=1.0)
    flight.drive(1.0, 1.0, 0.95)
    assert (
        len(set(flight.values(still, 'steps', since=1.1))) == 1
        and len(set(flight.values(moving, 'steps', since=1.1))) > 5
    )
    flight.drive(1.0, 1.0, 1.0)
    gaps = np.diff(flight.values(still, 'steps').astype(float))
    a_radian = SURE.steps_per_turn / (2 * math.pi)
    assert gaps.max() < a_radian * 0.1 * 1.3, 'no jump to where it would have been'
    assert flight.values(still, 'steps')[-1] < flight.values(moving, 'steps')[-1] - 0.5 * a_radian


def test_an_encoder_noisy(flight):
    flight.chair.faults.add('encoder_noisy', wheel='left', sigma=100.0)
    flight.drive(0, 0, 30.0)
    wrapped = flight.values('ENCODER_LEFT', 'steps').astype(np.uint32).astype(np.int32)
    assert np.std(wrapped) == pytest.approx(100.0, rel=0.2) and not flight.values('ENCODER_RIGHT', 'steps').any()


@pytest.mark.parametrize(
    'node, missing, there',
    [
        ('sensor', 'IMPACT_GYRO', 'ENCODER_LEFT'),
        ('motor', 'ENCODER_LEFT', 'IMPACT_GYRO'),
        ('joystick', 'JOYSTICK', 'IMPACT_GYRO'),
    ],
)
def test_a_node_silent(flight, node, missing, there):
    flight.drive(1.0, 1.0, 1.0)
    flight.chair.faults.add('node_silent', node=node, duration=1.5)
    flight.drive(1.0, 1.0, 1.45)
    assert count(flight, missing, 1.02) == 0 and count(flight, there, 1.02) > 5
    if node != 'sensor':
        assert abs(flight.chair.velocity[0]) < 1e-2, 'nobody may drive it'
    flight.drive(1.0, 1.0, 2.0)
    assert count(flight, missing, 2.6) > 5


# --- body and rider ---------------------------------------------------------------------------------------------------


def test_a_wheel_slips_on_a_patch(pilot):
    chair = SimulatedChair(
        World.empty(), 5, (0.0, 0.0, 0.0), config=ChairConfig.of(frame_loss=0.0, wheel_radius_sigma=0.0)
    )
    chair.faults.add('wheel_slip', wheel='right', factor=0.4, x=1.0, y=-0.26, radius=0.3)
    flight = pilot(chair)
    while chair.pose[0] < 0.67:
        flight.drive(2.0, 2.0, 0.05)
    assert chair.pose[2] == 0.0
    while chair.pose[0] < 1.5:
        flight.drive(2.0, 2.0, 0.05)
    right, left = chair.drive.steps()
    assert chair.pose[2] < -0.15 and abs(right - left) < 10, 'the encoders do not see it'
    yaw = chair.pose[2]
    flight.drive(2.0, 2.0, 1.0)
    assert chair.pose[2] == pytest.approx(yaw)


def test_both_wheels_slip_for_a_time(flight):
    flight.chair.faults.add('wheel_slip', factor=0.0, duration=2.0)
    flight.drive(2.0, 2.0, 1.9)
    assert (
        flight.chair.pose[:2] == pytest.approx((3.0, 3.0)) and flight.chair.drive.steps()[0] > SURE.steps_per_turn / 6
    )
    flight.drive(2.0, 2.0, 1.0)
    assert flight.chair.pose[0] > 3.0 + 1.3 * SURE.wheel_radius


def test_a_push_moves_the_body_and_is_felt_but_not_counted(flight):
    flight.drive(0, 0, 1.0)
    flight.chair.faults.add('push', forward=0.6, left=-0.4, turn=0.5, duration=0.4)
    flight.drive(0, 0, 1.5)
    share = 2 / math.pi * 0.4
    x, y, yaw = flight.chair.pose
    assert (x - 3.0, y - 3.0, yaw) == pytest.approx((0.6 * share, -0.4 * share, 0.5 * share), abs=0.02)
    assert flight.chair.drive.steps() == (0, 0)
    assert flight.values('IMPACT_GYRO', 'alarma', since=1.0).max() == 1, 'the motion interrupt fires'
    assert flight.values('IMPACT_GYRO', 'gz', since=1.0).max() > 5.0
    assert flight.chair.velocity == (0.0, 0.0) and flight.chair.drive.resting


def test_a_wall_ends_a_push(pilot):
    chair = SimulatedChair(room(), 5, (5.84 - 0.5 * SURE.length, 3.0, 0.0), config=SURE)
    chair.faults.add('push', forward=2.0, duration=0.5)
    pilot(chair).drive(0, 0, 1.0)
    assert chair.contacts == 1 and chair.pose[0] <= 5.95 - 0.5 * SURE.length


def test_the_battery_falls_and_recovers(flight):
    flight.chair.faults.add('battery_low', voltage=20.0, ramp=4.0, duration=8.0)
    flight.drive(0, 0, 12.0)
    volts = dict(zip(np.round(flight.times('BATTERY')), flight.values('BATTERY', 'voltage')))
    assert (
        volts[2] == pytest.approx((SURE.battery + 20.0) / 2, abs=0.2)
        and volts[6] == pytest.approx(20.0)
        and volts[11] == pytest.approx(SURE.battery)
    )


def test_the_joystick_grabbed_wins_and_let_go_gives_the_pc_control_again(flight):
    flight.drive(2.0, 2.0, 1.0)
    flight.chair.faults.add('joystick_grabbed', y=0, duration=1.0)
    flight.drive(2.0, 2.0, 0.9)
    assert flight.chair.motor.mode == 1 and flight.chair.velocity[0] < -0.2
    assert flight.values('JOYSTICK', 'joyy', since=1.1)[0] == 0
    flight.drive(2.0, 2.0, 1.5)
    assert flight.chair.motor.mode == 3 and flight.chair.velocity[0] > 0.2


# --- together ---------------------------------------------------------------------------------------------------------


def everything(chair):
    chair.faults.add('frames_dropped', probability=0.05)
    chair.faults.add('frames_delayed', probability=0.1, delay=0.05)
    chair.faults.add('frames_duplicated', probability=0.1)
    chair.faults.add('frames_corrupted', probability=0.05)
    chair.faults.add('sonar_noisy', sensor='all')
    chair.faults.add('imu_noisy')
    chair.faults.add('encoder_noisy', wheel='both')
    chair.faults.add('wheel_slip')


def test_same_seed_same_faults_same_bytes(pilot):
    def run(seed):
        chair = SimulatedChair(room(), seed, (3.0, 3.0, 0.0))
        everything(chair)
        return pilot(chair).drive(1.0, 0.5, 5.0).raw

    assert run(7) == run(7) != run(8)


def test_a_fault_that_spares_a_frame_does_not_change_it():
    """Nobody drives, so that nothing feeds back: what is left of the frames is as without the fault, to the last bit
    and microsecond.
    """

    def raw(*faults):
        chair = SimulatedChair(room(), 3, (3.0, 3.0, 0.0))
        for name, arguments in faults:
            chair.faults.add(name, **arguments)
        return [frame for _ in range(500) for frame in chair.step()]

    clean = raw()
    dropped = raw(('frames_dropped', dict(ids=['IMPACT_GYRO'])))
    assert dropped == [frame for frame in clean if frame.id != BUS.id_of('IMPACT_GYRO')]
    sensor, own = BUS.ranges['RANGES_1'][0], BUS.id_of('RANGES_1')
    noisy = raw(('sonar_noisy', dict(sensor=sensor)))
    assert [frame for frame in noisy if frame.id != own] == [frame for frame in clean if frame.id != own]
    # One more fault leaves the luck of the first alone.
    right, left = BUS.id_of('ENCODER_RIGHT'), BUS.id_of('ENCODER_LEFT')
    one = ('frames_dropped', dict(probability=0.5, ids=[right]))
    both = raw(('sonar_noisy', dict(sensor=sensor)), one, ('frames_dropped', dict(probability=0.5, ids=[left])))
    assert [frame for frame in both if frame.id == right] == [frame for frame in raw(one) if frame.id == right]


def test_cleared_they_leave_no_trace(flight):
    everything(flight.chair)
    flight.chair.faults.add('node_silent', node='sensor')
    flight.chair.faults.add('encoder_frozen', wheel='both')
    flight.chair.faults.add('battery_low')
    flight.drive(0, 0, 2.0)
    assert (
        len(flight.chair.faults.list()) == 11 and 'battery_low (voltage 20.5, ramp 0.0)' in flight.chair.faults.list()
    )
    assert flight.chair.faults.clear('node_silent') == 1 and flight.chair.faults.clear() == 10
    chair = flight.chair
    assert (chair.wire.faults, chair.box.noise, chair.box.acoustics.extra, chair.encoders.noise) == ([], [], {}, [])
    assert (chair.silent_nodes, chair.drive.grip, chair.grabbed) == (frozenset(), (1.0, 1.0), None)
    assert chair.battery == SURE.battery
    flight.drive(1.0, 1.0, 2.0)
    assert chair.velocity[0] == pytest.approx(SURE.wheel_radius, rel=0.1)
