"""The compass in the laboratory: nonsense, a chair's drive from door to door, and what is judged of it."""

import math

import numpy as np
import pytest

from canserial.calibration.iron import IronError
from canserial.reader.compass import Compass
from canserial.reader.readings import HeadingReading
from canserial.reader.status import status_of
from sara_lab.campaign import compass as part
from sara_lab.fuzz.bus import compass as fuzz
from sara_lab.fuzz.bus import compass_command
from sara_lab.studies.compass_drive import CompassChair, Row, Tour, doors, drive, posts
from sara_lab.studies.compass_track import agreement
from sara_sim.chips.magnetic_config import MagneticConfig


def test_nonsense_gives_no_heading_that_is_none():
    report = fuzz.fuzz_compass(6000, 2)
    assert report.faults == [] and report.kinds['headings'] > 100 and report.kinds['compass_disturbed'] > 100
    calibrations = [report.kinds[kind] for kind in ('refused calibrations', 'calibrations', 'right calibrations')]
    assert sum(calibrations[:2]) == 12 and min(calibrations) > 0
    assert fuzz.fuzz_compass(1000, 2).kinds == fuzz.fuzz_compass(1000, 2).kinds


def test_the_fuzz_notices_what_it_looks_for(monkeypatch, capsys):
    whole = Compass.on_imu

    def broken(self, reading, still):
        heading = whole(self, reading, still)
        return heading and heading._replace(yaw=math.nan)

    monkeypatch.setattr(Compass, 'on_imu', broken)
    with pytest.raises(SystemExit, match='seed 7000000: .*nan'):
        compass_command.main(['--count', '6000', '--seed', '7'])


def test_the_command_counts(capsys):
    compass_command.main(['--count', '1000'])
    assert '1000 inputs to compass, no failure' in capsys.readouterr().out


def test_a_chair_keeps_its_heading_for_a_minute_among_steel():
    turned, rows = drive(1, 1.0, MagneticConfig(), steel=True)
    heading = np.degrees([row.heading for row in rows])
    assert len(rows) > 1100 and np.abs(heading).max() < 3.0
    assert turned.residual < 0.5 and all(row.variance > 0.0 for row in rows)


def test_the_heading_outlives_every_fault_of_the_compass():
    vehicle, tour = CompassChair(2, MagneticConfig()), Tour(2, doors(2))
    vehicle.calibrate(0.0)
    reader, chair = vehicle.reader, vehicle.chair

    def errors(seconds):
        end, found = chair.time + seconds, []
        while chair.time < end:
            for reading in vehicle.step(*tour.command(chair.time, chair.pose)):
                if isinstance(reading, HeadingReading):
                    found.append(abs(math.degrees(math.remainder(reading.yaw - chair.pose[2], math.tau))))
        return found

    assert max(errors(20.0)) < 2.0
    for fault, sentence in (
        ('compass_magnet', 'steel or a current is near'),
        ('compass_stuck', 'always the same'),
        ('compass_silent', '0x207 COMPASS'),
    ):
        chair.faults.add(fault, duration=15.0)
        found = errors(14.0)
        assert sentence in status_of(reader, chair.time).text
        assert len(found) > 270 and max(found) < 2.5
        assert max(errors(10.0)) < 2.5
    errors(15.0)
    assert reader.compass.clear


def test_the_tour_goes_through_doors_between_their_posts():
    of = doors(3)
    tour, pose, way = Tour(3, of), [0.0, 0.0, 0.0], []
    for tick in range(4000):
        v, w = tour.command(0.05 * tick, tuple(pose))
        pose[2] += 0.05 * w
        pose[0] += 0.05 * v * math.cos(pose[2])
        pose[1] += 0.05 * v * math.sin(pose[2])
        way.append(pose[:2])
    nearest = [np.hypot(*(np.array(way) - door[:2]).T).min() for door in of]
    assert sum(away < 0.25 for away in nearest) >= 3
    steel = np.array(posts(of))
    assert np.hypot(*(steel[: len(of)] - steel[len(of) :]).T) == pytest.approx(0.9)


@pytest.mark.parametrize(
    'kind, heading, gyro, faults',
    [
        ('clean', 1.0, 1.0, []),
        ('clean', 2.5, 9.0, ['worst 2.50']),
        ('clean', 1.0, 0.2, ['more than the gyroscope']),
        ('steel', 2.5, 9.0, []),
        ('steel', 3.5, 9.0, ['p95 3.50']),
    ],
)
def test_what_is_judged(kind, heading, gyro, faults):
    rows = [Row(0.05 * k, math.radians(heading), math.radians(gyro), 1e-3, True) for k in range(4000)]
    found = part.judged(kind, 0, rows)['faults']
    assert len(found) == len(faults) and all(text in sentence for text, sentence in zip(faults, found))


def test_a_drift_is_judged_and_summed_up():
    rows = [Row(0.05 * k, math.radians(2.5 * k / 6000), 1.0, 1e-3, True) for k in range(6000)]
    result = part.judged('steel', 0, rows)
    assert result['drift'] == pytest.approx(2.0, abs=0.01) and result['p95'] == pytest.approx(2.375, abs=0.01)
    lines, figures = part.compass(1, None).summary([result])
    assert figures['steel_drift_deg']['worst'] == result['drift'] and any('steel_p95_deg' in line for line in lines)


def recorded(off=0.0, late=0.0, noise=0.0, seed=0):
    """A robot drives a circle of 3 m once and a half round: fields, speeds and fixes. Its magnetometer is turned by
    `off` (rad), the fixes are late (s) and off by noise (m).
    """
    random = np.random.default_rng(seed)
    times = np.arange(0.0, 40.0, 0.1)
    yaw = 0.4 - 0.25 * times
    angle = 0.5 * math.pi - yaw + off
    fields = np.column_stack((times, 30.0 + 20.0 * np.cos(angle), -10.0 + 17.0 * np.sin(angle)))
    speeds = np.column_stack((times, np.full_like(times, 0.75)))
    x, y = (np.interp(times - late, times, np.cumsum(0.1 * 0.75 * f(yaw))) for f in (np.cos, np.sin))
    fixes = np.column_stack((times, x, y)) + np.column_stack((np.zeros_like(x), *random.normal(0.0, noise, (2, 400))))
    return fields, speeds, fixes[4::4]


def test_a_compass_that_is_right_agrees_with_the_track_and_one_that_is_turned_is_found():
    found = agreement(*recorded())
    assert abs(math.degrees(found.whole)) < 0.5 and found.residual < 0.05
    assert found.ratio == pytest.approx(20.0 / 17.0, rel=1e-6) and found.rate == pytest.approx(-0.25)
    assert math.degrees(agreement(*recorded(off=0.2)).whole) == pytest.approx(math.degrees(0.2), abs=0.5)
    low, high = agreement(*recorded(off=0.2, noise=1.0)).interval(0.95)
    assert low < 0.2 < high and high - low < 1.0


def test_a_late_receiver_turns_the_track_by_the_rate_times_the_delay():
    assert agreement(*recorded(late=0.8)).whole == pytest.approx(0.25 * 0.8, abs=0.02)


def test_a_drive_that_is_too_short_or_does_not_turn_is_told():
    fields, speeds, fixes = recorded()
    with pytest.raises(ValueError, match='3 fixes lie within'):
        agreement(fields, speeds, fixes[:3])
    with pytest.raises(ValueError, match='no window of 10 s'):
        agreement(fields, speeds, fixes[:20])
    with pytest.raises(IronError):
        agreement(fields * (1.0, 0.0, 0.0), speeds, fixes)
