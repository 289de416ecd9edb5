"""Caution: who was heard is remembered, and while they are no part of the body goes faster than it could stop for who
comes out from behind something.
"""

import math
import random
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_common.platforms import load, parameters
from sara_control.gate.comfort import Comfort, Profile
from sara_control.gate.gate_config import GateConfig, SafetyConfig
from sara_control.gate.guard import Guard
from sara_control.gate.reasons import Reason, State
from sara_control.gate.safety import Command, Inputs, SafetyGate
from sara_control.zones.approach_detector import PAUSE, ApproachDetector
from sara_control.zones.caution import BETWEEN, Caution, CautionConfig, Motion
from sara_control.zones.zones import Zones

PARAMS = parameters('sara_control', 'safety.yaml', load('sara'))
SAFETY = SafetyConfig.from_params(PARAMS)
CONFIG, SENSORS = SAFETY.caution, SAFETY.zones.sensors
HALF, BODY = math.radians(30.0), (0.54, 0.31)
CREEP = CONFIG.creep * (1.0 + 1e-9)
SIDE = next(sensor for sensor in SENSORS if sensor.name == 'SLID')


def caution(config=CONFIG):
    return Caution(config, SENSORS, HALF, BODY)


def feed(what, ranges, start=0.0, v=0.0, w=0.0, seconds=0.2, sigma=0.01):
    """Every sensor hears what `ranges` says (m; a number for all), every 0.2 s for so long; the time after."""
    count = round(seconds / 0.2)
    for k in range(count):
        for sensor in SENSORS:
            distance = ranges.get(sensor.name, math.inf) if isinstance(ranges, dict) else ranges
            what.on_range(sensor.name, distance, start + 0.2 * k, Motion(v, w), sigma)
    return start + 0.2 * count


def alarmed(ranges, w=0.0, config=CONFIG):
    """Caution that has heard somebody far off, and hears this since; the time."""
    result = caution(config)
    t = feed(result, ranges, 0.0, 0.3, w, 2.0)
    result.on_approach('SDD', 2.0, t)
    result.on_approach('SDD', 1.9, t + 0.2)
    return result, t + 0.2


@given(st.floats(0.3, 2.4), st.floats(0.0, 1.0))
def test_from_what_is_allowed_it_stands_before_who_comes_out_from_behind_an_echo_is_there(heard, share):
    u = CONFIG.allowed(heard)
    assert u >= CONFIG.creep
    if u > CONFIG.creep:
        walk = share * CONFIG.walk
        brakes = u / CONFIG.braking
        assert heard - (walk + u) * CONFIG.reaction - walk * brakes - 0.5 * u * brakes >= -1e-9
    assert CONFIG.allowed(math.inf) == math.inf


@given(st.integers(0, 10**6), st.floats(0.005, 0.03))
@settings(max_examples=60)
def test_a_chair_that_stands_among_things_that_stand_hears_nobody(seed, sigma):
    noise, result = random.Random(seed), caution()
    away = {sensor.name: noise.uniform(0.2, 2.4) for sensor in SENSORS}
    for k in range(150):
        for name, distance in away.items():
            lost = noise.random() < 0.03
            echo = math.inf if lost else max(distance + noise.gauss(0.0, sigma), 0.16)
            result.on_range(name, echo, 0.2 * k, Motion(0.0, noise.gauss(0.0, 0.005)), max(sigma, 0.01))
        assert not result.pedestrians_nearby(0.2 * k)


@given(st.sampled_from(SENSORS), st.floats(0.6, 2.0), st.floats(0.6, 1.2), st.sampled_from((-1.0, 1.0)))
@settings(max_examples=60)
def test_a_chair_that_stands_hears_who_walks_to_or_fro(sensor, away, walk, sense):
    result = caution()
    t = feed(result, {sensor.name: away}, seconds=2.0)
    assert not result.pedestrians_nearby(t)
    for k in (1, 2):
        result.on_range(sensor.name, away + sense * walk * 0.2 * k, t + 0.2 * (k - 1), Motion(), 0.01)
    assert (
        result.pedestrians_nearby(t + 0.2)
        and result.pedestrians_nearby(t + 0.2 + CONFIG.memory - 1e-6)
        and not result.pedestrians_nearby(t + 0.2 + CONFIG.memory)
    )


