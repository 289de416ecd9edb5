"""Laws of the simulated chair: what its wheels, its body and its sensors may say of one motion."""

import math

import numpy as np
import pytest

from canserial.dbc.bus import BusDescription
from sara_common.platforms import chosen, load
from sara_lowlevel.config import SensorConfig
from sara_sim.chair import SimulatedChair
from sara_sim.config import ChairConfig
from sara_sim.world.world import World, WorldError

SARA = load('sara')
BUS = BusDescription.default()
IDEAL = ChairConfig.of(wheel_radius_sigma=0.0, frame_jitter=0.0, frame_loss=0.0)
IMU_RATE = round(1 / SensorConfig.of().imu_period)
QUIET = ChairConfig.of(
    gyro_frame_sigma=(0.0,) * 3, gyro_drift=0.0, accel_sigma_low=(0.0,) * 3, accel_sigma_high=(0.0,) * 3, tilt_sigma=0.0
)


def drive(chair, right, left, seconds):
    """Command the wheels at 50 Hz, as the PC does; returns the frames heard, decoded."""
    heard = []
    for tick in range(round(seconds * 100)):
        if tick % 2 == 0:
            in_control = chair.motor.mode == 3
            chair.receive(
                BUS.encode(
                    'WHEEL_COMMAND',
                    right=right if in_control else 0.0,
                    left=left if in_control else 0.0,
                    mode=ord('C' if in_control else 'A'),
                )
            )
        heard += [(frame.time, *BUS.decode(frame)) for frame in chair.step()]
    return heard


def values(heard, name, signal):
    return np.array([signals[signal] for _, message, signals in heard if message == name])


def heard_of(heard, sensor):
    """The ranges of a sonar, m."""
    message = next(name for name, sensors in BUS.ranges.items() if sensor in sensors)
    return values(heard, message, sensor)


def rolled(steps):
    """The way of an ideal wheel, m."""
    return steps / IDEAL.steps_per_turn * 2 * math.pi * IDEAL.wheel_radius


def test_driven_straight_odometer_and_truth_agree():
    chair = SimulatedChair(World.empty(), 1, bus=BUS, config=IDEAL)
    drive(chair, 2.0, 2.0, 5.0)
    drive(chair, 0.0, 0.0, 2.0)
    right, left = chair.drive.steps()
    assert right == left
    assert math.hypot(*chair.pose[:2]) == pytest.approx(rolled(right), abs=2e-5 + rolled(1))
    assert chair.pose[1:] == (0.0, 0.0)


def test_turned_in_place_wheels_say_more_than_the_body_does():
    for seed in range(5):
        chair = SimulatedChair(World.empty(), seed, bus=BUS, config=IDEAL)
        drive(chair, 1.0, -1.0, 6.0)
        said = IDEAL.wheel_radius * (chair.drive.right - chair.drive.left) / IDEAL.track
        assert IDEAL.slip_range[0] <= said / chair.drive.yaw <= IDEAL.slip_range[1]
        assert chair.pose[:2] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_there_and_back_again():
    """With ideal wheels, commands and the same commands reversed in order and sign lead home."""
    chair = SimulatedChair(World.empty(), 2, (1.0, 1.0, 0.3), BUS, IDEAL)
    drive(chair, 0.0, 0.0, 0.5)
    legs = [(2.0, 2.0), (1.0, -1.0), (3.0, 2.0)]
    for right, left in legs + [(-right, -left) for right, left in reversed(legs)]:
        drive(chair, right, left, 2.0)
        drive(chair, 0.0, 0.0, 1.5)
    assert chair.pose == pytest.approx((1.0, 1.0, 0.3), abs=5e-3)


def test_motor_lag_dead_band_and_top_speed():
    chair = SimulatedChair(World.empty(), 3, bus=BUS, config=IDEAL)
    speeds = []
    fastest = IDEAL.max_wheel_speed
    for _ in range(10):
        chair.drive.step(fastest + 2.0, 0.95 * IDEAL.dead_band)
        speeds.append(chair.drive.right_speed)
    assert speeds[-1] == pytest.approx(fastest * (1 - math.exp(-0.1 / IDEAL.motor_lag)))
    assert chair.drive.left == 0.0


