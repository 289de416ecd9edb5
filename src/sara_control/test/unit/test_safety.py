"""The safety gate's state machine, branch by branch: what stops the chair, how hard, and what starts it again."""

import dataclasses
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_control.gate.comfort import Comfort, Profile
from sara_control.gate.gate_config import GateConfig
from sara_control.gate.reasons import Reason, State
from sara_control.gate.safety import LONGEST_STEP, Command, Decision, Inputs, SafetyGate, _recent
from sara_control.zones.caution import CautionConfig
from sara_control.zones.zone_config import RangeSensor, ZoneConfig
from sara_control.zones.zones import Zones

DT = 0.02
CONFIG = GateConfig()
SENSORS = (
    RangeSensor('F', 0.54, 0.0, 0.0),
    RangeSensor('B', -0.54, 0.0, math.pi),
    RangeSensor('L', 0.35, 0.29, math.pi / 2),
    RangeSensor('R', 0.35, -0.29, -math.pi / 2),
)


ZONES = ZoneConfig(sensors=SENSORS, length=1.08, width=0.58)


class Bench:
    """A gate, a time, and inputs that are all well and of now but for those in `changed`."""

    def __init__(self, config=CONFIG, profile=Profile(), start=100.0):
        self.zones = Zones(ZONES)
        self.comfort = Comfort(profile)
        self.gate = SafetyGate(config, self.comfort, self.zones)
        self.t = start
        self.changed = {}
        self.command = None
        self.decision = None
        self.give_ups = []

    def inputs(self):
        values = dict(
            bus=self.t,
            encoders=self.t,
            imu=self.t,
            ranges=self.t,
            localization=self.t,
            pc_drives=True,
            source='navigation',
            speed=abs(self.comfort.v),
        )
        values.update(self.changed)
        return Inputs(**values)

    def ask(self, v, w=0.0):
        """Keep commanding this from now on; None: say nothing more."""
        self.command = None if v is None else (v, w)
        return self

    def step(self, count=1, dt=DT):
        """Steps; the command is given anew before each unless `command` is a Command or None. Returns the last
        Decision.
        """
        for _ in range(count):
            self.t += dt
            command = self.command
            if isinstance(command, tuple):
                command = self.last = Command(*command, self.t)
            self.decision = self.gate.step(self.t, command, self.inputs())
            if self.decision.give_up:
                self.give_ups.append(self.t)
        return self.decision

    def silence(self):
        """The last command stays, but is not given again."""
        self.command = self.last

    def driving(self, v=0.4, w=0.0):
        """Drives at this speed."""
        self.ask(0.0).step()
        self.ask(v, w).step(400)
        assert (self.decision.v, self.decision.w) == (v, w) and self.decision.state is State.DRIVING
        assert self.decision.reason is None
        return self


def steps_to_rest(bench):
    """How many steps until the command is zero."""
    for count in range(1, 400):
        bench.step()
        if bench.decision.v == bench.decision.w == 0.0:
            return count
    raise AssertionError('it does not stop')


# -- starting
# -----------------------------------------------------------------------------------------------------------


def test_ready_when_all_is_well():
    bench = Bench()
    assert bench.step() == Decision(0.0, 0.0, State.IDLE, None, False)
    assert bench.ask(0.2).step() == Decision(pytest.approx(0.8 * DT * DT), 0.0, State.DRIVING, None, False)


def test_a_stream_that_was_there_before_does_not_start_the_chair():
    bench = Bench().ask(0.4)
    assert bench.step(20) == Decision(0.0, 0.0, State.WAITING, Reason.START, False)
    assert bench.ask(0.0).step().state is State.IDLE
    assert bench.ask(0.4).step(10).v > 0.0


def test_turning_alone_is_a_command_too():
    bench = Bench().ask(0.0, 0.3)
    assert bench.step(10).state is State.WAITING
    bench.ask(0.0).step()
    assert bench.ask(0.0, 0.3).step(5).w > 0.0 and bench.decision.state is State.DRIVING


