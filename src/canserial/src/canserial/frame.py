"""A CAN frame as plain data, the one type that passes between all pure parts of the chair."""

from typing import NamedTuple

STANDARD_ID_MAX = 0x7FF
EXTENDED_ID_MAX = 0x1FFFFFFF


class Frame(NamedTuple):
    """One CAN 2.0 data frame.

    id: 11-bit identifier, or 29-bit where `extended`. data: 0..8 bytes in wire order.
    time: when it was received, s (0.0 for a frame that is yet to be sent).
    """

    id: int
    data: bytes
    time: float = 0.0
    extended: bool = False
