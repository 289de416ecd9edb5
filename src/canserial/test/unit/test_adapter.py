"""The adapter over python-can's virtual bus and over a pseudo-terminal: frames both ways, and every kind of loss."""

import os
import pty
import threading
import tty

import can
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from canserial.adapter.adapter import Adapter, AdapterConfig, AdapterError, BadFrame, NoDriver
from canserial.adapter.busload import frame_bits
from canserial.frame import Frame


@pytest.fixture
def pair():
    config = AdapterConfig(interface='virtual', port='canserial_unit')
    here, there = Adapter(config), Adapter(config)
    here.open()
    there.open()
    yield here, there
    here.close()
    there.close()


@given(
    st.booleans().flatmap(lambda e: st.tuples(st.integers(0, 0x1FFFFFFF if e else 0x7FF), st.just(e))),
    st.binary(max_size=8),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_sent_arrives_stamped_by_the_clock(pair, identifier, data):
    here, there = pair
    here.send(Frame(identifier[0], data, 0.0, identifier[1]))
    assert there.receive(1.0, lambda: 12.5) == Frame(identifier[0], data, 12.5, identifier[1])


@pytest.mark.parametrize('frame', [Frame(0x800, b''), Frame(-1, b''), Frame(1, bytes(9)), Frame(2**29, b'', 0.0, True)])
def test_what_can_cannot_carry_is_refused(pair, frame):
    with pytest.raises(BadFrame):
        pair[0].send(frame)


@pytest.mark.parametrize(
    'message, counted',
    [
        (can.Message(arbitration_id=1, is_remote_frame=True), {'remote_frames': 1}),
        (can.Message(arbitration_id=1, is_fd=True, data=bytes(12)), {'fd_frames': 1}),
        (can.Message(arbitration_id=0x80, is_error_frame=True), {'error_frames': 1}),
        (
            can.Message(arbitration_id=0x04, is_error_frame=True, data=[0, 1, 0, 0, 0, 0, 0, 0]),
            {'error_frames': 1, 'overruns': 1},
        ),
    ],
)
def test_what_is_no_data_frame_is_counted_by_kind_not_given_out(pair, message, counted):
    with can.Bus(interface='virtual', channel='canserial_unit', protocol=can.CanProtocol.CAN_FD) as other:
        other.send(message)
    assert pair[0].receive(1.0, lambda: 0.0) is None
    assert dict(pair[0].counters) == counted


def test_bits_on_the_wire_are_counted_both_ways(pair):
    pair[0].send(Frame(0x123, bytes(8)))
    pair[1].receive(1.0, lambda: 0.0)
    assert pair[0].counters == {'sent': 1, 'bits': frame_bits(0x123, bytes(8))}
    assert pair[1].counters == {'received': 1, 'bits': frame_bits(0x123, bytes(8))}


def test_filters_let_through_what_agrees_in_the_mask():
    here = Adapter(
        AdapterConfig(interface='virtual', port='canserial_filter', filters=[{'can_id': 0x200, 'can_mask': 0x7F0}])
    )
    there = Adapter(AdapterConfig(interface='virtual', port='canserial_filter'))
    here.open()
    there.open()
    for identifier in (0x101, 0x204, 0x210, 0x20F):
        there.send(Frame(identifier, b''))
    got = [here.receive(0.05, lambda: 0.0) for _ in range(4)]
    assert [frame.id for frame in got if frame] == [0x204, 0x20F]
    here.close()
    there.close()


def test_udp_multicast_hears_nothing_of_another_group_at_its_port():
    """Each group is a bus: two simulated chairs on one machine must not drive each other."""
    adapters = [
        Adapter(AdapterConfig(interface='udp_multicast', port=group, options={'port': 43902}))
        for group in ('239.74.163.3', '239.74.163.4')
    ]
    one, other = adapters
    try:
        one.open()
        other.open()
        one.send(Frame(0x120, bytes(8), 0.0))
        assert one.receive(5.0, lambda: 0.0).id == 0x120  # it has come
        assert other.receive(0.3, lambda: 0.0) is None
    except AdapterError as error:
        pytest.skip(f'no multicast on this machine: {error}')
    finally:
        for adapter in adapters:
            adapter.close()


def test_a_bus_that_cannot_be_set_up_is_shut_down(monkeypatch):
    shut = []

    class Bus:
        def shutdown(self):
            shut.append(self)

        def fileno(self):
            raise OSError('no socket')

    monkeypatch.setattr(can, 'Bus', lambda **_: Bus())
    with pytest.raises(AdapterError, match='no socket'):
        Adapter(AdapterConfig(interface='udp_multicast', port='239.74.163.2')).open()
    assert len(shut) == 1


def test_udp_multicast_carries_frames_between_two_adapters():
    config = AdapterConfig(interface='udp_multicast', port='239.74.163.2', options={'port': 43900})
    here, there = Adapter(config), Adapter(config)
    try:
        here.open()
        there.open()
        here.send(Frame(0x204, b'12345678'))
        assert there.receive(2.0, lambda: 3.0) == Frame(0x204, b'12345678', 3.0)
    except AdapterError as error:
        pytest.skip(f'no multicast on this machine: {error}')
    finally:
        here.close()
        there.close()


def test_an_interface_whose_driver_is_missing_is_told_from_one_that_is_not_plugged_in():
    with pytest.raises(NoDriver):
        Adapter(AdapterConfig(interface='gs_usb', port='0')).open()


def test_listen_only_opens_with_L_and_sends_nothing():
    terminal = Terminal()
    adapter = Adapter(AdapterConfig(port=os.ttyname(terminal.slave), listen_only=True))
    adapter.open()
    with pytest.raises(AdapterError, match='listens only'):
        adapter.send(Frame(1, b''))
    os.close(terminal.slave)
    adapter.close()
    terminal.thread.join(2.0)
    assert b'L\r' in terminal.seen and b'O\r' not in terminal.seen and b't001' not in terminal.seen
    os.close(terminal.master)


def test_a_closed_and_a_missing_adapter_raise_one_kind_of_error():
    adapter = Adapter(AdapterConfig(port='/dev/no_such_adapter'))
    with pytest.raises(AdapterError, match='^No such file or directory$'):
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


def test_lines_that_are_no_frames_are_counted_and_what_follows_is_received():
    terminal = Terminal()
    adapter = Adapter(AdapterConfig(port=os.ttyname(terminal.slave), bitrate=800000))
    adapter.open()
    os.write(terminal.master, b'\r\rt12\rt1012zz\rt10120102\r\xff\xfe\rt1018\rt-12101\rT1FFFFFFF0\r')
    frames = [adapter.receive(0.1, lambda: 1.0) for _ in range(3)]
    assert [frame for frame in frames if frame] == [Frame(0x101, b'\x01\x02', 1.0), Frame(0x1FFFFFFF, b'', 1.0, True)]
    assert adapter.counters['bad_lines'] == 5
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
