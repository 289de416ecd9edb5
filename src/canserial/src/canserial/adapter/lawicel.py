"""The byte stream of a Lawicel adapter, between the serial port and python-can.

python-can's slcan reads byte by byte, takes what it is given on trust (`int(' 1', 16)`, missing data) and swallows the
adapter's complaints. `LinePort` takes the place of its serial port: it reads what has come in one go, hands on only
lines that are frames by the CANUSB manual's grammar (and the CAN FD lines that some adapters add), and counts the rest.
It also asks for the status flags (command `F`, allowed on an open channel), for which python-can has no call.
"""

from __future__ import annotations

import errno
import os
import re
import select
import time
from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import serial

CR, BEL = 13, 7
LINE_MAX = 160  # bytes; the longest line, a CAN FD frame of 64 bytes with its stamp, has 142
STATUS = b'F\r'
STATUS_PERIOD = 1.0  # s
SETTLING = 0.5  # s after opening, in which C on a closed channel and O on an open one are refused, as they should be
STATUS_TRIES = 3  # an adapter that never answers is not asked for ever
# CANUSB manual, command F. Bit 4 is not used.
STATUS_BITS = {
    0: 'adapter_receive_full',
    1: 'adapter_transmit_full',
    2: 'error_warning',
    3: 'overruns',
    5: 'error_passive',
    6: 'arbitration_lost',
    7: 'bus_errors',
}
HEXADECIMAL = re.compile(rb'[0-9A-Fa-f]+')
CLASSIC, REMOTE, FD = b'tTx', b'rR', b'dDbB'
LONG_IDS = b'TxRDB'
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
MOST_ID = {3: b'7', 8: b'1'}  # the first digit of an identifier of so many digits


def is_frame(line: bytes) -> bool:
    """Whether a line (bytes without the CR) is a frame: identifier, length, as many bytes, and perhaps a stamp of four
    digits.
    """
    kind = line[:1]
    if not kind or kind not in CLASSIC + REMOTE + FD or not HEXADECIMAL.fullmatch(line, 1):
        return False
    digits = 8 if kind in LONG_IDS else 3
    rest = len(line) - digits - 2
    if rest < 0 or line[1:2] > MOST_ID[digits]:
        return False
    length = int(line[digits + 1 : digits + 2], 16)
    if kind in FD:
        length = FD_LENGTHS[length]
    elif length > 8:
        return False
    if kind in REMOTE:
        length = 0
    return rest in (2 * length, 2 * length + 4)


class LinePort:
    """A pyserial port as python-can's slcan uses it, giving it well-formed frames only.

    `counters`: `bad_lines`; `refused`, commands that the adapter answered with BEL since the channel was opened; and
    the events of STATUS_BITS. `clock` (s) only times the questions for the status.
    """

    def __init__(self, port: serial.Serial, counters: Counter, clock: Callable[[], float] = time.monotonic) -> None:
        self._port, self.counters, self._clock = port, counters, clock
        self._poll = _poll_of(port)
        self._line = bytearray()
        self._overlong = False
        self._ready, self._position = b'', 0
        self._asked = 0  # commands whose answer is due
        self._opened = clock()
        self._status_due, self._unanswered = self._opened + STATUS_PERIOD, 0

    def __getattr__(self, name):
        return getattr(self._port, name)

    @property
    def write_timeout(self) -> float | None:
        """Of the port, s."""
        return self._port.write_timeout

    @write_timeout.setter
    def write_timeout(self, seconds: float) -> None:
        self._port.write_timeout = seconds

    @property
    def in_waiting(self) -> int:
        """Bytes that are ready without asking the port."""
        return len(self._ready) - self._position

    def read(self, size: int = 1) -> bytes:
        """At most `size` bytes of frames; b'' when none came within the port's own timeout."""
        if self._position >= len(self._ready):
            self._ready, self._position = self.feed(self._read_port()), 0
        chunk = self._ready[self._position : self._position + size]
        self._position += len(chunk)
        return chunk

    def _read_port(self):
        """All that has come, waiting for the first byte as long as the port's timeout says."""
        port, poll = self._port, self._poll
        if poll is None:
            return port.read(max(1, port.in_waiting))
        if not poll.poll(1000.0 * port.timeout):
            return b''
        data = os.read(port.fileno(), 4096)
        if not data:
            raise OSError(errno.ENODEV, 'the device is gone, or something else reads from it, too')
        return data

    def write(self, data: bytes) -> int:
        """To the port, as it is."""
        self._asked += 1
        return self._port.write(data)

    def ask_status(self) -> None:
        """Ask for the status flags if that is due; call it from the thread that sends."""
        now = self._clock()
        if now < self._status_due or self._unanswered >= STATUS_TRIES:
            return
        self._status_due = now + STATUS_PERIOD
        self._unanswered += 1
        self.write(STATUS)

    def feed(self, data: bytes) -> bytes:
        """Bytes from the adapter; returns the frames among them, each ended by CR."""
        good = bytearray()
        for byte in data:
            if byte in (CR, BEL):
                line, overlong = bytes(self._line), self._overlong
                self._line.clear()
                self._overlong = False
                if byte == BEL:
                    self._refusal(line)
                elif overlong:
                    self.counters['bad_lines'] += 1
                elif is_frame(line):
                    good += line + b'\r'
                elif line:
                    self._answer(line)
            elif len(self._line) < LINE_MAX:
                self._line.append(byte)
            else:
                self._overlong = True
        return bytes(good)

    def _refusal(self, line):
        if line:
            self.counters['bad_lines'] += 1
        if self._asked and self._clock() > self._opened + SETTLING:
            self._asked -= 1
            self.counters['refused'] += 1

    def _answer(self, line):
        if line in (b'z', b'Z'):
            self._asked = max(0, self._asked - 1)
        elif line[:1] == b'F' and len(line) == 3 and HEXADECIMAL.fullmatch(line):
            self._asked = max(0, self._asked - 1)
            self._unanswered = 0
            flags = int(line[1:], 16)
            for bit, name in STATUS_BITS.items():
                if flags >> bit & 1:
                    self.counters[name] += 1
        else:
            self.counters['bad_lines'] += 1


def _poll_of(port):
    """A poll object on the port's descriptor, if it has one: two system calls a chunk where pyserial needs six."""
    try:
        poll = select.poll()
        poll.register(port.fileno(), select.POLLIN)
        return poll
    except (AttributeError, OSError, ValueError):  # Windows, and pyserial's network ports
        return None
