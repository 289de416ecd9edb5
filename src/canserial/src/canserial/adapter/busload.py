"""How many bits a frame takes on the wire, stuff bits included, and so how busy a bus is.

ISO 11898-1, 10.4-10.5: start bit, identifier, control field, data and the 15-bit CRC (polynomial 0x4599) are stuffed:
after five equal bits one of the other value is put in, which counts for the next five. CRC delimiter, acknowledgement,
end of frame (10 bits) and the intermission (3 bits) are not. The count is exact for a frame that everybody
acknowledges; tables of bytes make it cheap.
"""

from __future__ import annotations

from functools import lru_cache

UNSTUFFED_BITS = 13  # CRC delimiter, ACK slot and delimiter, 7 bits end of frame, 3 bits intermission
CRC_POLYNOMIAL = 0x4599


def frame_bits(identifier: int, data: bytes, extended: bool = False) -> int:
    """Bits on the wire of a CAN 2.0 data frame (identifier, 0..8 bytes of data, 29-bit identifier or not)."""
    crc_table, stuff_table = _tables()
    bits, state, stuffed, crc = _header(identifier, len(data), extended)
    for byte in data:
        crc = ((crc << 8) & 0x7FFF) ^ crc_table[(crc >> 7) ^ byte]
        state, more = stuff_table[state][byte]
        stuffed += more
    state, more = stuff_table[state][crc >> 7]
    return bits + 8 * len(data) + 15 + UNSTUFFED_BITS + stuffed + more + _stuff(crc & 0x7F, 7, state)[1]


def load(bits: int, seconds: float, bit_rate: float) -> float:
    """Share of the time (0..1) that `bits` kept a bus of `bit_rate` (bit/s) busy; 0 where there is no time."""
    return bits / (bit_rate * seconds) if seconds > 0.0 else 0.0


def crc15(data: bytes) -> int:
    """The CRC of ISO 11898-1 over whole bytes."""
    table, crc = _tables()[0], 0
    for byte in data:
        crc = ((crc << 8) & 0x7FFF) ^ table[(crc >> 7) ^ byte]
    return crc


@lru_cache(maxsize=4096)
def _header(identifier, length, extended):
    """Bits, state, stuff bits and CRC after the header: a frame's bus sees few different ones."""
    if extended:  # SOF, 11 bits, SRR, IDE, 18 bits, RTR, r1, r0, DLC
        high, low = identifier >> 18, identifier & 0x3FFFF
        value, bits = (high << 27 | 0b11 << 25 | low << 7 | length), 39
    else:  # SOF, 11 bits, RTR, IDE, r0, DLC
        value, bits = identifier << 7 | length, 19
    crc = 0
    for position in range(bits - 1, -1, -1):
        crc = _crc_bit(crc, value >> position & 1)
    state, stuffed = _stuff(value, bits, None)
    return bits, state, stuffed, crc


@lru_cache(maxsize=1)
def _tables():
    crc_table = []
    for byte in range(256):
        crc = 0
        for position in range(7, -1, -1):
            crc = _crc_bit(crc, byte >> position & 1)
        crc_table.append(crc)
    return crc_table, [[_stuff(byte, 8, state) for byte in range(256)] for state in range(10)]


def _crc_bit(crc, bit):
    out = bit ^ (crc >> 14 & 1)
    crc = (crc << 1) & 0x7FFF
    return crc ^ CRC_POLYNOMIAL if out else crc


def _stuff(value, bits, state):
    """(state, stuff bits) after `bits` bits of `value`; a state is 5 * last bit + (length of the run of equal bits -
    1).
    """
    last, run = (None, 0) if state is None else (state // 5, state % 5 + 1)
    stuffed = 0
    for position in range(bits - 1, -1, -1):
        bit = value >> position & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed += 1
            last, run = 1 - bit, 1
    return 5 * last + run - 1, stuffed
