"""What is late after a pause of the gate's own process, and what really does not come."""

import sys
from pathlib import Path

import pytest

from sara_control.gate.backlog import CATCH_UP, Backlog
from sara_control.gate.reasons import Reason, State

sys.path.append(str(Path(__file__).resolve().parent))
from test_guard import TICK, Chair, driving  # noqa: E402

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


def unheard(chair, seconds, steps=True):
    """The gate's last Decision while the chair drives on and its frames wait to be handled; steps: whether it steps."""
    for _ in range(round(seconds / TICK)):
        chair.t, chair.tick = chair.t + TICK, chair.tick + 1
        chair.told_at = chair.t
        chair.move()
        chair.talk()
        if steps and chair.tick % 2 == 0:
            chair.decision = chair.guard.step(chair.t, backlog=True)
    return chair.decision


@pytest.mark.parametrize('pause', [0.3, 0.5])
def test_the_gate_drives_on_while_what_came_is_not_handled_yet(pause):
    chair = driving(0, 0.3)
    before = unheard(chair, pause, steps=False)
    assert chair.guard.late(chair.t)
    left = max(before.v - 1.5 * (pause - 0.25), 0.0)  # the wheels brake by themselves from 0.25 s on
    after = unheard(chair, 0.2)
    assert after.state is State.DRIVING and after.v >= left and not after.give_up
    chair.states.clear()
    assert chair.run(0.5).states == {State.DRIVING}


def test_and_brakes_at_once_when_it_does_not_come():
    chair = driving(0, 0.3)
    unheard(chair, 0.5, steps=False)
    unheard(chair, 0.2)
    decision = chair.guard.step(chair.t + PERIOD)
    assert (decision.state, decision.reason, decision.give_up) == (State.BRAKING, Reason.BUS, True)


def test_a_backlog_hides_no_hazard():
    chair = driving(0, 0.3)
    chair.guard.on_emergency_stop(True)
    assert unheard(chair, PERIOD).reason is Reason.EMERGENCY_STOP


def test_what_never_came_is_missing_all_the_same():
    chair = Chair()
    chair.guard.on_mode(chair.t, 3)
    decision = unheard(chair, PERIOD)
    assert (decision.state, decision.reason) == (State.HELD, Reason.ENCODERS)


def test_a_command_that_was_void_stays_void():
    chair = driving(0, 0.3)
    chair.guard.on_emergency_stop(True)
    chair.run(0.5)
    chair.guard.on_emergency_stop(False)
    chair.command = None
    chair.run(1.5)
    assert chair.guard.reset()[0]
    assert chair.run(PERIOD).decision.state is State.IDLE
    assert unheard(chair, 1.0).v == 0.0
    chair.command = 0.3, 0.0
    assert chair.run(1.0).decision.v > 0.1
