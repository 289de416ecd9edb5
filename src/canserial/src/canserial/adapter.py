"""A CAN adapter behind python-can: open, receive, send, close, with one kind of error for everything that unplugging does.

python-can's slcan needs some care: no sleep after opening, receiving with a timeout above 0 (each acknowledgement of the
adapter eats one receive), errors from shutdown() too. A line that is no frame raises whatever parsing it raised; one that is
no text at all stays in python-can's buffer for ever, so it is an AdapterError: only opening anew gets rid of it.
"""

from collections import Counter
from dataclasses import dataclass

import can

from canserial.config import ConfigError
from canserial.frame import EXTENDED_ID_MAX, STANDARD_ID_MAX, Frame

# Lawicel's S0..S8. python-can calls S7 750 kbit/s, the CANUSB's manual 800 kbit/s: both names give S7.
LAWICEL_RATES = (10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000, 1000000)
SEND_TIMEOUT = 0.1  # s


class AdapterError(OSError):
    """The adapter is not there (any more)."""


class BadFrame(ValueError):
    """A frame that CAN cannot carry."""


@dataclass(frozen=True)
class AdapterConfig:
    """interface: a name python-can knows; port: its channel; bitrate: bit/s; tty_baudrate: of the serial port (slcan)."""

    interface: str = 'slcan'
    port: str = '/dev/ttyUSB0'
    bitrate: int = 500000
    tty_baudrate: int = 115200

    def __post_init__(self):
        faults = []
        if self.interface not in can.VALID_INTERFACES:
            faults.append(f'interface is {self.interface!r}, allowed are {", ".join(sorted(can.VALID_INTERFACES))}')
        if not isinstance(self.port, str) or not self.port:
            faults.append(f'port is {self.port!r}, allowed is the name of a port, such as /dev/ttyUSB0')
        for name in ('bitrate', 'tty_baudrate'):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value <= 0:
                faults.append(f'{name} is {value!r}, allowed are whole numbers above 0')
        if not faults and self.interface == 'slcan' and self.bitrate not in (*LAWICEL_RATES, 750000):
            faults.append(f'bitrate is {self.bitrate}, allowed with slcan are {", ".join(map(str, LAWICEL_RATES))}')
        if faults:
            raise ConfigError('; '.join(faults))


class Adapter:
    """An adapter that may come and go. receive() and send() may be called from one thread each."""

    def __init__(self, config):
        self.config = config
        self.counters = Counter()
        self._bus = None

    @property
    def is_open(self):
        """Whether open() succeeded and nothing failed since."""
        return self._bus is not None

    def open(self):
        """Open the port and the CAN channel. Raises AdapterError."""
        config = self.config
        options = {'channel': config.port, 'bitrate': config.bitrate}
        if config.interface == 'slcan':
            rate = 750000 if config.bitrate == 800000 else config.bitrate
            options.update(bitrate=rate, tty_baudrate=config.tty_baudrate, sleep_after_open=0, timeout=0.02)
        try:
            self._bus = can.Bus(interface=config.interface, ignore_config=True, **options)
        except (can.CanError, OSError, ValueError) as error:
            raise AdapterError(_why(error)) from error

    def receive(self, timeout, clock):
        """The next Frame, stamped by clock() on its arrival, or None after timeout (s, > 0). Raises AdapterError."""
        bus = self._bus
        if bus is None:
            raise AdapterError('the adapter is not open')
        try:
            message = bus.recv(timeout)
        except (ValueError, IndexError):
            self.counters['bad_lines'] += 1
            return None
        except (can.CanError, OSError, TypeError) as error:  # TypeError: pyserial, when the port closes under a read
            raise AdapterError(_why(error)) from error
        if message is None:
            return None
        if message.is_remote_frame or message.is_error_frame or message.is_fd:
            self.counters['not_data_frames'] += 1
            return None
        self.counters['received'] += 1
        return Frame(message.arbitration_id, bytes(message.data), clock(), message.is_extended_id)

    def send(self, frame):
        """Send a Frame. Raises AdapterError, BadFrame."""
        limit = EXTENDED_ID_MAX if frame.extended else STANDARD_ID_MAX
        if not 0 <= frame.id <= limit or len(frame.data) > 8:
            raise BadFrame(f'id 0x{frame.id:X} with {len(frame.data)} bytes does not fit into a CAN 2.0 frame')
        bus = self._bus
        if bus is None:
            raise AdapterError('the adapter is not open')
        message = can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=frame.extended)
        try:
            bus.send(message, timeout=SEND_TIMEOUT)
        except (can.CanError, OSError, TypeError) as error:
            raise AdapterError(_why(error)) from error
        self.counters['sent'] += 1

    def close(self):
        """Close what is open; an adapter that is gone is closed too."""
        bus, self._bus = self._bus, None
        if bus is None:
            return
        try:
            bus.shutdown()
        except (can.CanError, OSError, TypeError):
            port = getattr(bus, 'serialPortOrig', None)  # shutdown() gave up before closing the port
            if port is not None:
                port.close()


def _why(error):
    """python-can says what failed, the error beneath says why."""
    cause = str(error.__cause__ or '')
    return str(error) if cause in str(error) else f'{error} ({cause})'