def test_silence_makes_the_next_command_fresh_but_not_before_its_time():
    bench = Bench().ask(0.4)
    bench.step()
    bench.silence()
    assert bench.step(49).state is State.WAITING  # 0.98 s
    assert bench.step(2).state is State.IDLE  # 1.02 s
    bench.ask(0.4)
    assert bench.step(5).v > 0.0


def test_first_step_has_no_length():
    bench = Bench()
    bench.ask(0.0).step(dt=0.0)
    bench.ask(0.4)
    assert bench.step(dt=0.0).v == 0.0
    assert bench.step(dt=0.5).v == pytest.approx(0.8 * 0.1 * 0.1)  # as long as 0.1 s, by the jerk limit


def test_time_that_goes_back_is_no_step_and_old_stamps_are_not_believed():
    bench = Bench().driving()
    before = bench.decision.v
    bench.changed = {'imu': bench.t}
    assert bench.step(dt=-5.0) == Decision(before, 0.0, State.BRAKING, Reason.CLOCK, True)
    assert bench.step() == Decision(pytest.approx(before - 1.5 * DT), 0.0, State.BRAKING, Reason.IMU, False)
    bench.changed = {}
    steps_to_rest(bench)
    assert bench.step(20).state is State.WAITING
    bench.ask(0.0).step()
    assert bench.ask(0.4).step(5).v > 0.0


def test_silence_arms_once():
    bench = Bench().driving()
    bench.silence()
    bench.step(400)
    assert bench.decision == Decision(0.0, 0.0, State.IDLE, None, False) and len(bench.give_ups) == 1


# -- driving
# ------------------------------------------------------------------------------------------------------------


@given(st.lists(st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.integers(1, 60)), min_size=1, max_size=8))
@settings(max_examples=60)
def test_comfort_holds_exactly_while_nothing_is_wrong(plan):
    profile = Profile()
    bench = Bench()
    bench.ask(0.0).step()
    v = a = w = alpha = 0.0
    for target_v, target_w, count in plan:
        for _ in range(count):
            decision = bench.ask(target_v, target_w).step()
            new_a, new_alpha = (decision.v - v) / DT, (decision.w - w) / DT
            assert abs(new_a) <= (profile.braking if v * new_a < 0.0 else profile.acceleration) + 1e-9
            assert (
                abs(new_a - a) <= profile.jerk * DT + 1e-9 and abs(new_alpha - alpha) <= profile.turn_jerk * DT + 1e-9
            )
            assert abs(new_alpha) <= profile.turn_acceleration + 1e-9
            assert -profile.max_reverse - 1e-9 <= decision.v <= profile.max_forward + 1e-9
            v, a, w, alpha = decision.v, new_a, decision.w, new_alpha
            assert decision.state in (State.DRIVING, State.IDLE) and not decision.give_up


def test_a_command_of_zero_is_no_loss_however_old_it_is():
    bench = Bench().driving()
    bench.ask(0.0).step()
    bench.silence()
    assert bench.step().state is State.DRIVING  # still rolling, gently
    assert bench.step(200) == Decision(0.0, 0.0, State.IDLE, None, False)
    assert not bench.give_ups


def test_no_command_ever_is_idle():
    assert Bench().ask(None).step(10) == Decision(0.0, 0.0, State.IDLE, None, False)


def test_late_commands_fade_gently_and_may_come_back():
    bench = Bench().driving()
    bench.silence()
    assert bench.step(12).state is State.DRIVING  # 0.24 s
    assert bench.decision.v == 0.4
    decision = bench.step()  # 0.26 s
    assert (decision.state, decision.reason) == (State.FADING, Reason.COMMANDS)
    assert decision.v == pytest.approx(0.4 - 0.8 * DT * DT)
    assert bench.ask(0.4).step().state is State.DRIVING
    assert bench.step(300).v == 0.4 and not bench.give_ups


def test_commands_that_ceased_brake_hard_and_need_a_fresh_one():
    bench = Bench().driving()
    bench.silence()
    bench.step(22)  # 0.44 s
    assert bench.decision.state is State.FADING
    before = bench.decision.v
    decision = bench.step()  # 0.46 s
    assert decision == Decision(pytest.approx(before - 1.5 * DT), 0.0, State.BRAKING, Reason.COMMANDS, True)
    bench.ask(0.4)  # goes on as if nothing had been
    steps_to_rest(bench)
    assert bench.step(200) == Decision(0.0, 0.0, State.WAITING, Reason.COMMANDS, False)
    assert len(bench.give_ups) > 1


