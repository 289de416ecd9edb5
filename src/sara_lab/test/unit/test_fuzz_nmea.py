"""Nonsense at a GPS receiver's port, and that the fuzz finds what is wrong."""

from nmea_navsat_driver.receiver import FIX, Fix
from sara_lab.fuzz.bus import nmea


def test_no_nonsense_does_harm():
    report = nmea.fuzz_nmea(1500, seed=1)
    assert report.faults == [] and report.inputs == 1500
    assert set(report.kinds) == {'sentence', 'damaged', 'noise', 'clock_jumps'}


def test_a_place_off_the_earth_is_found(monkeypatch):
    wrong = Fix(1.0, FIX, 91.0, 0.0, 0.0, (1.0, 1.0, 1.0), 2)
    monkeypatch.setattr(nmea.Receiver, 'on_line', lambda self, line, now: [wrong])
    (fault,) = nmea.fuzz_nmea(10, seed=1).faults
    assert 'a place that is not on the earth' in fault