def test_same_seed_same_bytes_other_seed_others():
    def run(seed):
        return drive(SimulatedChair(World.empty(), seed, bus=BUS), 1.0, 0.5, 3.0)

    assert run(7) == run(7)
    assert run(7) != run(8)


def test_silence_stops_it():
    chair = SimulatedChair(World.empty(), 4, bus=BUS)
    drive(chair, 3.0, 3.0, 2.0)
    assert chair.velocity[0] > 0.86 * 3.0 * IDEAL.wheel_radius
    for _ in range(23):
        chair.step()
    assert chair.motor.target == (0.0, 0.0)
    for _ in range(100):
        chair.step()
    assert abs(chair.velocity[0]) < 1e-4


def test_grabbing_the_joystick_wins():
    chair = SimulatedChair(World.empty(), 4, bus=BUS)
    drive(chair, 2.0, 2.0, 1.0)
    chair.joystick = (512, 0)
    drive(chair, 2.0, 2.0, 1.0)
    assert chair.motor.mode == 1 and chair.velocity[0] < -0.2
    chair.joystick = (512, 512)
    drive(chair, 2.0, 2.0, 1.0)
    assert chair.motor.mode == 3


def test_a_stick_moves_it_at_once_but_not_one_that_was_held_at_the_switch_on():
    for power_up in (False, True):
        chair = SimulatedChair(World.empty(), 4, bus=BUS, power_up=power_up)
        chair.joystick = (512, 1000)
        drive(chair, 0.0, 0.0, 1.0)
        assert (chair.velocity[0] > 0.2) != power_up
        chair.joystick = (512, 512)
        drive(chair, 0.0, 0.0, 1.0)
        chair.joystick = (512, 1000)
        drive(chair, 0.0, 0.0, 1.0)
        assert chair.velocity[0] > 0.2


def test_a_wall_stops_it_and_is_counted_once():
    occupied = np.zeros((100, 200), bool)
    occupied[:, 80:] = True  # from x = 4.0
    chair = SimulatedChair(World(occupied), 5, (2.0, 2.5, 0.0), BUS, IDEAL)
    drive(chair, 3.0, 3.0, 6.0)
    assert chair.contacts == 1 and chair.drive.touching
    front = 0.5 * IDEAL.length
    assert 4.0 - front - 0.01 < chair.pose[0] <= 4.0 - front + 1e-9
    steps = chair.drive.steps()
    assert rolled(steps[0]) == pytest.approx(chair.pose[0] - 2.0, abs=1e-4), 'stalled wheels do not turn'
    drive(chair, -2.0, -2.0, 2.0)
    assert chair.pose[0] < 4.0 - front - 0.26 and not chair.drive.touching
    drive(chair, 3.0, 3.0, 4.0)
    assert chair.contacts == 2


def test_cannot_start_in_a_wall():
    with pytest.raises(WorldError, match='start'):
        SimulatedChair(World(np.ones((10, 10), bool)), 0, (0.2, 0.2, 0.0), BUS)


@pytest.mark.parametrize(
    'name, rate',
    [
        ('ENCODER_RIGHT', 10),
        ('ENCODER_LEFT', 10),
        ('RANGES_1', 5),
        ('RANGES_2', 5),
        ('RANGE_ACCEL', IMU_RATE),
        ('IMPACT_GYRO', IMU_RATE),
        ('COMPLEMENTARY', IMU_RATE),
        ('BATTERY', 1),
    ],
)
def test_frames_keep_their_rates_and_jitter_at_most_10_ms(name, rate):
    chair = SimulatedChair(World.empty(), 6, bus=BUS)
    times = np.array([time for time, message, _ in drive(chair, 0.0, 0.0, 20.0) if message == name])
    assert abs(len(times) - 20 * rate) <= 2
    gaps = np.diff(times) * rate
    assert np.all(np.abs(gaps - np.round(gaps)) <= 0.010 * rate + 1e-9)
    assert np.std(times * rate % 1.0) > 0


