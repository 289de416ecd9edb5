"""Random bytes against the Lawicel path: from the serial port through python-can's slcan to Adapter.receive.

What comes out must be the data frames among the lines, all of them in order and no others; nothing may hang or raise
anything but AdapterError. The serial port is replaced beneath pyserial's own interface, so that every line of
python-can runs.
"""

import random
import re
from collections.abc import Callable, Iterable
from unittest import mock

import serial

from canserial.adapter.adapter import Adapter, AdapterConfig, AdapterError
from canserial.frame import Frame

CHUNKS_PER_ADAPTER = 200
ALPHABET = b'tTrRdDbBxzZFVN0123456789abcdefABCDEF\r\r\r\r\a \x00\x80\xff_-+'
FRAME = re.compile(rb'(?:t([0-7][0-9A-Fa-f]{2})|[Tx]([01][0-9A-Fa-f]{7}))([0-8])((?:[0-9A-Fa-f]{2})*)')


class FuzzFailure(AssertionError):
    """Which input did what must not be."""


class Port:
    """A serial port whose far end is `chunks`; it is unplugged when they are used up."""

    def __init__(self, chunks: Iterable[bytes]) -> None:
        self.chunks = list(reversed(chunks))
        self.write_timeout = None

    @property
    def in_waiting(self) -> int:
        """Bytes of the next chunk."""
        return len(self.chunks[-1]) if self.chunks else 0

    def read(self, size: int = 1) -> bytes:
        """At most `size` bytes; raises serial.SerialException at the end."""
        if not self.chunks:
            raise serial.SerialException('device disconnected')
        chunk = self.chunks.pop()
        if len(chunk) > size:
            self.chunks.append(chunk[size:])
        return chunk[:size]

    def write(self, data: bytes) -> None:
        """Swallowed."""
        return len(data)

    def flush(self) -> None:
        """Nothing waits."""

    reset_input_buffer = close = flush


def fuzz_lawicel(count: int, seed: int, on_frame: Callable[[Frame], object] | None = None) -> int:
    """Feed `count` random lines to adapters; returns how many frames came.

    on_frame: called with each. Raises FuzzFailure, or whatever the adapter raised. The same seed gives the same bytes.
    """
    chance = random.Random(seed)
    number = 0
    for start in range(0, count, CHUNKS_PER_ADAPTER):
        stream = b''.join(_line(chance) for _ in range(min(CHUNKS_PER_ADAPTER, count - start)))
        frames = _feed(_cut(chance, stream), seed, start)
        expected = list(_expected(stream))
        if frames != expected:
            place = next(
                (k for k, pair in enumerate(zip(frames, expected)) if pair[0] != pair[1]),
                min(len(frames), len(expected)),
            )
            raise FuzzFailure(
                f'seed {seed}, inputs from {start}, frame {place}: {frames[place : place + 1]} came, '
                f'{expected[place : place + 1]} is right'
            )
        number += len(frames)
        for frame in frames if on_frame else ():
            on_frame(frame)
    return number


def _expected(stream):
    """The data frames in a stream, by the grammar alone."""
    for line, end in re.findall(rb'([^\r\a]*)([\r\a])', stream):
        match = FRAME.fullmatch(line)
        if match and end == b'\r':
            identifier, length, data = match[1] or match[2], 2 * int(match[3]), match[4].decode()
            if len(data) in (length, length + 4):
                yield Frame(int(identifier, 16), bytes.fromhex(data[:length]), 0.0, bool(match[2]))


def _feed(chunks, seed, start):
    with mock.patch('serial.serial_for_url', return_value=Port(chunks)):
        adapter = Adapter(AdapterConfig(port='fuzz'))
        adapter.open()
    frames, turns = [], 0
    try:
        while True:
            frame = adapter.receive(1e-9, lambda: 0.0)
            turns += 1
            if turns > 100 * (CHUNKS_PER_ADAPTER + sum(map(len, chunks))):
                raise FuzzFailure(f'seed {seed}, inputs from {start}: it does not come to an end')
            if frame is not None:
                frames.append(frame)
    except AdapterError:
        return frames
    finally:
        adapter.close()


def _line(chance):
    """Random bytes, or a good frame, or one with some bytes changed, left out, doubled."""
    kind = chance.random()
    if kind < 0.3:
        return bytes(chance.choices(ALPHABET, k=chance.randrange(40)))
    if kind < 0.4:
        return chance.randbytes(chance.randrange(60))
    extended, length = chance.random() < 0.3, chance.randrange(9)
    head = f'T{chance.getrandbits(29):08X}' if extended else f't{chance.getrandbits(11):03X}'
    line = bytearray(f'{head}{length}{chance.randbytes(length).hex()}\r'.encode('ascii'))
    while kind < 0.8 and line and chance.random() < 0.7:
        place = chance.randrange(len(line))
        line[place : place + chance.randrange(3)] = bytes(chance.choices(ALPHABET, k=chance.randrange(3)))
    return bytes(line)


def _cut(chance, stream):
    """The stream in pieces as a port could give them."""
    chunks = []
    while stream:
        size = chance.choice((1, 2, 5, 17, 64, 500))
        chunks.append(stream[:size])
        stream = stream[size:]
    return chunks
