"""Simulated time does not run away from a busy PC, and does not wait for a dead one for ever."""

from hypothesis import given
from hypothesis import strategies as st

from sara_sim.bus.pacing import MAX_LAG_S, OVERDUE_S, PATIENCE_S, Pacer, Patience


def test_nobody_who_never_commanded_is_waited_for():
    assert not Patience().waiting(100.0, 0.0)


def test_a_late_pc_is_waited_for_until_it_commands():
    patience = Patience()
    patience.commanded(1.0)
    assert not patience.waiting(1.0 + 0.9 * OVERDUE_S, 10.0)
    assert patience.waiting(1.0 + OVERDUE_S, 10.0)
    assert patience.waiting(1.0 + OVERDUE_S, 10.0 + 0.9 * PATIENCE_S)
    patience.commanded(1.0 + OVERDUE_S)
    assert not patience.waiting(1.0 + OVERDUE_S, 10.0 + 0.9 * PATIENCE_S) and patience.waits == 1


def test_a_dead_pc_is_given_up_once():
    patience = Patience()
    patience.commanded(1.0)
    assert patience.waiting(1.1, 10.0)
    assert not any(patience.waiting(1.1 + 0.01 * step, 10.0 + PATIENCE_S + 0.01 * step) for step in range(1000))
    assert patience.waits == 1


def test_an_adapter_that_is_closed_is_forgotten():
    patience = Patience()
    patience.commanded(1.0)
    patience.forget()
    assert not patience.waiting(5.0, 10.0)


@given(st.lists(st.floats(0.0, 3.0), min_size=1, max_size=50))
def test_lost_time_is_given_up_and_not_caught_up_in_a_burst(delays):
    pacer, now = Pacer(0.005, 0.0), 0.0
    for delay in delays:
        now += max(pacer.wait(now), delay)
        pacer.stepped(now)
        burst = 0
        while pacer.wait(now) == 0.0:
            pacer.stepped(now)
            burst += 1
        assert burst <= MAX_LAG_S / 0.005 + 1
