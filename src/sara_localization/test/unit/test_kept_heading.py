"""The heading that a lost robot keeps by its gyro: what is remembered, and which of two like places it means."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent))
from amcl_world import CELL, drifting, error, planar, scan  # noqa: E402

from sara_common.planar import compose, inverse, wrap  # noqa: E402
from sara_localization.particles.amcl import Amcl  # noqa: E402
from sara_localization.particles.amcl_config import AmclConfig  # noqa: E402
from sara_localization.particles.kept_heading import SPREAD, SURE, KeptHeading  # noqa: E402
from sara_localization.ranges.range_data import RangeMap  # noqa: E402

WIDTH, DEPTH = 7.0, 4.0


def rectangle():
    """An empty room: it looks the same after half a turn."""
    cells = np.zeros((round(DEPTH / CELL), round(WIDTH / CELL)), np.int8)
    cells[:2] = cells[-2:] = cells[:, :2] = cells[:, -2:] = 100
    return RangeMap.from_occupancy(cells, CELL, (0.0, 0.0, 0.0), 65)


ROOM = rectangle()


def test_a_heading_is_kept_from_when_the_pose_was_sure():
    kept = KeptHeading()
    kept.remember(1.0, 0.5 * SURE)
    kept.remember(2.0, 2.0 * SURE)
    assert kept.offset == 1.0
    kept.forget()
    assert kept.offset is None


def test_a_share_of_the_poses_gets_it_and_the_others_stay():
    kept, rng = KeptHeading(), np.random.default_rng(0)
    poses = rng.uniform(-math.pi, math.pi, (20_000, 3))
    before = poses.copy()
    assert np.array_equal(kept.turned(poses, 0.3, 0.7, rng), before), 'nothing was ever sure'
    kept.remember(3.0, 0.0)
    assert np.array_equal(kept.turned(poses, 0.3, 0.0, rng), before)
    after = kept.turned(poses, 0.3, 0.7, rng)
    assert np.array_equal(after[:, :2], before[:, :2])
    changed = after[:, 2] != before[:, 2]
    assert changed.mean() == pytest.approx(0.7, abs=0.02)
    off = wrap(after[changed, 2] - 3.3)
    assert off.mean() == pytest.approx(0.0, abs=0.01) and off.std() == pytest.approx(SPREAD, rel=0.05)


def circle(middle, start, steps):
    """Poses of a drive round a circle of 0.8 m, 0.1 m a step."""
    at = start + 0.125 * np.arange(steps + 1)
    x, y = middle[0] + 0.8 * np.cos(at), middle[1] + 0.8 * np.sin(at)
    return list(zip(x.tolist(), y.tolist(), wrap(at + 0.5 * math.pi).tolist()))


def carried(seed, share, steps=60):
    """(probability of being lost, m and rad by which the pose is off) at the end: a robot is carried across an empty
    room, and its gyro sees how it is turned.
    """
    before, later = circle((2.0, 2.0), 0.0, 40), circle((5.0, 1.8), 2.4, steps)
    amcl = Amcl(AmclConfig(min_particles=500, lost_keeps_heading=share, seed=seed))
    amcl.set_map(ROOM)
    amcl.set_pose(before[0], np.diag(np.square((0.1, 0.1, 0.1))))
    rng = np.random.default_rng(seed)
    odometry, moves = list(drifting(before, rng, 0.02)), list(drifting(later, rng, 0.02))
    turned = compose(odometry[-1], (0.0, 0.0, later[0][2] - before[-1][2]))
    odometry += [compose(turned, compose(inverse(moves[0]), move)) for move in moves]
    stamps = np.concatenate((0.2 * np.arange(len(before)), 12.0 + 0.2 * np.arange(len(later))))  # it takes some seconds
    for truth, moved, stamp in zip(before + later, odometry, 1.0 + stamps):
        result = amcl.on_scan(scan(ROOM, truth, moved, rng, count=60, stamp=float(stamp)))
    end = result.map_from_odom @ planar(moved)
    assert amcl.counts['searches'], 'it was not noticed'
    return amcl.lost.probability, *error((*end.translation[:2], end.yaw), later[-1])


@pytest.mark.parametrize('seed', range(2))
def test_with_a_gyro_it_is_the_right_one_of_two_places_that_look_alike(seed):
    probability, off, turned = carried(seed, 0.95)
    assert off < 0.3 and turned < 0.2 and probability < 0.1


@pytest.mark.parametrize('seed', range(2))
def test_without_one_it_stays_in_doubt(seed):
    assert 0.1 < carried(seed, 0.0)[0] < 0.9


def test_what_is_told_from_outside_is_not_overruled():
    amcl = Amcl(AmclConfig(lost_keeps_heading=0.95))
    amcl.set_map(ROOM)
    amcl.set_pose((2.0, 2.0, 0.0), np.zeros((3, 3)))
    for _ in range(8):
        amcl.force_update()
        amcl.on_scan(scan(ROOM, (2.0, 2.0, 0.0), (0.0, 0.0, 0.0)))
    assert amcl._heading.offset is not None
    amcl.start_anywhere()
    assert amcl._heading.offset is None


def test_another_map_may_be_turned():
    amcl = Amcl(AmclConfig())
    amcl.set_map(ROOM)
    amcl._heading.remember(1.0, 0.0)
    amcl.set_map(ROOM)
    assert amcl._heading.offset is None