def test_an_ended_turn_command_is_a_loss_too():
    bench = Bench().driving(0.0, 0.4)
    bench.silence()
    assert bench.step(23).reason is Reason.COMMANDS and bench.decision.state is State.BRAKING


def test_a_command_from_the_future_is_of_another_clock():
    bench = Bench().driving()
    bench.command = Command(0.4, 0.0, bench.t + 5.0)
    assert bench.step() == Decision(pytest.approx(0.4 - 1.5 * DT), 0.0, State.BRAKING, Reason.COMMANDS, True)
    ahead = Bench().driving()
    ahead.command = Command(0.4, 0.0, ahead.t + 0.1)
    assert ahead.step().state is State.DRIVING  # stamps may be a little ahead


# -- losses
# -------------------------------------------------------------------------------------------------------------

WATCHED = [
    ('bus', Reason.BUS, 0.25),
    ('encoders', Reason.ENCODERS, 0.25),
    ('imu', Reason.IMU, 0.45),
    ('ranges', Reason.RANGES, 0.5),
    ('localization', Reason.LOCALIZATION, 0.5),
]


@pytest.mark.parametrize('name, reason, timeout', WATCHED)
def test_silence_brakes_hard_after_its_time_and_not_before(name, reason, timeout):
    bench = Bench().driving()
    bench.changed = {name: bench.t}
    whole = math.floor(timeout / DT + 1e-9)
    assert bench.step(whole - 1).state is State.DRIVING and bench.decision.v == 0.4
    bench.changed = {name: bench.t + DT - timeout + 1e-6}  # all but too old
    assert bench.step().state is State.DRIVING
    bench.changed = {name: bench.t + DT - timeout - 1e-6}
    assert bench.step() == Decision(pytest.approx(0.4 - 1.5 * DT), 0.0, State.BRAKING, reason, True)
    assert steps_to_rest(bench) <= 0.4 / 1.5 / DT + 1
    assert bench.step() == Decision(0.0, 0.0, State.HELD, reason, False)


@pytest.mark.parametrize(
    'changed, reason',
    [
        ({'fault': Reason.FROZEN}, Reason.FROZEN),
        ({'fault': Reason.TURN}, Reason.TURN),
        ({'impact': True}, Reason.IMPACT),
        *[({name: -math.inf}, reason) for name, reason, _ in WATCHED],
    ],
)
def test_after_a_loss_a_stream_that_goes_on_moves_nothing(changed, reason):
    bench = Bench().driving(0.4, 0.2)
    bench.changed = changed
    decision = bench.step()
    assert (decision.state, decision.reason, decision.give_up) == (State.BRAKING, reason, True)
    assert decision.v / decision.w == pytest.approx(2.0)  # on its curve
    steps_to_rest(bench)
    bench.changed = {}
    assert bench.step(300) == Decision(0.0, 0.0, State.WAITING, reason, False)
    assert bench.ask(0.0).step() == Decision(0.0, 0.0, State.IDLE, None, False)
    assert bench.ask(0.4).step(10).v > 0.0


def test_a_loss_that_is_over_before_the_chair_stands_still_stops_it():
    bench = Bench().driving()
    bench.changed = {'imu': -math.inf}
    bench.step()
    bench.changed = {}
    bench.ask(0.0)  # a zero on the way is not a zero at rest
    assert bench.step() == Decision(pytest.approx(0.4 - 3.0 * DT), 0.0, State.BRAKING, Reason.IMU, False)
    bench.ask(0.4)
    steps_to_rest(bench)
    assert bench.step(5).state is State.WAITING


def test_the_newest_reason_is_told_while_it_stands():
    bench = Bench().driving()
    bench.changed = {'imu': -math.inf}
    steps_to_rest(bench)
    bench.changed = {'ranges': -math.inf}
    assert bench.step() == Decision(0.0, 0.0, State.HELD, Reason.RANGES, False)
    bench.changed = {}
    assert bench.step().reason is Reason.RANGES


