"""A start anywhere, frame by frame."""

import math

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from sara_lab.studies import draw_global_start
from sara_lab.studies.amcl_drives import AMCL_TESTS
from sara_lab.studies.amcl_trial import maps
from sara_lab.studies.draw_global_start import BEAMS, CELLS, ESTIMATE, PARTICLES, TRUE, coarse, title
from sara_localization.particles.amcl import LOST_WAITS
from sara_sim.world.world import World

TEST = AMCL_TESTS['global_localization_stage']


@pytest.fixture(scope='module')
def frames():
    return list(draw_global_start.drive(TEST, *maps(), 5))


def test_the_first_frame_knows_nothing_and_the_last_one_ends_the_search(frames):
    assert frames[0].estimate is None and not len(frames[0].beams) and frames[0].t == 0.0
    most = TEST.parameters['max_particles']
    assert [len(frame.particles) <= most for frame in frames] == [False] * (len(frames) - 1) + [True]
    assert math.dist(frames[-1].estimate[:2], frames[-1].truth[:2]) < TEST.tolerance[0]
    assert math.dist(frames[1].estimate[:2], frames[1].truth[:2]) > 1.0


def test_the_frames_keep_their_own_particles(frames):
    spreads = [frame.particles[:, :2].std(0).max() for frame in frames]
    assert spreads[0] > 5.0 * spreads[-1]
    assert math.dist(np.median(frames[-1].particles[:, :2], 0), frames[-1].truth[:2]) < TEST.tolerance[0]


def test_a_scan_that_does_not_count_makes_no_frame(frames):
    for before, after in zip(frames[1:], frames[2:]):
        has_moved = math.dist(before.truth[:2], after.truth[:2]) > 0.9 * TEST.parameters['update_min_d']
        assert has_moved or after.t - before.t > 0.9 * LOST_WAITS


def test_beams_end_at_the_walls_that_the_robot_sees(frames):
    world = maps()[0]
    rows, columns = np.nonzero(world.occupied)
    walls = (np.stack((columns, rows), 1) + 0.5) * world.resolution + world.origin
    for frame in frames[1:]:
        assert 20 <= len(frame.beams) <= TEST.parameters['laser_max_beams']
        off = [np.hypot(*(walls - end).T).min() for end in frame.beams]
        assert np.percentile(off, 90) < 0.15


def test_no_wall_gets_lost_in_larger_cells():
    occupied = np.zeros((7, 8), bool)
    occupied[[0, 4, 6], [0, 3, 7]] = True
    small = World(occupied, 0.05, (1.0, 2.0))
    large = coarse(small)
    assert large.occupied.shape == (3, 3) and large.origin == small.origin
    assert large.resolution == pytest.approx(CELLS * 0.05)
    assert np.argwhere(large.occupied).tolist() == [[0, 0], [1, 1], [2, 2]]


def test_a_title_says_time_scans_particles_and_error(frames):
    frame = frames[1]._replace(t=2.3, estimate=(3.0, 4.0, 0.0), truth=(0.0, 0.0, 0.0), particles=np.zeros((28062, 3)))
    assert title(frame, 4) == 'after 2.3 s, 4 scans: 28 062 particles, 5.00 m off'
    assert title(frame, 1).startswith('after 2.3 s, 1 scan:')
    assert title(frame._replace(estimate=None), 0) == 'before the first scan: 28 062 particles'


def test_the_picture_is_written(frames, tmp_path, monkeypatch, capsys):
    seeds = []
    monkeypatch.setattr(draw_global_start, 'drive', lambda test, world, map_, seed: seeds.append(seed) or frames)
    draw_global_start.main(['--out', str(tmp_path), '--seed', '7'])
    assert seeds == [7] and len(capsys.readouterr().out.splitlines()) == len(frames)
    with Image.open(tmp_path / 'global_start.png') as image:
        below_the_legend = np.asarray(image.convert('RGB'), float)[100:]
    assert below_the_legend.shape[1] > 1000
    for name in (TRUE, ESTIMATE, PARTICLES, BEAMS):
        off = np.abs(below_the_legend - 255.0 * np.array(to_rgb(name))).max(2)
        assert np.count_nonzero(off < 25.0) > 50, name
