"""The bus description: round trips of every frame, and every refusal by its name."""

import math
import struct
from contextlib import suppress

import cantools
import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.dbc.bus import BadLength, BadValue, BusDescription, BusError, UnknownFrame, packaged
from canserial.dbc.modes import has_assisted, modes_of
from canserial.frame import Frame
from canserial.reader.config import ReaderConfig
from canserial.reader.reader import Reader
from sara_common.platforms import load

BUS = BusDescription.default()
PACKAGED = packaged()
BUSES = {name: BusDescription.named(name) for name in PACKAGED}
DATABASES = {name: cantools.database.load_file(str(PACKAGED[name])) for name in PACKAGED}
MESSAGES = [(bus, message) for bus, database in DATABASES.items() for message in database.messages]
KINDS = st.sampled_from(MESSAGES)


def text_of(name):
    return PACKAGED[name].read_text()


def used_bits(message):
    return sum(((1 << signal.length) - 1) << signal.start for signal in message.signals)


@given(KINDS, st.binary(min_size=8, max_size=8))
def test_decode_then_encode_gives_the_same_bytes(kind, data):
    name, message = kind
    bus = BUSES[name]
    data = (int.from_bytes(data, 'little') & used_bits(message)).to_bytes(8, 'little')
    decoded_name, values = bus.decode(Frame(bus.id_of(message.name), data))
    assert decoded_name == message.name
    assert bus.encode(message.name, **values).data == data


@given(KINDS, st.data())
def test_encoding_rounds_to_half_a_step(kind, data):
    name, message = kind
    values = {}
    for signal in message.signals:
        low, high = (
            (-(1 << signal.length - 1), (1 << signal.length - 1) - 1)
            if signal.is_signed
            else (0, (1 << signal.length) - 1)
        )
        values[signal.name] = data.draw(st.floats(low * signal.scale, high * signal.scale))
    frame = BUSES[name].encode(message.name, **values)
    for key, value in BUSES[name].decode(frame)[1].items():
        scale = message.get_signal_by_name(key).scale
        assert abs(value - values[key]) <= 0.5 * scale + 1e-6 * scale
        assert BUSES[name].resolution(message.name, key) == scale


def kinds_of_signals():
    """One (bus, message, signal) of each kind of at most 16 bits: width, sign, step."""
    kinds = {}
    for name, message in MESSAGES:
        for signal in message.signals:
            if signal.length <= 16:
                kinds.setdefault((signal.length, signal.is_signed, signal.scale), (name, message, signal))
    return kinds


@pytest.mark.parametrize('kind', kinds_of_signals(), ids=str)
def test_every_value_of_a_signal_survives(kind):
    name, message, signal = kinds_of_signals()[kind]
    bus, (length, signed, scale) = BUSES[name], kind
    values = {other.name: 0 for other in message.signals}
    low = -(1 << length - 1) if signed else 0
    for raw in range(low, low + (1 << length)):
        values[signal.name] = raw * scale
        frame = bus.encode(message.name, **values)
        bits = int.from_bytes(frame.data, 'little') >> signal.start & (1 << length) - 1
        assert bits == raw % (1 << length)
        assert round(bus.decode(frame)[1][signal.name] / scale) == raw


def test_the_two_files_differ_in_the_step_of_the_rates_alone():
    hundredths, tenths = (text_of(name) for name in ('sara', 'sara_tenths'))
    hundredths = hundredths.replace('VERSION "SARA 1"', 'VERSION "SARA 1, angular velocity in tenths"')
    assert hundredths.count('(0.01,0) [0|0] "deg/s"') == 3
    assert tenths == hundredths.replace('(0.01,0) [0|0] "deg/s"', '(0.1,0) [0|0] "deg/s"')
    assert [BUSES[name].resolution('IMPACT_GYRO', 'gz') for name in ('sara', 'sara_tenths')] == [0.01, 0.1]


def test_the_assisted_bus_has_the_same_bytes_and_three_more_names_of_values():
    plain, assisted = (
        [line for line in text_of(name).splitlines() if not line.startswith(('VERSION', 'CM_'))]
        for name in ('sara', 'sara_assisted')
    )
    assert [new for old, new in zip(plain, assisted, strict=True) if old != new] == [
        'VAL_ 272 modo 0 "off" 1 "manual" 2 "assisted" 3 "PC" ;',
        'VAL_ 273 modoPC 0 "nobody" 1 "joystick" 2 "PC, which helps the joystick" 3 "PC" ;',
        'VAL_ 288 mode 65 "A" 67 "C" 72 "H" ;',
    ]
    assert [name for name in PACKAGED if has_assisted(BUSES[name])] == ['sara_assisted']
    assert modes_of(BUS) == {0, 1, 3} and modes_of(BUSES['sara_assisted']) == {0, 1, 2, 3}


def test_frames_of_saras_bus_as_bytes():
    """Spot values worked out by hand from the table of the bus, in wire order."""
    bus = BUSES['sara']
    assert bus.decode(Frame(0x101, bytes.fromhex('00fa000010270000')))[1] == {'steps': 64000, 'time': 10000}
    assert bus.decode(Frame(0x203, bytes.fromhex('64005226f6ff0a00')))[1] == pytest.approx(
        {'SJO': 1.0, 'az': 9.81, 'ay': -0.01, 'ax': 0.01}
    )
    assert bus.decode(Frame(0x204, bytes.fromhex('0100beff00007b00')))[1] == pytest.approx(
        {'alarma': 1, 'gz': -0.66, 'gy': 0.0, 'gx': 1.23}
    )
    assert bus.encode('WHEEL_COMMAND', right=2.0, left=-2.0, mode=ord('C')).data == bytes.fromhex('13ed000043000000')
    assert bus.id_of('BATTERY') == 0x210


