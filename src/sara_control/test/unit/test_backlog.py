"""What is late after a pause of the gate's own process, and what really does not come."""

import math

import pytest

from sara_common.platforms import load, parameters
from sara_control.gate.backlog import CATCH_UP, Backlog
from sara_control.gate.gate_config import SafetyConfig
from sara_control.gate.guard import Guard
from sara_control.gate.reasons import Reason, State

PERIOD = 0.02


def cycles(backlog, late, start, seconds, period=PERIOD):
    """What it says in each cycle of so many seconds."""
    return [backlog.explains(start + period * i, late) for i in range(round(seconds / period))]


@pytest.fixture
def backlog():
    one = Backlog(PERIOD)
    assert not any(cycles(one, False, 0.0, 1.0))
    return one


def test_what_is_late_after_a_pause_has_a_while_to_be_handled(backlog):
    said = cycles(backlog, True, 1.3, 1.0)
    assert all(said[:12]) and not any(said[13:])


def test_it_may_become_late_in_a_later_cycle_for_the_clock_is_handled_in_pieces(backlog):
    assert not backlog.explains(1.3, False)
    assert backlog.explains(1.32, True)
    assert not backlog.explains(1.34, False)


def test_without_a_pause_what_is_late_is_late(backlog):
    assert not any(cycles(backlog, True, 1.0, 1.0))


def test_what_was_late_before_the_pause_is_not_excused_by_it(backlog):
    cycles(backlog, True, 1.0, 0.5)
    assert not any(cycles(backlog, True, 1.8, 1.0))


@pytest.mark.parametrize('period', [0.06, 0.12, 0.3, 0.49])
def test_a_process_that_pauses_all_the_time_still_notices(backlog, period):
    said = cycles(backlog, True, 1.3, 5.0, period)
    assert sum(said) * period <= CATCH_UP + period and not any(said[5:])


@pytest.mark.parametrize(
    ('pause', 'excused'), [(0.04, False), (0.05, False), (0.06, True), (0.5, True), (0.51, False), (60.0, False)]
)
@pytest.mark.parametrize('start', [0.0, -60.0])
def test_pauses_of_0_05_to_0_5_s_excuse(pause, excused, start):
    backlog = Backlog(PERIOD)
    backlog.explains(start, False)
    assert backlog.explains(start + pause, True) is excused


def test_what_is_a_pause_depends_on_the_gates_own_rate():
    backlog = Backlog(0.1)
    backlog.explains(0.0, False)
    assert not backlog.explains(0.25, True)
    backlog.explains(0.3, False)
    assert backlog.explains(0.56, True)


def test_a_short_pause_after_a_long_one_excuses_again(backlog):
    assert not backlog.explains(11.0, False) and not backlog.explains(11.02, False)
    assert backlog.explains(11.2, True)


def test_for_less_than_0_25_s():
    backlog = Backlog(PERIOD)
    backlog.explains(-0.3, False)
    assert backlog.explains(0.0, True) and backlog.explains(0.24, True) and not backlog.explains(0.25, True)


def test_the_first_cycle_of_a_process_is_no_pause():
    assert not Backlog(PERIOD).explains(100.0, True)


class Driven:
    """A gate without sonars that drives ahead; only `told` names come."""

    def __init__(self):
        params = parameters('sara_control', 'safety.yaml', load('sara'))
        params['gate'].update(range_timeout=0.0)
        self.guard, self.t, self.angle = Guard(SafetyConfig.from_params(params)), 50.0, 0.0
        self.guard.on_mode(self.t, 3)
        self.guard.on_source('navigation')

    def hear(self, command=0.3):
        guard, t = self.guard, self.t
        if command is not None:
            guard.on_command(t, command, 0.0)
        for wheel in (0, 1):
            steps = round(self.angle / math.tau * guard.config.plausibility.steps_per_turn)
            guard.on_encoder(t, wheel, steps, round(t * 1e4))
        guard.on_imu(t, (0.0, 0.0, 0.0))
        guard.on_localization(t, 0.0, 0.0)

    def run(self, seconds, hears=True, backlog=False, command=0.3):
        for _ in range(round(seconds / PERIOD)):
            self.t += PERIOD
            if hears:
                self.hear(command)
            decision = self.guard.step(self.t, backlog)
            self.angle += decision.v / self.guard.config.plausibility.wheel_radius * PERIOD
        return decision


def ready():
    """One that has seen a zero, which arms it."""
    one = Driven()
    one.run(1.0, command=0.0)
    return one


def test_the_gate_drives_on_while_what_came_is_not_handled_yet():
    one = ready()
    before = one.run(2.0)
    assert before.state is State.DRIVING and before.v > 0.25
    one.t += 0.5
    assert one.guard.late(one.t)
    after = one.run(0.2, hears=False, backlog=True)
    assert after.state is State.DRIVING and after.v >= before.v and not after.give_up
    assert one.run(0.1).state is State.DRIVING


def test_and_brakes_at_once_when_it_does_not_come():
    one = ready()
    one.run(2.0)
    one.t += 0.5
    one.run(0.2, hears=False, backlog=True)
    decision = one.run(PERIOD, hears=False)
    assert (decision.state, decision.reason, decision.give_up) == (State.BRAKING, Reason.BUS, True)


def test_a_backlog_hides_no_hazard():
    one = ready()
    one.run(2.0)
    one.guard.on_emergency_stop(True)
    assert one.run(PERIOD, hears=False, backlog=True).reason is Reason.EMERGENCY_STOP


def test_what_never_came_is_missing_all_the_same():
    one = Driven()
    decision = one.run(PERIOD, hears=False, backlog=True)
    assert (decision.state, decision.reason) == (State.HELD, Reason.ENCODERS)


def test_a_command_that_was_void_stays_void():
    one = ready()
    one.run(2.0)
    one.guard.on_emergency_stop(True)
    one.run(0.5)
    one.guard.on_emergency_stop(False)
    one.run(1.5, command=None)
    assert one.guard.reset()[0]
    assert one.run(PERIOD, command=None).state is State.IDLE
    assert one.run(1.0, command=None, backlog=True).v == 0.0
    assert one.run(1.0).v > 0.1