def test_a_chair_that_moves_tells_nobody_by_what_it_hears_at_another_distance():
    for v, w in ((0.2, 0.0), (0.0, 0.2)):
        result, t = caution(), 0.0
        for k in range(20):
            t = feed(result, 2.0 - 0.09 * k, t, v, w)
        feed(result, 1.0, t, 0.0, 0.0)
        assert not result.pedestrians_nearby(t + 0.2)


def test_a_chair_that_has_just_been_told_to_turn_tells_nobody_by_the_wall_that_comes_into_a_cone():
    for told in (False, True):
        result = caution()
        t = feed(result, 2.1, seconds=3.0)
        result.on_range('STI', 0.83, t, Motion(0.0, 0.02, told), 0.01)
        assert result.pedestrians_nearby(t) == (not told)


def test_a_mover_heard_once_may_be_a_wall_and_twice_is_somebody():
    result = caution()
    for t in (1.0, 3.0, 5.0):
        result.on_approach('SDD', 1.0, t)
        assert not result.pedestrians_nearby(t + 0.2)
    result.on_approach('SDI', 1.0, 5.4)
    assert result.pedestrians_nearby(5.5)
    result.on_approach('SDI', 1.0, 5.4 + CONFIG.memory - 0.1)  # while people are about once is enough
    assert result.pedestrians_nearby(5.3 + 2.0 * CONFIG.memory - 0.1)


@given(
    st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.sampled_from([s for s in SENSORS if s.stops]), st.floats(0.2, 2.4)
)
def test_no_part_of_the_body_goes_faster_towards_where_a_sensor_answers_than_its_echo_allows(v, w, sensor, heard):
    """Whoever walks into the corner next to the sensor comes along a normal of the corner."""
    result, t = alarmed({sensor.name: heard})
    factor = result.scale(v, w, t)
    assert 0.0 < factor <= 1.0
    corner = math.copysign(BODY[0], sensor.x), math.copysign(BODY[1], sensor.y)
    for k in range(41):
        angle = sensor.yaw + (HALF + BETWEEN) * (k / 20.0 - 1.0)
        normal = math.cos(angle), math.sin(angle)
        if normal[0] * corner[0] < 0.0 or normal[1] * corner[1] < 0.0:
            continue
        towards = factor * ((v - w * corner[1]) * normal[0] + w * corner[0] * normal[1])
        assert towards <= CONFIG.allowed(heard) * 1.01 + 0.002  # looked at every 10 degrees


def test_with_nothing_near_people_about_do_not_slow_it():
    result, t = alarmed(math.inf)
    assert result.scale(0.5, 0.2, t) == 1.0 and result.scale(-0.3, 0.0, t) == 1.0


def test_what_left_the_cone_as_the_chair_went_on_hides_people_still_and_what_left_while_it_stood_does_not():
    result, t = alarmed({'SDI': 0.4})
    assert 0.5 * result.scale(0.5, 0.0, t) <= CREEP
    t = feed(result, math.inf, t, 0.2, 0.0, 1.6)  # 0.3 m on, and the cone is free
    assert 0.5 * result.scale(0.5, 0.0, t) <= CREEP
    t = feed(result, math.inf, t, 0.2, 0.0, 3.0)  # 0.9 m
    assert result.scale(0.5, 0.0, t) == 1.0
    result, t = alarmed(math.inf)
    t = feed(result, {'SDI': 0.4}, t, seconds=2.0)
    assert 0.5 * result.scale(0.5, 0.0, t) <= CREEP
    t = feed(result, math.inf, t, seconds=1.4)
    assert result.scale(0.5, 0.0, t) == 1.0


def test_what_left_the_cone_as_the_chair_went_on_is_known_still_after_it_has_stood_for_long():
    result, t = alarmed({'SDI': 0.4}, config=replace(CONFIG, memory=60.0))
    t = feed(result, math.inf, t, 0.2, 0.0, 1.0)
    t = feed(result, math.inf, t, 0.0, 0.02, 30.0)  # at rest; the gyro says 0.02 rad/s
    assert 0.5 * result.scale(0.5, 0.0, t) <= CREEP
    t = feed(result, math.inf, t, 0.2, 0.0, 3.0)
    assert result.scale(0.5, 0.0, t) == 1.0
    assert all(len(history) < 40 for history in result._history.values()), 'no more is kept than the way tells of'


