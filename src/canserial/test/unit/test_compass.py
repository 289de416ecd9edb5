"""The heading by compass and gyroscope: laws of the filter, what is left out, what is owned, and bad input."""

import math
from collections import Counter

import numpy as np
import pytest

from canserial.calibration.iron import Iron
from canserial.dbc.bus import BusDescription
from canserial.frame import Frame
from canserial.reader.compass import Compass
from canserial.reader.compass_config import CompassConfig
from canserial.reader.config import ReaderConfig
from canserial.reader.heading_filter import ANY_YAW, HeadingFilter, effort
from canserial.reader.reader import Reader
from canserial.reader.readings import LEFT, RIGHT, FieldReading, HeadingReading, ImuReading
from canserial.reader.tilt import Tilt
from sara_common.config import ConfigError

H, DOWN, NORTH = 25.7, 37.1, math.pi / 2
PLAIN = Iron((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), H, DOWN, yaw_sigma=0.5)
GRAVITY = (0.0, 0.0, 9.81)
STEPS = 64000


def field_at(yaw, added=(0.0, 0.0, 0.0)):
    """In world axes something is added to the earth's field."""
    world = np.array((H * math.cos(NORTH), H * math.sin(NORTH), -DOWN)) + added
    c, s = math.cos(yaw), math.sin(yaw)
    return (float(c * world[0] + s * world[1]), float(c * world[1] - s * world[0]), float(world[2]))


class Drive:
    """A robot that drives, with a gyroscope that is wrong by `offset` (rad/s) and `scale`."""

    def __init__(self, iron=PLAIN, seed=0, noise=0.25, offset=0.0, scale=1.0):
        self.random, self.noise = np.random.default_rng(seed), noise
        self.dropped = Counter()
        self.compass = Compass(
            CompassConfig(), iron, 1.0, math.tau / STEPS, lambda kind, _: self.dropped.update([kind])
        )
        self.time, self.yaw, self.steps = 0.0, 0.3, [0.0, 0.0]
        self.offset, self.scale = offset, scale
        self.headings = []

    def go(self, seconds, rate=0.0, speed=3.0, added=(0.0, 0.0, 0.0), motors=(0.0, 0.0, 0.0)):
        """At this yaw rate (rad/s), with both wheels at `speed` (rad/s); 20 rates, 10 fields and counters a second.
        added: uT in the world, or a function of the time; motors: uT along the robot's axes.
        """
        still = not (rate or speed)
        for tick in range(round(20 * seconds)):
            self.time += 0.05
            self.yaw += 0.05 * rate
            imu = ImuReading(self.time, 0.0, 0.0, 0.0, (0.0, 0.0, self.scale * rate + self.offset), GRAVITY)
            heading = self.compass.on_imu(imu, still)
            if heading is not None:
                self.headings.append((self.time, math.remainder(heading.yaw - self.yaw, math.tau), heading))
            if tick % 2:
                for wheel in (RIGHT, LEFT):
                    self.steps[wheel] += 0.1 * speed / math.tau * STEPS
                    self.compass.on_wheel(self.time, wheel, round(self.steps[wheel]) % 2**32, False)
                extra = added(self.time) if callable(added) else added
                field = np.array(field_at(self.yaw, extra)) + motors + self.random.normal(0.0, self.noise, 3)
                self.compass.on_field(self.time, tuple(map(float, field)))
        return self

    @property
    def error(self):
        """deg, of the newest heading."""
        return math.degrees(self.headings[-1][1])


def test_without_noise_the_heading_is_exact():
    drive = Drive(noise=0.0).go(5.0, speed=0.0).go(20.0, rate=0.3).go(20.0, rate=-0.5)
    assert max(abs(error) for _, error, _ in drive.headings) < 1e-6 and not drive.dropped


def test_one_field_begins_no_heading_and_two_seconds_at_rest_do():
    drive = Drive().go(1.5, speed=0.0)
    assert not drive.headings
    drive.go(1.0, speed=0.0)
    assert drive.headings and abs(drive.error) < 1.0


