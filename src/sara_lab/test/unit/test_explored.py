"""The chair explores in lockstep; how much of a map is known in the end."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from sara_lab.campaign.exploring import HERE, ended_wrong, explore, known_share
from sara_lab.journeys.travel_cases import MAPS, grid_of
from sara_lab.judge.walls import faces, occupied_points
from sara_lab.studies import explored
from sara_lab.studies.draw_explored import picture
from sara_lab.studies.map_trial import judged
from sara_nav.maps.map_io import FREE, OCCUPIED, UNKNOWN, GridMap


def test_the_chair_sets_out_into_what_it_does_not_know(monkeypatch, tmp_path: Path):
    monkeypatch.setattr(explored, 'LONGEST_S', 9.0)
    found = explored.explored('flat', 0, every=3.0)
    assert found.said[0].startswith('Exploring begins at (8.4') and found.said[1].startswith('To a frontier')
    assert found.drive.contacts == 0 and found.off_home > 0.3 and found.seconds == pytest.approx(9.0, abs=0.02)
    assert [sentence.split()[0] for sentence in ended_wrong(found, 0.5)] == ['it', '50.0%', 'it']
    made = judged('flat', found.drive, found.slam, HERE)
    assert made.errors.median < 0.03 and made.pose_max < 0.1
    assert 0.05 < known_share('flat', found.drive.poses[0, 4:], made.grid, made.errors.pose) < 0.9
    assert [round(frame.seconds) for frame in found.frames] == [0, 3, 6, 9]
    picture(found.frames, tmp_path / 'explored.png')
    assert (tmp_path / 'explored.png').stat().st_size > 5000


def test_known_is_what_the_chair_can_reach():
    true = grid_of('flat')
    start = (8.5, 2.7, 0.0)
    assert known_share('flat', start, true, HERE) == 1.0
    assert known_share('flat', start, GridMap(np.full_like(true.data, UNKNOWN), true.geometry), HERE) == 0.0
    left = true.data.copy()
    left[:, : left.shape[1] // 2] = UNKNOWN
    half = known_share('flat', start, GridMap(left, true.geometry), HERE)
    assert 0.3 < half < 0.7 and np.count_nonzero(left == FREE)
    assert known_share('flat', start, GridMap(left, true.geometry), (0.0, 0.0, math.pi)) < 0.01  # laid elsewhere


def test_the_part_has_each_map():
    assert len(explore(4, Path('nowhere')).cases) == 4 * len(MAPS)


def test_the_map_is_kept_in_the_true_ones_frame(monkeypatch, tmp_path):
    monkeypatch.setattr(explored, 'LONGEST_S', 2.0)
    grid = explored.kept_map('hall', 0, tmp_path)
    monkeypatch.setattr(explored, 'explored', None)
    again = explored.kept_map('hall', 0, tmp_path)
    assert again.geometry == grid.geometry and again.data.tobytes() == grid.data.tobytes()
    true = grid_of('hall')
    off = cKDTree(faces(true.data == OCCUPIED, true.geometry)).query(occupied_points(grid))[0]
    assert np.median(off) < 0.03
