"""Who may drive, for how long, and what the encoders say."""

import dataclasses
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from canserial.frame import Frame
from sara_common.config import ConfigError
from sara_lowlevel.config import MotorConfig
from sara_lowlevel.motor.command_guard import JUMP_FRAMES, STANDS
from sara_lowlevel.motor.motor_node import Joystick, MotorNode

BUS = BusDescription.default()
COMMAND, FASTEST = BUS.id_of('WHEEL_COMMAND'), MotorConfig.of().max_wheel_speed
HARD = MotorConfig.of().wheel_acceleration
CENTRE = Joystick()


def command(right, left, mode):
    return BUS.encode('WHEEL_COMMAND', right=right, left=left, mode=ord(mode))


class Bench:
    """A motor node in its 10 ms loop."""

    def __init__(self):
        self.node, self.t, self.frames = MotorNode(BUS), 0.0, []
        self.tick = 0

    def run(self, seconds, joystick=CENTRE, frame=None, steps=(0, 0)):
        for _ in range(round(seconds * 100)):
            self.tick += 1
            self.t = self.tick / 100
            if frame is not None:
                self.node.receive(frame, self.t)
            self.frames += [(self.t, *BUS.decode(f)) for f in self.node.update(self.t, *steps, joystick, 25.0)]
        return self

    def in_control(self):
        self.run(0.1).run(0.02, frame=command(0, 0, 'A'))
        assert self.node.mode == 3
        return self

    def modes(self):
        return [values['modoPC'] for _, name, values in self.frames if name == 'MODO_PC']


def test_commands_before_the_handshake_do_nothing():
    bench = Bench().run(0.5, frame=command(2, 2, 'C'))
    assert bench.node.target == (0.0, 0.0) and bench.node.mode == 1
    assert bench.node.counts['command without control'] == 50


def test_control_is_given_then_commands_drive():
    bench = Bench().in_control().run(0.1, frame=command(2, -1, 'C'))
    assert bench.node.target == pytest.approx((2, -1), abs=0.06)
    assert bench.modes()[:1] == [1] and bench.modes()[-1] == 3


@pytest.mark.parametrize('joystick', [Joystick(x=600), Joystick(y=100), Joystick(mode=0)])
def test_no_control_while_the_user_holds_the_joystick(joystick):
    bench = Bench().run(0.5, joystick, command(0, 0, 'A'))
    assert bench.node.mode != 3


@pytest.mark.parametrize('frame', [command(1, 0, 'A'), command(0, 0, 'C')])
def test_only_a_standing_request_gives_control(frame):
    assert Bench().run(0.2).run(0.2, frame=frame).node.mode == 1


def test_the_user_always_wins_at_once():
    bench = Bench().in_control().run(0.1, frame=command(2, 2, 'C'))
    before = len(bench.modes())
    bench.run(0.01, Joystick(x=512, y=900, mode=1, right=1.0, left=1.5), command(2, 2, 'C'))
    assert bench.node.mode == 1 and bench.node.target == (1.0, 1.5)
    assert bench.modes()[before:] == [1]
    bench.run(0.1, CENTRE, command(2, 2, 'C'))
    assert bench.node.target == (0.0, 0.0)


def test_commands_that_stop_coming_stop_it_after_200_ms():
    bench = Bench().in_control().run(0.1, frame=command(2, 2, 'C')).run(0.20)
    assert bench.node.target != (0.0, 0.0)
    bench.run(0.02)
    assert bench.node.target == (0.0, 0.0) and bench.node.counts['commands stopped'] == 1
    bench.run(0.05, frame=command(1, 1, 'C'))
    assert bench.node.target != (0.0, 0.0)


def test_stop_stops_and_keeps_control():
    bench = Bench().in_control().run(0.1, frame=command(2, 2, 'C')).run(0.01, frame=command(2, 2, 'A'))
    assert bench.node.target == (0.0, 0.0) and bench.node.mode == 3


