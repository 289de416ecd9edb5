"""The mode ASSISTED of the motor node: who has the wheels, and that no PC drives against the stick."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from sara_lowlevel.config import MotorConfig
from sara_lowlevel.joystick.joystick_node import JoystickNode
from sara_lowlevel.motor.assistance import Assistance, Stick
from sara_lowlevel.motor.command_guard import JUMP_FRAMES
from sara_lowlevel.motor.motor_node import Joystick, MotorNode

BUS = BusDescription.named('sara_assisted')
CENTRE, AHEAD, BACK, ASIDE = Joystick(), Joystick(y=900, right=1.5, left=1.5), Joystick(y=100), Joystick(x=900)
REST = (0.0, 0.0)
NOTICE_S, RELEASE_S, SILENCE_S = 1.0, 3.0, 0.2
STEP = 1 / 9.5


def helped(stick):
    """The stick while the switch says that the PC is to help."""
    return dataclasses.replace(stick, mode=2)


def command(right, left, letter):
    return BUS.encode('WHEEL_COMMAND', right=right, left=left, mode=ord(letter))


class Bench:
    """A motor node in its 10 ms loop, its joystick heard every 100 ms and when it changes, its PC every 20 ms."""

    def __init__(self, bus=BUS):
        self.node, self.tick, self.modes, self.stick = MotorNode(bus), 0, [], None

    def run(self, seconds, stick, frame=None):
        for _ in range(round(seconds * 100)):
            self.tick += 1
            t = self.tick / 100
            news = stick if stick != self.stick or self.tick % 10 == 0 else None
            self.stick = stick
            if news is not None:
                values = {'velD': news.right, 'velI': news.left, 'joyx': news.x, 'joyy': news.y, 'modo': news.mode}
                self.node.receive(BUS.encode('JOYSTICK', **values), t)
            if frame is not None and self.tick % 2 == 0:
                self.node.receive(frame, t)
            self.modes += [BUS.decode(sent)[1]['modoPC'] for sent in self.node.update(t, 0, 0) if sent.id == 0x111]
        return self

    def helped(self):
        """The PC has got control."""
        self.run(0.2, helped(CENTRE), command(0, 0, 'H'))
        assert self.node.mode == 2 and self.modes[-1] == 2
        return self

    def driven(self, right=2.0, left=2.0, stick=AHEAD):
        """And drives as the stick wishes."""
        self.helped().run(0.02 * JUMP_FRAMES, helped(stick), command(right, left, 'C'))
        assert self.node.target == pytest.approx((right, left), abs=0.06)
        return self


def test_the_pc_drives_while_the_stick_is_deflected():
    bench = Bench().driven(1.0, 1.5).run(5.0, helped(AHEAD), command(1.0, 1.5, 'C'))
    assert bench.node.mode == 2 and bench.node.target == pytest.approx((1.0, 1.5), abs=0.06)


@pytest.mark.parametrize('letter, switch', (('A', 2), ('H', 1), ('H', 3)))
def test_control_is_given_to_a_pc_that_helps_where_it_is_to_help_and_to_none_else(letter, switch):
    bench = Bench().run(0.5, dataclasses.replace(CENTRE, mode=switch), command(0, 0, letter))
    assert bench.node.mode == (0 if switch == 2 else 1)


@pytest.mark.parametrize(
    'stick, letter, right', ((AHEAD, 'H', 0), (ASIDE, 'H', 0), (CENTRE, 'H', STEP), (CENTRE, 'C', 0))
)
def test_only_a_standing_request_with_the_stick_centred_gives_control(stick, letter, right):
    assert Bench().run(0.5, helped(stick), command(right, 0, letter)).node.mode == 0


def test_a_bus_without_the_mode_knows_neither_switch_nor_letter():
    node = Bench(BusDescription.named('sara')).run(0.5, helped(CENTRE), command(0, 0, 'H')).node
    assert node.mode == 1 and node.counts['unknown command mode'] == 25
    node = Bench(BusDescription.named('sara')).run(0.5, helped(AHEAD)).node
    assert node.mode == 1 and node.target == REST and node.counts['damaged joystick'] == 6, 'nor what the switch says'


@pytest.mark.parametrize('last', (None, 'A'))
def test_without_the_pc_it_stands_after_200_ms_and_the_stick_does_not_drive_it(last):
    """A PC that cannot help, started in place of one that could, only stops it: that is no help."""
    bench = Bench().driven()
    bench.run(SILENCE_S - 0.02, helped(AHEAD), last and command(0, 0, last))
    assert bench.node.mode == 2
    bench.run(0.04, helped(AHEAD), last and command(0, 0, last))
    assert bench.node.target == REST and bench.node.mode == 0 and bench.modes[-1] == 0
    bench.run(10.0, helped(AHEAD), command(2, 2, 'C'))
    assert bench.node.target == REST and bench.node.mode == 0


@given(st.integers(0, 300), st.sampled_from((AHEAD, BACK, ASIDE)))
def test_without_help_the_stick_drives_after_a_push_in_vain_and_letting_go(pushed, stick):
    bench = Bench().driven().run(0.5, helped(CENTRE)).run(1.0, helped(CENTRE))
    bench.run(0.01 * pushed, helped(stick))
    assert bench.node.target == REST and bench.node.mode == 0, 'however long, it does not drive under the hand'
    bench.run(0.1, helped(CENTRE)).run(0.1, helped(AHEAD))
    if abs(0.01 * pushed - NOTICE_S) > 0.02:
        assert (bench.node.mode == 1) == (0.01 * pushed > NOTICE_S)
        assert (bench.node.target != REST) == (bench.node.mode == 1)


def test_pushes_in_vain_add_up_for_who_cannot_hold_the_stick():
    bench = Bench().driven().run(0.5, helped(CENTRE))
    for _ in range(5):
        bench.run(0.15, helped(AHEAD)).run(0.1, helped(CENTRE))
        assert bench.node.mode == 0
    assert bench.run(0.4, helped(AHEAD)).run(0.1, helped(CENTRE)).node.mode == 1


def test_a_pc_that_comes_back_helps_again_once_the_stick_was_let_go():
    bench = Bench().driven().run(0.5, helped(AHEAD)).run(1.0, helped(AHEAD), command(0, 0, 'H'))
    assert bench.node.mode == 0
    bench.run(0.1, helped(CENTRE), command(0, 0, 'H'))
    assert bench.node.mode == 2
    assert bench.run(0.08, helped(AHEAD), command(2, 2, 'C')).node.target == REST, 'a jump is to be said five times'
    assert bench.run(0.02, helped(AHEAD), command(2, 2, 'C')).node.target != REST


@pytest.mark.parametrize('stick', (CENTRE, AHEAD, BACK))
@pytest.mark.parametrize('switch', (0, 1, 3))
def test_the_switch_turned_stops_it_at_once_and_the_stick_drives_when_it_was_let_go(switch, stick):
    bench = Bench().driven().run(0.1, helped(stick), command(2, 2, 'C'))
    turned = dataclasses.replace(stick, mode=switch)
    bench.run(0.01, turned, command(2, 2, 'C'))
    assert bench.node.target == REST and bench.node.mode == 0
    bench.run(3.0, turned, command(2, 2, 'C'))
    assert bench.node.target == REST and bench.node.mode == (1 if stick is CENTRE and switch else 0)
    bench.run(0.3, dataclasses.replace(CENTRE, mode=1)).run(0.1, AHEAD)
    assert bench.node.mode == 1 and bench.node.target == pytest.approx((1.5, 1.5), abs=0.06)


def test_the_switch_turned_while_the_stick_drives_stops_it_too():
    bench = Bench().run(0.1, CENTRE).run(0.5, AHEAD)
    assert bench.node.target != REST
    bench.run(3.0, helped(AHEAD), command(0, 0, 'H'))
    assert bench.node.target == REST and bench.node.mode == 0
    assert bench.run(0.1, helped(CENTRE), command(0, 0, 'H')).node.mode == 2


def test_a_pc_that_drives_alone_loses_control_when_the_switch_is_turned():
    bench = Bench().run(0.2, CENTRE, command(0, 0, 'A')).run(0.2, CENTRE, command(2, 2, 'C'))
    assert bench.node.mode == 3 and bench.node.target != REST
    bench.run(0.5, helped(CENTRE), command(2, 2, 'C'))
    assert bench.node.mode == 0 and bench.node.target == REST


def test_without_its_joystick_nobody_drives():
    bench = Bench().driven()
    for tick in range(60):
        t = bench.tick / 100 + tick / 100
        bench.node.receive(command(2, 2, 'C'), t)
        bench.node.update(t, 0, 0)
    assert bench.node.mode == 0 and bench.node.target == REST


@pytest.mark.parametrize('after', (CENTRE, BACK, ASIDE))
def test_a_pc_that_drives_on_against_the_stick_is_stopped(after):
    bench = Bench().driven().run(RELEASE_S, helped(after), command(2, 2, 'C'))
    assert bench.node.mode == 2, 'it may be braking gently'
    bench.run(0.15, helped(after), command(2, 2, 'C'))
    assert bench.node.target == REST and bench.node.mode == 0
    assert bench.node.counts['command against the joystick'] >= 1


def test_a_pc_that_goes_on_turning_after_the_stick_was_let_go_is_stopped():
    bench = Bench().driven(1.0, -1.0, ASIDE).run(RELEASE_S + 0.15, helped(CENTRE), command(1, -1, 'C'))
    assert bench.node.target == REST and bench.node.mode == 0


WHEELS = st.floats(-7.0, 7.0)
STICKS = st.sampled_from((AHEAD, BACK, ASIDE, CENTRE))


@given(WHEELS, WHEELS, STICKS, st.integers(0, 400))
def test_whatever_the_pc_commands_the_wheels_stand_or_follow_the_stick_in_time(right, left, stick, after):
    """A PC that has driven with the stick goes mad."""
    bench = Bench().driven().run(0.3, helped(stick), command(right, left, 'C'))
    bench.run(RELEASE_S + 0.01 * after, helped(stick), command(right, left, 'C'))
    mean = 0.5 * sum(bench.node.target)
    sense = 1 if stick is AHEAD else -1 if stick is BACK else 0
    assert bench.node.target == REST or stick is not CENTRE
    assert abs(mean) <= 1.5 * STEP or mean * sense > 0.0


@given(WHEELS, WHEELS)
def test_a_pc_that_drives_to_a_goal_follows_a_stick_that_is_grabbed(right, left):
    bench = Bench().helped().run(3.0, helped(CENTRE), command(right, left, 'C'))
    assert bench.node.mode == 2 and bench.node.target == pytest.approx((right, left), abs=0.06), 'it may drive alone'
    bench.run(RELEASE_S + 0.3, helped(BACK), command(right, left, 'C'))
    assert bench.node.target == REST or right + left < 3.0 * STEP


def test_after_the_stick_the_pc_may_drive_alone_when_it_has_stood():
    bench = Bench().driven().run(0.5, helped(CENTRE), command(0, 0, 'C'))
    assert bench.run(5.0, helped(CENTRE), command(1, 1, 'C')).node.target != REST


def test_a_gentle_stop_is_let_finish():
    bench, speed = Bench().driven(2.6, 2.6), 2.6
    while speed > 0.0:
        bench.run(0.02, helped(CENTRE), command(speed, speed, 'C'))
        assert bench.node.target != REST or speed < STEP
        speed -= 0.025
    assert bench.node.mode == 2


def law():
    """The rules alone, at the moment at which the PC has got control."""
    assistance = Assistance(MotorConfig.of(), STEP)
    assert assistance.on_stick(0.0, 1, Stick(2, 0, False)) == 0
    assistance.begin()
    return assistance


def heed(assistance, t, sense, deflected=None):
    assert assistance.on_stick(t, 2, Stick(2, sense, sense != 0 if deflected is None else deflected)) == 2


@pytest.mark.parametrize('sense', (1, -1))
@pytest.mark.parametrize('speed', (2.0, 0.4))
def test_a_command_follows_the_stick_either_way(sense, speed):
    one, go, back = law(), (speed * sense, 0.75 * speed * sense), (-speed * sense, -0.75 * speed * sense)
    heed(one, 1.0, sense)
    assert one.agrees(go, 1.0) and not one.agrees(back, 1.0), 'it did not move so before'
    heed(one, 5.0, sense)
    heed(one, 5.1, -sense)
    assert one.agrees(back, 5.1) and one.agrees(go, 5.0 + RELEASE_S) and not one.agrees(go, 5.01 + RELEASE_S)
    heed(one, 6.0, -sense)
    heed(one, 6.1, 0)
    assert one.agrees(back, 6.0 + RELEASE_S) and not one.agrees(back, 6.01 + RELEASE_S)
    assert one.agrees((0.0, 0.0), 99.0), 'a stop is right at any time'


@pytest.mark.parametrize('sense', (1, -1, 0))
def test_what_the_pc_drove_before_the_stick_was_moved_is_braked_in_time(sense):
    one, before = law(), (sense + 1.0, sense - 1.0)
    assert one.agrees(before, 50.0)
    heed(one, 60.0, -sense, True)
    assert one.agrees(before, 60.0 + RELEASE_S)
    heed(one, 60.0 + RELEASE_S, -sense, True)
    assert one.agrees(before, 60.01 + RELEASE_S) == (sense == 0), 'a stick to the side turns'


@pytest.mark.parametrize(
    'steps, agreed', (((1.25, 1.25), True), ((2, 0), True), ((-1, -1), True), ((2, 1), False), ((-1, -2), False))
)
def test_what_rounding_adds_to_a_turn_in_place_is_no_way(steps, agreed):
    one = law()
    heed(one, 1.0, 0, True)
    assert one.agrees((steps[0] * STEP, steps[1] * STEP), 1.0) == agreed
    assert one.agrees((5.0, -5.0), 1.0 + RELEASE_S) and not one.agrees((5.0, -5.0), 1.01 + RELEASE_S)


@pytest.mark.parametrize('wheels', ((-1.0, -1.0), (1.0, 1.0), (1.0, -1.0)))
def test_the_pc_follows_until_it_has_stood_with_the_stick_centred(wheels):
    one = law()
    heed(one, 1.0, 1)
    assert one.agrees((0.0, 0.0), 1.0)
    heed(one, 1.1, -1)
    heed(one, 1.2, 0)
    assert one.agrees(wheels, 1.3) and not one.agrees(wheels, 9.0), 'it stood while the stick was pushed'
    assert one.agrees((0.0, 0.0), 9.1) and one.agrees(wheels, 99.0)


def test_a_stick_that_is_held_from_the_beginning_is_none_that_was_held_while_the_switch_was_turned():
    assert Assistance(MotorConfig.of(), STEP).on_stick(0.0, 1, Stick(1, 1, True)) is None


def test_time_in_vain_is_counted_between_two_pushes_and_over_a_gap_little():
    def after(*pushes, notice=NOTICE_S):
        one = Assistance(MotorConfig.of(notice_time=notice), STEP)
        for t, deflected in ((0.0, False), *pushes):
            mode = one.on_stick(t, 0, Stick(2, int(deflected), deflected))
        return mode

    steady = tuple((0.05 * k, True) for k in range(1, 22))
    assert after(*steady, (1.1, False)) == 1 and after(*steady[:-2], (1.0, False)) == 0
    assert after((0.05, True), (9.0, True), (9.1, False)) == 0, 'nobody knows what was in between'
    assert after(*((0.2 * k, True) for k in range(1, 7)), (1.4, False)) == 1
    assert after((0.125, True), (0.25, True), (0.375, False), notice=0.25) == 1
    assert after(*((0.1 * k, False) for k in range(1, 30))) == 0
    assert after((0.2, True), (0.1, True), (0.2, False)) == 0, 'a clock that goes back'
    assert after(*steady, (0.6, True), (0.65, False)) == 1, 'and takes nothing back'


def test_the_joystick_node_says_what_its_switch_says():
    node = JoystickNode(BUS)
    node.receive(BUS.encode('MODO_PC', modoPC=3), 0.0)
    said = [node.update(0.01 * k, y=900 if k > 5 else 512, assisted=k > 2, on=k < 9) for k in range(10)]
    assert [BUS.decode(frames[0])[1]['modo'] for frames in said if frames] == [3, 2, 2, 0]
