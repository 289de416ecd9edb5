"""The CAN base: counters that wrap, frames that get lost, and commands whose mean is what was asked."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from canserial.reader.readings import LEFT, RIGHT, EncoderReading
from sara_control.wheels.can_base import CanBase

BUS = BusDescription.default()
WRAP = 2**32
STEP = math.tau / 64000


def pair(base, left, right, ticks, stamp=0.0, apart=0):
    first = base.on_encoder(EncoderReading(stamp, RIGHT, right % WRAP, ticks % WRAP))
    assert first is None
    return base.on_encoder(EncoderReading(stamp + 0.003, LEFT, left % WRAP, (ticks + apart) % WRAP))


@given(
    st.integers(0, WRAP - 1),
    st.integers(0, WRAP - 1),
    st.integers(0, WRAP - 1),
    st.lists(st.tuples(st.integers(-9000, 9000), st.integers(-9000, 9000), st.integers(900, 1100)), max_size=30),
)
def test_positions_are_the_sum_of_the_steps_across_every_wrap(left, right, ticks, moves):
    base = CanBase(BUS, 64000)
    assert pair(base, left, right, ticks)[:2] == (0.0, 0.0)
    start = left, right
    for d_left, d_right, dt in moves:
        left, right, ticks = left + d_left, right + d_right, ticks + dt
        wheels = pair(base, left, right, ticks, 7.0, apart=2)
        assert wheels.left == pytest.approx((left - start[0]) * STEP, abs=1e-9)
        assert wheels.right == pytest.approx((right - start[1]) * STEP, abs=1e-9)
        assert wheels.interval == pytest.approx(dt * 1e-4)
        assert wheels.stamp == 7.003
    assert not base.counters


def test_a_lost_frame_costs_its_pair_but_no_motion():
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, 0)
    assert base.on_encoder(EncoderReading(0.1, RIGHT, 100, 1000)) is None  # its left partner is lost
    wheels = pair(base, 200, 200, 2000)
    assert wheels[:2] == pytest.approx((200 * STEP, 200 * STEP)) and wheels.interval == pytest.approx(0.2)
    assert base.on_encoder(EncoderReading(0.3, LEFT, 300, 3000)) is None
    assert base.on_encoder(EncoderReading(0.4, RIGHT, 400, 4000)) is None
    assert base.counters['without_partner'] == 1
    assert base.on_encoder(EncoderReading(0.4, LEFT, 400, 4000)).left == pytest.approx(400 * STEP)


def test_repeated_frames_change_nothing():
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, 0)
    pair(base, 100, 100, 1000)
    assert pair(base, 100, 100, 1000) is None
    assert pair(base, 0, 0, 0) is None
    assert base.counters == {'repeated': 4}
    assert pair(base, 200, 200, 2000).left == pytest.approx(200 * STEP)


def test_a_motor_node_that_restarts_moves_nothing():
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, 500000)
    pair(base, 6400, 6400, 501000)
    assert pair(base, 0, 0, 10) is None
    assert pair(base, 64, 64, 1010).left == pytest.approx(6464 * STEP)
    assert base.counters['clock_restarted'] == 1


def test_readings_that_are_missing_are_counted_and_said():
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, 0)
    assert pair(base, 100, 100, 1000, apart=2).missed == 0.0
    wheels = pair(base, 400, 400, 4000)
    assert wheels.missed == pytest.approx(0.2) and wheels.unmeasured == 0.0
    assert base.counters['readings_lost'] == 2


def test_what_a_restart_hid_is_said_with_the_next_reading():
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, 500000, stamp=1.0)
    assert pair(base, 0, 0, 10, stamp=4.0) is None
    wheels = pair(base, 64, 64, 1010, stamp=4.1)
    assert wheels.unmeasured == pytest.approx(3.0) and wheels.interval == pytest.approx(0.1)
    assert pair(base, 128, 128, 2010, stamp=4.2).unmeasured == 0.0


def test_an_implausible_step_is_time_without_knowledge():
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, 0)
    wheels = pair(base, 1 << 24, 0, 1000)
    assert wheels.interval == 0.0 and wheels.unmeasured == pytest.approx(0.1)


def test_one_wheels_frame_that_comes_again_is_no_partner():
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, 0)
    pair(base, 100, 100, 1000)
    assert base.on_encoder(EncoderReading(0.2, RIGHT, 100, 1000)) is None
    assert pair(base, 200, 200, 2000).left == pytest.approx(200 * STEP)
    assert base.counters == {'repeated': 1}


@given(
    st.integers(0, WRAP - 1),
    st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans()), min_size=1, max_size=40),
    st.randoms(),
)
def test_whatever_is_lost_or_repeated_the_way_is_measured(ticks, fates, random):
    """Steady wheels; frames vanish or come twice, in any order of the wheels: positions stay those of the clock."""
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, ticks)
    for k, (right_lost, left_lost, twice) in enumerate(fates, 1):
        frames = [EncoderReading(0.1 * k, RIGHT, 128 * k % WRAP, (ticks + 1000 * k) % WRAP)] * (not right_lost)
        frames += [EncoderReading(0.1 * k, LEFT, 64 * k % WRAP, (ticks + 1000 * k + 3) % WRAP)] * (not left_lost)
        frames += frames * twice
        random.shuffle(frames)
        for frame in frames:
            wheels = base.on_encoder(frame)
            if wheels is not None:
                assert (wheels.left, wheels.right) == pytest.approx((64 * k * STEP, 128 * k * STEP))
    k += 1
    wheels = pair(base, 64 * k, 128 * k, ticks + 1000 * k, apart=3)
    assert (wheels.left, wheels.right) == pytest.approx((64 * k * STEP, 128 * k * STEP))


counts = st.integers(0, WRAP - 1) | st.integers(0, 3000)


@given(st.lists(st.tuples(st.sampled_from([RIGHT, LEFT, 2]), counts, counts), max_size=60))
def test_no_frames_make_a_wheel_faster_than_it_can_be(frames):
    base, last = CanBase(BUS, 64000, max_wheel_speed=20.0), None
    for k, (wheel, steps, ticks) in enumerate(frames):
        wheels = base.on_encoder(EncoderReading(0.05 * k, wheel, steps, ticks))
        if wheels is None:
            continue
        assert wheels.interval >= 0.0 and wheels.missed >= 0.0 and wheels.unmeasured >= 0.0
        if last is not None:
            assert abs(wheels.left - last.left) <= 20.0 * wheels.interval + 1e-9
            assert abs(wheels.right - last.right) <= 20.0 * wheels.interval + 1e-9
        last = wheels


def test_steps_that_no_wheel_can_make_are_not_believed():
    base = CanBase(BUS, 64000)
    pair(base, 0, 0, 0)
    assert pair(base, 1 << 24, 0, 1000).left == 0.0
    assert pair(base, (1 << 24) + 64, 0, 2000).left == pytest.approx(64 * STEP)
    assert base.counters['implausible_steps'] == 1


@given(st.floats(0.05, 7.0), st.sampled_from([-1, 1]))
def test_over_a_second_and_over_ten_the_mean_command_is_what_was_asked(speed, sign):
    base = CanBase(BUS, 64000)
    base.on_mode(3)
    sent = [BUS.decode(base.command(sign * speed, -sign * speed))[1] for _ in range(500)]
    for name, wanted in (('left', sign * speed), ('right', -sign * speed)):
        values = [command[name] for command in sent]
        for start in range(0, 500, 50):
            assert sum(values[start : start + 50]) / 50 == pytest.approx(wanted, abs=1.0 / (9.5 * 50) + 1e-9)
        assert sum(values) / 500 == pytest.approx(wanted, rel=0.01)


@given(st.lists(st.floats(0.05, 7.0), min_size=10, max_size=10))
def test_the_mean_holds_for_speeds_that_change_too(changes):
    base = CanBase(BUS, 64000)
    speeds = [speed for speed in changes for _ in range(5)]
    base.on_mode(3)
    sent = [BUS.decode(base.command(speed, 1.0))[1]['left'] for speed in speeds]
    assert sum(sent) / 50 == pytest.approx(sum(speeds) / 50, abs=1.0 / (9.5 * 50) + 1e-9)


@given(st.floats(0.05, 7.0), st.sampled_from([-1, 1]), st.integers(1, 200))
def test_the_mean_of_the_commands_is_what_was_asked(speed, sign, count):
    base = CanBase(BUS, 64000)
    base.on_mode(3)
    sums = [0.0, 0.0]
    for _ in range(count):
        values = BUS.decode(base.command(sign * speed, -sign * speed))[1]
        assert values['mode'] == ord('C')
        sums = [sums[0] + values['left'], sums[1] + values['right']]
    assert sums[0] / count == pytest.approx(sign * speed, abs=1.01 * 0.5 / 9.5 / count)
    assert sums[1] / count == pytest.approx(-sign * speed, abs=1.01 * 0.5 / 9.5 / count)


def test_a_stop_is_a_stop_at_once_and_forgets_the_remainder():
    base = CanBase(BUS, 64000)
    base.on_mode(3)
    base.command(0.04, 0.04)
    for _ in range(5):
        assert base.command(0.0, 0.0).data == bytes([0, 0, 0, 0, ord('C'), 0, 0, 0])


@given(st.floats(-200.0, 200.0), st.floats(-200.0, 200.0))
def test_too_fast_a_command_keeps_its_arc(left, right):
    base = CanBase(BUS, 64000)
    base.on_mode(3)
    values = BUS.decode(base.command(left, right))[1]
    share = min(1.0, 127.0 / 9.5 / max(abs(left), abs(right), 1e-9))
    assert (values['left'], values['right']) == pytest.approx((left * share, right * share), abs=0.5 / 9.5 + 1e-6)
    assert base.counters['command_too_fast'] == (share < 1.0)


@pytest.mark.parametrize('mode', [None, 0, 1, 2])
def test_without_the_motor_nodes_consent_it_only_asks(mode):
    base = CanBase(BUS, 64000)
    base.on_mode(mode)
    assert base.command(3.0, 3.0).data == bytes([0, 0, 0, 0, ord('A'), 0, 0, 0])


@given(st.sampled_from((None, 0, 1, 2, 3)), st.sampled_from((0, 1, 2, 3)), st.booleans(), st.booleans())
def test_it_helps_where_the_switch_says_so_and_drives_at_2_only_if_it_can_help(mode, switch, assists, has):
    base = CanBase(BusDescription.named('sara_assisted') if has else BUS, 64000, assists=assists)
    base.on_mode(mode)
    base.on_switch(switch)
    helps = assists and has
    drives = mode == 3 or helps and mode == 2
    letter = 'C' if drives else 'H' if helps and switch == 2 else 'A'
    assert base.may_drive == drives
    assert base.command(2.0, 2.0).data == bytes([19 * drives, 19 * drives, 0, 0, ord(letter), 0, 0, 0])
    assert base.stop().data == bytes([0, 0, 0, 0, ord('A'), 0, 0, 0])


@given(st.floats(), st.floats())
def test_any_speed_makes_a_frame(left, right):
    base = CanBase(BUS, 64000)
    base.on_mode(3)
    values = BUS.decode(base.command(left, right))[1]
    if not (math.isfinite(left) and math.isfinite(right)):
        assert (values['left'], values['right']) == (0.0, 0.0)


@pytest.mark.parametrize('hours', [10, 60, 100])
def test_a_motor_node_that_starts_anew_moves_nothing_however_long_it_ran(hours):
    """Its clock of 0.1 ms wraps after 119 h."""
    base, ticks = CanBase(BUS, 64000, 20.0), int(hours * 36e6)
    for k in range(5):
        before = pair(base, 30_000_000, 30_000_000, ticks + 1000 * k, 1000.0 + 0.1 * k)
    after = None
    for k in range(1, 4):
        after = pair(base, 0, 0, 1000 * k, 1000.9 + 0.1 * k) or after
    assert base.counters['clock_restarted'] >= 1 and after[:2] == before[:2]