@given(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8))
def test_for_a_while_after_somebody_was_near_the_whole_body_creeps(v, w):
    result = caution()
    t = feed(result, {'SLIT': 0.9}, seconds=2.0)
    feed(result, {'SLIT': 0.6}, t)
    for later in (0.0, CONFIG.near_memory - 0.1):
        factor = result.scale(v, w, t + later)
        for x in (-0.54, 0.54):
            for y in (-0.29, 0.29):
                assert factor * math.hypot(v - w * y, w * x) <= CREEP
    assert result.scale(0.4, 0.0, t + CONFIG.near_memory + 0.1) <= 1.0


def test_who_touches_it_is_near():
    result, t = alarmed(math.inf)
    assert result.scale(0.5, 0.0, t) == 1.0
    result.on_range('SLID', -math.inf, t, Motion(0.3), 0.01)
    assert 0.5 * result.scale(0.5, 0.0, t) <= CREEP


def test_a_sensor_that_goes_on_scattering_has_told_of_nobody_and_who_others_heard_is_believed_still():
    def doubt(name, start, seconds):
        result, t = alarmed(0.4, config=replace(CONFIG, memory=60.0))
        for k in range(round(seconds / 0.2) + 1):
            result.on_noise(name, t + start + 0.2 * k)
        return result, t + start + seconds

    result, t = doubt('SDD', 0.4, 4.0)
    assert not result.pedestrians_nearby(t) and result.scale(0.5, 0.0, t) == 1.0
    for name, start, seconds in (
        ('SLID', 0.4, 4.0),
        ('SDD', 0.4, 2.0),
        ('SDD', 6.0, 4.0),
    ):  # another, for a while only, long after
        result, t = doubt(name, start, seconds)
        assert result.pedestrians_nearby(t)


def test_who_does_not_give_way_is_remembered_for_longer():
    result = caution()
    t = feed(result, 0.4, seconds=2.0)
    result.on_contact(t)
    for later in (0.0, CONFIG.memory + 1.0, CONFIG.after_contact - 0.1):
        assert result.pedestrians_nearby(t + later)
        assert 0.5 * result.scale(0.5, 0.0, t + later) <= CREEP
    assert not result.pedestrians_nearby(t + CONFIG.after_contact)
    off = caution(replace(CONFIG, memory=0.0))
    off.on_contact(t)
    assert not off.pedestrians_nearby(t)


def test_the_guard_tells_of_an_impact():
    guard = Guard(SAFETY)
    guard.on_impact(5.0, False)
    assert not guard.zones.pedestrians_nearby(5.0)
    guard.on_impact(5.0, True)
    assert guard.zones.pedestrians_nearby(5.0 + CONFIG.after_contact - 0.1)


def test_without_a_memory_there_is_no_caution():
    result = caution(CautionConfig())
    feed(result, 0.5, feed(result, 1.0, seconds=3.0))
    result.on_approach('SDI', 0.5, 4.0)
    result.on_approach('SDI', 0.5, 4.2)
    assert not result.pedestrians_nearby(4.2) and result.scale(0.8, 0.8, 4.2) == 1.0


def test_a_clock_set_back_forgets_them():
    result, t = alarmed(0.4)
    feed(result, 0.4, t - 5.0)
    assert not result.pedestrians_nearby(t - 5.0)


def test_faults_name_the_parameter_and_what_is_allowed():
    with pytest.raises(
        ConfigError,
        match='memory is -1.0, allowed are numbers of 0 or more; patience is .a.*walk is 0|walk is 0.*memory is -1.0',
    ):
        CautionConfig(memory=-1.0, walk=0, patience='a')
    with pytest.raises(ConfigError, match='hope is 1, but there is no such parameter'):
        SafetyConfig.from_params({**PARAMS, 'caution': {'hope': 1}})
    assert (
        SafetyConfig.from_params({name: value for name, value in PARAMS.items() if name != 'caution'}).caution.memory
        == 0.0
    )