@pytest.mark.parametrize(
    'silent, frozen, reason',
    [('imu', True, Reason.IMU_FROZEN), ('imu', False, Reason.IMU), ('ranges', True, Reason.RANGES)],
)
def test_an_imu_that_is_silent_because_it_stands_still_is_called_so(silent, frozen, reason):
    bench = Bench().driving()
    bench.changed = {silent: -math.inf, 'imu_frozen': frozen}
    assert bench.step().reason is reason


@pytest.mark.parametrize(
    'off, well',
    [(CONFIG.imu_timeout, True), (math.nextafter(CONFIG.imu_timeout, 1.0), False), (-0.1, True), (-0.11, False)],
)
def test_the_ends_of_what_is_heard_in_time_belong_to_it(off, well):
    bench = Bench(start=-DT).ask(0.0)
    bench.changed = {'imu': -off}
    assert (bench.step().state is State.IDLE) is well and bench.t == 0.0


def test_the_gravest_reason_is_told():
    bench = Bench().driving()
    order = [
        ({'localization': -math.inf}, Reason.LOCALIZATION),
        ({'fault': Reason.FROZEN}, Reason.FROZEN),
        ({'ranges': -math.inf}, Reason.RANGES),
        ({'imu': -math.inf}, Reason.IMU),
        ({'encoders': -math.inf}, Reason.ENCODERS),
        ({'bus': -math.inf}, Reason.BUS),
        ({'impact': True}, Reason.IMPACT),
    ]
    for changed, reason in order:
        bench.changed.update(changed)
        assert bench.step().reason is reason
    bench.gate.emergency_stop(True)
    assert bench.step().reason is Reason.EMERGENCY_STOP
    bench.changed['pc_drives'] = False
    assert bench.step().reason is Reason.JOYSTICK


def test_what_is_not_there_is_not_watched():
    bench = Bench(
        GateConfig(bus_timeout=0, encoder_timeout=0, imu_timeout=0, range_timeout=0, localization_timeout=0)
    ).driving()
    bench.changed = dict.fromkeys(('bus', 'encoders', 'imu', 'ranges', 'localization'), -math.inf)
    assert bench.step(10).state is State.DRIVING


def test_only_who_needs_the_place_is_stopped_without_it():
    bench = Bench().driving()
    bench.changed = {'localization': -math.inf, 'source': 'joystick'}
    assert bench.step(10).state is State.DRIVING
    bench.changed['source'] = 'navigation'
    assert bench.step().state is State.BRAKING


def test_stamps_from_the_future_are_of_another_clock():
    bench = Bench().driving()
    bench.changed = {'imu': bench.t + DT + 0.1}
    assert bench.step().state is State.DRIVING
    bench.changed = {'imu': bench.t + DT + 0.11}
    assert bench.step().reason is Reason.IMU


def test_goals_are_given_up_at_once_and_then_once_a_second_while_somebody_insists():
    bench = Bench().driving()
    bench.changed = {'imu': -math.inf}
    bench.step(160)
    assert [t - bench.give_ups[0] for t in bench.give_ups] == [
        0.0,
        *(pytest.approx(n, abs=3.1 * DT) for n in (1.0, 2.0, 3.0)),
    ]
    bench.ask(0.0).step(160)
    assert len(bench.give_ups) == 4


def test_who_insists_at_the_start_has_a_second():
    bench = Bench().ask(0.4)
    bench.step(50)
    assert not bench.give_ups
    bench.step(2)
    assert len(bench.give_ups) == 1
    bench.step(20)
    bench.t = 10.0  # the clock is set back: a second again
    bench.step(50)
    assert len(bench.give_ups) == 1
    bench.step(2)
    assert len(bench.give_ups) == 2


def test_an_old_insistence_counts_for_nothing():
    bench = Bench().ask(0.4)
    bench.step()
    bench.silence()
    bench.step(60)
    assert not bench.give_ups


