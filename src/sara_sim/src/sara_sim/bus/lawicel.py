"""A Lawicel CANUSB adapter as a machine of bytes: commands of the PC in, answers and frames out.

The protocol is that of the CANUSB manual: lines of ASCII ended by CR, answered by CR (done) or BEL (refused);
`tiiildd..`, `Tiiiiiiiildd..`,
`riiil`, `Riiiiiiiil` are frames in both directions, with four hexadecimal digits of milliseconds behind those to the PC
after `Z1`. The controller behind it is an SJA1000 at 16 MHz: `sxxyy` are its bus timing registers, `M` and `m` the
acceptance code and mask of its two filters. An adapter that is opened with another bit rate than the bus's hears no
frame, sends none, and tells of bus errors.
"""

from __future__ import annotations

from collections import Counter

from canserial.frame import Frame

CR, BEL = b'\r', b'\a'
VERSION, SERIAL = b'V1013', b'NSARA'
MAX_LINE = 64
TIMESTAMP_PERIOD_MS = 60000
STATUS_TX_FULL, STATUS_WARNING, STATUS_OVERRUN, STATUS_PASSIVE, STATUS_BUS_ERROR = 0x02, 0x04, 0x08, 0x20, 0x80
RATES = (10000, 20000, 50000, 100000, 125000, 250000, 500000, 800000, 1000000)  # S0..S8
CLOCK_HZ = 16e6
TX_FIFO = 8  # frames the adapter takes that the bus does not
RATE_TOLERANCE = 0.01
_HEX = frozenset(b'0123456789abcdefABCDEF')
_CLOSED, _OPEN, _LISTEN = 'closed', 'open', 'listen only'


