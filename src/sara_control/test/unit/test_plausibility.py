"""Encoders and turn rate that must not be believed."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.platforms import chosen
from sara_control.gate.comfort import Comfort, Profile
from sara_control.gate.gate_config import PlausibilityConfig
from sara_control.gate.plausibility import LEFT, RIGHT, Plausibility
from sara_control.gate.reasons import Reason

CONFIG = PlausibilityConfig.of()
STEPS, RADIUS, SEPARATION = CONFIG.steps_per_turn / math.tau, CONFIG.wheel_radius, CONFIG.wheel_separation
SLIP = chosen().simulated['slip_range']


class Wheels:
    """Two wheels with a lag of 0.1 s, encoders every 0.1 s, an IMU every 0.2 s; `frozen`, `factor`: per wheel (right,
    left).
    """

    def __init__(self, start=2**32 - 900):
        self.watch = Plausibility(CONFIG)
        self.t, self.start = 10.0, start
        self.angle, self.speed, self.shown = [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]
        self.frozen, self.factor, self.slip, self.lost = [False, False], [1.0, 1.0], SLIP[0], 0
        self.obeyed = True
        self.imu_offset = 0.0
        self.tick = 0

    def run(self, v, w, seconds):
        """Drive; stops where a fault is found. Returns the fault."""
        for _ in range(round(seconds / 0.02)):
            self.t, self.tick = self.t + 0.02, self.tick + 1
            self.watch.on_command(self.t, v, w, self.obeyed)
            for i, side in ((RIGHT, 0.5 * SEPARATION), (LEFT, -0.5 * SEPARATION)):
                target = self.factor[i] * (v + side * w) / RADIUS
                self.speed[i] += (target - self.speed[i]) * (1.0 - math.exp(-0.2))
                self.angle[i] += self.speed[i] * 0.02
                if not self.frozen[i]:
                    self.shown[i] = self.angle[i]
            if self.tick % 5 == 0:
                for i in (RIGHT, LEFT):
                    if self.lost:
                        self.lost -= 1
                        continue
                    assert self.watch.on_encoder(
                        self.t,
                        i,
                        (self.start + round(self.shown[i] * STEPS)) % 2**32,
                        (2**32 - 3000 + self.tick * 200) % 2**32,
                    )
            if self.tick % 10 == 0:
                turn = (self.speed[RIGHT] - self.speed[LEFT]) * RADIUS / SEPARATION / self.slip + self.imu_offset
                assert self.watch.on_imu(self.t, (0.0, 0.0, turn))
            if self.watch.fault is not None:
                return self.watch.fault
        return None


@given(
    st.lists(st.tuples(st.floats(-0.4, 0.8), st.floats(-0.8, 0.8), st.floats(0.2, 2.0)), max_size=6),
    st.floats(*SLIP),
)
@settings(max_examples=30)
def test_a_sound_chair_is_never_suspected(plan, slip):
    """Commands within comfort limits twice those of the default, counters that wrap, slip; a frame is lost now and
    then.
    """
    wheels = Wheels()
    wheels.slip = slip
    comfort = Comfort(Profile(acceleration=0.8, braking=1.6, jerk=3.0, turn_acceleration=1.6, turn_jerk=5.0))
    for target_v, target_w, seconds in plan:
        for _ in range(round(seconds / 0.02)):
            assert wheels.run(*comfort.step(target_v, target_w, 0.02), 0.02) is None
        wheels.lost = 1
    assert wheels.watch.dropped == {}


@pytest.mark.parametrize('v, w', [(0.8, 0.0), (0.3, 0.2), (0.1, 0.0), (0.06, 0.0), (0.0, 0.4), (-0.3, 0.0)])
@pytest.mark.parametrize('frozen', [(True, True), (True, False), (False, True)])
def test_frozen_encoders_are_found_in_time(v, w, frozen):
    for phase in range(5):
        wheels = Wheels()
        assert wheels.run(v, w, 2.0 + 0.02 * phase) is None
        wheels.frozen = list(frozen)
        since = wheels.t
        assert wheels.run(v, w, 2.0) is Reason.FROZEN
        # Slow wheels make their way more slowly; 0.5 s leave the chair in time for the 0.3 s + 0.25 s of the
        # requirement.
        assert wheels.t - since <= (0.31 if abs(v) + 0.5 * SEPARATION * abs(w) > 0.1 else 0.5)


def test_a_blocked_wheel_is_found_at_the_start():
    wheels = Wheels()
    wheels.factor = [0.0, 0.0]
    assert wheels.run(0.2, 0.0, 2.0) is Reason.FROZEN


def test_a_wheel_that_runs_away():
    wheels = Wheels()
    wheels.run(0.2, 0.0, 1.0)
    wheels.factor = [4.0, 1.0]
    since = wheels.t
    assert wheels.run(0.2, 0.0, 2.0) in (Reason.RUNAWAY, Reason.TURN) and wheels.t - since <= 0.6
    backwards = Wheels()
    backwards.run(0.3, 0.0, 1.0)
    backwards.factor = [-2.0, -2.0]
    assert backwards.run(0.3, 0.0, 2.0) is Reason.RUNAWAY


def test_slower_is_no_danger():
    wheels = Wheels()
    wheels.factor = [0.3, 0.3]
    assert wheels.run(0.8, 0.0, 3.0) is None


def test_an_imu_that_contradicts_the_wheels():
    wheels = Wheels()
    wheels.run(0.3, 0.0, 1.0)
    wheels.imu_offset = 0.7
    since = wheels.t
    assert wheels.run(0.3, 0.0, 2.0) is Reason.TURN and 0.4 <= wheels.t - since <= 0.61


def test_two_contrary_readings_are_none():
    wheels = Wheels()
    for _ in range(5):
        wheels.imu_offset = 0.7
        assert wheels.run(0.3, 0.0, 0.4) is None
        wheels.imu_offset = 0.0
        assert wheels.run(0.3, 0.0, 0.2) is None


def test_a_fault_is_forgotten_at_rest_and_whoever_does_not_obey_is_not_judged():
    wheels = Wheels()
    wheels.run(0.3, 0.0, 1.0)
    wheels.frozen = [True, True]
    assert wheels.run(0.3, 0.0, 1.0) is Reason.FROZEN
    wheels.watch.on_command(wheels.t, 0.0, 0.0, True)
    assert wheels.watch.fault is None
    manual = Wheels()
    manual.obeyed = False
    manual.factor = [2.5, -2.5]
    assert manual.run(0.4, 0.0, 2.0) is None


def test_a_wheel_that_goes_on_after_the_stop_keeps_its_fault():
    wheels = Wheels()
    wheels.run(0.4, 0.0, 1.0)
    wheels.factor = [4.0, 4.0]
    assert wheels.run(0.4, 0.0, 2.0) is Reason.RUNAWAY
    for _ in range(10):
        wheels.t += 0.02
        wheels.watch.on_command(wheels.t, 0.0, 0.0, True)
    assert wheels.watch.fault is Reason.RUNAWAY and wheels.watch.speed > 0.8


def test_stamps_are_those_of_the_wheel_that_was_silent_longer():
    watch = Plausibility(CONFIG)
    assert watch.encoder_stamp == -math.inf and math.isnan(watch.speed)
    for t in (1.0, 1.1):
        watch.on_encoder(t, RIGHT, 0, round(t * 1e4))
        watch.on_encoder(t + 0.003, LEFT, 0, round(t * 1e4))
    assert watch.encoder_stamp == 1.1 and watch.speed == 0.0
    watch.on_encoder(1.2, LEFT, 700, 12000)
    assert watch.encoder_stamp == 1.1 and watch.speed == pytest.approx(700 / STEPS / 0.1 * RADIUS, rel=0.03)


def test_what_is_not_believed_is_dropped_counted_and_does_not_keep_alive():
    watch = Plausibility(CONFIG)
    for t in (1.0, 1.1):
        watch.on_encoder(t, RIGHT, 0, round(t * 1e4))
    assert not watch.on_encoder(1.2, 2, 0, 12000)
    assert not watch.on_encoder(1.2, RIGHT, 0, 11000)  # repeated
    assert not watch.on_encoder(1.2, RIGHT, 0, 10500)  # older
    assert not watch.on_encoder(1.2, RIGHT, 20000, 12000)  # 20 rad/s
    assert watch.on_encoder(1.3, RIGHT, 20100, 13000)  # the motor node counts anew from there
    assert not watch.on_encoder(1.4, RIGHT, 20100, 500)  # its clock too
    assert watch.on_encoder(1.5, RIGHT, 20100, 1500)
    assert watch.dropped == {'unknown wheel': 1, 'encoder clock does not go on': 2, 'encoder jumped': 2}
    for bad in ((math.nan, 0.0, 0.0), (0.0, 0.0, math.inf), (0.0, 4.5, 0.0)):
        assert not watch.on_imu(1.0, bad)
    assert watch.imu_stamp == -math.inf and watch.dropped['turn rate not possible'] == 3
    assert watch.on_imu(2.0, (0.0, 0.0, 4.4)) and watch.imu_stamp == 2.0