def test_the_gyroscope_s_offset_and_scale_are_learned_while_driving():
    drive = Drive(offset=math.radians(0.05), scale=0.999).go(3.0, speed=0.0)
    for _ in range(8):
        drive.go(20.0).go(3.0, rate=0.5, speed=0.5).go(20.0).go(6.0, rate=-0.5, speed=0.5)
    learned = drive.compass.filter
    assert math.degrees(learned.rate(math.radians(0.05))) == pytest.approx(0.0, abs=0.01)
    assert max(abs(math.degrees(error)) for time, error, _ in drive.headings if time > 200.0) < 1.2


def test_a_robot_that_stands_keeps_its_heading_and_learns_the_offset_at_once():
    drive = Drive(offset=math.radians(0.03)).go(3.0, speed=0.0)
    first = drive.error
    drive.go(200.0, speed=0.0)
    assert drive.error == pytest.approx(first, abs=0.1)
    assert math.degrees(drive.compass.filter.rate(math.radians(0.03))) == pytest.approx(0.0, abs=0.003)


def test_ten_fields_of_one_place_say_no_more_than_one():
    drive = Drive().go(3.0, speed=0.0)
    before = drive.compass.filter.yaw_variance
    drive.go(60.0, speed=0.0)
    assert drive.compass.filter.yaw_variance == pytest.approx(before, rel=0.05)
    drive.go(60.0, rate=0.2)
    assert drive.compass.filter.yaw_variance < 0.6 * before


def test_a_straight_drive_cannot_tell_the_motors_from_the_heading_and_owns_it():
    straight, curved = (Drive().go(3.0, speed=0.0).go(40.0, rate=rate) for rate in (0.0, 0.2))
    assert straight.compass.filter.yaw_variance > 1.5 * curved.compass.filter.yaw_variance


def test_steel_is_left_out_by_strength_or_dip_and_the_gyroscope_goes_on():
    drive = Drive().go(3.0, speed=0.0).go(30.0)
    known, variance = drive.error, drive.compass.filter.yaw_variance
    for added in ((0.0, 5.0, 0.0), (0.0, 0.0, 12.0), (-40.0, 10.0, 20.0)):
        drive.go(5.0, added=added)
        assert not drive.compass.clear
    assert drive.error == pytest.approx(known, abs=0.1) and drive.compass.filter.yaw_variance > variance
    assert set(drive.dropped) == {'compass_disturbed'}
    drive.go(30.0)
    assert drive.compass.clear and abs(drive.error) < 1.5


def test_a_heading_begins_though_the_first_field_was_a_wrong_one():
    drive = Drive().go(0.1, speed=0.0, added=(1.9, 0.0, 0.0)).go(4.0, speed=0.0)
    assert drive.compass.clear and abs(drive.error) < 1.0


def test_a_field_that_only_turns_is_left_out_by_the_gyroscope():
    drive = Drive(noise=0.1).go(3.0, speed=0.0).go(60.0, rate=0.1)
    known = drive.error
    angle = math.radians(25.0)
    turned = H * np.array((math.cos(NORTH + angle) - math.cos(NORTH), math.sin(NORTH + angle) - math.sin(NORTH), 0.0))
    drive.go(10.0, added=tuple(turned))
    assert drive.error == pytest.approx(known, abs=0.3) and not drive.compass.clear


def test_a_gyroscope_that_lost_the_heading_is_given_up_after_a_long_way():
    drive = Drive(noise=0.1).go(3.0, speed=0.0).go(30.0)
    drive.yaw += 1.0  # turned unseen
    drive.go(15.0)
    assert abs(drive.error) > 50.0
    drive.go(60.0)
    assert abs(drive.error) < 3.0 and drive.dropped['compass_restarts'] == 1


def test_the_motors_field_is_learned():
    motors = (0.8, -0.9, 0.7)
    drive = Drive(offset=0.0).go(3.0, speed=0.0)
    for rate in (0.0, 0.4, 0.0, -0.4) * 6:
        drive.go(8.0, rate=rate, motors=motors).go(2.0, speed=0.0)
    assert abs(drive.error) < 1.0
    assert drive.compass.filter.added((effort(3.0),) * 2) == pytest.approx(motors, abs=0.3)


