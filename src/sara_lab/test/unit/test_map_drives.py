"""A drive that is mapped: recorded, heard by slam_gmapping, judged."""

import math
from pathlib import Path

from sara_lab.studies import map_drives
from sara_lab.studies.map_drives import kept, tour
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
