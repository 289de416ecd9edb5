"""A CAN adapter behind python-can: open, receive, send, close, with one kind of error for everything that unplugging
does.

python-can's slcan needs some care: no sleep after opening, errors from shutdown() too, and a stream that is checked
before it is parsed (canserial.adapter.lawicel).
"""

from __future__ import annotations

import os
import socket
import time
from collections import Counter
from collections.abc import Callable

import can

from canserial.adapter.adapter_config import AdapterConfig, Filter
from canserial.adapter.busload import frame_bits
from canserial.adapter.lawicel import LinePort
from canserial.frame import EXTENDED_ID_MAX, STANDARD_ID_MAX, Frame

__all__ = ['Adapter', 'AdapterConfig', 'AdapterError', 'BadFrame', 'Filter', 'NoDriver']
SEND_TIMEOUT = 0.1  # s
# linux/can/error.h, of which python-can hands on identifier and data.
CAN_ERR_CRTL, CAN_ERR_CRTL_OVERFLOW = 0x04, 0x03
IP_MULTICAST_ALL, IPV6_MULTICAST_ALL = 49, 29  # linux/in.h and in6.h; Python does not name them


class AdapterError(OSError):
    """The adapter is not there (any more)."""


class NoDriver(AdapterError):
    """This machine lacks what the interface needs: waiting for the adapter is of no use."""


class BadFrame(ValueError):
    """A frame that CAN cannot carry."""


class Adapter:
    """An adapter that may come and go. receive() and send() may be called from one thread each.

    `counters`: received, sent, bits (on the wire, both ways), remote_frames, fd_frames, error_frames, overruns,
    bad_lines, and what a Lawicel adapter's status flags say (canserial.adapter.lawicel).
    """

    def __init__(self, config: AdapterConfig) -> None:
        self.config = config
        self.counters = Counter()
        self._bus = None
        self._port = None

    @property
    def is_open(self) -> bool:
        """Whether open() succeeded and close() was not called since."""
        return self._bus is not None

    def open(self) -> None:
        """Open the port and the CAN channel. Raises AdapterError (NoDriver)."""
        self.close()
        try:
            bus = _bus_of(self.config)
        except (can.CanInterfaceNotImplementedError, ImportError) as error:
            raise NoDriver(_why(error)) from error
        except (can.CanError, OSError, ValueError, TypeError) as error:
            raise AdapterError(_why(error)) from error
        if self.config.interface == 'slcan':
            bus.serialPortOrig.write_timeout = SEND_TIMEOUT
            self._port = bus.serialPortOrig = LinePort(bus.serialPortOrig, self.counters, time.monotonic)
        self._bus = bus

    def receive(self, timeout: float, clock: Callable[[], float]) -> Frame | None:
        """The next Frame, stamped by clock() on its arrival, or None after timeout (s, > 0). Raises AdapterError."""
        bus = self._bus
        if bus is None:
            raise AdapterError('the adapter is not open')
        try:
            message = bus.recv(timeout)
        except (can.CanError, OSError, TypeError) as error:  # TypeError: pyserial, when the port closes under a read
            raise AdapterError(_why(error)) from error
        except (ValueError, IndexError):  # an interface that takes its stream on trust
            self.counters['bad_lines'] += 1
            return None
        if message is None:
            return None
        if message.is_error_frame or message.is_remote_frame or message.is_fd:
            self._no_data(message)
            return None
        data = bytes(message.data)
        self.counters['received'] += 1
        self.counters['bits'] += frame_bits(message.arbitration_id, data, message.is_extended_id)
        return Frame(message.arbitration_id, data, clock(), message.is_extended_id)

    def send(self, frame: Frame) -> None:
        """Send a Frame. Raises AdapterError, BadFrame."""
        check(frame)
        bus = self._bus
        if bus is None:
            raise AdapterError('the adapter is not open')
        if self.config.listen_only:
            raise AdapterError('the adapter listens only')
        message = can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=frame.extended)
        try:
            bus.send(message, timeout=SEND_TIMEOUT)
        except (can.CanError, OSError, TypeError) as error:
            raise AdapterError(_why(error)) from error
        self.counters['sent'] += 1
        self.counters['bits'] += frame_bits(frame.id, frame.data, frame.extended)

    def ask_status(self) -> None:
        """Ask the adapter for its error flags where it has any and it is time (once a second); from the thread that
        sends.

        Raises AdapterError.
        """
        port = self._port
        if port is None:
            return
        try:
            port.ask_status()
        except (OSError, TypeError) as error:
            raise AdapterError(_why(error)) from error

    def close(self) -> None:
        """Close what is open; an adapter that is gone is closed too."""
        bus, self._bus, self._port = self._bus, None, None
        if bus is None:
            return
        try:
            bus.shutdown()
        except (can.CanError, OSError, TypeError):
            port = getattr(bus, 'serialPortOrig', None)  # shutdown() gave up before closing the port
            if port is not None:
                port.close()

    def _no_data(self, message):
        if message.is_error_frame:
            self.counters['error_frames'] += 1
            if (
                message.arbitration_id & CAN_ERR_CRTL
                and len(message.data) > 1
                and message.data[1] & CAN_ERR_CRTL_OVERFLOW
            ):
                self.counters['overruns'] += 1
        else:
            self.counters['fd_frames' if message.is_fd else 'remote_frames'] += 1


def check(frame: Frame) -> None:
    """Raise BadFrame if a CAN 2.0 frame cannot be this."""
    limit = EXTENDED_ID_MAX if frame.extended else STANDARD_ID_MAX
    if not 0 <= frame.id <= limit or len(frame.data) > 8:
        raise BadFrame(f'id 0x{frame.id:X} with {len(frame.data)} bytes does not fit into a CAN 2.0 frame')


def _why(error):
    """The system's reason where there is one, else what python-can says failed and what the error beneath says."""
    beneath = error
    while beneath is not None:
        if isinstance(beneath, OSError) and beneath.errno:
            return os.strerror(beneath.errno)
        beneath = beneath.__cause__ or beneath.__context__
    cause = str(error.__cause__ or '')
    return str(error) if cause in str(error) else f'{error} ({cause})'


def _bus_of(config):
    """An open can.Bus."""
    bus = can.Bus(**config.keywords())
    if config.interface == 'udp_multicast':
        try:
            _hear_own_group_only(bus)
        except OSError:
            bus.shutdown()
            raise
    return bus


def _hear_own_group_only(bus):
    """Leave out other groups at the same port: Linux gives a socket all that anybody on the machine has joined."""
    with socket.socket(fileno=os.dup(bus.fileno())) as multicast:
        if multicast.family == socket.AF_INET:
            multicast.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
        else:
            multicast.setsockopt(socket.IPPROTO_IPV6, IPV6_MULTICAST_ALL, 0)
