"""Publishing at a rate: never more, in the mean as much, whatever the clock does."""

from hypothesis import given
from hypothesis import strategies as st

from sara_control.wheels.pacer import Pacer


@given(st.floats(1.0, 90.0), st.floats(0.0, 0.003))
def test_out_of_a_hundred_a_second_come_as_many_as_asked(rate, jitter):
    pacer = Pacer(rate)
    count = sum(pacer.due(0.01 * k + jitter * (k % 2)) for k in range(1001))
    assert 10.0 * rate - 2.0 <= count <= 10.0 * rate + 1.0


def test_the_first_comes_one_period_after_the_start():
    pacer = Pacer(10.0)
    assert [pacer.due(t) for t in (5.0, 5.05, 5.1)] == [False, False, True]


def test_slower_than_the_rate_everything_is_published():
    pacer = Pacer(50.0)
    assert [pacer.due(0.1 * k) for k in range(5)] == [False, True, True, True, True]


def test_never_at_rate_zero():
    assert not any(Pacer(0.0).due(t) for t in range(10))


def test_a_pause_is_not_made_up_for_and_a_clock_set_back_starts_anew():
    pacer = Pacer(10.0)
    assert sum(pacer.due(t) for t in (0.0, 100.0, 100.01, 100.02)) == 1
    assert [pacer.due(t) for t in (1.0, 1.1)] == [False, True]
