"""What a footprint meets: the peer's footprint cost, cell by cell, and a world whose frame is not the costmap's."""

import math
import pathlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import LETHAL, UNKNOWN, Costmap
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import parse_footprint
from sara_nav.grids.grid import GridGeometry

REFERENCE = np.load(pathlib.Path(__file__).parents[1] / 'data' / 'costmap_reference.npz')
SARA = parse_footprint([[0.54, 0.29], [0.54, -0.29], [-0.54, -0.29], [-0.54, 0.29]])
GRID = GridGeometry(160, 160, 0.05, 0.0, 0.0)
poses = st.tuples(st.floats(-2.0, 10.0), st.floats(-2.0, 10.0), st.floats(-7.0, 7.0))


def test_the_footprint_cost_is_the_peers_at_every_pose():
    world = LocalWorld(
        Costmap(REFERENCE['fpcost_grid'], GRID), REFERENCE['poly_0']
    )  # SARA, from the peer's first corner
    ours = [world.footprint_cost(*pose) for pose in REFERENCE['fpcost_poses']]
    assert np.array_equal(ours, REFERENCE['fpcost'])
    assert {-1.0, -2.0, -3.0} < set(ours)


def test_footprint_costs_by_hand():
    costs = np.zeros(GRID.shape, np.uint8)
    world = LocalWorld(Costmap(costs, GRID), SARA)
    assert world.footprint_cost(4.0, 4.0, 0.0) == 0.0
    costs[80, 80] = LETHAL
    assert world.footprint_cost(4.0, 4.0, 0.3) == 0.0, 'the peer looks at the outline alone'
    assert world.collides(Pose2D(4.0, 4.0, 0.3)), 'we look inside too'
    costs[80, 90] = 253
    assert world.footprint_cost(4.0, 4.0, 0.0) == 253.0
    costs[80, 90] = UNKNOWN
    assert world.footprint_cost(4.0, 4.0, 0.0) == -2.0
    costs[80, 90] = LETHAL
    assert world.footprint_cost(4.0, 4.0, 0.0) == -1.0
    for x, y, yaw in ((0.2, 4.0, 0.0), (math.nan, 4.0, 0.0), (4.0, math.inf, 0.0), (4.0, 4.0, math.nan)):
        assert world.footprint_cost(x, y, yaw) == -3.0


@settings(max_examples=50)
@given(poses, poses)
def test_it_does_not_matter_which_frame_the_costmap_is_in(pose, offset):
    """Of a costmap in the global frame and the same poses seen from another frame: as many points are touched."""
    costs = REFERENCE['fpcost_grid']
    offset = Pose2D(*offset)
    there = offset.inverse().compose(Pose2D(*pose))
    local = LocalWorld(Costmap(costs, GRID), SARA)
    world = LocalWorld(Costmap(costs, GRID), SARA, offset=offset)
    back = world.to_local([[there.x, there.y, there.yaw]])[0]
    assert back[:2] == pytest.approx(pose[:2], abs=1e-9)
    assert math.cos(back[2] - pose[2]) == pytest.approx(1.0)
    assert world.touched([[there.x, there.y, there.yaw]])[0] == pytest.approx(local.touched([pose])[0], abs=48)


@settings(max_examples=200)
@given(st.floats(-3.1, 3.1), st.floats(0.03, 0.12), st.floats(-0.14, 0.14), st.sampled_from((1.0, -1.0)))
def test_what_lies_inside_is_not_driven_over(yaw, deep, aside, sense):
    """A single cell behind the front edge, or before the rear one: in contact already, the robot may leave by that end,
    and not drive on over it.
    """
    costmap = Costmap(np.zeros(GRID.shape, np.uint8), GRID)
    c, s, ahead = math.cos(yaw), math.sin(yaw), sense * (0.54 - deep - 0.025)
    costmap.costs[int((4.0 + s * ahead + c * aside) / 0.05), int((4.0 + c * ahead - s * aside) / 0.05)] = LETHAL
    world, way = LocalWorld(costmap, SARA), sense * np.linspace(0.0, 0.3, 31)
    straight = np.column_stack([4.0 + c * way, 4.0 + s * way, np.full(31, yaw)])
    assert world.touched(straight)[0] > 0
    assert world.worsens(straight)
    back = 2.0 * straight[0] - straight[::3]
    back[:, 2] = yaw
    touched = world.touched(back)
    assert touched[-1] < touched[0]


def test_poses_that_are_no_numbers_touch():
    world = LocalWorld(Costmap(np.zeros(GRID.shape, np.uint8), GRID), SARA)
    assert (world.touched([[math.nan, 4.0, 0.0], [4.0, math.inf, 0.0], [4.0, 4.0, math.nan]]) > 0).all()
    assert world.touched([[4.0, 4.0, 1.0]])[0] == 0
