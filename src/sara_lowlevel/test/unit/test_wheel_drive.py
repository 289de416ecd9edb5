"""The wheels of the real chair, against motors and a controller that are simulated at byte level."""

import math
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.config import ConfigError
from sara_lowlevel.config import AmplifierConfig, SpeedLoopConfig
from sara_lowlevel.motor import ax3500
from sara_lowlevel.motor.speed_loop import SpeedLoop
from sara_lowlevel.motor.wheel_drive import WheelDrive

sys.path.insert(0, str(Path(__file__).parent))
from fake_amplifier import FULL_SPEED, STEPS_PER_TURN, FakeAmplifier, abbreviate  # noqa: E402


class Bench:
    """A drive and its controller in a 10 ms loop."""

    def __init__(self, amplifier=None, **fake):
        self.fake, self.drive, self.tick = FakeAmplifier(**fake), WheelDrive(amplifier or AmplifierConfig()), 0

    def run(self, seconds, target=(0.0, 0.0), each=lambda: None):
        for _ in range(round(seconds * 100)):
            self.tick += 1
            t = self.tick / 100
            self.fake.advance(t)
            self.fake.write(self.drive.update(t, target, self.fake.read()))
            each()
        return self


@given(st.integers(-(2**31), 2**31 - 1))
def test_counters_come_back_from_their_abbreviation(value):
    assert ax3500.counter(abbreviate(value)) == value


@pytest.mark.parametrize(
    'value, text', [(5, '5'), (250, '0FA'), (-6, 'A'), (-235, 'F15'), (91011186, '56CB872'), (-7986091, '862455')]
)
def test_the_examples_of_the_manual(value, text):
    assert ax3500.counter(text) == value
    assert abbreviate(value) == text


@given(st.floats(-3, 3), st.sampled_from([1, 2]))
def test_a_command_is_a_letter_and_seven_bits(output, channel):
    line = ax3500.command(channel, output)
    value = int(line[2:], 16) * (1 if line[1].isupper() else -1)
    assert line[0] == '!' and line[1].upper() == 'AB'[channel - 1] and len(line) == 4
    assert abs(value / 127 - min(max(output, -1), 1)) <= 0.5 / 127 + 1e-9


@given(st.lists(st.binary(max_size=40), max_size=30))
def test_no_bytes_on_the_line_raise_or_make_a_count_out_of_nothing(noise):
    amplifier, t = ax3500.Ax3500(), 0.0
    for data in noise:
        t += 0.01
        asked = amplifier.poll(t)
        amplifier.feed(data, t)
        assert asked == b'' or asked.endswith(b'\r')
    if not any(b'?Q' in data for data in noise):
        assert amplifier.right is amplifier.left is None


def test_a_late_answer_is_not_taken_for_the_other_wheels():
    amplifier, t = ax3500.Ax3500(), 0.0
    while amplifier.poll(t) != b'?Q0\r':
        t += 0.2
    while (asked := amplifier.poll(t)) != b'?Q1\r':
        t += 0.2
    amplifier.feed(b'?Q0\r123\r', t)
    assert amplifier.left is None and amplifier.counts['unasked'] == 2
    amplifier.feed(b'?Q1\r456\r', t)
    assert amplifier.left.steps == 0x456 and amplifier.right is None and asked == b'?Q1\r'


@settings(max_examples=100)
@given(st.floats(0.5, 6.0), st.sampled_from([1, -1]), st.floats(7.0, 12.0), st.floats(0.05, 0.25), st.floats(-0.8, 0.8))
def test_the_wheels_come_to_their_speed_whatever_the_motor(speed, sign, full_speed, lag, load):
    bench = Bench(full_speed=full_speed, lag=lag)
    bench.run(0.5)
    bench.fake.load = load
    peak = [0.0]
    target = (sign * speed, -sign * speed / 2)
    bench.run(3.0, target, lambda: peak.append(abs(bench.fake.speeds[0])))
    assert bench.fake.speeds == pytest.approx(target, abs=0.1)  # an output step of 1/127 is 0.07 to 0.09 rad/s
    # The feed-forward takes the motor for one of FULL_SPEED: a stronger one runs ahead until the integral has it.
    assert max(peak) < 1.25 * speed * max(full_speed / FULL_SPEED, 1.0) + 0.3 + 0.5 * abs(load)
    bench.fake.load = 0.0
    bench.run(1.5)
    assert max(map(abs, bench.fake.speeds)) < 0.05 and bench.drive.fault == ''