def test_where_people_are_about_a_first_step_is_enough_though_the_chair_turns():
    for alert in (False, True):
        detector = ApproachDetector(SIDE, HALF)
        told = [detector.add(0.2 * k, distance, 0.0, 0.2, alert) for k, distance in enumerate((1.2, 1.2, 1.2, 1.0))]
        assert told[:3] == [0.0, 0.0, 0.0] and (told[3] > 0.2) == alert
        assert detector.speed(0.6 + PAUSE + 0.01) == 0.0


@pytest.mark.parametrize('nothing, alert, told', [(2, True, False), (3, True, True), (3, False, False)])
def test_where_people_are_about_who_steps_in_where_nothing_was_heard_is_waited_for(nothing, alert, told):
    detector = ApproachDetector(next(sensor for sensor in SENSORS if sensor.name == 'SJO'), HALF)
    for k, distance in enumerate((*([math.inf] * nothing), 0.7)):
        speed = detector.add(0.2 * k, distance, 0.1, 0.0, alert)
    assert (speed > 0.0) == told


class Ride:
    """A guard as SARA is set up, told to drive; what its raw sonars hear is `ranges`."""

    def __init__(self):
        self.guard, self.t, self.ranges, self.command, self.speeds, self.decisions = (
            Guard(SAFETY),
            0.0,
            {},
            (0.0, 0.0),
            [],
            [],
        )

    def go(self, seconds):
        """So many seconds; the last Decision."""
        guard = self.guard
        for _ in range(round(seconds / 0.02)):
            self.t += 0.02
            tick = round(self.t / 0.02)
            if tick % 10 == 0:
                for sensor in SENSORS:
                    distance = self.ranges.get(sensor.name, math.inf)
                    guard.on_raw_range(self.t, sensor.name, distance)
                    guard.on_range(self.t, sensor.name, distance)
            inputs = Inputs(self.t, self.t, self.t, self.t, self.t, None, False, True, 'navigation', 0.0)
            self.decisions.append(guard.gate.step(self.t, Command(*self.command, self.t), inputs))
        return self.decisions[-1]


def test_somebody_heard_and_then_hidden_makes_the_chair_creep_and_say_why_and_quiet_lets_it_go_on():
    ride = Ride()
    ride.ranges = {'SLDD': 1.6, 'SLID': 0.45}
    ride.go(3.0)
    for distance in (
        1.4,
        1.3,
        1.6,
    ):  # somebody passes on the right, at rest; then a wall on the left hides whoever is behind it
        ride.ranges['SLDD'] = distance
        ride.go(0.4)
    del ride.ranges['SLDD']
    ride.command = 0.4, 0.0
    ride.go(3.0)
    assert 0.02 < ride.decisions[-1].v * math.cos(math.radians(40.0)) <= CREEP
    assert (ride.decisions[-1].state, ride.decisions[-1].reason) == (State.SLOWED, Reason.PEOPLE)
    ride.go(CONFIG.memory)
    assert ride.decisions[-1].v == pytest.approx(0.4) and ride.decisions[-1].state is State.DRIVING
    assert not any(decision.give_up for decision in ride.decisions)


def test_nobody_is_said_to_be_expected_while_the_last_who_were_heard_are_forgotten():
    ride = Ride()
    ride.ranges = {'SLDD': 1.6, 'SLID': 0.45}
    ride.go(3.1)
    ride.guard.on_impact(ride.t, True)  # between two readings, and forgotten between two
    ride.command = 0.4, 0.0
    ride.go(CONFIG.after_contact + 1.0)
    told = [(decision.state, decision.reason) for decision in ride.decisions]
    assert told[-100] == (State.SLOWED, Reason.PEOPLE) and told[-1][0] is State.DRIVING
    assert (State.SLOWED, Reason.EXPECTED) not in told


def test_a_wall_that_a_turn_which_has_just_begun_brings_into_a_cone_is_nobody():
    ride = Ride()
    ride.ranges = {'STI': 2.1}
    ride.go(3.0)
    ride.command = 0.0, 0.4
    ride.go(0.1)
    ride.ranges = {'STI': 0.83}  # before the gyroscope tells of the turn
    ride.go(0.4)
    assert not ride.guard.zones.pedestrians_nearby(ride.t)