# -- who drives
# ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize('who, reason', [(False, Reason.JOYSTICK), (None, Reason.UNKNOWN_DRIVER)])
def test_the_joystick_takes_over_at_once_and_what_was_is_forgotten(who, reason):
    bench = Bench().driving(0.4, 0.2)
    bench.changed = {'pc_drives': who}
    assert bench.step() == Decision(0.0, 0.0, State.MANUAL, reason, True)
    bench.changed = {}
    assert bench.step(20) == Decision(0.0, 0.0, State.WAITING, reason, False)
    bench.ask(0.0).step()
    assert bench.ask(0.4).step(5).v > 0.0


# -- emergency stop
# -----------------------------------------------------------------------------------------------------


def test_emergency_stop_is_latched_and_released_only_explicitly():
    bench = Bench().driving()
    bench.gate.emergency_stop(True)
    assert bench.gate.latched
    assert bench.step() == Decision(pytest.approx(0.4 - 1.5 * DT), 0.0, State.BRAKING, Reason.EMERGENCY_STOP, True)
    steps_to_rest(bench)
    bench.ask(0.0)
    assert bench.step(100) == Decision(0.0, 0.0, State.HELD, Reason.EMERGENCY_STOP, False)
    assert bench.gate.reset(bench.last, bench.inputs()) == (False, 'The emergency stop is still pressed.')
    bench.gate.emergency_stop(False)
    assert bench.step(100).state is State.HELD and bench.gate.latched
    assert bench.gate.reset(bench.last, bench.inputs()) == (True, 'The emergency stop is released.')
    assert not bench.gate.latched and bench.step().state is State.IDLE
    assert bench.gate.reset(bench.last, bench.inputs()) == (True, 'The emergency stop is not on.')
    assert bench.ask(0.4).step(5).v > 0.0


STILL = 'The emergency stop is released only when the chair stands still.'


def test_emergency_stop_is_released_only_at_rest_and_at_zero():
    bench = Bench().driving()
    bench.gate.emergency_stop(True)
    bench.step()
    bench.gate.emergency_stop(False)
    bench.changed = {'speed': 0.0}
    assert bench.gate.reset(None, bench.inputs()) == (False, STILL)  # still commanded to move
    steps_to_rest(bench)
    for speed in (0.05, 0.06, -0.3, math.nan):
        bench.changed = {'speed': speed}
        assert bench.gate.reset(None, bench.inputs()) == (False, STILL)
    bench.changed = {'speed': 0.049}
    wanted = (False, 'The emergency stop is released only when no command to move is given.')
    assert bench.gate.reset(Command(0.1, 0.0, bench.t), bench.inputs()) == wanted
    assert bench.gate.reset(Command(0.0, 0.1, bench.t), bench.inputs()) == wanted
    assert bench.gate.latched
    assert bench.gate.reset(None, bench.inputs())[0] and not bench.gate.latched


def test_a_command_of_long_ago_keeps_no_emergency_stop():
    """Its source has died while it drove: nobody commands any more."""
    bench = Bench().driving()
    bench.gate.emergency_stop(True)
    bench.silence()
    steps_to_rest(bench)
    bench.gate.emergency_stop(False)
    end = bench.last.stamp + CONFIG.fresh_silence
    while bench.t < end - DT:
        assert not bench.gate.reset(bench.last, bench.inputs())[0]
        bench.step()
    bench.step(2)
    assert bench.gate.reset(bench.last, bench.inputs())[0]


def test_emergency_stop_of_a_joystick_that_drives_is_kept():
    bench = Bench().driving()
    bench.changed = {'pc_drives': False}
    bench.gate.emergency_stop(True)
    bench.step()
    bench.changed = {}
    assert bench.ask(0.0).step() == Decision(0.0, 0.0, State.HELD, Reason.EMERGENCY_STOP, False)


def test_letting_go_of_a_button_that_was_not_pressed_is_nothing():
    bench = Bench().driving()
    bench.gate.emergency_stop(False)
    assert bench.step().state is State.DRIVING and not bench.gate.latched


# -- zones
# --------------------------------------------------------------------------------------------------------------


def see(bench, name, distance):
    for _ in range(3):
        bench.zones.on_range(name, distance)


