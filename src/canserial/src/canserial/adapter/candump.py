"""Lines of candump's log format (can-utils, `candump -l`): `(1612345678.123456) can0 204#0011223344556677`, and Frames.

python-can has a reader of this format, which is not used: it stops at the first bad line without its number, takes most
error frames for data frames, and `int()` lets `-1` and `1_0` pass for identifiers. Stamps are whole microseconds here,
so that nothing is rounded.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from canserial.frame import EXTENDED_ID_MAX, STANDARD_ID_MAX, Frame

ERROR_FLAG = 0x20000000  # in an identifier of eight digits, linux/can.h
# (s.fraction) interface id#data | id#R[length] | id##flags+data, then perhaps R(eceived) or T(ransmitted).
LINE = re.compile(
    r'\((\d{1,12})\.(\d{1,9})\)\s+(\S+)\s+([0-9A-F]{3}|[0-9A-F]{8})#'
    r'(?:(?P<data>(?:[0-9A-F]{2}){0,8})(?:_[9A-F])?|(?P<remote>R[0-8]?)|#(?P<fd>[0-9A-F](?:[0-9A-F]{2}){0,64}))'
    r'(?:\s+[RT])?\s*',
    re.IGNORECASE | re.ASCII,
)


class BadLine(ValueError):
    """A line that is not of the format, and why."""


class Line(NamedTuple):
    """kind: 'data', 'remote', 'error' or 'fd'; frame: the Frame of a data frame, otherwise None."""

    microseconds: int
    interface: str
    kind: str
    frame: Frame | None


def parse(text: str) -> Line:
    """The Line that a text is. Raises BadLine."""
    match = LINE.fullmatch(text)
    if not match:
        raise BadLine(f'not "(seconds.micros) interface id#data": {text.strip()[:80]!r}')
    seconds, fraction, interface, digits = match.group(1, 2, 3, 4)
    microseconds = int(seconds) * 1000000 + int((fraction + '00000')[:6])
    identifier, extended = int(digits, 16), len(digits) == 8
    if extended and identifier & ERROR_FLAG:
        return Line(microseconds, interface, 'error', None)
    if identifier > (EXTENDED_ID_MAX if extended else STANDARD_ID_MAX):
        raise BadLine(f'no CAN identifier: {digits}')
    if match['data'] is None:
        return Line(microseconds, interface, 'remote' if match['remote'] else 'fd', None)
    return Line(
        microseconds, interface, 'data', Frame(identifier, bytes.fromhex(match['data']), microseconds / 1e6, extended)
    )


def to_line(frame: Frame, interface: str = 'can0', microseconds: int | None = None) -> str:
    """The line (without its end) of a Frame, stamped with its time (s) or, exactly, with whole microseconds."""
    if microseconds is None:
        microseconds = round(frame.time * 1e6)
    identifier = f'{frame.id:08X}' if frame.extended else f'{frame.id:03X}'
    return (
        f'({microseconds // 1000000}.{microseconds % 1000000:06d}) {interface} {identifier}#{frame.data.hex().upper()}'
    )