def test_a_wall_that_was_there_all_the_time_slows_nobody():
    ride = Ride()
    ride.ranges = {'SLDD': 1.6, 'SLID': 0.45}
    ride.go(3.0)
    ride.command = 0.4, 0.0
    assert ride.go(3.0).v == pytest.approx(0.4)


def test_who_is_expected_is_reckoned_with_before_anybody_is_heard_and_no_more_when_they_have_gone():
    ride = Ride()
    assert ride.guard.zones.caution.expect(True)
    ride.ranges = {'SLDD': 1.6, 'SLID': 0.45}
    ride.go(3.0)
    ride.command = 0.4, 0.0
    told = ride.go(90.0)
    assert 0.02 < told.v * math.cos(math.radians(40.0)) <= CREEP and (told.state, told.reason) == (
        State.SLOWED,
        Reason.EXPECTED,
    )
    assert not any(decision.give_up for decision in ride.decisions)  # nobody holds it up
    assert ride.guard.zones.caution.expect(False)
    assert ride.go(3.0).v == pytest.approx(0.4)


def test_people_cannot_be_expected_where_nothing_is_kept_in_mind():
    assert not caution(CautionConfig()).expect(True) and caution(CautionConfig()).expect(False)
    expecting = SafetyConfig.from_params({**PARAMS, 'caution': {**PARAMS['caution'], 'expected': True}}).caution
    assert caution(expecting).expected and not caution().expected
    for fault, sentence in (
        ({'expected': 1}, 'expected is 1, allowed are true and false'),
        ({'expected': True}, 'expected is True, allowed is false where memory is 0'),
    ):
        with pytest.raises(ConfigError, match=sentence):
            CautionConfig(**fault)


def crowd(patience, drives=((40.0, 0.5),), still=False):
    """The Decisions of a gate before which somebody walks to and fro (`still`: stands), told to drive at v (m/s) for so
    many s: `drives`, one after another; 0 m/s is to stand.
    """
    zones = Zones(SAFETY.zones, CautionConfig(memory=200.0, patience=patience))
    gate = SafetyGate(GateConfig(), Comfort(Profile()), zones)
    for t in (0.0, 0.2):
        zones.caution.on_approach('SDI', 2.0, t)
    decisions, k = [], 10
    for seconds, v in ((0.1, 0.0), *drives):
        for _ in range(round(seconds / 0.02)):
            k += 1
            t = 0.02 * k
            if k % 10 == 0:
                for sensor in SENSORS:
                    distance = 0.4 if still or sensor.side != 'front' else 1.2 - 0.2 * (k // 10 % 5)
                    zones.on_raw_range(sensor.name, distance, t)
                    zones.on_range(sensor.name, distance, t)
            decisions.append(
                gate.step(t, Command(v, 0.0, t), Inputs(t, t, t, t, t, None, False, True, 'navigation', 0.0))
            )
    return decisions


def test_goals_are_given_up_in_words_when_people_have_held_it_up_for_long():
    decisions = crowd(patience=15.0)
    given_up = [k for k, decision in enumerate(decisions) if decision.give_up]
    assert [round(0.02 * k) for k in given_up] == [15, 30]
    assert all(
        (decisions[k].state, decisions[k].reason, decisions[k].v) == (State.BLOCKED, Reason.CROWD, 0.0)
        for k in given_up
    )
    assert not any(decision.give_up for decision in crowd(patience=0.0))


def test_it_says_that_it_waits_for_who_moves_and_not_for_what_stands_where_it_creeps_on():
    assert all(decision.waits for decision in crowd(0.0)[100:])
    creeping = crowd(15.0, still=True)[100:]
    assert all(decision.v > 0.0 for decision in creeping) and not any(
        decision.waits or decision.give_up for decision in creeping
    )


@pytest.mark.parametrize('pause, gives_up', [(1.0, True), (8.0, False)])
def test_time_in_which_nobody_wants_it_to_move_makes_up_for_time_that_people_took(pause, gives_up):
    assert any(decision.give_up for decision in crowd(15.0, ((10.0, 0.5), (pause, 0.0), (10.0, 0.5)))) == gives_up