@pytest.mark.parametrize(
    'name, v, w, reason',
    [
        ('F', 0.4, 0.0, Reason.FRONT),
        ('B', -0.4, 0.0, Reason.REAR),
        ('L', 0.0, 0.5, Reason.LEFT),
        ('R', 0.0, -0.5, Reason.RIGHT),
    ],
)
def test_something_near_slows_blocks_and_says_where(name, v, w, reason):
    bench = Bench()
    bench.ask(0.0).step()
    see(bench, name, 0.5 if v else 0.16)
    slowed = bench.ask(v, w).step(300)
    assert (slowed.state, slowed.reason) == (State.SLOWED if v else slowed.state, reason)
    factor = bench.zones.scale(v, w)[0]
    assert (slowed.v, slowed.w) == (pytest.approx(v * factor), pytest.approx(w * factor)) and factor < 1.0
    see(bench, name, 0.0)
    bench.step()
    steps_to_rest(bench) if bench.comfort.moving else None
    blocked = bench.step(2)
    assert blocked == Decision(0.0, 0.0, State.BLOCKED, reason, False)
    see(bench, name, math.inf)  # it went away: a queue is no loss
    assert bench.step(5).state is State.DRIVING and not bench.give_ups


def test_gently_when_there_is_time():
    bench = Bench().driving(0.4)
    see(bench, 'F', 0.75)
    decision = bench.step()
    assert decision.state is State.SLOWED and decision.v >= 0.4 - 0.8 * DT * DT - 1e-12


def test_hard_when_there_is_none_until_gently_would_do():
    bench = Bench().driving(0.4)
    see(bench, 'F', 0.4)
    decision = bench.step()
    assert decision == Decision(pytest.approx(0.4 - 1.5 * DT), 0.0, State.BRAKING, Reason.FRONT, False)
    gentle = 0.4 * bench.zones.scale(0.4, 0.0)[0]
    hard = 0.4 * bench.zones.scale(0.4, 0.0, gentle=False)[0]
    assert gentle < hard < 0.4 - 1.5 * DT
    while bench.decision.state is State.BRAKING:
        last = bench.decision.v
        bench.step()
    assert last - 1.5 * DT <= gentle + 1e-9 or last <= gentle + 1e-9
    assert bench.decision.state is State.SLOWED and bench.decision.reason is Reason.FRONT
    assert bench.step(200).v == pytest.approx(gentle, abs=1e-6)


def test_who_creeps_up_to_an_obstacle_stops_within_a_centimetre():
    bench = Bench().driving(0.1)
    see(bench, 'F', 0.12)
    speeds = [0.1]
    while speeds[-1] > 0.0:
        speeds.append(bench.step().v)
        assert (bench.decision.state, bench.decision.reason) == (State.BLOCKED, Reason.FRONT)
        assert speeds[-1] >= speeds[-2] - 0.8 * DT - 1e-12
    assert sum(speeds) * DT < 0.01


def test_who_creeps_up_to_an_obstacle_and_is_asked_back_is_slowed_within_the_jerk_limit():
    bench = Bench().driving(0.1)
    see(bench, 'F', 0.12)
    assert bench.zones.scale(0.1, 0.0)[0] == 0.0
    assert bench.ask(-0.2).step().v >= 0.1 - 0.8 * DT * DT - 1e-12


def test_a_command_into_an_obstacle_ends_another_motion_within_the_jerk_limit():
    bench = Bench().driving(0.4)
    see(bench, 'B', 0.12)
    assert bench.ask(-0.2).step().v >= 0.4 - 0.8 * DT * DT - 1e-12


def test_what_is_in_the_way_of_the_present_motion_counts_though_another_is_asked():
    bench = Bench().driving(0.4)
    see(bench, 'F', 0.3)
    assert bench.ask(-0.2).step() == Decision(pytest.approx(0.4 - 1.5 * DT), 0.0, State.BRAKING, Reason.FRONT, False)


def test_after_a_hard_brake_for_an_obstacle_the_chair_sets_out_on_the_curve_that_it_is_to_drive():
    bench = Bench().driving(0.4)
    see(bench, 'F', 0.3)
    bench.ask(0.0)
    steps_to_rest(bench)
    bench.ask(-0.2, 0.16)
    curves = [abs(bench.decision.w / bench.decision.v) for _ in range(8) if bench.step().v < 0.0]
    assert len(curves) == 8 and max(curves) < 1.15 * 0.16 / 0.2


