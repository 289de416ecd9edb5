"""The joystick's axes become wheel commands: nothing at the centre, symmetric, no jump at the dead band's edge."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BusDescription
from sara_common.config import ConfigError
from sara_lowlevel.config import JoystickConfig
from sara_lowlevel.joystick.joystick_node import JoystickNode

BUS = BusDescription.default()


def said(x, y, on=True):
    (frame,) = JoystickNode(BUS).update(0.0, x, y, on)
    return BUS.decode(frame)[1]


@given(st.integers(-40, 40), st.integers(-40, 40))
def test_nothing_inside_the_dead_band(x, y):
    values = said(512 + x, 512 + y)
    assert values['velD'] == values['velI'] == 0 and values['joyx'] == 512 + x


@given(st.integers(0, 1023), st.integers(0, 1023))
def test_mirrored_stick_mirrors_the_wheels(x, y):
    a, b = said(x, y), said(min(1024 - x, 1023), y)
    assert abs(a['velD'] - b['velI']) <= 1 / 9.5 + 1e-9


def test_forward_and_right():
    forward, right = said(512, 1023), said(1023, 512)
    assert forward['velD'] == forward['velI'] > 2.5
    assert right['velD'] < 0 < right['velI']
    assert said(512, 1023, on=False)['modo'] == 0 and said(512, 1023, on=False)['velD'] == 0


@pytest.mark.parametrize('forward, turn, fits', [(9.0, 4.3, True), (3.0, 10.36, True), (10.0, 5.0, False)])
def test_what_the_frame_cannot_hold_is_refused_at_the_start_not_in_a_corner_of_the_stick(forward, turn, fits):
    config = JoystickConfig.of(max_forward=forward, max_turn=turn)
    if not fits:
        with pytest.raises(ConfigError, match='10 and 5 rad/s, allowed are 13.37 together'):
            JoystickNode(BUS, config)
        return
    for x, y in itertools.product((0, 1023), repeat=2):
        (frame,) = JoystickNode(BUS, config).update(0.0, x, y)
        values = BUS.decode(frame)[1]
        assert max(abs(values['velD']), abs(values['velI'])) == pytest.approx(forward + turn, abs=0.08)


def test_tells_a_change_at_once_and_otherwise_every_100_ms():
    node = JoystickNode(BUS)
    sent = [len(node.update(tick / 100, 512, 512 if tick < 33 else 900)) for tick in range(100)]
    assert sum(sent) == 11 and sent[33] == 1
    node.receive(BUS.encode('MODO_PC', modoPC=3), 1.0)
    (frame,) = node.update(1.0)
    assert BUS.decode(frame)[1]['modo'] == 3
