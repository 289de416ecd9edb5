"""Packing and unpacking with `struct` where a message of the DBC allows it: whole bytes, one byte order, whole numbers.

A robot packs and unpacks hundreds of frames a second, and nearly all buses are laid out like that; cantools, which is general, takes
five times as long. What does not fit the pattern (single bits, multiplexed or floating-point signals) has no Codec and is left to cantools,
which the tests hold this against.
"""

import struct

_CODES = {8: 'b', 16: 'h', 32: 'i', 64: 'q'}


class Codec:
    """One message. `of` makes it."""

    def __init__(self, layout, signals):
        self._struct = struct.Struct(layout)
        self._signals = [(signal.name, signal.scale, signal.offset, signal.scale == 1 and signal.offset == 0) for signal in signals]

    @classmethod
    def of(cls, message):
        """The Codec of a layout.Message, or None where it does not fit the pattern."""
        signals = sorted(message.signals, key=lambda signal: signal.start // 8)
        orders = {signal.byte_order for signal in signals}
        if len(orders) != 1 or not message.plain:
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

    def encode(self, values):
        """The bytes of {signal: number}. Raises struct.error, ValueError or OverflowError where a value does not fit, TypeError for no number."""
        return self._struct.pack(*[round(values[name]) if plain else round((values[name] - offset) / scale)
                                   for name, scale, offset, plain in self._signals])

    def decode(self, data):
        """{signal: value in physical units} of the message's whole bytes."""
        return {name: raw if plain else raw * scale + offset
                for (name, scale, offset, plain), raw in zip(self._signals, self._struct.unpack(data))}
