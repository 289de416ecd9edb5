"""The whole gate on a chair with its bus: frames at their own rates with jitter, one lost now and then, hazards at
random moments.
"""

import math
import random

import numpy as np
import pytest

from sara_common.config import ConfigError
from sara_common.files import merged
from sara_common.platforms import folders, load, parameters
from sara_common.scans import Sweep
from sara_control.gate.gate_config import GateConfig, PlausibilityConfig, SafetyConfig
from sara_control.gate.guard import Guard
from sara_control.gate.reasons import Reason, State

PARAMS = parameters('sara_control', 'safety.yaml', load('sara'))
STEPS = 64000 / math.tau
TICK = 0.01


class Chair:
    """A guard in front of two wheels with a lag of 0.1 s, told at 50 Hz over a bus that takes 10 to 20 ms each way.

    wall: m from the front sensors to a wall across, seen with a median of 3 at 5 Hz as on the chair; it comes nearer as
    the chair drives. `old`: IMU frames of old data since the IMU froze; of the first, a part is new. `dead`: what is
    silent. `lose`: names of the frames to lose next.
    """

    def __init__(self, seed=0, params=PARAMS):
        self.guard = Guard(SafetyConfig.from_params(params))
        self.random = random.Random(seed)
        self.t, self.tick = 50.0, self.random.randrange(20)
        self.v = self.w = self.odometer = 0.0
        self.angles, self.frozen = [0.0, 0.0], None
        self.old = None
        self.wall, self.echoes = math.inf, []
        self.dead, self.lose = set(), []
        self.pending = []
        self.command, self.mode, self.impact = None, 3, False
        self.decision, self.told = None, (0.0, 0.0)
        self.told_at, self.wheels_at = self.t, self.t
        self.states = set()

    def later(self, name, hear):
        """The frame arrives after the bus's time, unless it is lost."""
        if name in self.lose:
            self.lose.remove(name)
        elif name not in self.dead and 'bus' not in self.dead:
            self.pending.append((self.t + self.random.uniform(0.0, 0.01), hear))

    def run(self, seconds):
        for _ in range(round(seconds / TICK)):
            self.step()
        return self

    def step(self):
        self.t, self.tick = self.t + TICK, self.tick + 1
        self.move()
        self.talk()
        due, self.pending = [p for p in self.pending if p[0] <= self.t], [p for p in self.pending if p[0] > self.t]
        for stamp, hear in due:
            hear(stamp)
        if self.tick % 2 == 0:
            self.decision = self.guard.step(self.t)
            self.states.add(self.decision.state)
            if 'bus' not in self.dead:
                self.pending.append((self.t + 0.02, lambda _, d=self.decision: self.tell(d)))

    def tell(self, decision):
        self.told, self.told_at = (decision.v, decision.w), self.t

    def move(self):
        """The motor node stops by itself when it hears nothing for 0.2 s."""
        v, w = self.told if self.t - self.told_at <= 0.2 else (0.0, 0.0)
        gain = 1.0 - math.exp(-TICK / 0.1)
        self.v, self.w = self.v + gain * (v - self.v), self.w + gain * (w - self.w)
        self.odometer += self.v * TICK
        for i, side in enumerate((0.2625, -0.2625)):
            self.angles[i] += (self.v + side * self.w) / 0.155 * TICK

    def talk(self):
        guard, clock = self.guard, round(self.t * 1e4)
        if self.tick % 10 == 0:
            self.later('mode', lambda t: guard.on_mode(t, self.mode))
            for i in (0, 1):
                steps = round((self.frozen or self.angles)[i] * STEPS) % 2**32
                self.later('encoders', lambda t, i=i, steps=steps: guard.on_encoder(t, i, steps, clock))
        if self.tick % 20 == 0:
            turn, impact = self.w / 1.27, self.impact
            self.old = None if self.old is None else self.old + 1
            frozen = self.old is not None and self.old > 3
            self.later('imu', lambda t: (guard.on_impact(t, impact), guard.on_imu(t, (0.0, 0.0, turn), frozen)))
            echo = self.wall - self.odometer
            self.echoes = [*self.echoes[-2:], echo if echo >= 0.16 else -math.inf]
            for name in guard.zones.sensors:
                ahead = sorted(self.echoes)[len(self.echoes) // 2] if name in ('SDI', 'SDD') else math.inf
                self.later(
                    'ranges',
                    lambda t, name=name, ahead=ahead: guard.on_range(t, name, ahead if ahead <= 2.5 else math.inf),
                )
        if self.tick % 2 == 0 and 'localization' not in self.dead:
            guard.on_localization(self.t, 0.0, 0.0, 0.0, 1.0)
        if self.tick % 5 == 0 and self.command is not None and 'navigation' not in self.dead:
            guard.on_source('navigation')
            guard.on_command(self.t, *self.command)


def driving(seed, v, w=0.0):
    chair = Chair(seed)
    chair.run(1.0)
    chair.command = (v, w)
    chair.run(4.0 + chair.random.uniform(0.0, 0.4))
    assert chair.decision.state is State.DRIVING and chair.v == pytest.approx(v, abs=1e-3), chair.decision
    return chair


def hazard(chair, name):
    if name == 'emergency_stop':
        chair.guard.on_emergency_stop(True)
    elif name == 'impact':
        chair.impact = True
    elif name == 'frozen':
        chair.frozen = list(chair.angles)
    elif name == 'imu_frozen':
        chair.old = 0
    else:
        chair.dead = {name}


LIMITS = {
    'emergency_stop': 0.05,
    'impact': 0.2,
    'bus': 0.25,
    'encoders': 0.3,
    'frozen': 0.3,
    'imu': 0.5,
    'imu_frozen': 0.8,
    'navigation': 0.5,
    'ranges': 0.6,
    'localization': 0.6,
}


@pytest.mark.parametrize('name', LIMITS)
def test_at_rest_in_time_and_never_again_by_itself(name):
    """From v at rest within T + v / 1.5 + 0.25 s; the hazard passes, commands go on: it does not move."""
    for seed in range(12):
        v = (0.8, 0.5, 0.2, 0.12)[seed % 4]
        chair = driving(seed, v, (0.0, 0.1)[seed % 2])
        hazard(chair, name)
        happened = end = chair.t
        while chair.t < happened + 4.0:
            chair.step()
            if abs(chair.v) >= 0.05:
                end = chair.t
        assert end - happened <= LIMITS[name] + v / 1.5 + 0.25, (seed, end - happened)
        chair.dead, chair.impact, chair.frozen, chair.old = set(), False, None, None
        chair.guard.on_emergency_stop(False)
        before = chair.odometer
        if name == 'navigation':
            chair.command = None
        chair.run(3.0)
        assert chair.odometer - before < 0.005 and not chair.guard.comfort.moving, seed
        chair.command = (0.0, 0.0)
        chair.run(0.3)
        if name == 'emergency_stop':
            assert chair.decision.state is State.HELD
            assert chair.guard.reset() == (True, 'The emergency stop is released.')
            chair.run(0.1)
        chair.command = (v, 0.0)
        assert chair.run(2.0).decision.state is State.DRIVING, chair.decision


def test_a_frozen_imu_is_named_from_the_frame_that_tells_of_it_to_the_first_that_does_not():
    chair = driving(0, 0.5, 0.3)
    hazard(chair, 'imu_frozen')
    chair.run(0.82)
    assert (chair.decision.state, chair.decision.reason) == (State.BRAKING, Reason.IMU_FROZEN)
    chair.run(3.0)
    assert (chair.decision.state, chair.decision.reason) == (State.HELD, Reason.IMU_FROZEN)
    chair.old = None
    chair.run(0.3)
    assert (chair.decision.state, chair.decision.reason) == (State.WAITING, Reason.IMU_FROZEN)


def test_what_the_chairs_own_joystick_drives_to_does_not_approach_by_itself():
    chair = Chair(3)
    guard, zones = chair.guard, chair.guard.zones
    filtered = guard.on_range
    guard.on_range = lambda *reading: guard.on_raw_range(*reading) and filtered(*reading)
    chair.run(1.0)
    chair.mode, chair.wall, chair.tell = 1, 3.0, lambda _: None
    chair.told, chair.told_at = (0.4, 0.0), math.inf  # by the stick
    chair.run(5.0)
    assert chair.decision.state is State.MANUAL and chair.echoes[-1] < 1.2
    assert not zones.pedestrian_moving and not zones.pedestrians_nearby(chair.t)
    chair.told = (0.0, 0.0)
    chair.run(1.0)
    for _ in range(5):
        chair.wall -= 0.1
        chair.run(0.2)
    assert zones.pedestrian_moving, 'who walks to a chair that stands approaches'


def test_one_lost_frame_of_any_kind_stops_nothing():
    """Even where the frames beside it jitter the wrong way; 200 losses."""
    for seed in range(5):
        chair = driving(seed, 0.5, 0.1)
        chair.states.clear()
        for _ in range(40):
            chair.lose = [chair.random.choice(['mode', 'encoders', 'imu', 'ranges'])]
            chair.run(chair.random.uniform(0.7, 1.0))
            assert not chair.lose
        assert chair.states == {State.DRIVING}


def test_an_hour_without_a_fault_is_an_hour_without_a_stop():
    """10 minutes of starts, turns and stops, frames lost at a rate of 1 in 10 000."""
    chair = Chair(3)
    chair.run(1.0)
    chair.states.clear()
    while chair.t < 650.0:
        chair.command = (chair.random.choice([0.0, 0.3, 0.6, 0.8, -0.3]), chair.random.choice([0.0, 0.0, 0.3, -0.6]))
        chair.run(chair.random.uniform(0.5, 4.0))
        if chair.random.random() < 0.05:
            chair.lose = ['encoders']
    assert chair.states <= {State.DRIVING, State.IDLE}
    assert chair.guard.dropped == {}


@pytest.mark.parametrize('seed', range(10))
def test_an_obstacle_that_appears_1_5_m_ahead_at_0_8_is_not_touched(seed):
    chair = driving(seed, 0.8)
    chair.wall = chair.odometer + 1.5
    chair.states.clear()
    chair.run(12.0)
    assert abs(chair.v) < 0.005
    assert 0.02 < chair.wall - chair.odometer < 0.35, chair.wall - chair.odometer
    assert chair.decision.state is State.BLOCKED
    assert State.HELD not in chair.states


def test_a_wall_that_was_always_there_is_approached_gently():
    chair = Chair(1)
    chair.wall = 6.0
    chair.run(1.0)
    chair.command = (0.8, 0.0)
    chair.run(30.0)
    assert State.BRAKING not in chair.states and State.SLOWED in chair.states
    assert 0.05 < chair.wall - chair.odometer < 0.3


def test_who_drives_is_the_chairs_own_word():
    chair = driving(0, 0.4)
    chair.mode = 1
    chair.run(0.3)
    assert chair.decision.state is State.MANUAL and not chair.guard.comfort.moving
    for mode in (0, 2, 4, 255):
        helping = driving(0, 0.4)
        helping.mode = mode
        helping.run(0.3)
        assert (helping.decision.state is State.MANUAL) == (mode != 2), 'at 2 the PC helps, and drives'
    free = Guard(SafetyConfig.from_params({**PARAMS, 'handshake': False}))
    free.on_mode(1.0, 1)
    assert free.step(1.0).state is State.HELD


def test_bad_data_is_dropped_and_counted_and_moves_nothing():
    guard = Chair().guard
    assert not guard.on_command(1.0, math.nan, 0.0) and not guard.on_command(1.0, 0.0, math.inf)
    assert not guard.on_range(1.0, 'SDI', math.nan) and not guard.on_range(1.0, 'nose', 1.0)
    assert not guard.on_localization(1.0, 0.0, math.nan) and guard.on_localization(1.0, 0.0, 0.0)
    assert not guard.on_imu(1.0, (0.0, 0.0, math.nan))
    assert guard.dropped == {
        'command not finite': 2,
        'range not known or not possible': 2,
        'pose not finite': 1,
        'turn rate not possible': 1,
    }
    assert guard.step(1.0).v == 0.0


def test_what_is_missing_is_named():
    chair = Chair()
    assert set(chair.guard.missing(50.0)) == {
        'encoders',
        'imu',
        *(f'range {name}' for name in PARAMS['zones']['sensors']),
    }
    chair.dead = {'imu'}
    chair.run(3.0)
    assert chair.guard.missing(chair.t) == ['imu']


def test_profiles():
    chair = Chair()
    assert not chair.guard.set_profile('wild') and chair.guard.profile == 'standard'
    assert chair.guard.set_profile('gentle') and chair.guard.profile == 'gentle'
    chair.run(1.0)
    chair.command = (0.8, 0.0)
    chair.run(5.0)
    assert chair.decision.v == 0.5


@pytest.mark.parametrize('robot', folders())
def test_the_packaged_configuration_is_the_robots(robot):
    platform = load(robot)
    config = SafetyConfig.from_params(parameters('sara_control', 'safety.yaml', platform))
    assert {sensor.name for sensor in config.zones.sensors} == platform.sonars.keys() and config.rate == 50.0
    standard = config.profiles['standard']
    assert (standard.acceleration, standard.braking, standard.jerk, config.gate.emergency_braking) == (
        0.4,
        0.8,
        0.8,
        1.5,
    )
    assert config.gate == GateConfig(localization_for=('navigation',)) and config.plausibility == PlausibilityConfig.of(
        platform
    )


def test_a_slipping_base_is_told_more_than_the_profile_which_is_the_chairs_own():
    fastest = {}
    for slip in (1.0, 1.27):
        chair = Chair(params={**PARAMS, 'turn_slip': slip}).run(2.0)
        assert chair.guard.rider.max_turn == 0.8
        chair.command = (0.0, 3.0)
        chair.run(4.0)
        fastest[slip] = chair.guard.comfort.w
        assert chair.guard.set_profile('gentle') and chair.guard.rider.max_turn == 0.5
        chair.command = (0.0, 0.0)
        chair.run(3.0).command = (0.0, 3.0)
        chair.run(4.0)
        assert chair.guard.comfort.w == pytest.approx(0.5 * slip)
    assert fastest == {1.0: pytest.approx(0.8), 1.27: pytest.approx(0.8 * 1.27)}


LASER_ALONE = merged(PARAMS, {'scan': {'enabled': True}, 'handshake': False, 'gate': {'localization_timeout': 0}})
LASER_ALONE['zones'] = {**PARAMS['zones'], 'sensors': {}}


@pytest.mark.parametrize('silent', [False, True])
def test_a_robot_with_a_laser_scanner_alone_stops_when_that_is_silent(silent):
    guard, rng = Guard(SafetyConfig.from_params(LASER_ALONE)), np.random.default_rng(0)
    t = x = 0.0
    moves = []
    for k in range(500):
        t += 0.02
        x += 0.02 * guard.comfort.v
        if k % 5 == 0:
            steps = round(x / 0.155 * STEPS)
            for wheel in (0, 1):
                guard.on_encoder(t, wheel, steps, 200 * k)
            guard.on_imu(t, (0.0, 0.0, 0.001 * (k % 10)))
            if not (silent and k > 250):
                ranges = 20.0 - x + rng.normal(0.0, 0.005, 61)
                guard.on_scan(t, Sweep(t - 0.01, -1.5, 1.5, 0.05, 0.0, 0.05, 30.0, ranges))
        guard.on_command(t, 0.5 if k > 25 else 0.0, 0.0)
        moves.append(guard.step(t).v)
    assert moves[250] == 0.5 and moves[-1] == (0.0 if silent else 0.5)
    assert not silent or guard.comfort.v == 0.0 == max(moves[350:])


@pytest.mark.parametrize(
    ('params', 'gate', 'fault'),
    [
        (LASER_ALONE, {'imu_timeout': 0}, 'imu_timeout is 0, but scan/enabled'),
        (LASER_ALONE, {'encoder_timeout': 0}, 'encoder_timeout is 0, but scan/enabled'),
        (LASER_ALONE, {'range_timeout': 0}, 'range_timeout is 0, but scan/enabled'),
    ],
)
def test_what_a_laser_scanner_needs_is_watched(params, gate, fault):
    with pytest.raises(ConfigError, match=fault):
        SafetyConfig.from_params(merged(params, {'gate': gate}))


def test_config_names_every_fault():
    with pytest.raises(ConfigError) as error:
        SafetyConfig.from_params(
            {
                'gate': {'imu_timeout': -1, 'emergency_braking': 0, 'localization_for': 'all', 'speed': 1},
                'plausibility': 3,
                'zones': {'length': 0},
                'profiles': {'a': {'jerk': 0}},
                'rate': 5,
                'handshake': 'yes',
                'cancel_topics': '/x',
                'turn_slip': 0.9,
                'tempo': 1,
            }
        )
    text = str(error.value)
    for part in (
        'imu_timeout is -1',
        'emergency_braking is 0',
        "localization_for is 'all'",
        'speed is 1',
        '3 is given where',
        'length is 0',
        'profiles/a/jerk is 0',
        'rate is 5',
        "handshake is 'yes'",
        "cancel_topics is '/x'",
        'turn_slip is 0.9',
        'tempo is 1',
    ):
        assert part in text, part
    with pytest.raises(ConfigError, match="profile is 'x', allowed are a"):
        SafetyConfig.from_params({**PARAMS, 'profiles': {'a': {}}, 'profile': 'x'})
    with pytest.raises(ConfigError, match=r"profile is \['a'\], allowed are a"):
        SafetyConfig.from_params({**PARAMS, 'profiles': {'a': {}}, 'profile': ['a']})
    with pytest.raises(ConfigError, match='command_hard_timeout is 0.1'):
        GateConfig(command_hard_timeout=0.1)
    with pytest.raises(ConfigError, match='steps_per_turn is 0'):
        PlausibilityConfig(steps_per_turn=0)
    with pytest.raises(ConfigError, match='depth is 1'):
        SafetyConfig.from_params({**PARAMS, 'plausibility': {'depth': 1}})


ALONE = {f'{name}_timeout': 0.0 for name in ('encoder', 'imu', 'localization', 'bus', 'range')}


@pytest.mark.parametrize('back', [5.0, 5.02])
def test_a_command_of_before_the_clock_was_set_back_is_none(back):
    """No other node stops a robot whose gate watches no sensor."""
    guard, t, ends = Guard(SafetyConfig.from_params({**PARAMS, 'gate': {**PARAMS['gate'], **ALONE}})), 100.0, 0
    guard.on_mode(t, 3)
    guard.step(t)
    for _ in range(200):
        t += 0.02
        guard.on_command(t, 0.4, 0.0)
        guard.step(t)
    assert guard.step(t).v > 0.3
    t -= back
    for k in range(400):  # past the old command's stamp
        t += 0.02
        decision = guard.step(t)
        ends += decision.give_up
        assert k < 60 or decision.v == 0.0
    assert ends <= 1


def test_an_emergency_stop_is_released_on_a_robot_without_encoders():
    guard, t = Guard(SafetyConfig.from_params({**PARAMS, 'gate': {**PARAMS['gate'], **ALONE}})), 100.0
    guard.on_mode(t, 3)
    guard.on_emergency_stop(True)
    guard.step(t)
    guard.on_emergency_stop(False)
    for _ in range(100):
        t += 0.02
        guard.step(t)
    assert guard.reset() == (True, 'The emergency stop is released.')


def test_who_was_detected_before_the_clock_was_set_back_is_past():
    zones, t = Guard(SafetyConfig.from_params(PARAMS)).zones, 1000.0
    for distance in (2.5, 2.5, 2.5, 2.2, 1.9, 1.6, 1.3):
        t += 0.2
        zones.on_raw_range('SDI', distance, t)
        zones.on_range('SDI', distance, t)
    assert zones.pedestrian_moving
    t -= 600.0
    for k in range(30):
        t += 0.2
        zones.on_raw_range('SDI', 5.0 + 0.001 * (k % 2), t)
        zones.on_range('SDI', 5.0 + 0.001 * (k % 2), t)
    assert not zones.pedestrian_moving
