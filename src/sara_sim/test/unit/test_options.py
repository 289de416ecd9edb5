"""Castors, payload, ramps, thresholds, collisions, counters near their wrap: off, no cost; on, they obey equations."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sara_common.config import ConfigError
from sara_sim.chair import SimulatedChair
from sara_sim.config import ChairConfig
from sara_sim.options import ChairOptions
from sara_sim.world.terrain import PATCH, Ramp, TerrainError, Threshold, attitude, bump
from sara_sim.world.world import World

G = 9.80665
QUIET = ChairConfig.of(
    wheel_radius_sigma=0.0,
    gyro_frame_sigma=(0.0,) * 3,
    gyro_drift=0.0,
    gyro_bias=(0.0,) * 3,
    gyro_bias_sigma=0.0,
    accel_offset=(0.0,) * 3,
    accel_sigma_low=(0.0,) * 3,
    accel_sigma_high=(0.0,) * 3,
    tilt_sigma=0.0,
    frame_loss=0.0,
)


def drive_of(options=ChairOptions(), world=None, start=(0.0, 0.0, 0.0)):
    chair = SimulatedChair(world or World.empty(), 0, start, config=QUIET, options=options, power_up=True)
    return chair.drive


def run(drive, right, left, seconds):
    for _ in range(round(seconds * 100)):
        drive.step(right, left)
    return drive


def uphill(slope_deg=5.0):
    return World(np.zeros((1, 1), bool), ramps=[Ramp(0.0, 0.0, 40.0, 40.0, 0.0, math.radians(slope_deg))])


def test_impossible_options_are_named():
    with pytest.raises(ConfigError) as error:
        ChairOptions(
            castor_swing=2.0,
            payload=-1.0,
            mass=0.0,
            collision_shake=1,
            right_steps=2**32,
            castor_x=0.0,
            payload_x=math.nan,
        )
    for name in ('castor_swing', 'payload', 'mass', 'collision_shake', 'right_steps', 'castor_x', 'payload_x'):
        assert f'{name} is' in str(error.value)
    assert ChairOptions(payload=5.0).changes() == {'payload': (5.0, 0.0)}


def test_the_default_is_the_reference_chair():
    assert ChairOptions().changes() == {}
    assert not drive_of().drift.active


def test_counters_wrap_at_2_to_the_32(pilot):
    chair = SimulatedChair(World.empty(), 0, options=ChairOptions(right_steps=2**32 - 5000, left_steps=2**32 - 1))
    flight = pilot(chair).drive(2.0, 2.0, 4.0)
    for signal in ('ENCODER_RIGHT', 'ENCODER_LEFT'):
        steps = flight.values(signal, 'steps')
        assert steps.min() >= 0 and steps.max() < 2**32
        moved = np.diff(np.array(steps, dtype=np.uint32).astype(np.int64)) % 2**32
        assert np.any(np.diff(steps.astype(float)) < 0), 'it did wrap'
        assert 0 <= moved.max() < 5000


# --- ramps ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize('yaw_deg, roll, pitch', [(0, 0, -5), (180, 0, 5), (90, -5, 0), (-90, 5, 0)])
def test_a_chair_on_a_ramp_leans_with_it(yaw_deg, roll, pitch):
    lean = attitude([Ramp(0.0, 0.0, 9.0, 9.0, 0.0, math.radians(5))], 0.0, 0.0, math.radians(yaw_deg), 0.5)
    assert np.degrees(lean) == pytest.approx((roll, pitch), abs=1e-9)


def test_over_the_edge_it_tips_without_a_jump():
    ramp = Ramp(2.0, 0.0, 2.0, 2.0, 0.0, math.radians(6))
    pitches = [attitude([ramp], x, 0.0, 0.0, 0.5)[1] for x in np.arange(0.0, 4.0, 0.005)]
    assert pitches[0] == pitches[-1] == 0.0 and min(pitches) == pytest.approx(-math.radians(6))
    assert np.abs(np.diff(pitches)).max() < math.radians(6) * 0.005 / 0.5 * 1.05


def test_the_line_on_a_ramp_is_what_points_say():
    random = np.random.default_rng(0)
    for _ in range(200):
        ramp = Ramp(*random.uniform(-1, 1, 2), *random.uniform(0.3, 3, 2), random.uniform(-4, 4), 0.1)
        x, y, dx, dy = random.uniform(-1.5, 1.5, 4)
        s = np.linspace(-1, 1, 4001)
        px, py = x + s * dx - ramp.x, y + s * dy - ramp.y
        c, n = math.cos(ramp.yaw), math.sin(ramp.yaw)
        inside = (np.abs(c * px + n * py) <= ramp.length / 2) & (np.abs(c * py - n * px) <= ramp.width / 2)
        assert ramp.share(x, y, dx, dy) == pytest.approx(inside.mean(), abs=2e-3)


def test_ramps_that_cannot_be_are_named():
    with pytest.raises(TerrainError, match='slope is'):
        Ramp(0.0, 0.0, 1.0, 1.0, 0.0, 0.5)
    with pytest.raises(TerrainError, match='length is'):
        Ramp(0.0, 0.0, -1.0, 1.0, 0.0, 0.1)


def test_gravity_pulls_and_the_brake_holds():
    level = run(drive_of(), 3.0, 3.0, 5.0)
    up, down = (run(drive_of(world=uphill(slope)), 3.0, 3.0, 5.0) for slope in (5.0, -5.0))
    droop = QUIET.motor_lag * G * math.sin(math.radians(5))
    assert level.speed - up.speed == pytest.approx(droop, rel=0.01) and down.speed - level.speed == pytest.approx(
        droop, rel=0.01
    )
    for drive in (up, down):
        run(drive, 0.0, 0.0, 3.0)
        x = drive.x
        assert run(drive, 0.0, 0.0, 5.0).x == x and drive.speed == 0.0


def test_gravity_is_seen_by_the_accelerometer(pilot):
    chair = SimulatedChair(uphill(5.0), 0, (0.0, 0.0, 0.0), config=QUIET, power_up=True)
    for _ in range(2000):
        chair.step()
    ax, ay, az = (count / 16384 * G for count in chair.box.imu.counts[:3])
    assert (ax, ay, az) == pytest.approx((G * math.sin(math.radians(5)), 0.0, G * math.cos(math.radians(5))), abs=2e-3)
    assert np.degrees(chair.attitude) == pytest.approx((0.0, -5.0))


def test_level_ground_beside_a_ramp_is_level_ground():
    beside = World(np.zeros((1, 1), bool), ramps=[Ramp(50.0, 50.0, 2.0, 2.0, 0.0, 0.1)])
    one, other = run(drive_of(world=beside), 2.0, 1.0, 3.0), run(drive_of(), 2.0, 1.0, 3.0)
    assert one.pose == pytest.approx(other.pose, abs=1e-12)


# --- thresholds -------------------------------------------------------------------------------------------------------

STEP = Threshold(1.0, 0.0, 0.1, 2.0, 0.0, 0.02)
RADIUS = 0.155


def over(yaw=0.0):
    """A World with a threshold of 2 cm across the way, 1 m ahead."""
    world = World(np.zeros((1, 1), bool))
    world.thresholds.append(replace(STEP, yaw=yaw))
    return world


def test_a_wheel_rises_over_a_threshold():
    xs = np.arange(0.5, 1.5, 1e-4)
    lifts, rises = np.transpose([STEP.under(x, 0.3, RADIUS) for x in xs])
    assert lifts[0] == lifts[-1] == 0.0 and lifts.max() == 0.02
    assert np.abs(np.gradient(lifts, xs) - rises).max() < 1e-3
    climb = math.sqrt(0.02 * (2 * RADIUS - 0.02)) + PATCH
    assert rises.max() == pytest.approx(0.5 * math.pi * 0.02 / climb, rel=1e-3)
    assert (xs[lifts > 0.0][0], xs[lifts > 0.0][-1]) == pytest.approx((1 - 0.025 - climb, 1 + 0.025 + climb), abs=1e-3)
    assert STEP.under(1.0, 1.1, RADIUS) == (0.0, 0.0)


def test_a_chair_on_a_threshold_leans_and_what_goes_up_comes_down():
    poses = [(x, 0.0, 0.0) for x in np.arange(0.0, 2.0, 1e-3)]
    pitch, steep = np.transpose([bump([STEP], pose, 0.5, RADIUS) for pose in poses])
    assert pitch.min() == pytest.approx(-math.atan(0.02 / 0.5)) and pitch.max() == pytest.approx(math.atan(0.02 / 0.5))
    assert steep.sum() == pytest.approx(0.0, abs=1e-6) and bump([STEP], (1.0, 0.0, math.pi / 2), 0.5, RADIUS)[1] == 0.0
    back = [bump([STEP], (x, y, math.pi), 0.5, RADIUS) for x, y, _ in poses]
    assert np.allclose(np.transpose(back)[1], -steep)


@pytest.mark.parametrize('yaw', [0.0, math.pi])
def test_a_quick_chair_passes_a_threshold_and_a_slow_one_stops_at_it(yaw):
    steepest = max(bump([STEP], (x, 0.0, 0.0), 0.5, QUIET.wheel_radius)[1] for x in np.arange(0.5, 1.0, 1e-3))
    held_back = QUIET.motor_lag * G * steepest / QUIET.wheel_radius  # rad/s
    quick = run(drive_of(world=over(yaw)), 4.0 * held_back, 4.0 * held_back, 8.0)
    slow = run(drive_of(world=over(yaw)), 0.7 * held_back, 0.7 * held_back, 20.0)
    level = run(drive_of(), 4.0 * held_back, 4.0 * held_back, 8.0)
    assert quick.x > 2.0 and level.x - quick.x < 0.1
    assert 0.55 < slow.x < 0.75 and abs(slow.speed) < 1e-3 and slow.drift.pitch < 0.0


def test_thresholds_that_cannot_be_are_named():
    for name, value in (('height', 0.05), ('height', 0.0), ('length', -1.0), ('yaw', math.nan)):
        with pytest.raises(TerrainError, match=f'{name} is'):
            replace(STEP, **{name: value})


# --- payload ----------------------------------------------------------------------------------------------------------


def test_a_payload_makes_it_slower_to_follow():
    options = ChairOptions(payload=75.0, mass=150.0)
    loaded, empty = run(drive_of(options), 4.0, 4.0, 0.15), run(drive_of(), 4.0, 4.0, 0.15)
    lag = QUIET.motor_lag
    assert loaded.right_speed == pytest.approx(4.0 * (1 - math.exp(-0.15 / (1.5 * lag))))
    assert empty.right_speed == pytest.approx(4.0 * (1 - math.exp(-0.15 / lag)))


def test_a_payload_in_front_lowers_the_nose():
    options = ChairOptions(payload=50.0, payload_x=0.3, payload_y=0.1)
    chair = SimulatedChair(World.empty(), 0, config=QUIET, options=options, power_up=True)
    assert chair.attitude[1] == pytest.approx(50 * G * 0.3 / (50000 * 0.5**2))
    assert chair.attitude[0] == pytest.approx(-50 * G * 0.1 / (50000 * QUIET.track**2))


# --- castors ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize('swing', (0.02, 0.05))
def test_castors_turn_the_chair_by_their_share_when_it_reverses_and_then_no_more(swing):
    drive = run(drive_of(ChairOptions(castor_swing=swing)), 3.0, 3.0, 3.0)
    assert abs(drive.yaw) < swing * 0.03
    run(drive, -3.0, -3.0, 3.0)
    assert abs(drive.yaw) == pytest.approx(swing * math.pi, rel=0.05)
    swung = drive.yaw
    run(drive, -3.0, -3.0, 3.0)
    assert drive.yaw == pytest.approx(swung, abs=1e-3), 'once round, they trail again'


def test_castors_that_stand_still_do_nothing():
    drive = drive_of(ChairOptions(castor_swing=0.2))
    assert run(drive, 0.0, 0.0, 2.0).pose == (0.0, 0.0, 0.0)


# --- collisions -------------------------------------------------------------------------------------------------------


def wall(x=4.0):
    occupied = np.zeros((100, 200), bool)
    occupied[:, round(x / 0.05) :] = True
    return World(occupied)


def test_a_collision_shakes_the_accelerometer_so_that_the_interrupt_fires(pilot):
    chair = SimulatedChair(wall(), 5, (2.0, 2.5, 0.0), options=ChairOptions(collision_shake=True))
    flight = pilot(chair).drive(0.0, 0.0, 0.5)
    for number in range(200):  # softly: an abrupt start shakes it too
        speed = min(0.02 * number, 2.5)
        flight.drive(speed, speed, 0.04)
        if chair.contacts:
            break
    hit = chair.time
    flight.drive(0.0, 0.0, 1.0)
    assert chair.contacts == 1
    assert not flight.values('IMPACT_GYRO', 'alarma')[flight.times('IMPACT_GYRO') < hit - 0.1].any()
    assert flight.values('IMPACT_GYRO', 'alarma', since=hit - 0.1).any()
    assert not flight.drive(0.0, 0.0, 1.0).values('IMPACT_GYRO', 'alarma', since=hit + 1.2).any()


def test_the_ringing_dies_away():
    drive = drive_of(ChairOptions(collision_shake=True), wall(), (2.0, 2.5, 0.0))
    run(drive, 3.0, 3.0, 6.0)
    assert drive.contacts == 1
    run(drive, 0.0, 0.0, 2.0)
    assert drive.drift.shaken == (0.0, 0.0) and drive.resting
