"""A Lawicel CANUSB adapter as a machine of bytes: commands of the PC in, answers and frames out.

The protocol is that of the CANUSB manual: lines of ASCII ended by CR, answered by CR (done) or BEL (refused); `tiiildd..`, `Tiiiiiiiildd..`,
`riiil`, `Riiiiiiiil` are frames in both directions, with four hexadecimal digits of milliseconds behind those to the PC after `Z1`.
It has no bus of its own: it accepts every bit rate, and acceptance filters only when they let everything through.
"""

from __future__ import annotations

from collections import Counter

from canserial.frame import Frame

CR, BEL = b'\r', b'\a'
VERSION, SERIAL = b'V1013', b'NSARA'
MAX_LINE = 64
TIMESTAMP_PERIOD_MS = 60000
STATUS_OVERRUN = 0x08
_HEX = frozenset(b'0123456789abcdefABCDEF')
_CLOSED, _OPEN, _LISTEN = 'closed', 'open', 'listen only'


class LawicelAdapter:
    """State of one adapter. `state`: 'closed', 'open' or 'listen only'; `bit_rate`: n of the last `Sn`, -1 after `sxxyy`, None before;
    `counts`: what passed and what was refused;
    `switched`: how often the channel was opened or closed."""

    def __init__(self):
        self.state = _CLOSED
        self.bit_rate: int | None = None
        self.timestamps = False
        self.switched = 0
        self.counts: Counter = Counter()
        self._line = bytearray()
        self._overlong = False
        self._status = 0

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
        """A frame of the bus as it goes to the PC; nothing while the channel is closed. `frame.time` is the stamp (s)."""
        if not self.is_open:
            return b''
        self.counts['to PC'] += 1
        head = f'T{frame.id:08X}' if frame.extended else f't{frame.id:03X}'
        stamp = f'{int(frame.time * 1000) % TIMESTAMP_PERIOD_MS:04X}' if self.timestamps else ''
        return f'{head}{len(frame.data)}{frame.data.hex().upper()}{stamp}\r'.encode('ascii')

    def overrun(self) -> None:
        """The PC did not read: tell so in the next status."""
        self.counts['overruns'] += 1
        self._status |= STATUS_OVERRUN

    def _command(self, line: bytes, frames: list[Frame]) -> bytes:
        if not line:
            return CR  # hosts send empty lines to clear what an earlier one left
        letter, rest = line[:1], line[1:]
        if letter in b'tTrR':
            return self._transmit(letter, rest, frames)
        handler = {b'S': self._rate, b's': self._registers, b'O': self._open, b'L': self._listen, b'C': self._close, b'V': self._version,
                   b'N': self._serial, b'F': self._flags, b'Z': self._stamps, b'M': self._code, b'm': self._mask}.get(letter)
        return handler(rest) if handler else BEL

    def _transmit(self, letter: bytes, rest: bytes, frames: list[Frame]) -> bytes:
        extended, remote = letter in b'TR', letter in b'rR'
        digits = 8 if extended else 3
        if self.state != _OPEN or len(rest) < digits + 1 or not _HEX.issuperset(rest):
            return BEL
        identifier, length = int(rest[:digits], 16), int(rest[digits:digits + 1], 16)
        expected = digits + 1 + (0 if remote else 2 * length)
        if length > 8 or len(rest) != expected or identifier > (0x1FFFFFFF if extended else 0x7FF):
            return BEL
        if remote:
            self.counts['remote requests'] += 1  # nobody on SARA's bus answers them
        else:
            self.counts['from PC'] += 1
            frames.append(Frame(identifier, bytes.fromhex(rest[digits + 1:].decode('ascii')), 0.0, extended))
        return (b'Z' if extended else b'z') + CR

    def _rate(self, rest: bytes) -> bytes:
        if self.is_open or len(rest) != 1 or rest not in b'012345678':
            return BEL
        self.bit_rate = int(rest)
        return CR

    def _registers(self, rest: bytes) -> bytes:
        if self.is_open or len(rest) != 4 or not _HEX.issuperset(rest):
            return BEL
        self.bit_rate = -1
        return CR

    def _open(self, rest: bytes, state: str = _OPEN) -> bytes:
        if rest or self.is_open or self.bit_rate is None:
            return BEL
        self.state, self._status = state, 0
        self.switched += 1
        return CR

    def _listen(self, rest: bytes) -> bytes:
        return self._open(rest, _LISTEN)

    def _close(self, rest: bytes) -> bytes:
        if rest or not self.is_open:
            return BEL
        self.state = _CLOSED
        self.switched += 1
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
        return CR if not self.is_open and rest == b'00000000' else BEL

    def _mask(self, rest: bytes) -> bytes:
        return CR if not self.is_open and rest.upper() == b'FFFFFFFF' else BEL
