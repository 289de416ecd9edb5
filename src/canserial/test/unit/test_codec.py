"""Packing with `struct` against cantools, on SARA's bus and on messages laid out in other ways."""

import cantools
import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BadValue, BusDescription, packaged
from canserial.dbc.codec import Codec
from canserial.frame import Frame

OTHERS = """VERSION ""
NS_ :
BS_:
BU_: A
BO_ 1 MOTOROLA: 8 A
 SG_ big : 7|32@0- (0.5,-3) [0|0] "" A
 SG_ small : 47|16@0+ (1,0) [0|0] "" A
BO_ 2 BITS: 2 A
 SG_ flag : 0|1@1+ (1,0) [0|0] "" A
 SG_ rest : 1|15@1+ (1,0) [0|0] "" A
BO_ 3 MIXED: 4 A
 SG_ little : 0|16@1+ (1,0) [0|0] "" A
 SG_ big : 23|16@0+ (1,0) [0|0] "" A
BO_ 4 CHOSEN: 4 A
 SG_ which M : 0|8@1+ (1,0) [0|0] "" A
 SG_ one m0 : 8|8@1+ (1,0) [0|0] "" A
 SG_ two m1 : 8|16@1+ (1,0) [0|0] "" A
BO_ 5 REAL: 4 A
 SG_ real : 0|32@1- (1,0) [0|0] "" A
BO_ 6 ODD: 4 A
 SG_ three : 0|24@1+ (1,0) [0|0] "" A
BO_ 7 LABELS: 2 A
 SG_ state : 8|8@1+ (2,1) [0|0] "" A
BO_ 8 WIDE: 9 A
 SG_ eight : 8|64@1- (1,0) [0|0] "" A
SIG_VALTYPE_ 5 real : 1;
VAL_ 7 state 1 "on" 0 "off" ;
"""
OTHER = {message.name: message for message in cantools.database.load_string(OTHERS, 'dbc').messages}
PLAIN = [message for name in packaged() for message in BusDescription.named(name).messages] + [
    OTHER[name] for name in ('MOTOROLA', 'LABELS', 'WIDE')
]


def test_every_message_of_sara_has_a_codec_and_what_is_laid_out_otherwise_has_none():
    assert all(Codec.of(message) for message in PLAIN)
    assert not any(Codec.of(OTHER[name]) for name in ('BITS', 'MIXED', 'CHOSEN', 'REAL', 'ODD'))


@given(st.sampled_from(PLAIN), st.data())
def test_bytes_are_unpacked_and_packed_as_cantools_does(message, data):
    raw = data.draw(st.binary(min_size=message.length, max_size=message.length))
    codec, values = Codec.of(message), message.decode(raw, decode_choices=False)
    assert codec.decode(raw) == values
    assert codec.encode(values) == message.encode(values, strict=False)


@given(st.sampled_from(PLAIN), st.data())
def test_values_between_the_steps_are_rounded_as_cantools_does(message, data):
    def span(signal):
        ends = [end * signal.scale + signal.offset for end in (-100.0 if signal.is_signed else 0.0, 100.0)]
        return st.floats(min(ends), max(ends))

    values = {signal.name: data.draw(span(signal)) for signal in message.signals}
    assert Codec.of(message).encode(values) == message.encode(values, strict=False)


def test_a_message_without_a_codec_goes_through_cantools(tmp_path):
    path = tmp_path / 'other.dbc'
    path.write_text(OTHERS)
    bus = BusDescription.named(str(path))
    frame = bus.encode('BITS', flag=1, rest=1234)
    assert frame == Frame(2, bytes([0xA5, 0x09]), 0.0, False)
    assert bus.decode(frame) == ('BITS', {'flag': 1, 'rest': 1234})


@pytest.mark.parametrize('bad', ['x', None, float('nan'), float('inf'), 1e300, 128 * 2 / 19 + 1])
def test_what_is_no_number_or_does_not_fit_is_refused_by_name(bad):
    with pytest.raises(BadValue, match='WHEEL_COMMAND.right is'):
        BusDescription.default().encode('WHEEL_COMMAND', right=bad, left=0.0, mode=67)
