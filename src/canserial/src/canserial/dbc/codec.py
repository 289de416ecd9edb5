"""Packing and unpacking with `struct` where a message of the DBC allows it: whole bytes, one byte order, whole numbers.

Nearly all buses are laid out like that; cantools, which is general, takes two and a half times as long. What does not
fit the pattern (single bits, multiplexed or floating-point signals) has no Codec and is left to cantools, which the
tests hold this against.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

from cantools.database.can import Message

_CODES = {8: 'b', 16: 'h', 32: 'i', 64: 'q'}


class Codec:
    """One message: the layout of its bytes as `struct` writes it, and its signals in their order. `of` makes it."""

    def __init__(self, layout: str, signals: list) -> None:
        self._packing = struct.Struct(layout)
        self._names = tuple(signal.name for signal in signals)
        self._scaled = tuple(
            (place, signal.name, signal.scale, signal.offset)
            for place, signal in enumerate(signals)
            if signal.scale != 1 or signal.offset != 0
        )

    @classmethod
    def of(cls, message: Message) -> Codec | None:
        """The Codec of a cantools Message, or None where it does not fit the pattern."""
        signals = sorted(message.signals, key=lambda signal: signal.start // 8)
        orders = {signal.byte_order for signal in signals}
        if len(orders) != 1 or message.is_multiplexed() or message.is_container:
            return None
        little = orders == {'little_endian'}
        layout, place = '<' if little else '>', 0
        for signal in signals:
            first, inside = divmod(signal.start, 8)
            if signal.length not in _CODES or inside != (0 if little else 7) or first < place or signal.is_float:
                return None
            code = _CODES[signal.length]
            layout += f'{first - place}x{code if signal.is_signed else code.upper()}'
            place = first + signal.length // 8
        if place > message.length:
            return None
        return cls(f'{layout}{message.length - place}x', signals)

    def encode(self, values: Mapping[str, float]) -> bytes:
        """The bytes of {signal: value in physical units}, each rounded to its resolution.

        Raises KeyError where a signal is missing, struct.error, ValueError or OverflowError where a value does not fit,
        TypeError for no number.
        """
        numbers = [values[name] for name in self._names]
        for place, _, scale, offset in self._scaled:
            numbers[place] = (numbers[place] - offset) / scale
        return self._packing.pack(*map(round, numbers))

    def decode(self, data: bytes) -> dict[str, float]:
        """{signal: value in physical units} of as many bytes as the message has."""
        values = dict(zip(self._names, self._packing.unpack(data)))
        for _, name, scale, offset in self._scaled:
            values[name] = values[name] * scale + offset
        return values
