"""The adapter over python-can's virtual bus and over a pseudo-terminal: frames both ways, and every way of going away."""

import os
import pty
import threading
import tty

import can
import pytest
from canserial.adapter import Adapter, AdapterConfig, AdapterError, BadFrame
from canserial.config import ConfigError
from canserial.frame import Frame
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st


@pytest.fixture
def pair():
    config = AdapterConfig(interface='virtual', port='canserial_unit')
    here, there = Adapter(config), Adapter(config)
    here.open()
    there.open()
    yield here, there
    here.close()
    there.close()


@given(st.booleans().flatmap(lambda e: st.tuples(st.integers(0, 0x1FFFFFFF if e else 0x7FF), st.just(e))),
       st.binary(max_size=8))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_sent_arrives_stamped_by_the_clock(pair, identifier, data):
    here, there = pair
    here.send(Frame(identifier[0], data, 0.0, identifier[1]))
    assert there.receive(1.0, lambda: 12.5) == Frame(identifier[0], data, 12.5, identifier[1])


@pytest.mark.parametrize('frame', [Frame(0x800, b''), Frame(-1, b''), Frame(1, bytes(9)), Frame(2 ** 29, b'', 0.0, True)])
def test_what_can_cannot_carry_is_refused(pair, frame):
    with pytest.raises(BadFrame):
        pair[0].send(frame)


def test_remote_frames_are_counted_not_given_out(pair):
    with can.Bus(interface='virtual', channel='canserial_unit') as other:
        other.send(can.Message(arbitration_id=1, is_remote_frame=True))
    assert pair[0].receive(1.0, lambda: 0.0) is None
    assert pair[0].counters['not_data_frames'] == 1


def test_a_closed_and_a_missing_adapter_raise_one_kind_of_error():
    adapter = Adapter(AdapterConfig(port='/dev/no_such_adapter'))
    with pytest.raises(AdapterError, match='no_such_adapter'):
        adapter.open()
    with pytest.raises(AdapterError):
        adapter.send(Frame(1, b''))
    with pytest.raises(AdapterError):
        adapter.receive(0.01, lambda: 0.0)
    adapter.close()


class Terminal:
    """A pseudo-terminal whose far end swallows commands."""

    def __init__(self):
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.seen = b''
        self.thread = threading.Thread(target=self.read)
        self.thread.start()

    def read(self):
        try:
            while chunk := os.read(self.master, 100):
                self.seen += chunk
        except OSError:
            pass


def test_lines_that_are_no_frames_are_counted_and_unplugging_is_an_adapter_error():
    terminal = Terminal()
    adapter = Adapter(AdapterConfig(port=os.ttyname(terminal.slave), bitrate=800000))
    adapter.open()
    os.write(terminal.master, b'\r\rt12\rt1012zz\rt10120102\r')
    frames = [adapter.receive(0.1, lambda: 1.0) for _ in range(6)]
    assert [frame for frame in frames if frame] == [Frame(0x101, b'\x01\x02', 1.0)]
    assert adapter.counters['bad_lines'] == 2
    os.write(terminal.master, b'\xff\xfe\r')
    with pytest.raises(AdapterError, match='decode'):
        adapter.receive(0.5, lambda: 1.0)
    os.close(terminal.slave)
    adapter.close()
    terminal.thread.join(2.0)
    assert b'S7\r' in terminal.seen
    os.close(terminal.master)


def test_an_adapter_pulled_out_while_open():
    terminal = Terminal()
    adapter = Adapter(AdapterConfig(port=os.ttyname(terminal.slave)))
    adapter.open()
    os.close(terminal.slave)
    os.dup2(os.open('/dev/null', os.O_RDONLY), terminal.master)  # the far end goes away under the reading thread
    with pytest.raises(AdapterError):
        for _ in range(20):
            adapter.receive(0.05, lambda: 0.0)
            adapter.send(Frame(1, b'12345678'))
    adapter.close()
    assert not adapter.is_open
    os.close(terminal.master)


def test_configuration_faults_are_named_all_at_once():
    with pytest.raises(ConfigError, match="interface is 'usb'.*port is ''.*bitrate is -1"):
        AdapterConfig(interface='usb', port='', bitrate=-1)
    with pytest.raises(ConfigError, match='bitrate is 123, allowed with slcan'):
        AdapterConfig(bitrate=123)