def test_a_blocked_wheel_is_let_go_and_does_not_jump_when_it_is_free():
    bench = Bench().run(0.5)
    bench.fake.blocked = True
    bench.run(3.0, (3.0, 3.0))
    assert 'stalled' in bench.drive.fault and bench.fake.power == [0.0, 0.0]
    bench.fake.blocked = False
    bench.run(1.0, (3.0, 3.0))
    assert bench.fake.speeds == pytest.approx((0.0, 0.0), abs=1e-6)
    bench.run(0.2).run(2.0, (3.0, 3.0))
    assert bench.fake.speeds == pytest.approx((3.0, 3.0), abs=0.1)


@settings(max_examples=20)
@given(st.floats(0.3, 7.0))
def test_a_dead_encoder_does_not_let_the_wheel_race(speed):
    bench, peak = Bench(), [0.0]
    bench.fake.encoder_sign[1] = 0
    bench.run(0.3).run(4.0, (speed, speed), lambda: peak.append(bench.fake.speeds[1]))
    assert bench.drive.fault == 'the left wheel is stalled' and bench.fake.power == [0.0, 0.0]
    # Feed-forward, kp, and what the integral may reach
    assert max(peak) < (1.0 / FULL_SPEED + 0.06) * FULL_SPEED * speed + 0.2 * FULL_SPEED + 0.2


def test_saturation_winds_nothing_up():
    bench = Bench(full_speed=4.0).run(0.3).run(5.0, (6.0, 6.0))
    assert bench.fake.power == [1.0, 1.0] and bench.drive.fault == ''
    bench.run(0.35, (2.0, 2.0))
    bench.run(
        1.0,
        (2.0, 2.0),
        lambda: pytest.approx(2.0, abs=0.7) == bench.fake.speeds[0] or pytest.fail(str(bench.fake.speeds)),
    )


@pytest.mark.parametrize('wrong', ['encoder_sign', 'motor_sign'])
def test_a_wheel_wired_backwards_is_stopped_within_half_a_second(wrong):
    bench = Bench()
    getattr(bench.fake, wrong)[0] = -1
    bench.run(0.3).run(0.6, (1.0, 1.0))
    assert bench.drive.fault == 'the right wheel is reversed' and bench.fake.power == [0.0, 0.0]
    assert abs(bench.fake.angles[0]) < 2.0


def test_reversing_is_no_fault():
    bench = Bench(lag=0.3).run(0.3)
    for target in ((4.0, 4.0), (-4.0, -4.0), (4.0, -4.0)):
        bench.run(2.0, target)
        assert bench.drive.fault == '' and bench.fake.speeds == pytest.approx(target, abs=0.2)


@pytest.mark.parametrize('channel, reversed_', [(1, False), (2, False), (1, True), (2, True)])
def test_wiring_by_configuration(channel, reversed_):
    bench = Bench(AmplifierConfig(right_channel=channel, right_reversed=reversed_, right_encoder_reversed=reversed_))
    bench.fake.motor_sign[channel - 1] = 1
    bench.run(0.3).run(2.0, (2.0, 4.0))
    right = bench.fake.speeds[channel - 1] * (-1 if reversed_ else 1)
    assert (right, bench.fake.speeds[2 - channel]) == pytest.approx((2.0, 4.0), abs=0.1)
    steps = bench.drive.steps(bench.tick / 100)
    assert steps[0] > 0 and steps[1] > 0


def test_silence_of_the_controller_stops_the_wheels_and_its_return_does_not_start_them():
    bench = Bench().run(0.3).run(1.0, (3.0, 3.0))
    bench.fake.alive = False
    bench.run(0.45, (3.0, 3.0))
    assert bench.drive.steps(bench.tick / 100) is None and 'does not answer' in bench.drive.fault
    assert bench.drive.amplifier.counts['no reply'] >= 3
    bench.fake.alive = True
    bench.run(1.0, (3.0, 3.0))
    assert bench.fake.power == [0.0, 0.0] and bench.drive.steps(bench.tick / 100)
    bench.run(0.2).run(1.5, (3.0, 3.0))
    assert bench.fake.speeds == pytest.approx((3.0, 3.0), abs=0.1)


def test_the_counts_of_both_wheels_are_of_one_instant():
    bench = Bench().run(0.3)
    seen, truth = {}, {}

    def note():
        t = bench.tick / 100
        truth[bench.tick] = bench.fake.counts(0) - bench.fake.counts(1)
        steps = bench.drive.steps(t)
        if steps:
            seen[steps[2]] = steps[0] - steps[1]

    bench.run(2.5, (3.0, 1.5), note)
    times = sorted(seen)
    assert len(times) > 25 and max(b - a for a, b in zip(times, times[1:])) < 0.1
    limit = 0.01 * STEPS_PER_TURN / (2 * math.pi)  # 1.5 mm
    for when, apart in seen.items():  # the controller reads a counter 20 ms before its answer is taken
        assert when < 0.8 or abs(apart - truth[round(100 * when) - 2]) < limit


