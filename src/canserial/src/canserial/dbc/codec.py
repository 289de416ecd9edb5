"""Packing and unpacking with `struct` where a message of the DBC allows it: whole bytes, one byte order, whole numbers.

A robot packs and unpacks hundreds of frames a second, and nearly all buses are laid out like that; cantools, which is
general, takes five times as long. What does not fit the pattern (single bits, multiplexed or floating-point signals)
has no Codec and is left to cantools, which the tests hold this against.
"""

import struct

_CODES = {8: 'b', 16: 'h', 32: 'i', 64: 'q'}


class Codec:
    """One message. `of` makes it.

    `encode`: the bytes of {signal: number}; raises KeyError where one is missing, struct.error, ValueError or
    OverflowError where a value does not fit, TypeError for no number. `decode`: {signal: value in physical units} of
    the message's whole bytes.
    """

    def __init__(self, layout, signals):
        packing = struct.Struct(layout)
        # Written out per message, as dataclasses write their methods: a loop over the signals takes twice as long.
        values = ', '.join(_whole(signal) for signal in signals)
        raw = ', '.join(f'v{number}' for number in range(len(signals)))
        physical = ', '.join(
            f'{signal.name!r}: {_physical(signal, f"v{number}")}' for number, signal in enumerate(signals)
        )
        known = {'pack': packing.pack, 'unpack': packing.unpack}
        exec(
            f'def encode(values):\n    return pack({values})\n'
            f'def decode(data):\n    {raw + ", = " if signals else ""}unpack(data)\n    return {{{physical}}}\n',
            known,
        )
        self.encode, self.decode = known['encode'], known['decode']

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


def _whole(signal):
    """The source of a signal's whole number, of the dictionary `values`."""
    value = f'values[{signal.name!r}]'
    return f'round({value})' if _plain(signal) else f'round(({value} - {signal.offset!r}) / {signal.scale!r})'


def _physical(signal, raw):
    """The source of a signal's physical value, of its whole number."""
    return raw if _plain(signal) else f'{raw} * {signal.scale!r} + {signal.offset!r}'


def _plain(signal):
    return signal.scale == 1 and signal.offset == 0
