"""Nothing old moves the chair: beats, ages, repetitions, and exactly one zero."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from sara_hmi.config.config import FreshnessConfig
from sara_hmi.freshness.freshness import LATE, LIFT, USED, ZERO, Freshness

CONFIG = FreshnessConfig(beat_s=0.05, oldest_s=0.2, repeat_s=0.05, hold_s=0.125, lift_s=0.5)
EXACT = FreshnessConfig(
    beat_s=0.0625, oldest_s=0.25, repeat_s=0.0625, hold_s=0.125, lift_s=0.5
)  # sums without rounding
AHEAD = (0.5, -0.25)


@pytest.fixture(name='fresh')
def begun():
    """A Freshness that has sent beat 1 at 0 s."""
    fresh = Freshness(EXACT)
    assert fresh.beat(0.0) == 1
    return fresh


def test_a_fresh_command_is_passed_on_at_once_and_repeated_until_one_zero(fresh):
    assert fresh.drive(0.0, 1, 1, AHEAD) == (AHEAD, '')
    assert fresh.moving
    assert fresh.step(0.0625 - 1 / 1024) is None
    assert fresh.step(0.0625) == AHEAD
    assert fresh.step(0.125 - 1 / 1024) is None
    assert fresh.step(0.125) == ZERO
    assert not fresh.moving
    assert fresh.step(0.25) is None and fresh.step(9.0) is None


def test_a_look_at_the_very_moment_and_one_that_is_late(fresh):
    assert ZERO == (0.0, 0.0)
    fresh.drive(0.0, 1, 1, AHEAD)
    assert fresh.step(0.0) is None and fresh.moving
    assert fresh.step(0.09375) == AHEAD
    assert fresh.step(0.125) == ZERO


def test_old_beats_are_forgotten_and_none_too_early(fresh):
    fresh.beat(0.25)
    assert fresh.drive(0.25, 1, 1, AHEAD) == (AHEAD, '')
    for k in range(5, 500):
        fresh.beat(k * 0.0625)
    assert len(fresh._sent) <= 5


def test_a_silence_of_many_times_its_beginning(fresh):
    fresh.drive(0.0, 1, 1, AHEAD)
    fresh.step(1.0)
    number = fresh.beat(3.0)
    assert fresh.drive(3.0, 2, number, AHEAD) == (None, LIFT)


def test_a_new_command_postpones_repetition_and_end(fresh):
    fresh.drive(0.0, 1, 1, AHEAD)
    assert fresh.drive(0.03125, 2, 1, (0.25, 0.0)) == ((0.25, 0.0), '')
    assert fresh.step(0.0625) is None
    assert fresh.step(0.09375) == (0.25, 0.0)
    assert fresh.step(0.140625) is None
    assert fresh.step(0.15625) == ZERO


def test_no_command_is_published_when_it_is_too_old(fresh):
    assert fresh.drive(0.1875, 1, 1, AHEAD) == (AHEAD, '')  # its beat is 0.1875 s old
    assert fresh.step(0.25 - 1 / 1024) is None
    assert fresh.step(0.25) == ZERO  # before hold_s is over


@pytest.mark.parametrize('age, why', [(0.25, ''), (0.25 + 1 / 1024, LATE), (5.0, LATE)])
def test_the_age_is_that_of_the_beat(fresh, age, why):
    assert fresh.drive(age, 1, 1, AHEAD) == (None if why else AHEAD, why)
    assert fresh.moving is not bool(why)


def test_a_clock_that_goes_back_stops(fresh):
    fresh.beat(5.0)
    assert fresh.drive(4.9, 1, 2, AHEAD) == (None, LATE)
    fresh.drive(5.0, 2, 2, AHEAD)
    assert fresh.step(4.9) == ZERO


@pytest.mark.parametrize('beat', [0, 2, 10**9])
def test_beats_that_were_never_sent_count_for_nothing(fresh, beat):
    assert fresh.drive(0.0, 1, beat, AHEAD) == (None, LATE)


def test_a_number_counts_once_and_only_upwards(fresh):
    assert fresh.drive(0.0, 0, 1, AHEAD) == (AHEAD, '')
    assert fresh.drive(0.0, 0, 1, (1.0, 0.0)) == (None, USED)
    assert fresh.drive(0.0, 7, 1, AHEAD) == (AHEAD, '')
    assert fresh.drive(0.0, 6, 1, AHEAD) == (None, USED)
    assert fresh.drive(0.0, 8, 1, AHEAD) == (AHEAD, '')


def test_a_refused_command_uses_its_number_and_leaves_the_newest_as_it_is(fresh):
    fresh.drive(0.0, 1, 1, AHEAD)
    assert fresh.drive(0.0, 5, 99, (1.0, 1.0)) == (None, LATE)
    assert fresh.drive(0.0, 4, 1, (1.0, 1.0)) == (None, USED)
    assert fresh.step(0.0625) == AHEAD


def test_halt_is_one_zero_at_once(fresh):
    assert fresh.halt(1) is None
    fresh.drive(0.0, 2, 1, AHEAD)
    assert fresh.halt(3) == ZERO
    assert fresh.halt(4) is None
    assert fresh.step(0.0625) is None
    assert fresh.drive(0.0, 4, 1, AHEAD) == (None, USED)
    assert fresh.drive(0.0, 5, 1, AHEAD) == (AHEAD, '')


def test_halt_is_obeyed_whatever_its_number(fresh):
    fresh.drive(0.0, 9, 1, AHEAD)
    assert fresh.halt(2) == ZERO
    assert fresh.drive(0.0, 9, 1, AHEAD) == (None, USED)
    assert fresh.drive(0.0, 10, 1, AHEAD) == (AHEAD, '')


def test_a_motion_of_zero_is_a_halt_of_any_age(fresh):
    fresh.drive(0.0, 1, 1, AHEAD)
    assert fresh.drive(0.0, 2, 99, ZERO) == (ZERO, '')
    assert fresh.drive(0.0, 3, 99, ZERO) == (None, '')
    assert fresh.drive(0.0, 3, 1, ZERO) == (None, USED)


def test_one_speed_alone_is_a_motion(fresh):
    assert fresh.drive(0.0, 1, 1, (0.0, 0.5)) == ((0.0, 0.5), '')
    assert fresh.drive(0.0, 2, 1, (0.5, 0.0)) == ((0.5, 0.0), '')


@pytest.mark.parametrize('silence, why', [(0.5, ''), (0.5 + 1 / 1024, LIFT)])
def test_after_a_long_silence_the_finger_must_be_lifted(fresh, silence, why):
    fresh.drive(0.0, 1, 1, AHEAD)
    assert fresh.step(1.0) == ZERO  # silent since
    number = fresh.beat(1.0 + silence)
    assert fresh.drive(1.0 + silence, 2, number, AHEAD) == (None if why else AHEAD, why)
    if why:
        assert fresh.drive(1.0 + silence, 3, number, AHEAD) == (None, LIFT)
        assert fresh.halt(4) is None
        assert fresh.drive(1.0 + silence, 5, number, AHEAD) == (AHEAD, '')


def test_a_silence_that_ended_is_forgotten(fresh):
    fresh.drive(0.0, 1, 1, AHEAD)
    fresh.step(0.25)
    number = fresh.beat(0.5)
    assert fresh.drive(0.5, 2, number, AHEAD) == (AHEAD, '')
    number = fresh.beat(0.875)
    assert fresh.drive(0.875, 3, number, AHEAD) == (AHEAD, '')


def test_who_lifted_the_finger_may_wait(fresh):
    fresh.drive(0.0, 1, 1, AHEAD)
    fresh.halt(2)
    number = fresh.beat(100.0)
    assert fresh.drive(100.0, 3, number, AHEAD) == (AHEAD, '')


def test_stop_is_one_zero(fresh):
    assert fresh.stop() is None
    fresh.drive(0.0, 1, 1, AHEAD)
    assert fresh.stop() == ZERO
    assert fresh.stop() is None


def test_beats_come_every_beat_s_and_not_in_a_heap_after_a_pause():
    fresh = Freshness(EXACT, first=40)
    assert fresh.next_beat == 40
    assert [fresh.beat(k / 64) for k in range(9)] == [40, None, None, None, 41, None, None, None, 42]
    assert fresh.next_beat == 43
    assert fresh.beat(3.0) == 43
    assert fresh.beat(3.03125) is None
    assert fresh.beat(3.0625) == 44


def test_a_beat_that_is_a_little_late_does_not_delay_the_next():
    fresh = Freshness(EXACT)
    fresh.beat(0.0)
    assert fresh.beat(0.0625 + 1 / 64) == 2
    assert fresh.beat(0.125) == 3
    assert fresh.beat(0.1875 + 0.0625) == 4  # a whole beat late: counted from now
    assert fresh.beat(0.25 + 1 / 64) is None
    assert fresh.beat(0.3125) == 5


def test_due_names_the_next_moment(fresh):
    assert Freshness(EXACT).due(3.0) == 3.0
    assert fresh.due(0.0) == 0.0625
    assert fresh.due(1.0) == 1.0
    fresh.beat(0.0625)
    fresh.drive(0.0625 + 1 / 64, 1, 1, AHEAD)
    assert fresh.due(0.078125) == 0.125  # the beat
    fresh.beat(0.125)
    assert fresh.due(0.125) == 0.0625 + 1 / 64 + 0.0625  # the repetition
    fresh.drive(0.140625, 2, 2, AHEAD)
    fresh.step(0.140625 + 0.0625)
    assert fresh.due(0.2) == 0.2
    fresh = Freshness(FreshnessConfig(beat_s=0.2, oldest_s=0.25, repeat_s=0.2, hold_s=0.0625))
    fresh.beat(0.0)
    fresh.drive(0.0, 1, 1, AHEAD)
    assert fresh.due(0.0) == 0.0625  # the end


@settings(max_examples=50)
@given(st.lists(st.floats(0.0, 0.08), min_size=1, max_size=60))
def test_whoever_calls_when_due_publishes_at_20_hz_and_ends_in_time(pauses):
    """Called exactly when `due` says, repetitions are never late, and the end comes on time."""
    fresh, t, out = Freshness(CONFIG), 0.0, []
    number = fresh.beat(t)
    for seq, pause in enumerate(pauses, 1):
        end = t + pause
        while fresh.due(t) <= end:
            t = fresh.due(t)
            number = fresh.beat(t) or number
            motion = fresh.step(t)
            if motion:
                out.append((t, motion))
        t = end
        motion, why = fresh.drive(t, seq, number, AHEAD)
        assert not why
        out.append((t, motion))
    while fresh.moving:
        t = fresh.due(t)
        fresh.beat(t)
        motion = fresh.step(t)
        if motion:
            out.append((t, motion))
    assert all(later[0] - earlier[0] <= 0.05 + 1e-9 for earlier, later in zip(out, out[1:]))
    assert [motion for _, motion in out].count(ZERO) == 1 and out[-1][1] == ZERO


class Machine(RuleBasedStateMachine):
    """Beats, commands of any age and number, pauses: what is published is never too old, and each motion ends in one
    zero.
    """

    @initialize(first=st.integers(1, 10**6))
    def begin(self, first):
        self.t, self.fresh, self.sent = 0.0, Freshness(CONFIG, first), {}
        self.seq, self.command_sent, self.came, self.moving = -1, None, None, False

    def published(self, motion):
        """Laws of every publication."""
        if motion is None:
            return
        if motion == ZERO:
            assert self.moving, 'a second zero'
            self.moving = False
            return
        assert self.t - self.command_sent <= CONFIG.oldest_s
        assert self.t - self.came < CONFIG.hold_s
        self.moving = True

    @rule(pause=st.floats(0.0, 0.3))
    def wait(self, pause):
        self.t += pause

    @rule()
    def beat(self):
        number = self.fresh.beat(self.t)
        if number is not None:
            assert number not in self.sent
            self.sent[number] = self.t

    @rule()
    def step(self):
        self.published(self.fresh.step(self.t))

    @rule(data=st.data(), v=st.floats(-1.0, 1.0), w=st.floats(-1.0, 1.0), seq=st.integers(-3, 3))
    def drive(self, data, v, w, seq):
        number = data.draw(st.sampled_from([*self.sent, -1, 10**9]))
        number_was, self.seq = self.seq, max(self.seq, self.seq + seq)
        motion, why = self.fresh.drive(self.t, number_was + seq, number, (v, w))
        if why:
            assert motion is None
            if why == LATE:
                assert not self.t - self.sent.get(number, -math.inf) <= CONFIG.oldest_s
            return
        assert seq > 0
        if (v, w) != ZERO:
            self.command_sent, self.came = self.sent[number], self.t
            assert motion == (v, w)
        self.published(motion)

    @rule(seq=st.integers(0, 5))
    def halt(self, seq):
        self.seq = max(self.seq, seq)
        self.published(self.fresh.halt(seq))
        assert not self.moving

    @precondition(lambda self: self.moving)
    @rule()
    def stop(self):
        self.published(self.fresh.stop())
        assert not self.moving

    @invariant()
    def agrees(self):
        assert self.fresh.moving == self.moving
        assert self.fresh.due(self.t) >= self.t


TestMachine = Machine.TestCase
TestMachine.settings = settings(max_examples=60, stateful_step_count=40)
