"""A drive that is mapped: recorded, heard by slam_gmapping, judged."""

import math
from pathlib import Path

import pytest

from sara_lab.studies import map_drives
from sara_lab.studies.draw_map_growth import picture
from sara_lab.studies.map_drives import kept, tour
from sara_lab.studies.map_growth import grown
from sara_lab.studies.map_trial import judged, mapped
from sara_nav.maps import places


def test_a_tour_comes_to_every_place_and_back_and_goes_to_near_ones_first():
    named = places.load(places.beside(map_drives.map_file('flat')))
    start = (3.0, 4.9, 0.0)
    stops = tour('flat', start)
    assert stops[-1] == start and len(stops) == len(named) + 1
    assert {stop[:2] for stop in stops[:-1]} == {(place.x, place.y) for place in named.values()}
    front_door = named['front_door']
    assert stops[0][:2] == (front_door.x, front_door.y)


def test_a_drive_is_recorded_and_becomes_a_map(monkeypatch, tmp_path: Path):
    monkeypatch.setattr(map_drives, 'tour', lambda _name, start: [(start[0] - 1.2, start[1] + 1.0, 2.0)])
    drive = kept('hall', 0, False, tmp_path)
    assert drive.missed == drive.contacts == 0 and 1.2 < drive.way < 4.0
    assert kept('hall', 0, False, tmp_path).poses.tobytes() == drive.poses.tobytes()
    slam = mapped(drive)
    assert slam.counts['used'] > 8 and slam.counts['not_deskewed'] == 0
    made = judged('hall', drive, slam)
    assert made.errors.median < 0.02 and made.errors.p95 < 0.06 and made.errors.mapped > 0.95
    assert made.pose_max < 0.05 and math.dist(made.errors.pose[:2], drive.poses[0, 4:6]) < 0.1
    skewed = judged('hall', drive, mapped(drive, {'deskew': False}))
    assert skewed.errors.p95 > made.errors.p95


def test_laps_of_a_drive_grow(monkeypatch, tmp_path: Path):
    monkeypatch.setattr(map_drives, 'tour', lambda _name, start: [(start[0] - 1.2, start[1] + 1.0, 2.0), start])
    laps = list(grown(kept('hall', 1, False, tmp_path), 8.0))
    assert len(laps) >= 2 and laps[-1].way >= 8.0
    for before, after in zip(laps, laps[1:]):
        assert after.key_scans > before.key_scans and after.core_s > before.core_s and after.mb >= before.mb
    assert laps[-1].key_scans == pytest.approx(
        len(laps) * laps[0].key_scans, rel=0.2
    )  # a lap begins where the last ended
    picture(laps, tmp_path / 'growth.png')
    assert (tmp_path / 'growth.png').stat().st_size > 5000