def talk(bench, frame, frames=1):
    """The PC says it, 50 times a second."""
    for _ in range(frames):
        bench.run(0.01, frame=frame).run(0.01)
    return bench


def moving(right, left):
    """A Bench whose PC drives at these speeds, rad/s."""
    return talk(Bench().in_control(), command(right, left, 'C'), JUMP_FRAMES)


SPEEDS = st.floats(-FASTEST, FASTEST)
STEP = 1 / 9.5


@given(SPEEDS, SPEEDS, st.sets(st.sampled_from([*range(16, 32), *range(40, 64)]), min_size=1), st.integers(0, 2**16))
def test_a_command_whose_constant_bytes_are_wrong_is_not_obeyed_and_holds_no_watchdog_off(right, left, wrong, speeds):
    bench = moving(right, left)
    before = bench.node.target
    data = bytearray(command(right, left, 'C').data)
    for bit in wrong | {bit for bit in range(16) if speeds >> bit & 1}:
        data[bit // 8] ^= 1 << bit % 8
    talk(bench, Frame(COMMAND, bytes(data)), 9)
    assert bench.node.target == before and bench.node.counts['damaged command'] == 9
    talk(bench, Frame(COMMAND, bytes(data)), 3)
    assert bench.node.target == (0.0, 0.0)


@given(st.integers(-128, 127), st.integers(-128, 127))
def test_from_rest_a_wheel_is_set_off_by_one_step_and_a_jump_must_be_said_five_times(right, left):
    bench = talk(Bench().in_control(), command(0, 0, 'C'), 20)
    wanted = command(right * STEP, left * STEP, 'C')
    for frames in range(1, JUMP_FRAMES):
        talk(bench, wanted)
        # Those before, which were not obeyed, may as well have been lost: the wheel may have got faster meanwhile.
        reach = 1.5 * STEP + HARD * max(0.02 * frames - 0.03, 0.0)
        assert (bench.node.target == (0.0, 0.0)) == (STEP * max(abs(right), abs(left)) > reach or right == left == 0)
    talk(bench, wanted)
    share = min(FASTEST / (STEP * max(abs(right), abs(left), 1)), 1.0)
    assert bench.node.target == pytest.approx((right * STEP * share, left * STEP * share), abs=1e-9)


def test_after_a_damaged_frame_a_start_must_be_said_five_times_however_slow():
    bench = talk(Bench().in_control(), command(0, 0, 'C'), 5)
    talk(bench, Frame(COMMAND, bytes((0, 0, 1, 0, ord('C'), 0, 0, 0))))
    talk(bench, command(0, 0, 'C'))
    assert talk(bench, command(STEP, STEP, 'C'), JUMP_FRAMES - 1).node.target == (0.0, 0.0)
    assert talk(bench, command(STEP, STEP, 'C')).node.target == (STEP, STEP)
    talk(bench, command(0, 0, 'C'), 60)
    assert talk(bench, command(STEP, STEP, 'C')).node.target == (STEP, STEP), 'and a second later is forgotten'


@given(SPEEDS, SPEEDS, SPEEDS, SPEEDS, st.integers(0, 8))
def test_in_motion_a_wheel_changes_as_fast_as_the_gate_brakes_hard_and_lost_frames_are_made_up_for(
    right, left, new_right, new_left, lost
):
    bench = moving(right, left)
    before, said = bench.node.target, command(new_right, new_left, 'C')
    new = BUS.decode(said)[1]['right'], BUS.decode(said)[1]['left']
    talk(bench.run(0.02 * lost), said)
    over = max(abs(now - was) for was, now in zip(before, new)) - 1.5 * STEP - HARD * 0.02 * (lost + 2)
    if STANDS not in (before, new) and abs(over) > 1e-6:
        assert bench.node.target == (new if over < 0.0 else before)


@given(SPEEDS, SPEEDS, st.sampled_from((command(0, 0, 'C'), command(0, 0, 'A'), command(3, -2, 'A'))))
def test_a_stop_is_obeyed_at_once_and_one_that_was_none_is_over_with_the_next_frame(right, left, stop):
    bench = moving(right, left)
    before = bench.node.target
    bench.run(0.01, frame=stop)
    assert bench.node.target == (0.0, 0.0) and bench.node.mode == 3
    assert talk(bench, command(right, left, 'C')).node.target == before


def test_a_joystick_that_was_moved_leaves_nothing_to_go_on_from():
    bench = moving(3.0, 3.0).run(0.02, Joystick(y=900)).run(0.02, frame=command(0, 0, 'A'))
    assert bench.node.mode == 3
    assert talk(bench, command(3, 3, 'C')).node.target == (0.0, 0.0)


HELD = Joystick(y=1023, right=3.0, left=3.0)


@pytest.mark.parametrize(
    'before',
    [
        lambda bench: bench,
        lambda bench: bench.run(0.1).run(1.0, HELD).run(0.6, None),
        lambda bench: bench.run(0.1).run(1.0, HELD).run(0.1, dataclasses.replace(HELD, mode=0)),
        lambda bench: bench.run(0.1).run(0.1, Joystick(mode=0)),
    ],
    ids=['power-up', 'silence', 'off', 'centred while off'],
)
def test_a_stick_that_is_held_drives_only_once_it_was_let_go(before):
    bench = before(Bench()).run(2.0, HELD)
    assert bench.node.mode == 1 and bench.node.target == STANDS
    assert bench.run(0.01).run(0.01, HELD).node.target == (3.0, 3.0)


def test_a_silence_that_the_loop_slept_through_is_one_too():
    node = MotorNode(BUS)
    node.receive(stick_frame(joyy=512), 0.0)
    node.receive(stick_frame(), 0.1)
    node.update(0.1, 0, 0)
    assert node.target != STANDS
    node.receive(stick_frame(), 3.0)
    node.update(3.0, 0, 0)
    assert node.target == STANDS


@given(st.lists(st.integers(1, 5), min_size=1, max_size=20))
def test_frames_that_are_lost_let_a_held_stick_drive_on(gaps):
    node, t = MotorNode(BUS), 0.0
    node.receive(stick_frame(joyy=512), t)
    for lost in gaps:
        t += 0.1 * lost
        node.receive(stick_frame(), t)
        node.update(t, 0, 0)
        assert node.target != STANDS


def test_without_a_joystick_nobody_drives():
    bench = Bench().in_control().run(0.1, frame=command(2, 2, 'C')).run(0.6, None, command(2, 2, 'C'))
    assert bench.node.mode == 1 and bench.node.target == (0.0, 0.0)
    assert Bench().run(1.0, None, command(0, 0, 'A')).node.mode == 1


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_no_frame_but_a_command_moves_it(identifier, data):
    bench = Bench().in_control()
    bench.run(0.05, CENTRE, Frame(identifier, data))
    if identifier != COMMAND:
        assert bench.node.target == (0.0, 0.0) or identifier == BUS.id_of('JOYSTICK')
    assert all(abs(wheel) <= FASTEST for wheel in bench.node.target)


def test_commands_are_limited():
    bench = Bench().in_control().run(0.1, frame=command(13, -13, 'C'))
    assert bench.node.target == (FASTEST, -FASTEST)


@given(st.integers(-127, 127), st.integers(-127, 127), st.sampled_from((FASTEST, 3.0, 1.5)))
def test_at_the_limit_it_stays_on_its_curve_whoever_drives(right, left, limit):
    """Gate, planner and shared control reckon with the curve that they command."""
    bench = Bench()
    bench.node = MotorNode(BUS, MotorConfig.of(max_wheel_speed=limit))
    talk(bench.in_control(), command(right * STEP, left * STEP, 'C'), JUMP_FRAMES)
    share = min(limit / (STEP * max(abs(right), abs(left), 1)), 1.0)
    expected = pytest.approx((right * STEP * share, left * STEP * share), abs=1e-9)
    assert bench.node.target == expected and max(map(abs, bench.node.target)) <= limit
    bench.run(0.01, Joystick(y=900, right=right * STEP, left=left * STEP))
    assert bench.node.mode == 1 and bench.node.target == expected


def stick_frame(**other):
    """A JOYSTICK frame: fully ahead, by hand."""
    values = {'velD': 3.0, 'velI': 3.0, 'joyx': 512, 'joyy': 1023, 'modo': 1}
    return BUS.encode('JOYSTICK', **{**values, **other})


@given(
    st.fixed_dictionaries(
        {}, optional={name: st.integers(1024, 65535) for name in ('joyx', 'joyy')} | {'modo': st.sampled_from((2, 9))}
    ).filter(bool)
)
def test_a_joystick_frame_that_cannot_be_is_as_none(wrong):
    frame = stick_frame(**wrong)
    bench = Bench().in_control().run(0.1, frame=command(2, 2, 'C'))
    before = bench.node.target
    bench.node.receive(frame, bench.t)
    bench.run(0.05, None)
    assert bench.node.mode == 3 and bench.node.target == before and bench.node.counts['damaged joystick'] == 1
    bench.run(0.1, frame=command(2, 2, 'C'))
    for _ in range(60):
        bench.node.receive(frame, bench.t)
        bench.run(0.01, None, command(2, 2, 'C'))
    assert bench.node.mode == 1 and bench.node.target == STANDS, 'and keeps no joystick alive'


def test_a_joystick_frame_with_bits_that_no_signal_uses_is_as_none(tmp_path):
    text = Path(BUS.path).read_text()
    short = tmp_path / 'short.dbc'
    short.write_text(text.replace('SG_ modo : 32|16@1+', 'SG_ modo : 32|8@1+'))
    node = MotorNode(BusDescription(short))
    node.receive(stick_frame(modo=1), 0.0)
    assert node.counts == {}
    node.receive(stick_frame(modo=257), 0.1)
    assert node.counts == {'damaged joystick': 1}


def test_frames_and_their_rates():
    bench = Bench().run(10.0, steps=(-1, 2**32 + 5))
    count = {}
    for _, name, _ in bench.frames:
        count[name] = count.get(name, 0) + 1
    assert count == {'ENCODER_RIGHT': 100, 'ENCODER_LEFT': 100, 'MODO_PC': 50, 'BATTERY': 10}
    right = [values for _, name, values in bench.frames if name == 'ENCODER_RIGHT']
    assert right[0]['steps'] == 2**32 - 1
    assert {b['time'] - a['time'] for a, b in zip(right, right[1:])} == {1000}
    assert [values['steps'] for _, name, values in bench.frames if name == 'ENCODER_LEFT'][0] == 5
    assert [values['voltage'] for _, name, values in bench.frames if name == 'BATTERY'][0] == 25.0


def test_counts_that_are_old_or_missing_are_not_sent():
    node, sent = MotorNode(BUS), []
    for tick in range(100):
        t = tick / 100
        old, dead = 30 <= tick < 60, tick >= 60
        frames = node.update(
            t, *((None, None) if dead else (tick, tick)), CENTRE, measured_at=0.295 if old else t - 0.005
        )
        sent += [BUS.decode(frame)[1] for frame in frames if frame.id == BUS.id_of('ENCODER_RIGHT')]
    assert [values['time'] for values in sent] == [round((-0.005) * 1e4) % 2**32, 950, 1950, 2950]
    assert node.counts['encoders not read'] == 6


def test_bad_settings_are_named():
    with pytest.raises(ConfigError) as error:
        MotorConfig.of(encoder_period=0, command_timeout=float('nan'))
    assert 'encoder_period' in str(error.value) and 'command_timeout' in str(error.value)
