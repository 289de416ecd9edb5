"""The adapter's protocol: frames survive the trip, anything else gets an answer and does no harm."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.frame import Frame
from sara_sim.bus.lawicel import LawicelAdapter

CR, BEL = b'\r', b'\a'
COMMANDS = [b'S6\r', b'O\r', b'C\r', b't1208', b'L\r', b'\r', b'Z1\r', b't12080A0A000043000000\r']


def opened():
    adapter = LawicelAdapter()
    assert adapter.feed(b'\r\rC\rS6\rO\r') == (CR + CR + BEL + CR + CR, [])
    return adapter


frames = st.one_of(
    st.builds(Frame, st.integers(0, 0x7FF), st.binary(max_size=8), st.just(0.0), st.just(False)),
    st.builds(Frame, st.integers(0, 0x1FFFFFFF), st.binary(max_size=8), st.just(0.0), st.just(True)),
)


@given(st.lists(frames, max_size=5), st.integers(1, 9))
def test_what_goes_out_can_come_in_again_in_any_pieces(sent, size):
    adapter = opened()
    wire = b''.join(map(adapter.frame_bytes, sent))
    heard, answers = [], b''
    for start in range(0, len(wire), size):
        answer, some = adapter.feed(wire[start : start + size])
        answers += answer
        heard += some
    assert heard == sent
    assert answers == b''.join(b'Z\r' if frame.extended else b'z\r' for frame in sent)


@given(st.lists(st.one_of(st.binary(max_size=60), st.sampled_from(COMMANDS))))
def test_any_bytes_are_answered_line_by_line_and_never_raise(pieces):
    adapter = LawicelAdapter()
    adapter.feed(b'S6\rO\r')
    lines, answers = 0, 0
    for piece in pieces:
        answer, heard = adapter.feed(piece)
        lines += piece.count(CR)
        answers += answer.count(CR) + answer.count(BEL)
        assert all(0 <= frame.id <= 0x1FFFFFFF and len(frame.data) <= 8 for frame in heard)
        assert len(adapter._line) <= 64
    assert answers == lines


@given(frames)
def test_closed_channel_carries_nothing(frame):
    adapter = LawicelAdapter()
    assert adapter.frame_bytes(frame) == b''
    assert adapter.feed(opened().frame_bytes(frame)) == (BEL, [])


@pytest.mark.parametrize('rate', range(9))
def test_every_bit_rate_opens(rate):
    adapter = LawicelAdapter()
    assert adapter.feed(b'S%d\rO\r' % rate)[0] == CR + CR
    assert adapter.bit_rate == rate and adapter.closed == 0
    assert adapter.feed(b'C\rC\r')[0] == CR + BEL and adapter.closed == 1


@pytest.mark.parametrize(
    'line, answer',
    [
        (b'V', b'V1013\r'),
        (b'N', b'NSARA\r'),
        (b'F', b'F00\r'),
        (b'O', BEL),
        (b'S6', BEL),
        (b'Z1', BEL),
        (b'x', BEL),
        (b'', CR),
        (b't1208000000000000000', BEL),
        (b't12090000000000000000AA', BEL),
        (b't8000', BEL),
        (b't12G0', BEL),
        (b'T200000000', BEL),
        (b'r1208', b'z\r'),
        (b'R1FFFFFFF0', b'Z\r'),
        (b't' * 200, BEL),
    ],
)
def test_answers_while_open(line, answer):
    assert opened().feed(line + CR) == (answer, [])


def test_opens_only_after_a_bit_rate_and_listen_only_does_not_send():
    adapter = LawicelAdapter()
    assert adapter.feed(b'O\r')[0] == BEL
    assert adapter.feed(b'S6\rL\r')[0] == CR + CR
    assert adapter.feed(b't1230\r') == (BEL, [])
    assert adapter.frame_bytes(Frame(0x123, b'')) == b't1230\r'


def test_stamps_are_milliseconds_modulo_a_minute():
    adapter = LawicelAdapter()
    adapter.feed(b'S6\rZ1\rO\r')
    assert adapter.frame_bytes(Frame(0x111, b'\x03', 61.5)) == b't111103' + b'05DC\r'


def test_overrun_is_told_once():
    adapter = opened()
    adapter.overrun()
    assert adapter.feed(b'F\rF\r')[0] == b'F08\rF00\r'


@pytest.mark.parametrize('rate', range(9))
def test_only_the_buss_own_bit_rate_carries_frames(rate):
    adapter = LawicelAdapter(bus_rate=250000)
    adapter.feed(b'S%d\rO\r' % rate)
    frame = Frame(0x123, b'\x01\x02')
    passes = rate == 5
    assert adapter.agrees == passes
    assert bool(adapter.frame_bytes(frame)) == passes
    assert adapter.feed(b't1230\r') == (b'z\r', [Frame(0x123, b'')] if passes else [])
    status = adapter.feed(b'F\r')[0]
    assert status == (b'F00\r' if passes else b'FA4\r'), 'warning, error passive, bus error'


def test_what_the_bus_does_not_take_fills_the_adapter():
    adapter = LawicelAdapter()
    adapter.feed(b'S5\rO\r')
    assert [adapter.feed(b't1230\r')[0] for _ in range(10)] == [b'z\r'] * 8 + [BEL] * 2
    assert adapter.feed(b'F\rF\r')[0] == b'FA6\rF00\r'
    assert adapter.feed(b'C\rS6\rO\rt1230\r')[0] == CR * 3 + b'z\r'


@pytest.mark.parametrize(
    'registers, rate', [(b'001C', 500000), (b'011C', 250000), (b'031C', 125000), (b'0014', 1000000), (b'311C', 10000)]
)
def test_bus_timing_registers_are_a_bit_rate(registers, rate):
    adapter = LawicelAdapter(bus_rate=rate)
    assert adapter.feed(b's' + registers + b'\rO\r')[0] == CR + CR
    assert adapter.agrees and adapter.frame_bytes(Frame(0x1, b''))


def filtered(code, mask):
    adapter = LawicelAdapter()
    assert adapter.feed(b'S6\rM%s\rm%s\rO\r' % (code, mask))[0] == CR * 4
    return adapter


@given(st.integers(0, 0x7FF), st.integers(0, 0x7FF), st.integers(0, 0x7FF), st.binary(max_size=8))
def test_the_filters_pass_what_agrees_where_they_compare(identifier, code, compared, data):
    """Both filters alike, on all bits of the identifier that `compared` has."""
    half_code, half_mask = code << 5, ~(compared << 5) & 0xFFFF
    adapter = filtered(b'%04X%04X' % (half_code, half_code), b'%04X%04X' % (half_mask, half_mask))
    passes = not (identifier ^ code) & compared
    assert bool(adapter.frame_bytes(Frame(identifier, data))) == passes


def test_two_filters_pass_either_and_the_first_looks_at_the_data_too():
    adapter = filtered(b'%04X%04X' % (0x204 << 5, 0x101 << 5), b'001F001F')
    assert [bool(adapter.frame_bytes(Frame(identifier, bytes(8)))) for identifier in (0x101, 0x102, 0x203, 0x204)] == [
        True,
        False,
        False,
        True,
    ]
    adapter = filtered(b'%04X%04X' % (0x204 << 5 | 0xA, 0x7FF << 5 | 0x5), b'00000010')
    assert [bool(adapter.frame_bytes(Frame(0x204, bytes([byte])))) for byte in (0xA5, 0xA4, 0x55)] == [
        True,
        False,
        False,
    ]
    assert adapter.counts['filtered'] == 2


@given(st.integers(0, 0x1FFFFFFF), st.integers(0, 0xFFFF))
def test_extended_frames_are_compared_in_their_upper_16_bits(identifier, code):
    adapter = filtered(b'%04X%04X' % (code, code), b'00000000')
    assert bool(adapter.frame_bytes(Frame(identifier, b'', 0.0, True))) == (identifier >> 13 == code)


def test_filters_are_set_only_between_bit_rate_and_opening():
    adapter = LawicelAdapter()
    assert adapter.feed(b'M00000000\r')[0] == BEL
    assert adapter.feed(b'S6\rM0000000\rmGGGGGGGG\rO\rm00000000\r')[0] == CR + BEL + BEL + CR + BEL
