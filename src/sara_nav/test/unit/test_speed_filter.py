"""Slow places: what the mask says, and that a robot is slow when it gets there, by whichever local planner."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import Costmap
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.speed import SpeedConfig, SpeedFilter
from sara_nav.grids.collision import LocalWorld
from sara_nav.grids.footprint import cover
from sara_nav.grids.grid import GridGeometry
from sara_nav.maps.edits import SLOW, SLOW_PERCENT, Edit, drawn, keep_out_mask, speed_mask
from sara_nav.maps.map_io import GridMap, MapError
from sara_nav.move_base.robot_state import within_limits
from sara_nav.pursuit.messages import following
from sara_nav.pursuit.path_tracker import Leg
from sara_nav.pursuit.rotate_then_pursue_config import RotateThenPursueConfig
from sara_nav.pursuit.smooth_speed import Motion, way_to_slow
from sara_nav.pursuit.speed_plan import END, SpeedPlan, driven_now
from sara_nav.pursuit.speed_plan import SLOW as SLOW_PLACE

BODY = np.array([[0.5, 0.3], [0.5, -0.3], [-0.5, -0.3], [-0.5, 0.3]])
POINTS = cover(BODY, 0.05)


def floor(value=0):
    return GridMap(np.full((40, 200), value, np.int8), GridGeometry(200, 40, 0.05, 0.0, -1.0))


def slow_filter(percent=40, left=6.0, right=6.2):
    """A SpeedFilter with a strip across the way along x."""
    layer, mask = SpeedFilter('speed_filter'), floor()
    x = 0.05 * (np.arange(200) + 0.5)
    mask.data[:, (x > left) & (x < right)] = percent
    LayeredCostmap(CostmapConfig(), [layer], BODY)
    layer.set_mask(mask)
    return layer


def poses(*x, yaw=0.0, y=0.0):
    return np.array([(at, y, yaw) for at in x])


def test_all_of_the_body_counts():
    share = slow_filter().share(poses(5.4, 5.6, 6.1, 6.6, 6.8), POINTS)
    assert share.tolist() == [1.0, 0.4, 0.4, 0.4, 1.0]
    assert slow_filter().share(poses(5.6, yaw=0.5 * math.pi), POINTS).tolist() == [1.0]  # its side is nearer


def test_values_are_per_cent_and_what_is_none_limits_nothing():
    for value, share in ((1, 0.01), (99, 0.99), (100, 1.0), (0, 1.0), (-1, 1.0)):
        assert slow_filter(value).share(poses(6.1), POINTS).tolist() == [pytest.approx(share)]
    assert SpeedFilter('none', SpeedConfig()).config.faults() == []
    assert SpeedConfig(mask_topic='').faults()


def test_without_a_mask_or_switched_off_nothing_is_slow():
    layer = SpeedFilter('speed_filter')
    LayeredCostmap(CostmapConfig(), [layer], BODY)
    assert layer.share(poses(1.0, 6.0), POINTS).tolist() == [1.0, 1.0]
    layer = slow_filter()
    layer.reconfigure(SpeedConfig(enabled=False))
    assert layer.share(poses(6.0), POINTS).tolist() == [1.0]


def test_a_mask_that_makes_no_sense_is_refused_and_the_old_one_stays():
    layer = slow_filter()
    with pytest.raises(MapError):
        layer.set_mask(GridMap(np.zeros((2, 2), np.int8), GridGeometry(2, 2, 60.0, 0.0, 0.0)))
    assert layer.share(poses(6.1), POINTS).tolist() == [0.4]
    layer.set_frame(Pose2D(math.nan, 0.0, 0.0))
    assert layer.counts['bad_frames'] == 1 and layer.share(poses(6.1), POINTS).tolist() == [0.4]


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-math.pi, math.pi), st.floats(0.0, 9.0))
def test_the_mask_may_be_in_another_frame(x, y, yaw, at):
    layer, frame = slow_filter(), Pose2D(x, y, yaw)
    layer.set_frame(frame)
    here = frame.inverse().compose(Pose2D(at, 0.1, 0.2))
    plain = slow_filter().share(poses(at, y=0.1, yaw=0.2), POINTS)
    if abs(at - 6.1) < 0.3 or abs(at - 6.1) > 0.9:
        assert layer.share(np.array([here]), POINTS) == plain


@given(
    st.lists(st.tuples(*(st.floats(-1e5, 1e5),) * 3), min_size=1, max_size=5), st.integers(-1, 100), st.floats(0.0, 9.0)
)
def test_any_pose_has_a_share(at, percent, left):
    share = slow_filter(percent, left, left + 0.4).share(np.array(at), POINTS)
    assert share.shape == (len(at),) and (share > 0.0).all() and (share <= 1.0).all()


def world(*layers):
    costmap = Costmap(np.zeros((40, 200), np.uint8), GridGeometry(200, 40, 0.05, 0.0, -1.0))
    return LocalWorld(costmap, BODY, slow=layers)


def test_a_world_takes_the_least_share():
    assert world().speed_share(poses(6.1)).tolist() == [1.0]
    assert world(slow_filter(60), slow_filter(30)).speed_share(poses(5.0, 6.1)).tolist() == [1.0, 0.3]


def driven(layers, config):
    """[(x, speed, cause)] of a robot that drives 8 m along x from 1.0 on."""
    plan, leg, around = SpeedPlan(config), Leg(np.array([(1.0, 0.0), (9.0, 0.0)])), world(*layers)
    x, v, a, rows = 1.0, 0.0, 0.0, []
    while leg.left > 0.1 and len(rows) < 2000:
        leg.locate(x, 0.0)
        pace = plan.pace(leg, driven_now(Motion(v, a), 0.0, 1.0, Pose2D(x, 0.0, 0.0)), around, 0.05)
        v, a = pace.speed, pace.acceleration
        x += v * 0.05
        rows.append((x, v, pace.cause.kind, following(leg, pace, 'the goal')[1]))
    return rows


def test_it_brakes_before_a_slow_place_and_speeds_up_behind_it():
    config = RotateThenPursueConfig(max_vel_x=0.8)
    rows, free = driven((slow_filter(),), config), driven((), config)
    on = [v for x, v, _, _ in rows if 5.5 < x < 6.7]
    assert max(on) <= 0.4 * 0.8 + 0.02 and min(on) > 0.25
    assert max(v for x, v, _, _ in rows if x < 5.0) > 0.7 and max(v for x, v, _, _ in rows if x > 7.0) > 0.6
    begins = next(x for x, v, kind, _ in rows if kind == SLOW_PLACE)
    assert 5.5 - begins < way_to_slow(0.8, 0.0, 0.32, config.comfort_dec_x, config.jerk_lim_x) + 0.5
    assert {kind for _, _, kind, _ in free} == {'free', END}
    assert any('0.32 m/s: a slow place' in text for *_, text in rows)


def test_whatever_the_local_planner_commands_is_limited_on_its_arc():
    config = RotateThenPursueConfig(max_vel_x=0.8)
    assert within_limits(0.8, 0.4, config, 0.4) == pytest.approx((0.32, 0.16))
    assert within_limits(-0.1, 0.1, config, 0.4) == (-0.1, 0.1)
    assert within_limits(0.0, 0.5, config, 0.4) == (0.0, 0.5)  # turning in place is not


def test_slow_places_drawn_over_a_map_are_a_mask_and_nothing_else():
    grid, edits = floor(), [Edit(SLOW, (6.0, -1.0), (6.2, 1.0))]
    mask = speed_mask(grid, edits)
    rows, columns = np.nonzero(mask.data)
    assert set(mask.data.ravel().tolist()) == {0, SLOW_PERCENT} and 4 <= len(set(columns.tolist())) <= 6
    assert drawn(grid, edits) is grid and not keep_out_mask(grid, edits).data.any()
