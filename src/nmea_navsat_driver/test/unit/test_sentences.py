"""Sentences, fields and what a receiver's sentences say."""

import datetime
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nmea_navsat_driver import fields
from nmea_navsat_driver.config import DriverConfig, prefixed
from nmea_navsat_driver.receiver import (
    APPROXIMATED,
    DIAGONAL,
    FIX,
    NO_FIX,
    SBAS,
    Fix,
    Receiver,
    TimeReference,
    Velocity,
)
from nmea_navsat_driver.sentences import LONGEST, Damaged, Lines, framed, parsed
from sara_common.config import ConfigError

GGA = 'GNGGA,120000.40,4030.600000,N,00321.000000,W,{},09,1.2,588.0,M,51.5,M,,'
NO_FIX_GGA = 'GPGGA,120000.00,,,,,0,00,99.9,,,,,,'
GST = 'GNGST,120000.40,,,,,1.5,1.2,3.0'
RMC = 'GNRMC,120000.40,A,4030.600000,N,00321.000000,W,1.9438445,90.0,010126,,,A'
PRINTABLE = st.text(st.characters(min_codepoint=32, max_codepoint=126, blacklist_characters='$*'), max_size=60)


class Heard:
    """A receiver and all that it says."""

    def __init__(self):
        self.warned, self.told = [], []
        self.receiver = Receiver(DriverConfig(), self.warned.append, self.told.append)

    def on(self, body, now=1.0):
        return self.receiver.on_line(framed(body).strip(), now)


def test_checksum_of_a_published_sentence():
    body = 'GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,'
    assert framed(body) == f'${body}*47\r\n'.encode()


@given(PRINTABLE)
def test_what_was_framed_is_read_again(words):
    sentence = parsed(framed(f'GPXYZ,{words}').strip())
    assert (sentence.talker, sentence.kind) == ('GP', 'XYZ')
    assert ','.join(sentence.fields) == words


@given(PRINTABLE, st.integers(0, 7), st.data())
def test_one_flipped_bit_is_found(words, bit, data):
    line = bytearray(framed(f'GPGGA,{words}').strip())
    at = data.draw(st.integers(1, len(line) - 4))  # between $ and *
    line[at] ^= 1 << bit
    with pytest.raises(Damaged):
        parsed(bytes(line))


@settings(max_examples=30)
@given(st.lists(st.integers(1, 30), min_size=1, max_size=40))
def test_lines_do_not_depend_on_how_the_bytes_come(counts):
    wanted = [b'$GPGGA,1*23', b'\xff\x00noise', b'$', b'$GPRMC,2,A*11']
    stream, lines, got = b'\r\n'.join(wanted) + b'\n\n', Lines(), []
    for count in [*counts, len(stream)]:
        got += lines.feed(stream[:count])
        stream = stream[count:]
    assert got == wanted


def test_a_stream_without_ends_is_not_kept():
    lines = Lines()
    for _ in range(100):
        assert lines.feed(b'x' * LONGEST) == []
    assert lines.feed(b'\r\n$A*00\r\n')[-1] == b'$A*00'


@settings(max_examples=40)
@given(st.binary(max_size=120), st.booleans())
def test_no_bytes_break_a_receiver(data, whole):
    line = b'$GNGGA,' + data + b'*00' if whole else data
    for message in Receiver(DriverConfig()).on_line(line, 0.0):
        assert isinstance(message, Fix)


@settings(max_examples=40)
@given(st.sampled_from(['GGA', 'GST', 'RMC']), st.lists(st.text('0123456789.,NSEWA-', max_size=12), max_size=16))
def test_no_fields_break_a_receiver(kind, words):
    for message in Receiver(DriverConfig()).on_line(framed(f'GP{kind},{",".join(words)}').strip(), 0.0):
        if isinstance(message, Fix) and message.status != NO_FIX:
            assert abs(message.latitude) <= 90.0 and abs(message.longitude) <= 180.0
            assert min(message.variances) > 0.0


def test_a_fix_has_the_deviations_of_gst_and_its_height_above_the_ellipsoid():
    heard = Heard()
    assert heard.on(GST, 1.0) == []
    (fix,) = heard.on(GGA.format(1), 1.1)
    assert (fix.stamp, fix.status, fix.covariance_type) == (1.1, FIX, DIAGONAL)
    assert fix.latitude == pytest.approx(40.51, abs=1e-9) and fix.longitude == pytest.approx(-3.35, abs=1e-9)
    assert fix.altitude == pytest.approx(639.5)
    assert fix.variances == pytest.approx((1.2**2, 1.5**2, 9.0))  # GST tells latitude first


@pytest.mark.parametrize('height', ['588.0,M,,', ',M,51.5,M', ',,,'])
def test_a_height_above_the_sea_alone_is_none_above_the_ellipsoid(height):
    (fix,) = Heard().on(GGA.format(1).replace('588.0,M,51.5,M', height))
    assert math.isnan(fix.altitude) and fix.status == FIX and fix.latitude == pytest.approx(40.51)


