"""Lines of candump: round trips exact to the microsecond, every other kind told apart, bad lines refused; cantools
reads what we write.
"""

import subprocess
import sys
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from canserial.adapter.candump import BadLine, Line, parse, to_line
from canserial.dbc.bus import BusDescription
from canserial.frame import Frame

FRAMES = st.booleans().flatmap(
    lambda extended: st.builds(
        lambda identifier, data: Frame(identifier, data, 0.0, extended),
        st.integers(0, 2**29 - 1 if extended else 2**11 - 1),
        st.binary(max_size=8),
    )
)


@given(FRAMES, st.integers(0, 4 * 10**15), st.sampled_from(['can0', 'vcan1', 'slcan0', '0']))
def test_written_then_read_is_the_same_to_the_microsecond(frame, microseconds, interface):
    line = parse(to_line(frame, interface, microseconds))
    assert line[:3] == (microseconds, interface, 'data')
    assert line.frame == Frame(frame.id, frame.data, microseconds / 1e6, frame.extended)
    assert to_line(line.frame, interface) == to_line(frame, interface, microseconds)


@given(st.text(max_size=60))
def test_any_text_is_a_line_or_refused(text):
    with suppress(BadLine):
        assert isinstance(parse(text), Line)


@pytest.mark.parametrize(
    'text, microseconds, kind, frame',
    [
        (
            '(1612345678.123456) can0 204#0011223344556677\n',
            1612345678123456,
            'data',
            (0x204, '0011223344556677', False),
        ),
        ('(1.000001) can0 00000204#', 1000001, 'data', (0x204, '', True)),
        ('(1.5) can0 204#aB R\r\n', 1500000, 'data', (0x204, 'ab', False)),
        ('(1.123456789) can0 204#01 T', 1123456, 'data', (0x204, '01', False)),
        ('(1.0) can0 204#0011223344556677_F', 1000000, 'data', (0x204, '0011223344556677', False)),
        ('(1.0) can0 204#R', 1000000, 'remote', None),
        ('(1.0) can0 204#R8', 1000000, 'remote', None),
        ('(1.0) can0 204##3' + 12 * '00', 1000000, 'fd', None),
        ('(1.0) can0 20000004#0001000000000000', 1000000, 'error', None),
    ],
)
def test_kinds_of_lines(text, microseconds, kind, frame):
    line = parse(text)
    assert (line.microseconds, line.kind) == (microseconds, kind)
    assert line.frame == (frame and Frame(frame[0], bytes.fromhex(frame[1]), microseconds / 1e6, frame[2]))


@pytest.mark.parametrize(
    'text',
    [
        '',
        'rubbish',
        '1.0 can0 204#',
        '(1.0) can0 204',
        '(1.0) can0 204#1',
        '(1.0) can0 204#' + 18 * '0',
        '(1.0) can0 20#',
        '(1.0) can0 -04#',
        '(1.0) can0 800#',
        '(nan) can0 204#',
        '(1.0) can0 204#R9',
        '(-1.0) can0 204#',
        '(1.0) can0 204#00 X',
        '(1.0)  204#00',
        '(1.0) can0 0_4#00',
        '(1.0) can0 C0000000#',
    ],
)
def test_bad_lines_are_refused(text):
    with pytest.raises(BadLine):
        parse(text)


def test_cantools_decodes_what_is_written():
    bus = BusDescription.default()
    values = {'alarma': 1, 'gz': -0.65, 'gy': 0.0, 'gx': 12.34}
    log = (
        to_line(bus.encode('IMPACT_GYRO', 12.345678, **values))
        + '\n'
        + to_line(bus.encode('BATTERY', 13.0, voltage=24.5))
        + '\n'
    )
    done = subprocess.run(
        [sys.executable, '-m', 'cantools', 'decode', '--single-line', bus.path],
        input=log,
        text=True,
        capture_output=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    first, second = done.stdout.splitlines()
    assert 'IMPACT_GYRO(alarma: 1, gz: -0.65 deg/s, gy: 0.0 deg/s, gx: 12.34 deg/s)' in first
    assert 'BATTERY(voltage: 24.5 V)' in second