def test_frames_come_in_the_step_they_are_stamped_in():
    chair = SimulatedChair(World.empty(), 6, bus=BUS)
    for _ in range(500):
        before = chair.time
        times = [frame.time for frame in chair.step()]
        assert times == sorted(times)
        assert all(before < time <= chair.time for time in times)


def test_gyro_at_rest_has_the_sigmas_of_the_platform_which_for_sara_are_those_of_table_4_5():
    assert ChairConfig.of(SARA).gyro_frame_sigma == (0.0841, 0.0971, 0.0734)
    means = SensorConfig.of(imu_period=0.2)
    heard = drive(SimulatedChair(World.empty(), 11, bus=BUS, sensors=means), 0.0, 0.0, 200.0)
    for axis, sigma in zip(('gx', 'gy', 'gz'), ChairConfig.of().gyro_frame_sigma):
        rates = values(heard, 'IMPACT_GYRO', axis)
        assert np.std(rates) == pytest.approx(sigma, rel=0.12)


def test_a_full_turn_reads_short_by_the_gyros_scale():
    chair = SimulatedChair(World.empty(), 12, bus=BUS, config=QUIET)
    heard = drive(chair, 0.0, 0.0, 2.0)
    offset = np.mean(values(heard, 'IMPACT_GYRO', 'gz'))
    heard = drive(chair, 1.0, -1.0, 12.0) + drive(chair, 0.0, 0.0, 2.0)
    turned = np.sum(values(heard, 'IMPACT_GYRO', 'gz') - offset) / IMU_RATE
    low, high = QUIET.gyro_scale_range
    assert low - 0.005 < turned / math.degrees(chair.drive.yaw) < high + 0.005


def test_sonars_scatter_by_a_centimetre_and_lose_one_in_fifty():
    occupied = np.zeros((100, 200), bool)
    occupied[:, 100:] = True  # from x = 5.0
    sensor = min(chosen().sonars, key=lambda name: abs(chosen().sonars[name].yaw))
    mount = chosen().sonars[sensor]
    chair = SimulatedChair(World(occupied), 13, (3.46, 2.5, -mount.yaw), BUS)
    heard = drive(chair, 0.0, 0.0, 400.0)
    readings = heard_of(heard, sensor)
    echoes = readings[readings > 0]
    assert 1.0 - len(echoes) / len(readings) == pytest.approx(0.02, abs=0.012)
    ahead = mount.x * math.cos(mount.yaw) + mount.y * math.sin(mount.yaw)
    assert np.mean(echoes) == pytest.approx(5.0 - 3.46 - ahead, abs=0.01)
    assert np.std(echoes) == pytest.approx(0.01, abs=0.003)
    assert np.allclose(readings * 100, np.round(readings * 100))
    behind = [name for name, place in chosen().sonars.items() if abs(place.yaw) > 2.5]
    assert behind and all(np.all(heard_of(heard, name) == 0) for name in behind)


def test_an_abrupt_start_fires_the_motion_interrupt_and_a_soft_one_does_not():
    def alarms(ramp_s):
        chair = SimulatedChair(World.empty(), 14, bus=BUS)
        heard = drive(chair, 0.0, 0.0, 1.0)
        for tick in range(200):
            speed = 3.0 * min(tick * 0.02 / ramp_s, 1.0)
            heard += drive(chair, speed, speed, 0.02)
        return values(heard, 'IMPACT_GYRO', 'alarma').sum()

    assert alarms(0.01) > 0 and alarms(2.0) == 0


def test_both_descriptions_of_saras_bus_and_the_fast_mode():
    tenths = BusDescription.named('sara_tenths')
    sensors = SensorConfig.of(SARA, imu_period=0.05, calibrate=False)
    chair = SimulatedChair(World.empty(), 15, bus=tenths, sensors=sensors, platform=SARA)
    rates = [tenths.decode(frame)[1]['gz'] for _ in range(1000) for frame in chair.step() if frame.id == 0x204]
    assert len(rates) == pytest.approx(200, abs=4)
    assert np.allclose(np.array(rates) * 10, np.round(np.array(rates) * 10)) and np.mean(rates) == pytest.approx(
        -0.65, abs=0.08
    )
