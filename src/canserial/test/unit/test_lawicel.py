"""The stream of a Lawicel adapter: only frames pass, in order, however the bytes are cut; the rest is counted."""

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from canserial.adapter.lawicel import STATUS_PERIOD, STATUS_TRIES, LinePort, is_frame

FRAMES = st.booleans().flatmap(
    lambda extended: st.builds(
        lambda identifier, data, stamp: (
            (f'T{identifier:08X}' if extended else f't{identifier:03X}') + f'{len(data)}{data.hex()}{stamp}'
        ),
        st.integers(0, 2**29 - 1 if extended else 2**11 - 1),
        st.binary(max_size=8),
        st.sampled_from(['', '0F3a']),
    )
)
NOISE = st.text(alphabet='tTrRzZFV0189AFaf #\x00\xff', max_size=12).filter(
    lambda line: not is_frame(line.encode('latin1'))
)


class Port:
    """A serial port that gives what it was filled with."""

    def __init__(self, *chunks):
        self.chunks, self.written, self.write_timeout = list(chunks), [], None

    @property
    def in_waiting(self):
        return len(self.chunks[0]) if self.chunks else 0

    def read(self, size):
        return self.chunks.pop(0) if self.chunks else b''

    def write(self, data):
        self.written.append(data)


def make(*chunks, clock=lambda: 0.0):
    return LinePort(Port(*chunks), Counter(), clock)


@given(st.lists(FRAMES | NOISE), st.lists(st.integers(0, 400)))
def test_frames_pass_in_order_and_nothing_else_does(lines, cuts):
    stream = ''.join(line + '\r' for line in lines).encode('latin1')
    edges = [0, *sorted(min(cut, len(stream)) for cut in cuts), len(stream)]
    port = make()
    passed = b''.join(port.feed(stream[start:end]) for start, end in zip(edges, edges[1:]))
    assert passed == ''.join(line + '\r' for line in lines if is_frame(line.encode('latin1'))).encode('latin1')


@given(st.binary(max_size=300))
def test_any_bytes_pass_only_as_frames(data):
    for line in make().feed(data).split(b'\r')[:-1]:
        assert is_frame(line)


def test_what_the_grammar_allows():
    for line in (
        b't0000',
        b't7FF81122334455667788',
        b't1012aabb1234',
        b'T1FFFFFFF0',
        b'r1018',
        b'R000001230',
        b'd1019' + b'00' * 12,
        b'x000001231ff',
        b'B000001230',
    ):
        assert is_frame(line), line
    for line in (
        b'',
        b't',
        b't8000',
        b't1019',
        b't1018',
        b't101112345',
        b't 010',
        b't-010',
        b't1_10',
        b'T200000000',
        b'T1230',
        b'd101900',
        b't1012aab',
        b'V1013',
        b'z',
    ):
        assert not is_frame(line), line


def test_python_can_reads_it_byte_by_byte_without_asking_the_port_each_time():
    port = make(b't10120102\r', b't1010\r')
    assert b''.join(iter(port.read, b'')) == b't10120102\rt1010\r'
    assert port.in_waiting == 0


def test_a_line_that_never_ends_is_cut_off_and_counted_once():
    port = make()
    assert port.feed(b't' + b'0' * 100000 + b'\rt1010\r') == b't1010\r'
    assert port.counters == {'bad_lines': 1}


def test_refusals_are_counted_only_when_something_was_asked_of_an_open_channel():
    now = [0.0]
    port = make(clock=lambda: now[0])
    port.write(b't1010\r')
    port.feed(b'\a\a')
    assert not port.counters
    now[0] = 1.0
    port.feed(b'z\r\a')
    assert not port.counters
    port.write(b't1010\r')
    port.feed(b'\a')
    assert port.counters == {'refused': 1}


def test_status_flags_are_asked_for_once_a_second_and_counted():
    now = [0.0]
    port = make(clock=lambda: now[0])
    for _ in range(3):
        port.ask_status()
    assert port.written == []
    now[0] += STATUS_PERIOD
    port.ask_status()
    port.ask_status()
    assert port.written == [b'F\r']
    assert port.feed(b'F88\rt1010\r') == b't1010\r'
    assert port.counters == {'overruns': 1, 'bus_errors': 1}


def test_an_adapter_that_does_not_know_the_command_is_not_asked_for_ever():
    now = [0.0]
    port = make(clock=lambda: now[0])
    for _ in range(10):
        now[0] += STATUS_PERIOD
        port.ask_status()
        port.feed(b'\a')
    assert len(port.written) == STATUS_TRIES
