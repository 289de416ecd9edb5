"""Encounters with a pedestrian, frame by frame."""

import numpy as np
import pytest
from PIL import Image

from sara_common.platforms import chosen
from sara_lab.journeys import draw_encounters
from sara_lab.journeys.draw_encounters import APART_S, FRAMES, Frame
from sara_lab.judge import gaps
from sara_sim.world.world import World

BODY = chosen().size


def frames(begin, end):
    """The gap is least at 10 s."""
    return [
        Frame(t, (1.0 + 0.1 * t, 1.0, 0.1 * t), (8.0 - 0.5 * t, 1.2), 0.1, abs(t - 10.0))
        for t in np.arange(begin, end, 0.1).tolist()
    ]


def test_the_frames_lie_about_the_nearest_approach_and_begin_with_the_first():
    times = [frame.t for frame in draw_encounters.chosen(frames(0.0, 30.0))]
    assert len(times) == FRAMES and 10.0 in np.round(times, 6) and np.allclose(np.diff(times), APART_S)
    assert draw_encounters.chosen(frames(8.0, 30.0))[0].t == 8.0


@pytest.mark.parametrize('name', ('door', 'corridor', 'crossing'))
def test_start_and_goal_of_a_scene_are_free(name):
    scene = draw_encounters.scenes()[name]
    geometry = scene.grid.geometry
    world = World(scene.grid.data > 0, geometry.resolution, (geometry.origin_x, geometry.origin_y))
    assert min(gaps.at(world, pose, BODY) for pose in (scene.start, scene.goal)) > 0.3


def test_the_picture_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(draw_encounters, 'drive', lambda scene: (frames(0.0, 20.0), True))
    draw_encounters.main(['--out', str(tmp_path)])
    assert Image.open(tmp_path / 'encounters.png').width > 1000