@pytest.mark.parametrize('distance, kept', [(0.5, True), (math.inf, False)])
def test_near_an_obstacle_the_chair_sets_out_on_the_curve_that_it_is_to_drive(distance, kept):
    bench = Bench(start=0.0)
    bench.ask(0.0).step()
    see(bench, 'F', distance)
    bench.ask(0.4, 0.32)
    assert (bench.zones.scale(0.4, 0.32)[0] < 1.0) is kept
    curves = [bench.decision.w / bench.decision.v for _ in range(8) if bench.step().v > 0.0]
    assert len(curves) == 8 and (max(curves) < 1.15 * 0.32 / 0.4) is kept


@pytest.mark.parametrize('pause, kept', [(40, True), (60, False)])
def test_for_a_second_after_it_was_slowed_too(pause, kept):
    bench = Bench()
    bench.ask(0.0).step()
    see(bench, 'F', 0.25)
    bench.ask(0.2).step()
    bench.ask(0.0).step(pause)
    see(bench, 'F', math.inf)
    bench.ask(0.4, 0.32)
    curves = [bench.decision.w / bench.decision.v for _ in range(5) if bench.step().v > 0.0]
    assert len(curves) == 5 and (max(curves) < 1.15 * 0.32 / 0.4) is kept


def test_patience_lasts_as_long_as_it_says():
    def until(*blocked, patience=0.125):
        gate = SafetyGate(CONFIG, Comfort(Profile()), Zones(ZONES, CautionConfig(patience=patience)))
        gave_up = [gate._out_of_patience(0.0625, stands, stands) for stands in blocked]
        return gave_up.index(True) + 1 if True in gave_up else None

    assert until(True, True, True) == 2 and until(True, True, True, True, patience=0.15) == 3
    assert until(False, False, False, True, True, True) == 5
    assert until(True, False, True, True) == 4 and until(*10 * [True], patience=0.0) is None
    assert until(*40 * [True], patience=2.0) == 32


def test_a_hard_brake_for_an_obstacle_is_forgotten_by_a_loss():
    bench = Bench().driving(0.4)
    see(bench, 'F', 0.4)
    bench.step()
    bench.changed = {'imu': -math.inf}
    steps_to_rest(bench)
    bench.changed = {}
    bench.ask(0.0).step()
    see(bench, 'F', 0.6)
    assert bench.ask(0.1).step(60).state is State.DRIVING


def test_late_commands_near_an_obstacle():
    bench = Bench().driving(0.2)
    see(bench, 'F', 0.7)
    bench.silence()
    assert bench.step(14).state is State.FADING


# -- pauses of the gate itself
# ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('pause', 'timeout', 'left'), [(0.2, 0.25, 0.4), (0.35, 0.25, 0.25), (0.6, 0.25, 0.0), (0.6, 0.0, 0.4)]
)
def test_after_a_pause_it_goes_on_from_the_speed_that_wheels_without_commands_have_left(pause, timeout, left):
    bench = Bench(dataclasses.replace(CONFIG, wheels_timeout=timeout)).driving(0.4)
    decision = bench.step(dt=pause)
    assert decision.state is State.DRIVING
    assert left <= decision.v <= left + bench.comfort.profile.jerk * LONGEST_STEP**2 + 1e-9


def test_after_a_pause_as_long_as_the_wheels_wait_it_goes_on_as_it_did():
    def speed(timeout):
        bench = Bench(dataclasses.replace(CONFIG, wheels_timeout=timeout))
        bench.ask(0.0).step(dt=1 / 64)
        bench.ask(0.8).step(32, dt=1 / 64)
        return bench.step(dt=0.25).v

    assert speed(0.25) == speed(0.0) > 0.0


# -- the required times, with wheels of a lag of 0.1 s ----------------------------------------------------------


