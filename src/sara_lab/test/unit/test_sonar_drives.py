"""Drives as of somebody who draws a map with ultrasonic sensors."""

import numpy as np

from sara_lab.studies import sonar_survey
from sara_lab.studies.sonar_drives import STOP_S, kept


def test_a_drive_keeps_its_limit_and_is_made_once(tmp_path, monkeypatch):
    monkeypatch.setattr(sonar_survey, 'FINISH_S', 0.0)
    drive = kept('room', 0, tmp_path, 27.0)
    start, end = drive.poses[0, 0], drive.poses[-1, 0]
    assert start < 27.0 <= end <= 27.0 + STOP_S and drive.way > 0.3 and len(drive.ranges) > 100
    (path,) = tmp_path.iterdir()
    before = path.stat().st_mtime_ns
    again = kept('room', 0, tmp_path, 27.0)
    assert path.stat().st_mtime_ns == before and np.array_equal(again.poses, drive.poses)