class LawicelAdapter:
    """State of one adapter. `state`: 'closed', 'open' or 'listen only'; `bit_rate`: n of the last `Sn`, -1 after
    `sxxyy`, None before;
    `rate`: the bit/s of that; `counts`: what passed and what was refused; `closed`: how often the channel was closed.
    """

    def __init__(self, bus_rate: int = 500000):
        """`bus_rate`: bit/s of the bus that the adapter is plugged into."""
        self.bus_rate = bus_rate
        self.state = _CLOSED
        self.bit_rate: int | None = None
        self.rate: float | None = None
        self.code, self.mask = bytes(4), b'\xff' * 4
        self.timestamps = False
        self.closed = 0
        self.counts: Counter = Counter()
        self._line = bytearray()
        self._overlong = False
        self._status = 0
        self._stuck = 0

    @property
    def agrees(self) -> bool:
        """Whether the bit rate is the bus's."""
        return self.rate is not None and abs(self.rate / self.bus_rate - 1.0) <= RATE_TOLERANCE

    @property
    def is_open(self) -> bool:
        """True when frames pass to the PC."""
        return self.state != _CLOSED

    def feed(self, data: bytes) -> tuple[bytes, list[Frame]]:
        """Bytes from the PC. Returns (bytes to answer, frames the PC sent). Any bytes are allowed."""
        answers, frames = bytearray(), []
        for byte in data:
            if byte != 13:
                if len(self._line) < MAX_LINE:
                    self._line.append(byte)
                else:
                    self._overlong = True
                continue
            line, overlong = bytes(self._line), self._overlong
            self._line.clear()
            self._overlong = False
            answer = BEL if overlong else self._command(line, frames)
            if answer == BEL:
                self.counts['refused'] += 1
            answers += answer
        return bytes(answers), frames

    def frame_bytes(self, frame: Frame) -> bytes:
        """A frame of the bus as it goes to the PC; nothing while the channel is closed. `frame.time`: the stamp, s."""
        if not self.is_open:
            return b''
        if not self.agrees:
            self._disturbed()
            return b''
        if self.mask != b'\xff' * 4 and not self._accepts(frame):
            self.counts['filtered'] += 1
            return b''
        self.counts['to PC'] += 1
        head = f'T{frame.id:08X}' if frame.extended else f't{frame.id:03X}'
        stamp = f'{int(frame.time * 1000) % TIMESTAMP_PERIOD_MS:04X}' if self.timestamps else ''
        return f'{head}{len(frame.data)}{frame.data.hex().upper()}{stamp}\r'.encode('ascii')

    def overrun(self) -> None:
        """The PC did not read: tell so in the next status."""
        self.counts['overruns'] += 1
        self._status |= STATUS_OVERRUN

    def _disturbed(self) -> None:
        self.counts['bus errors'] += 1
        self._status |= STATUS_WARNING | STATUS_PASSIVE | STATUS_BUS_ERROR

    def _accepts(self, frame: Frame) -> bool:
        """The SJA1000's dual filter: 16 bits each; a mask bit of 1 is not compared."""
        if frame.extended:
            bits = frame.id >> 13
            first = second = (bits, 0xFFFF)
        else:
            head = frame.id << 5  # 11 bits, RTR, and in the first filter the first data byte
            byte = frame.data[0] if frame.data else 0
            first = (head | byte >> 4, 0xFFFF if frame.data else 0xFFF0)
            second = (head, 0xFFF0)
            if frame.data:
                low_code, low_mask = self.code[3] & 0x0F, self.mask[3] & 0x0F
                if (byte & 0x0F ^ low_code) & ~low_mask & 0x0F:
                    first = None
        for value, code, mask in ((first, self.code[:2], self.mask[:2]), (second, self.code[2:], self.mask[2:])):
            if value is not None:
                bits, compared = value
                if not (bits ^ int.from_bytes(code, 'big')) & ~int.from_bytes(mask, 'big') & compared:
                    return True
        return False

    def _command(self, line: bytes, frames: list[Frame]) -> bytes:
        if not line:
            return CR  # hosts send empty lines to clear what an earlier one left
        letter, rest = line[:1], line[1:]
        if letter in b'tTrR':
            return self._transmit(letter, rest, frames)
        handler = {
            b'S': self._rate,
            b's': self._registers,
            b'O': self._open,
            b'L': self._listen,
            b'C': self._close,
            b'V': self._version,
            b'N': self._serial,
            b'F': self._flags,
            b'Z': self._stamps,
            b'M': self._code,
            b'm': self._mask,
        }.get(letter)
        return handler(rest) if handler else BEL

    def _transmit(self, letter: bytes, rest: bytes, frames: list[Frame]) -> bytes:
        extended, remote = letter in b'TR', letter in b'rR'
        digits = 8 if extended else 3
        if self.state != _OPEN or len(rest) < digits + 1 or not _HEX.issuperset(rest):
            return BEL
        identifier, length = int(rest[:digits], 16), int(rest[digits : digits + 1], 16)
        expected = digits + 1 + (0 if remote else 2 * length)
        if length > 8 or len(rest) != expected or identifier > (0x1FFFFFFF if extended else 0x7FF):
            return BEL
        if not self.agrees:
            self._disturbed()
            if self._stuck >= TX_FIFO:
                self._status |= STATUS_TX_FULL
                return BEL
            self._stuck += 1
        elif remote:
            self.counts['remote requests'] += 1  # nobody on SARA's bus answers them
        else:
            self.counts['from PC'] += 1
            frames.append(Frame(identifier, bytes.fromhex(rest[digits + 1 :].decode('ascii')), 0.0, extended))
        return (b'Z' if extended else b'z') + CR

    def _rate(self, rest: bytes) -> bytes:
        if self.is_open or len(rest) != 1 or rest not in b'012345678':
            return BEL
        self.bit_rate = int(rest)
        self.rate = RATES[self.bit_rate]
        return CR

    def _registers(self, rest: bytes) -> bytes:
        if self.is_open or len(rest) != 4 or not _HEX.issuperset(rest):
            return BEL
        prescaler, segments = int(rest[:2], 16), int(rest[2:], 16)
        self.bit_rate = -1
        self.rate = CLOCK_HZ / (2 * ((prescaler & 0x3F) + 1) * (3 + (segments & 0x0F) + (segments >> 4 & 0x07)))
        return CR

    def _open(self, rest: bytes, state: str = _OPEN) -> bytes:
        if rest or self.is_open or self.bit_rate is None:
            return BEL
        self.state, self._status, self._stuck = state, 0, 0
        return CR

    def _listen(self, rest: bytes) -> bytes:
        return self._open(rest, _LISTEN)

    def _close(self, rest: bytes) -> bytes:
        if rest or not self.is_open:
            return BEL
        self.state = _CLOSED
        self.closed += 1
        return CR

    def _version(self, rest: bytes) -> bytes:
        return BEL if rest else VERSION + CR

    def _serial(self, rest: bytes) -> bytes:
        return BEL if rest else SERIAL + CR

    def _flags(self, rest: bytes) -> bytes:
        if rest or not self.is_open:
            return BEL
        status, self._status = self._status, 0
        return f'F{status:02X}\r'.encode('ascii')

    def _stamps(self, rest: bytes) -> bytes:
        if self.is_open or rest not in (b'0', b'1'):
            return BEL
        self.timestamps = rest == b'1'
        return CR

    def _code(self, rest: bytes) -> bytes:
        value = self._filter(rest)
        self.code = value or self.code
        return CR if value else BEL

    def _mask(self, rest: bytes) -> bytes:
        value = self._filter(rest)
        self.mask = value or self.mask
        return CR if value else BEL

    def _filter(self, rest: bytes) -> bytes | None:
        """Four bytes; only between setting the bit rate and opening the channel."""
        if self.is_open or self.bit_rate is None or len(rest) != 8 or not _HEX.issuperset(rest):
            return None
        return bytes.fromhex(rest.decode('ascii'))