def test_the_voltage_and_the_rate_of_the_round():
    bench = Bench().run(2.0)
    assert bench.drive.amplifier.voltage == pytest.approx(55 * 0x73 / 256)
    rounds = [t for t, line in bench.fake.commands if line[1] == 'A']
    assert 11 < len(rounds) / 2.0 < 26
    assert not bench.drive.amplifier.counts and not bench.drive.counts


def test_a_count_no_wheel_can_have_made_is_a_glitch():
    loop = SpeedLoop(SpeedLoopConfig.of(steps_per_turn=64000))
    for k, steps in enumerate((0, 1000, 2000, 900000, 3000, 4000, 5000)):
        loop.update(steps, k * 0.06, 1.0)
    assert loop.glitches == 2 and loop.speed == pytest.approx(1000 / 64000 * 2 * math.pi / 0.06)


@given(st.integers(0, 2**32 - 1))
def test_counters_wrap(start):
    loop = SpeedLoop(SpeedLoopConfig.of(steps_per_turn=64000))
    for k in range(5):
        loop.update((start + 600 * k) % 2**32, k * 0.06, 1.0)
    assert loop.speed == pytest.approx(600 / 64000 * 2 * math.pi / 0.06) and loop.glitches == 0


def test_bad_settings_are_named():
    with pytest.raises(ConfigError, match='right_channel is 3.*'):
        AmplifierConfig(right_channel=3)
    with pytest.raises(ConfigError, match='kp is -1'):
        SpeedLoopConfig.of(kp=-1)


@pytest.mark.parametrize('target, allowed', [(0.0, True), (5.0, False)])
def test_to_stop_needs_no_count_that_is_believed(target, allowed):
    """A disturbed encoder says any number: it must not keep the wheels driven."""
    loop, count = SpeedLoop(SpeedLoopConfig.of(steps_per_turn=64000, full_speed=9.0)), 0
    for tick in range(100):
        count += round(4.0 / math.tau * 64000 / 100)
        driven = loop.update(count, tick / 100, 5.0)
    assert driven > 0.2
    assert loop.update(count + 10**6, 1.0, 5.0) == driven and loop.glitches == 1  # one is left out, and drives on
    assert loop.update(count, 1.01, target, allowed) == 0.0 and loop.glitches == 2


@pytest.mark.parametrize('side, channel', [('right', 0), ('left', 1)])
def test_counts_of_which_none_can_be_true_stop_both_wheels(side, channel):
    """Noise on an encoder's line: the speed of before was held for ever, whatever was asked then."""
    bench = Bench().run(0.3).run(2.0, (4.0, 4.0))
    counts, noise, said = bench.fake.counts, [0], [0]

    def noisy(which):
        said[0] += which == channel
        return counts(which) + (noise[0] if which == channel and said[0] % 2 else 0)

    bench.fake.counts, noise[0] = noisy, 40000
    bench.run(0.2, (4.0, 4.0))
    assert bench.drive.fault == '' and min(bench.fake.power) > 0.3, 'single ones are left out'
    bench.run(0.3, (0.5, 0.5))
    assert bench.drive.fault == f'the {side} wheel is unreadable' and bench.fake.power == [0.0, 0.0]
    bench.run(1.0, (0.5, 0.5)).run(0.3).run(0.3, (0.5, 0.5))
    assert bench.fake.power == [0.0, 0.0], 'it stands as long as the noise goes on'
    assert bench.drive.counts == {f'the {side} wheel is unreadable': 1}
    noise[0] = 0
    bench.run(0.3, (2.0, 2.0))
    assert bench.fake.power == [0.0, 0.0], 'and until the target has been zero'
    bench.run(0.2).run(2.0, (2.0, 2.0))
    assert bench.drive.fault == '' and bench.fake.speeds == pytest.approx((2.0, 2.0), abs=0.1)


def test_a_count_that_is_believed_now_and_then_is_enough():
    loop, driven = SpeedLoop(SpeedLoopConfig.of(steps_per_turn=64000)), 0.0
    for tick in range(200):
        good = round(4.0 / math.tau * 64000 * 0.06) * tick
        driven = loop.update(good + (10**6 if tick % 4 == 3 else 0), 0.06 * tick, 4.0)
        assert loop.fault == ''
    assert loop.glitches > 90 and driven != 0.0