def test_the_variance_is_honest_over_many_drives():
    scores = []
    for seed in range(20):
        random = np.random.default_rng(1000 + seed)
        places = random.normal(0.0, 0.5, (400, 3))
        drive = Drive(seed=seed, offset=random.normal(0.0, math.radians(0.01)), scale=1.0 + random.normal(0.0, 0.001))
        drive.go(3.0, speed=0.0, added=tuple(places[0])).go(
            40.0, rate=float(random.uniform(-0.1, 0.1)), added=lambda time, p=places: tuple(p[int(time)])
        )
        yaw = drive.headings[-1]
        scores.append(yaw[1] ** 2 / yaw[2].yaw_variance)
    assert 0.2 < np.mean(scores) < 1.7  # chi-squared of one, 20 of them; the calibration's own error is not drawn


def test_what_the_gyroscope_missed_opens_the_variance():
    drive = Drive().go(3.0, speed=0.0).go(10.0)
    variance = drive.compass.filter.yaw_variance
    reading = ImuReading(drive.time + 0.05, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), GRAVITY, unseen=0.5)
    heading = drive.compass.on_imu(reading, False)
    assert heading.yaw_variance == pytest.approx(variance + 0.5, rel=0.05)
    assert drive.compass.on_imu(reading._replace(stamp=drive.time + 9.0, unseen=99.0), False).yaw_variance == ANY_YAW


def test_what_was_missed_counts_where_the_robot_stands_again_by_then():
    drive = Drive().go(3.0, speed=0.0).go(10.0).go(2.0, speed=0.0)
    variance, iron = drive.compass.filter.yaw_variance, drive.compass.filter.P[3, 3]
    reading = ImuReading(drive.time + 0.05, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), GRAVITY, unseen=0.5)
    assert drive.compass.on_imu(reading, True).yaw_variance == pytest.approx(variance + 0.5, rel=0.05)
    assert drive.compass.filter.P[3, 3] > iron


def test_the_heading_is_found_again_after_every_outage_in_which_the_robot_turned():
    drive = Drive().go(3.0, speed=0.0).go(15.0, rate=0.1)
    for _ in range(2):
        drive.yaw, drive.time = drive.yaw + 2.5, drive.time + 4.0  # nothing was heard of it
        reading = ImuReading(drive.time, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), GRAVITY, unseen=ANY_YAW)
        assert drive.compass.on_imu(reading, True).yaw_variance > 3.0
        drive.go(2.0, speed=0.0).go(40.0, rate=0.1)
        assert abs(drive.error) < 2.0


def test_a_frozen_imu_gives_no_heading():
    drive = Drive().go(3.0, speed=0.0)
    reading = ImuReading(drive.time + 0.05, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), GRAVITY, frozen=True)
    assert drive.compass.on_imu(reading, False) is None


def test_uncalibrated_fields_are_passed_on_and_give_no_heading():
    drive = Drive(iron=None).go(10.0)
    assert not drive.headings and drive.compass.filter is None
    assert drive.compass.on_field(99.0, (1.0, 2.0, 3.0)) == FieldReading(99.0, (1.0, 2.0, 3.0), False)


def test_a_clock_that_went_back_and_wheels_that_jump_do_no_harm():
    drive = Drive().go(3.0, speed=0.0).go(10.0)
    drive.time -= 5.0
    drive.go(10.0)
    for wheel in (RIGHT, LEFT):
        drive.compass.on_wheel(drive.time + 0.1, wheel, 12345, True)
    drive.go(5.0)
    assert abs(drive.error) < 2.0 and np.isfinite(drive.compass.filter.P).all()


