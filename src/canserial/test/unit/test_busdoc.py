"""The document of the bus: docs/bus.md is what the command prints, and every signal of any DBC has its row."""

import re
from pathlib import Path

import pytest

from canserial.dbc import busdoc
from canserial.dbc.bus import BusDescription, packaged
from canserial.dbc.busdoc import markdown

BIG_ENDIAN = """VERSION ""
NS_ :
BS_:
BU_: A
BO_ 2147483649 LONG: 8 A
 SG_ big : 7|16@0- (0.5,-3) [0|0] "K" Vector__XXX
"""
TWINS = """
BO_ 1 FIRST: 2 A
 SG_ small : 0|8@1+ (2,0) [0|0] "" Vector__XXX
BO_ 2 SECOND: 3 A
 SG_ small : 0|8@1+ (2,0) [0|0] "" Vector__XXX
"""


def test_the_committed_document_is_what_the_command_prints():
    committed = Path(__file__).resolve().parents[2] / 'docs' / 'bus.md'
    assert committed.read_text() == markdown(BusDescription.named('sara')), (
        'rosrun canserial bus2md sara > src/canserial/docs/bus.md'
    )


@pytest.mark.parametrize('name', [*packaged(), '+compass'])
def test_every_signal_is_described(name):
    bus = BusDescription.named(name)
    text = markdown(bus)
    for message in bus.messages:
        assert message.cycle_time and f'0x{message.frame_id:03X} {message.name}' in text
        for signal in message.signals:
            assert signal.comment and re.search(rf'`{signal.name}`: .*{re.escape(signal.comment)}', text, re.IGNORECASE)


def test_a_bus_of_another_kind(tmp_path):
    path = tmp_path / 'other.dbc'
    path.write_text(BIG_ENDIAN)
    text = markdown(BusDescription.named(str(path)))
    assert '## 0x00000001 LONG\n`A` to -.\n\n- `big`: from 7, int16, big-endian, 0.5 K, offset -3\n' in text


def test_messages_with_the_same_signals_share_a_section(tmp_path):
    path = tmp_path / 'twins.dbc'
    path.write_text(BIG_ENDIAN + TWINS)
    text = markdown(BusDescription.named(str(path)))
    assert '## 0x001 FIRST, 0x002 SECOND\n`A` to -, 2 bytes.\n`A` to -, 3 bytes.\n\n- `small`: 0..7, uint8, 2' in text
    assert text.count('`small`') == 1


def test_the_command(capsys):
    for name, bus in (('sara', BusDescription.named('sara')), (None, BusDescription.default())):
        busdoc.main([name] if name else [])
        assert capsys.readouterr().out == markdown(bus)
    with pytest.raises(SystemExit):
        busdoc.main(['none'])
    assert 'allowed are kate, sara, sara_assisted, sara_tenths or the path of a DBC file' in capsys.readouterr().err
