"""Simulated time waits for the PC's answers however slow its machine is, and does not wait for a dead PC for ever."""

from hypothesis import given, settings
from hypothesis import strategies as st

from sara_sim.bus.pacing import (
    MAX_LAG_STEPS,
    OVERDUE_S,
    PATIENCE_S,
    PROMPT_S,
    STEADY,
    Pacer,
    Patience,
    Speedometer,
)

STEP = 0.01


STAGES = 3  # programs of the PC through which a frame's answer goes: a controller, and the adapter's node twice


class Bench:
    """The simulator's loop with a PC of STAGES programs one behind the other.

    Each works for `delay()` s of the wall clock at what is newest when it begins. The first begins every `period` s of
    simulated time, the last one commands. `ages`: how much older than its newest answer each step is, s simulated.
    """

    def __init__(self, speed, delay, period=0.02):
        self.now, self.ticks = 100.0, 0
        self.pacer, self.patience = Pacer(STEP / speed, self.now), Patience()
        self.delay, self.period = delay, round(period / STEP)
        self.inputs, self.work = [0] * STAGES, [None] * STAGES
        self.answered, self.ages = 0, []

    @property
    def simulated(self):
        return self.ticks * STEP

    def run(self, wall):
        end = self.now + wall
        while self.now < end:
            if self.delay:
                self._work()
            if self.pacer.wait(self.now) > 0.0 or self.patience.waiting(self.simulated, 0, self.now):
                self.now += 0.0005
                continue
            self.ticks += 1
            if self.ticks % self.period == 0:
                self.inputs[0] = self.ticks
            self.ages.append(self.simulated - self.answered * STEP)
            self.patience.stepped(self.simulated, self.now)
            self.pacer.stepped(self.now, self.patience.step_takes(STEP, self.now))
        return self

    def _work(self):
        for stage in reversed(range(STAGES)):
            if self.work[stage] and self.work[stage][0] <= self.now:
                done = self.work[stage][1]
                self.work[stage] = None
                if stage + 1 < STAGES:
                    self.inputs[stage + 1] = done
                else:
                    self.answered = done
                    self.patience.commanded(self.simulated, self.now)
            if self.work[stage] is None and self.inputs[stage]:
                self.work[stage] = self.now + self.delay(), self.inputs[stage]
                self.inputs[stage] = 0


@settings(max_examples=20)
@given(st.floats(0.5, 10.0), st.lists(st.floats(0.0, 0.3), min_size=1, max_size=20))
def test_on_no_machine_is_time_far_ahead_of_the_answers(speed, delays):
    turn = iter(range(10**9))
    bench = Bench(speed, lambda: delays[next(turn) % len(delays)])
    while not bench.answered:
        bench.run(0.1)
    bench.run(2.0)  # what was under way when the first command came
    bench.ages.clear()
    bench.run(10.0)
    # Every program may hold one answer back, each for one period and the patience.
    assert max(bench.ages) <= STAGES * (0.02 + OVERDUE_S)
    assert not bench.patience.failed


def test_a_fast_pc_gets_the_speed_that_was_asked_for():
    for speed in (0.5, 1.0, 3.0, 10.0):
        bench = Bench(speed, lambda: 0.0).run(5.0)
        assert abs(bench.simulated / 5.0 / speed - 1.0) < 0.05, speed
        assert bench.patience.waits == 0


def test_a_pc_ten_times_too_slow_slows_time_and_nothing_else():
    bench = Bench(10.0, lambda: 0.02).run(10.0)
    assert 0.5 < bench.simulated / 10.0 < 3.0
    assert not bench.patience.failed


def test_who_never_commanded_is_not_waited_for():
    assert not Patience().waiting(100.0, 0, 0.0)


def test_a_late_pc_is_waited_for_until_it_commands():
    patience = Patience()
    patience.commanded(1.0, 9.0)
    assert not patience.waiting(1.0 + 0.9 * OVERDUE_S, 0, 10.0)
    assert patience.waiting(1.0 + OVERDUE_S, 0, 10.0)
    assert patience.waiting(1.0 + OVERDUE_S, 0, 10.0 + 0.9 * PATIENCE_S)
    patience.commanded(1.0 + OVERDUE_S, 10.0 + 0.9 * PATIENCE_S)
    assert not patience.waiting(1.0 + OVERDUE_S, 0, 10.0 + 0.9 * PATIENCE_S)
    assert patience.waits == 1 and abs(patience.waited - 0.9 * PATIENCE_S) < 1e-9


def test_a_dead_pc_is_given_up_once_and_time_goes_on_no_faster_than_real():
    bench = Bench(3.0, lambda: 0.001).run(2.0)
    bench.delay = None
    bench.run(PATIENCE_S + 0.2)
    assert bench.patience.failed
    simulated = bench.simulated
    bench.run(5.0)
    assert 4.7 < bench.simulated - simulated <= 5.0 + STEP
    assert bench.patience.waits == 1


def test_a_pc_that_comes_back_is_waited_for_again():
    bench = Bench(3.0, lambda: 0.001).run(2.0)
    bench.delay = None
    bench.run(PATIENCE_S + 1.0)
    bench.delay = lambda: 0.001
    bench.run(1.0 + STEADY * PROMPT_S)
    assert not bench.patience.failed
    bench.delay = None
    before = bench.simulated
    bench.run(0.9 * PATIENCE_S)
    assert bench.simulated - before < OVERDUE_S + 2 * bench.period * STEP


def test_who_commands_too_seldom_costs_one_wait_and_then_real_time():
    bench = Bench(3.0, lambda: 0.001, period=0.1).run(PATIENCE_S + 10.0)
    assert bench.patience.waits == 1
    assert 9.0 < bench.simulated < 11.0


def test_frames_that_are_not_read_are_waited_for_and_not_for_ever():
    patience = Patience()
    assert patience.waiting(1.0, 20, 10.0) and not patience.waiting(1.0, 0, 10.1)
    assert patience.waiting(2.0, 20, 20.0)
    assert not patience.waiting(2.0, 20, 20.0 + PATIENCE_S) and not patience.waiting(3.0, 60, 21.0 + PATIENCE_S)
    assert not patience.failed, 'who never commands cannot cease to'
    assert not patience.waiting(4.0, 0, 30.0) and patience.waiting(5.0, 20, 31.0), 'who reads again is waited for again'


def test_an_adapter_that_is_closed_is_forgotten():
    patience = Patience()
    patience.commanded(1.0, 9.0)
    patience.forget()
    assert not patience.waiting(5.0, 0, 10.0)


@given(st.floats(0.5, 20.0), st.lists(st.floats(0.0, 3.0), min_size=1, max_size=50))
def test_lost_time_is_given_up_and_not_caught_up_in_a_burst(speed, delays):
    pacer, now = Pacer(STEP / speed, 0.0), 0.0
    for delay in delays:
        now += max(pacer.wait(now), delay)
        pacer.stepped(now)
        burst = 0
        while pacer.wait(now) == 0.0:
            pacer.stepped(now)
            burst += 1
        assert burst <= MAX_LAG_STEPS + 1


@given(st.floats(0.1, 20.0))
def test_the_speed_reached_is_that_of_the_last_seconds(speed):
    meter = Speedometer(window=5.0)
    assert meter.speed == 0.0 and not meter.full
    simulated = now = 0.0
    for rate in (7.0, speed):
        for _ in range(12):
            meter.mark(simulated, now)
            simulated, now = simulated + rate, now + 1.0
    assert meter.full
    assert abs(meter.speed - speed) < 1e-9 * speed + 1e-9