@pytest.mark.parametrize('index', range(12))
def test_the_jacobian_is_that_of_the_measurement(index):
    """By what a small change of a state does to the innovation of a field that fits exactly."""
    config = CompassConfig(compass_place_sigma=1e-3, compass_gate_sigma=1e3)
    estimate = HeadingFilter(PLAIN, config, 1.0)
    estimate.begin(field_at(0.4), 0.0)
    estimate.x[:] = (0.4, 0.0, 0.0, *([0.0] * 9))
    estimate.P = np.zeros((12, 12))
    estimate.P[index, index] = 1.0
    truth = estimate.x.copy()
    step = 1e-4
    estimate.x[index] += step
    estimate._share = 1.0
    assert estimate.correct(field_at(0.4), 0.0, (0.5, -0.7), 0.0)
    seen = 0.0 if index in (1, 2) else step  # offset and scale show in no single field
    left = estimate.x[index] - truth[index]
    assert left == pytest.approx(step if not seen else 0.0, abs=0.3 * step)


def test_level_angles_follow_ramps_and_not_the_setting_off():
    tilt, time = Tilt(), 0.0
    for _ in range(100):
        time += 0.05
        tilt.add(time, (0.0, 0.0, 0.0), GRAVITY)
    for _ in range(20):  # 0.5 m/s2 for a second
        time += 0.05
        tilt.add(time, (0.0, 0.0, 0.0), (0.5, 0.0, 9.81))
    assert abs(math.degrees(tilt.pitch)) < 0.5
    for _ in range(20):  # a ramp of 5 deg, nose up
        time += 0.05
        tilt.add(time, (0.0, -math.radians(5.0), 0.0), GRAVITY)
    assert math.degrees(tilt.pitch) == pytest.approx(-5.0, abs=0.8)
    assert tilt.levelled((math.cos(tilt.pitch), 0.0, math.sin(tilt.pitch))) == pytest.approx(
        (math.cos(2 * 0.0), 0.0, 0.0), abs=0.02
    )


def test_a_gyroscope_that_leans_does_not_tilt_a_robot_that_turns():
    straight, leaning = Tilt(), Tilt((0.02, -0.01))
    for step in range(400):
        for tilt in (straight, leaning):
            tilt.add(0.05 * step, (0.02 * 0.6, -0.01 * 0.6, 0.6), GRAVITY)
    assert abs(leaning.roll) < 1e-9 and abs(leaning.pitch) < 1e-9 and abs(straight.roll) > math.radians(0.4)


def test_settings_that_cannot_be_are_named_all_at_once():
    with pytest.raises(ConfigError) as caught:
        CompassConfig(compass_place_sigma=0.0, compass_north=math.nan, compass_restart_roll=-1.0)
    assert len(caught.value.faults) == 3


BUS = BusDescription.named('sara+compass')


def test_the_reader_says_fields_and_drops_what_cannot_be():
    reader = Reader(ReaderConfig.of(), BUS)
    assert reader.on_frame(BUS.encode('COMPASS', 1.0, mx=10.0, my=20.0, mz=-30.0)) == [
        FieldReading(1.0, pytest.approx((10.0, 20.0, -30.0)), False)
    ]
    assert reader.on_frame(BUS.encode('COMPASS', 1.1, mx=325.0, my=0.0, mz=0.0)) == []
    for number in range(100):
        came = reader.on_frame(BUS.encode('COMPASS', 2.0 + 0.1 * number, mx=1.0, my=1.0, mz=1.0))
    assert came == [] and set(reader.counters) == {'compass_implausible', 'compass_stuck'}
    assert Reader(ReaderConfig.of(), BusDescription.default()).on_frame(Frame(0x207, bytes(8), 1.0)) == []


def test_a_heading_has_the_variance_of_its_yaw():
    heading = HeadingReading(1.0, 0.0, 0.0, 0.1, (0.0,) * 3, GRAVITY, 0.02)
    assert heading.variances([(1.0, 2.0, 3.0), (4.0,) * 3, (5.0,) * 3])[0] == (1.0, 2.0, 0.02)


def test_another_gain_begins_the_heading_anew():
    drive = Drive().go(3.0, speed=0.0)
    drive.compass.set_gain(1.05)
    assert not drive.compass.filter.started
    drive.go(3.0, speed=0.0)
    assert drive.compass.filter.x[2] == pytest.approx(1.0 / 1.05 - 1.0)
