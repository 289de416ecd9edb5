"""Bits on the wire: the tables against a bit-by-bit count, the CRC against its catalogued check value, bounds of the
literature.
"""

from hypothesis import given
from hypothesis import strategies as st

from canserial.adapter.busload import crc15, frame_bits, load

FRAMES = st.booleans().flatmap(
    lambda extended: st.tuples(
        st.integers(0, 2**29 - 1 if extended else 2**11 - 1), st.binary(max_size=8), st.just(extended)
    )
)


def stuffed_length(identifier, data, extended):
    """Runs are counted anew after a stuff bit, which itself counts."""
    head = f'0{identifier >> 18:011b}11{identifier & 0x3FFFF:018b}000' if extended else f'0{identifier:011b}000'
    bits = head + f'{len(data):04b}' + ''.join(f'{byte:08b}' for byte in data)
    crc = 0
    for bit in bits:
        crc, out = (crc << 1) & 0x7FFF, crc >> 14
        if out != int(bit):
            crc ^= 0x4599
    out = []
    for bit in bits + f'{crc:015b}':
        out.append(bit)
        if len(out) >= 5 and len(set(out[-5:])) == 1:
            out.append('1' if bit == '0' else '0')
    return len(out)


@given(FRAMES)
def test_tables_agree_with_counting_bit_by_bit(frame):
    assert frame_bits(*frame) == stuffed_length(*frame) + 13


@given(FRAMES)
def test_between_the_bare_frame_and_the_worst_case_of_davis_2007(frame):
    """Davis, Burns, Bril, Lukkien, 'CAN schedulability analysis: refuted, revisited and revised', 2007, eq. 1."""
    stuffable = (54 if frame[2] else 34) + 8 * len(frame[1])
    bits = frame_bits(*frame)
    assert stuffable + 13 <= bits <= stuffable + 13 + (stuffable - 1) // 4


def test_the_crc_is_the_catalogued_one():
    assert crc15(b'123456789') == 0x059E


def test_load_is_bits_over_what_the_rate_carries():
    assert load(250000, 1.0, 500000) == 0.5
    assert load(1, 0.0, 500000) == 0.0
