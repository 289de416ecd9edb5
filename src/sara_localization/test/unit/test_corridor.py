"""A corridor whose ends are out of the scanner's reach: amcl's covariance grows along it, and not across."""

import math
import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent))
from amcl_world import CELL, MOST, drifting, error, planar, scan  # noqa: E402

from sara_localization.particles.amcl import Amcl  # noqa: E402
from sara_localization.particles.amcl_config import AmclConfig  # noqa: E402
from sara_localization.ranges.range_data import RangeMap  # noqa: E402

LENGTH, WIDTH, TURN = 40.0, 2.0, 0.6
START, END = 1.5 * MOST, LENGTH - 1.5 * MOST
STEP, TOLD, ALPHA = 0.25, 0.05, 0.8  # m of a step; m, deviation of what is told at the start; of way from way


def corridor():
    """Along the map's x axis, turned by TURN."""
    cells = np.zeros((round(WIDTH / CELL), round(LENGTH / CELL)), np.int8)
    cells[:2] = cells[-2:] = cells[:, :2] = cells[:, -2:] = 100
    return RangeMap.from_occupancy(cells, CELL, (0.0, 0.0, TURN), 65)


def place(x):
    """The pose in the middle of the corridor, x m from its end."""
    c, s = math.cos(TURN), math.sin(TURN)
    return c * x - s * 0.5 * WIDTH, s * x + c * 0.5 * WIDTH, TURN


@pytest.mark.parametrize('seed', range(2))
def test_the_covariance_grows_along_a_corridor_as_the_odometry_s_does_and_not_across(seed):
    map_, rng = corridor(), np.random.default_rng(seed)
    path = [place(x) for x in np.arange(START, END, STEP).tolist()]
    amcl = Amcl(AmclConfig(seed=seed, odom_alpha3=ALPHA))
    amcl.set_map(map_)
    amcl.set_pose(path[0], np.diag(np.square((TOLD, TOLD, 0.05))))
    along, across = [], []
    axis = np.array((math.cos(TURN), math.sin(TURN)))
    normal = np.array((-axis[1], axis[0]))
    for truth, moved in zip(path, drifting(path, rng, 0.02)):
        result = amcl.on_scan(scan(map_, truth, moved, rng, count=45))
        place_covariance = amcl.belief.covariance[:2, :2]
        along.append(math.sqrt(axis @ place_covariance @ axis))
        across.append(math.sqrt(normal @ place_covariance @ normal))
    by_model = math.hypot(TOLD, ALPHA * STEP**2 * math.sqrt(len(path) - 1))  # the diff model's deviation of each step
    assert along[-1] == pytest.approx(by_model, rel=0.25) and by_model > 5.0 * TOLD
    assert max(across[4:]) < 0.15, 'the walls are seen all the time'
    end = result.map_from_odom @ planar(moved)
    assert error((*end.translation[:2], end.yaw), path[-1])[0] < 2.0 * along[-1]