@given(
    st.floats(0.06, 0.8),
    st.floats(-0.4, 0.4),
    st.sampled_from(['stop', 'impact', 'bus', 'encoders', 'imu', 'ranges', 'localization']),
    st.integers(0, 30),
)
@settings(max_examples=40)
def test_at_rest_in_time(v, w, hazard, phase):
    limit = {'stop': 0.05, 'impact': 0.2, 'bus': 0.25, 'encoders': 0.3, 'imu': 0.5, 'ranges': 0.6, 'localization': 0.6}[
        hazard
    ]
    bench = Bench()
    bench.ask(0.0).step()
    bench.ask(v, w).step(400 + phase)
    start = speed = bench.decision.v
    happened = bench.t
    if hazard == 'stop':
        bench.gate.emergency_stop(True)
    bench.changed = {'impact': True} if hazard == 'impact' else {} if hazard == 'stop' else {hazard: bench.t}
    end = happened
    while bench.t < happened + 3.0:
        bench.step()
        for _ in range(20):
            speed += (bench.decision.v - speed) * (1.0 - math.exp(-0.001 / 0.1))
        if abs(speed) >= 0.05:
            end = bench.t
    assert end - happened <= limit + start / 1.5 + 0.25 - 0.05  # 0.05 s are left for the bus
    assert bench.decision.v == 0.0 and bench.decision.state in (State.HELD,)


# -- what mutation testing asked for
# --------------------------------------------------------------------------------------


def test_nothing_is_taken_as_heard_that_was_not():
    never = -math.inf
    inputs = Inputs()
    assert (inputs.bus, inputs.encoders, inputs.imu, inputs.ranges, inputs.localization) == (never,) * 5
    assert (inputs.fault, inputs.impact, inputs.pc_drives, inputs.source) == (None, False, None, '') and math.isnan(
        inputs.speed
    )


def test_a_limit_that_falls_is_followed_closely():
    bench = Bench().driving(0.6)
    lags = []
    for tick in range(150):
        distance = 1.5 - 0.008 * tick
        if distance > 0.4:
            see(bench, 'F', distance)
            bench.step()
            lags.append(bench.decision.v - 0.6 * bench.zones.scale(0.6, 0.0)[0])
    assert bench.decision.state is State.SLOWED and abs(lags[-1]) < 0.02
    free = Bench().driving(0.6)
    speeds = [free.ask(0.3).step().v for _ in range(200)]
    assert min(speeds) > 0.28 and speeds[-1] == 0.3


def test_steps_of_no_length_between_others_do_not_put_off_giving_up():
    bench = Bench().ask(0.4)
    for _ in range(60):
        bench.step()
        bench.step(dt=0.0)
    assert len(bench.give_ups) == 1


def test_a_command_of_the_very_moment_the_chair_became_ready_counts():
    bench = Bench()
    bench.ask(0.0).step()
    bench.command = Command(0.4, 0.0, bench.t)
    assert bench.step().v > 0.0


@pytest.mark.parametrize('data', [Command(0.0, 0.0, 0.0), Inputs(), Decision(0.0, 0.0, State.IDLE, None, False)])
def test_what_travels_cannot_be_changed_on_the_way(data):
    for name in data._fields if isinstance(data, tuple) else [field.name for field in dataclasses.fields(data)]:
        with pytest.raises(AttributeError):
            setattr(data, name, 1.0)


def test_a_second_is_a_second_soon_after_the_clock_began():
    bench = Bench(start=0.3).ask(0.4)
    bench.step(45)
    assert not bench.give_ups
    bench.step(8)
    assert len(bench.give_ups) == 1


@pytest.mark.parametrize('back', [0.01, 0.5, 0.99])
def test_a_clock_that_is_set_back_a_little_is_set_back(back):
    assert Bench().driving().step(dt=-back).reason is Reason.CLOCK


def test_the_second_is_over_when_it_is_over():
    bench = Bench(start=1.0).ask(0.4)
    bench.step(3, dt=0.5)
    assert bench.give_ups == [2.5]


def test_the_ends_of_what_is_recent_belong_to_it():
    assert _recent(0.5, 0.0, 0.5) and not _recent(0.5, -1e-9, 0.5)
    assert _recent(0.0, 0.1, 0.5) and not _recent(0.0, 0.1 + 1e-9, 0.5)
