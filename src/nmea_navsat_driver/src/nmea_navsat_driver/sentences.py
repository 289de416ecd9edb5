"""NMEA 0183 sentences: `$GPGGA,...*hh`, the two hexadecimal digits being the exclusive or of all between $ and *."""

from __future__ import annotations

import functools
import operator
from typing import NamedTuple

LONGEST = 256
"""Bytes of a line; the standard allows 82, receivers send more."""
_ADDRESS = 5


class Damaged(ValueError):
    """What was received is no sentence, or not one that can be right. `kind`: checksum, noise, field."""

    def __init__(self, kind: str, sentence: str):
        super().__init__(sentence)
        self.kind = kind


class Sentence(NamedTuple):
    """talker: who measured (GP, GN, GL, ...); kind: GGA, GST, RMC, ...; fields: the words behind these."""

    talker: str
    kind: str
    fields: tuple[str, ...]


def checksum(body: bytes) -> int:
    """Of the bytes between $ and *."""
    return functools.reduce(operator.xor, body, 0)


def framed(body: str) -> bytes:
    """The line, with its end, of a body such as 'GPRMC,...'. Raises ValueError for what is not ASCII."""
    data = body.encode('ascii')
    return b'$%s*%02X\r\n' % (data, checksum(data))


def parsed(line: bytes) -> Sentence | None:
    """The sentence of a line without its end; None for one of a receiver's maker, or a question. Raises Damaged."""
    start, star = line.rfind(b'$'), line.rfind(b'*')
    if start < 0 or star < start:
        raise Damaged('noise', 'a line is no NMEA sentence: is the baud rate right?')
    body, told = line[start + 1 : star], line[star + 1 :].strip()
    try:
        right = len(told) == 2 and int(told, 16) == checksum(body)
        address, *fields = body.decode('ascii').split(',')
    except ValueError:
        raise Damaged('noise', 'a line holds bytes that no NMEA sentence has: is the baud rate right?') from None
    if not right:
        raise Damaged('checksum', 'a sentence was damaged on the way: its checksum does not fit')
    if len(address) != _ADDRESS or address.startswith('P'):
        return None
    return Sentence(address[:2], address[2:], tuple(fields))


class Lines:
    """Cuts a stream of bytes into lines; what is too long for a line is dropped. Memory is bounded by LONGEST."""

    def __init__(self) -> None:
        self._rest = b''

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that ended in the data, without their ends and empty ones."""
        *whole, rest = (self._rest + data).replace(b'\r', b'\n').split(b'\n')
        self._rest = rest[-LONGEST:]
        return [line for line in whole if line and len(line) <= LONGEST]
