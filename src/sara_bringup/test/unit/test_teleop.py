"""Keys to commands: the peer's keys, a dead man's switch on every one of them, silence when there is nothing to say."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_bringup.missions.teleop import MOVES, SPEEDS, Decoder, Teleop, TeleopConfig

CONFIG = TeleopConfig()


@pytest.mark.parametrize(
    'key, v, w',
    (
        ('i', 1, 0),
        (',', -1, 0),
        ('j', 0, 1),
        ('l', 0, -1),
        ('u', 1, 1),
        ('o', 1, -1),
        ('m', -1, -1),
        ('.', -1, 1),
        ('up', 1, 0),
        ('down', -1, 0),
        ('left', 0, 1),
        ('right', 0, -1),
    ),
)
def test_the_keys_of_the_peer(key, v, w):
    teleop = Teleop(CONFIG)
    teleop.on_key(key, 5.0)
    assert teleop.command(5.0) == (v * 0.3, w * 0.4)


def test_silence_before_the_first_key_and_after_the_stop():
    teleop = Teleop(CONFIG)
    assert teleop.command(0.0) is None
    teleop.on_key('i', 1.0)
    assert teleop.command(1.0 + CONFIG.first_timeout) == (0.3, 0.0)
    said = [teleop.command(1.01 + CONFIG.first_timeout + 0.05 * k) for k in range(5)]
    assert said == [(0.0, 0.0)] * 3 + [None] * 2


def test_a_key_that_is_held_runs_out_soon_after_its_last_repeat():
    teleop = Teleop(CONFIG)
    for t in (0.0, 0.6, 0.64, 0.68):
        teleop.on_key('i', t)
    assert teleop.command(0.68 + CONFIG.repeat_timeout) == (0.3, 0.0)
    assert teleop.command(0.69 + CONFIG.repeat_timeout) == (0.0, 0.0)


def test_another_key_is_a_first_stroke_again():
    teleop = Teleop(CONFIG)
    teleop.on_key('i', 0.0)
    teleop.on_key('j', 0.1)
    assert teleop.command(0.1 + CONFIG.first_timeout) == (0.0, 0.4)


@pytest.mark.parametrize('key', ('k', ' ', '5', 'I', 'é', '\x1b', '\n', '\x03'))
def test_any_other_key_stops_at_once(key):
    teleop = Teleop(CONFIG)
    teleop.on_key('i', 0.0)
    teleop.on_key(key, 0.1)
    assert teleop.command(0.1) == (0.0, 0.0) and teleop.quit is (key == '\x03')


def test_speeds_grow_by_tenths_to_their_limits_and_what_drives_goes_on():
    teleop = Teleop(dataclasses.replace(CONFIG, speed=0.7))
    teleop.on_key('i', 0.0)
    teleop.on_key('w', 0.1)
    assert teleop.command(0.1) == (pytest.approx(0.77), 0.0) and teleop.said == 'speed 0.77 m/s, turning 0.40 rad/s'
    teleop.on_key('q', 0.2)
    assert (teleop.speed, teleop.turn) == (0.8, pytest.approx(0.44)) and 'speed at the limit' in teleop.said
    teleop.on_key('c', 0.3)
    assert (teleop.speed, teleop.turn) == (0.8, pytest.approx(0.396))


KEYS = st.sampled_from([*MOVES, *SPEEDS, 'k', 'I', '?'])


@given(st.lists(st.tuples(KEYS, st.floats(0.0, 1.5)), max_size=30))
def test_whatever_is_pressed_nothing_moves_longer_than_the_timeout_after_a_key_nor_faster_than_the_limits(strokes):
    teleop, t = Teleop(CONFIG), 0.0
    for key, wait in strokes:
        teleop.on_key(key, t)
        v, w = teleop.command(t) or (0.0, 0.0)
        assert abs(v) <= CONFIG.speed_limit and abs(w) <= CONFIG.turn_limit
        t += wait
    assert (teleop.command(t + CONFIG.first_timeout + 1e-6) or (0.0, 0.0)) == (0.0, 0.0)


@given(st.lists(st.sampled_from(['a', 'é', '\x1b[A', '\x1bOD', '\x1b[1;5C', '\x1b[3~', 'i'])), st.randoms())
def test_sequences_are_whole_however_reads_cut_them(pieces, random):
    text, decoder, keys = ''.join(pieces), Decoder(), []
    while text:
        cut = random.randint(1, len(text))
        keys += decoder.feed(text[:cut])
        text = text[cut:]
    assert keys == [
        {'\x1b[A': 'up', '\x1bOD': 'left', '\x1b[1;5C': '\x1b', '\x1b[3~': '\x1b'}.get(piece, piece) for piece in pieces
    ]


def test_a_lone_escape_is_a_key_once_another_follows():
    assert Decoder().feed('\x1bi') == ['\x1b', 'i']


def test_faults_name_the_parameter():
    assert CONFIG.faults() == []
    assert any('repeat_timeout' in fault for fault in dataclasses.replace(CONFIG, repeat_timeout=0.0).faults())
    assert any('speed is 0.9' in fault for fault in dataclasses.replace(CONFIG, speed=0.9).faults())


def test_an_escape_that_nothing_follows_is_a_key():
    decoder = Decoder()
    assert decoder.feed('i\x1b') == ['i'] and decoder.flush() == ['\x1b'] and decoder.flush() == []
    assert decoder.feed('\x1b[A') == ['up'] and decoder.flush() == []