@pytest.mark.parametrize(('quality', 'status', 'sigma'), [(1, FIX, 4.0), (2, SBAS, 3.0), (4, 2, 0.02), (5, 2, 4.0)])
def test_without_gst_the_deviation_is_that_of_the_quality_times_hdop(quality, status, sigma):
    (fix,) = Heard().on(GGA.format(quality))
    assert (fix.status, fix.covariance_type) == (status, APPROXIMATED)
    assert fix.variances == pytest.approx(((1.2 * sigma) ** 2, (1.2 * sigma) ** 2, 4.0 * (1.2 * sigma) ** 2))


def test_an_old_gst_is_not_believed():
    heard = Heard()
    heard.on(GST, 1.0)
    heard.on(GGA.format(1), 1.1)
    assert heard.on(GGA.format(1), 2.8)[0].covariance_type == DIAGONAL
    assert heard.on(GGA.format(1), 4.5)[0].covariance_type == APPROXIMATED


@pytest.mark.parametrize('says_so', [True, False], ids=['no fix', 'silence'])
def test_the_first_fix_after_an_outage_has_its_own_deviations(says_so):
    heard = Heard()
    heard.on(GGA.format(1), 1.0)
    heard.on(GST, 1.1)
    if says_so:
        heard.on(NO_FIX_GGA, 2.0)
    assert heard.receiver.silent(59.9) and not heard.receiver.silent(2.0)
    assert heard.on(GGA.format(1), 60.0) == []
    assert len(heard.on(RMC, 60.05)) == 2
    (fix,) = heard.on(GST.replace('1.2,3.0', '2.2,3.0'), 60.1)
    assert (fix.stamp, fix.covariance_type, fix.variances[0]) == (60.0, DIAGONAL, pytest.approx(2.2**2))
    (fix,) = heard.on(GGA.format(1), 61.0)  # the others go out at once
    assert fix.variances[0] == pytest.approx(2.2**2)
    assert heard.on(GST, 61.1) == []


@pytest.mark.parametrize(
    ('follows', 'stamps'),
    [(GGA.format(1), [60.0, 61.0]), (NO_FIX_GGA, [60.0, 61.0]), ('GNGST,120000.40,,,,,,,', [60.0])],
)
def test_a_first_fix_whose_deviations_do_not_come_is_not_lost(follows, stamps):
    heard = Heard()
    heard.on(GST, 1.0)
    heard.on(NO_FIX_GGA, 2.0)
    assert heard.on(GGA.format(1), 60.0) == []
    fixes = heard.on(follows, 61.0)
    assert [fix.stamp for fix in fixes] == stamps
    assert fixes[0].covariance_type == APPROXIMATED and fixes[0].variances[0] == pytest.approx(4.8**2)


def test_an_outage_and_its_end_are_told_once_each():
    heard = Heard()
    for now, body in enumerate([GGA.format(1), *[NO_FIX_GGA] * 5, GGA.format(1)] * 2):
        heard.on(body, float(now))
    assert heard.warned == ['the receiver has no fix'] * 2
    assert heard.told == ['the receiver has a fix'] + ['the receiver has a fix again, after 5.0 s without'] * 2


def test_without_a_fix_the_place_is_no_number():
    (fix,) = Heard().on(NO_FIX_GGA)
    assert fix.status == NO_FIX and math.isnan(fix.latitude) and math.isnan(fix.altitude)


def test_velocity_and_time_come_from_rmc():
    reference, velocity = Heard().on(RMC)
    assert isinstance(reference, TimeReference) and isinstance(velocity, Velocity)
    assert reference.utc == datetime.datetime(2026, 1, 1, 12, 0, 0, 400000, datetime.UTC).timestamp()
    assert (velocity.east, velocity.north) == pytest.approx((1.0, 0.0), abs=1e-6)
    assert len(Heard().on(RMC.replace(',A,', ',V,'))) == 1  # not valid: the time alone


def test_damage_of_a_kind_is_told_once():
    heard = Heard()
    for _ in range(3):
        heard.receiver.on_line(b'$GPGGA,1*00', 0.0)
        heard.receiver.on_line(b'\xff\x00garbage', 0.0)
        heard.on('GPGGA,120000.00,9960.0,N,00000.0,E,1,08,1.0,0,M,0,M,,')
    assert len(heard.warned) == 3 and set(heard.receiver.problems.values()) == {3}


@pytest.mark.parametrize('words', [('4030.6', 'X'), ('4060.0', 'N'), ('9001.0', 'N'), ('abc', 'N'), ('4030.6', 'NS')])
def test_a_place_that_is_not_on_the_earth_is_refused(words):
    with pytest.raises(Damaged):
        fields.angle(words, 0, 90.0, 'NS')


@pytest.mark.parametrize(
    ('clock', 'day'), [('250000', '010126'), ('120061', '010126'), ('120000', '310226'), ('1', '2')]
)
def test_a_time_that_is_none_is_refused(clock, day):
    with pytest.raises(Damaged):
        fields.utc((clock, day), 0, 1)


def test_wrong_parameters_are_named():
    with pytest.raises(ConfigError) as told:
        DriverConfig(port='', baud=0, epe_quality1=-1.0)
    assert len(told.value.faults) == 3


@pytest.mark.parametrize(
    'frame, prefix, whole',
    [('gps', None, 'gps'), ('gps', '/one/', 'one/gps'), ('/gps', 'one', 'gps'), ('/gps', '', 'gps')],
)
def test_a_robot_with_a_tf_prefix_has_its_own_antenna(frame, prefix, whole):
    assert prefixed(frame, prefix) == whole