def test_every_message_has_eight_bytes_and_no_two_signals_overlap():
    for _, message in MESSAGES:
        assert message.length == 8
        assert used_bits(message).bit_count() == sum(signal.length for signal in message.signals)


@pytest.mark.parametrize('bad', [math.nan, math.inf, -0.6, 5e9])
def test_values_that_do_not_fit_are_refused(bad):
    with pytest.raises(BadValue, match='ENCODER_LEFT.steps'):
        BUS.encode('ENCODER_LEFT', steps=bad, time=0)


def test_missing_and_unknown_signals_are_named():
    with pytest.raises(BadValue, match='missing.*time.*unknown.*speed'):
        BUS.encode('ENCODER_LEFT', steps=0, speed=0)


@given(st.integers(0, 0x7FF), st.binary(max_size=8), st.booleans())
def test_any_frame_decodes_or_is_refused_by_name(identifier, data, extended):
    with suppress(UnknownFrame, BadLength):
        BUS.decode(Frame(identifier, data, 0.0, extended))


OTHER = """BO_ 900 OTHER: 8 SENSOR
 SG_ part M : 0|8@1+ (1,0) [0|0] "" PC
 SG_ a m0 : 8|8@1+ (1,0) [0|0] "" PC
 SG_ b m1 : 8|8@1+ (1,0) [0|0] "" PC

BO_ 901 RATE: 4 SENSOR
 SG_ rate : 0|32@1- (1,0) [0|0] "" PC

"""


def test_what_cantools_cannot_unpack_and_what_is_no_number_is_refused_by_name(tmp_path):
    """Multiplexed signals of an unknown part; floats that are none."""
    file, text = tmp_path / 'other.dbc', text_of('sara')
    start = text.index('BO_ ')
    file.write_text(text[:start] + OTHER + text[start:] + '\nSIG_VALTYPE_ 901 rate : 1;\n')
    bus = BusDescription(file)
    assert bus.decode(Frame(900, bytes([1, 7, *[0] * 6]))) == ('OTHER', {'part': 1, 'b': 7})
    assert bus.decode(Frame(901, struct.pack('<f', 1.5))) == ('RATE', {'rate': 1.5})
    reader = Reader(ReaderConfig.of(), bus)
    for frame in (Frame(900, bytes([7] * 8), 1.0), Frame(901, struct.pack('<f', math.nan), 1.1)):
        with pytest.raises(BadValue, match='OTHER|RATE'):
            bus.decode(frame)
        assert reader.on_frame(frame) == []
    assert reader.counters['bad_value'] == 2


def test_an_unknown_message_and_a_missing_file_are_named():
    with pytest.raises(UnknownFrame, match='BRAKE'):
        BUS.encode('BRAKE')
    with pytest.raises(BusError, match='nowhere.dbc'):
        BusDescription('nowhere.dbc')
    with pytest.raises(BusError, match="'sahra', allowed are kate, sara, sara_assisted, sara_tenths or the path"):
        BusDescription.named('sahra')


def test_a_description_is_found_by_name_or_path_and_read_once():
    assert BusDescription.named('sara') is BusDescription.of(load('sara'))
    assert BusDescription.named(str(PACKAGED['sara_tenths'])) is BusDescription.named('sara_tenths')


def test_the_compass_adds_a_frame_to_any_bus_and_changes_none():
    for name in PACKAGED:
        both = BusDescription.named(f'{name}+compass')
        assert both.names == (*BUSES[name].names, 'COMPASS') and both.comment == BUSES[name].comment
        assert both.nodes == BUSES[name].nodes and both is BusDescription.named(f'{name}+compass')
    assert both.decode(both.encode('COMPASS', mx=12.34, my=-327.68, mz=-0.01)) == (
        'COMPASS',
        pytest.approx({'mx': 12.34, 'my': -327.68, 'mz': -0.01}),
    )
    assert both.encode('COMPASS', mx=0.01, my=0.02, mz=-0.01) == Frame(0x207, bytes.fromhex('0000ffff02000100'))


def test_additions_are_named_and_may_describe_nothing_twice(tmp_path):
    with pytest.raises(BusError, match=r"'sara\+radar', allowed are .* behind it \+compass"):
        BusDescription.named('sara+radar')
    with pytest.raises(BusError, match=r"'sahra\+compass', allowed are"):
        BusDescription.named('sahra+compass')
    assert BusDescription.named('+compass', load('sara')) is BusDescription.named('sara+compass')
    with pytest.raises(BusError, match='describe the same frame twice'):
        BusDescription.named('sara+compass+compass')
    odd = tmp_path / 'a+b.dbc'
    odd.write_text(text_of('sara'))
    assert BusDescription.named(odd).names == BUS.names
    assert BusDescription.named(f'{odd.rename(tmp_path / "own.dbc")}+compass').names[-1] == 'COMPASS'
