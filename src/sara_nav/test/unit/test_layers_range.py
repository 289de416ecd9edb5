"""The range layer: REP-117's readings, marks that hold and ghosts that vanish, the cone's shape, and readings that are
wrong."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D, wrap
from sara_nav.costmaps.costmap import FREE, LETHAL, UNKNOWN
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.range_sensor import MOST_WAITING, RangeReading, RangeSensorConfig, RangeSensorLayer

HERE = Pose2D(0.0, 0.0, 0.0)
SRF02 = dict(min_range=0.16, max_range=2.5, field_of_view=math.radians(60.0))


def make(unknown=False, **parameters):
    """Return (LayeredCostmap of 8 x 8 m about the origin at 0.05 m, its range layer)."""
    layer = RangeSensorLayer('ultrasonic', RangeSensorConfig(**dict(dict(topics=('/a', '/b')), **parameters)))
    return LayeredCostmap(
        CostmapConfig(width=8.0, height=8.0, origin_x=-4.0, origin_y=-4.0, track_unknown_space=unknown),
        [layer],
        np.ones((1, 2)),
    ), layer


def reading(distance, at=HERE, stamp=0.0, source='/a', **other):
    return RangeReading(source, stamp, at.x, at.y, at.yaw, distance, **dict(SRF02, **other))


def lethal(costmap):
    """Return the distances and bearings (n,) from the origin of all lethal cells."""
    rows, columns = np.nonzero(costmap.costmap.costs == LETHAL)
    x, y = costmap.geometry.to_world(columns, rows)
    return np.hypot(x, y), np.arctan2(y, x)


def say(costmap, layer, *distances, t=0.0, at=HERE, **other):
    for distance in distances:
        layer.add_range(reading(distance, at, t, **other))
    costmap.update(t, None)


# -- marking and clearing ------------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(st.floats(0.2, 2.45), st.floats(-math.pi, math.pi), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_an_echo_marks_on_the_axis_at_its_range_and_nothing_off_the_cone(distance, yaw, x, y):
    costmap, layer = make()
    say(costmap, layer, distance, distance, at=Pose2D(x, y, yaw))
    assert costmap.costmap.cost_at(x + distance * math.cos(yaw), y + distance * math.sin(yaw)) == LETHAL
    rows, columns = np.nonzero(costmap.costmap.costs == LETHAL)
    cx, cy = costmap.geometry.to_world(columns, rows)
    off = np.abs(np.vectorize(wrap)(np.arctan2(cy - y, cx - x) - yaw))
    far = np.hypot(cx - x, cy - y)
    assert np.abs(far - distance).max() <= max(0.05 * distance, 0.0355) + 0.0355
    assert ((off <= math.radians(30.0)) | (far * np.sin(np.minimum(off, 1.5)) <= 0.08)).all()


def test_an_echo_frees_unknown_space_before_it_and_leaves_what_is_behind_unknown():
    costmap, layer = make(unknown=True)
    for k in range(4):
        say(costmap, layer, 1.5, t=0.1 * k)
    at = costmap.costmap.cost_at
    assert (at(0.5, 0.0), at(1.0, 0.0), at(1.5, 0.01), at(2.0, 0.0), at(-0.5, 0.0)) == (
        FREE,
        FREE,
        LETHAL,
        UNKNOWN,
        UNKNOWN,
    )


@pytest.mark.parametrize('empty', [math.inf, 2.5, 2.6, 1e9])
def test_no_echo_clears_the_cone_at_once(empty):
    costmap, layer = make()
    for _ in range(10):
        say(costmap, layer, 1.0)
    assert len(lethal(costmap)[0]) > 3
    say(costmap, layer, empty)
    assert len(lethal(costmap)[0]) == 0


def test_no_echo_clears_the_cone_only():
    costmap, layer = make(use_decay=False)
    for yaw in (0.0, math.pi / 2):
        say(costmap, layer, 1.0, at=Pose2D(0.0, 0.0, yaw))
    before = np.sort(lethal(costmap)[1])
    say(costmap, layer, math.inf)
    left = np.sort(lethal(costmap)[1])
    assert len(left) and (left == before[before > math.radians(55.0)]).all()


def test_the_peers_default_for_no_echo_can_be_had():
    costmap, layer = make(clear_on_max_reading=False)
    say(costmap, layer, 1.0)
    say(costmap, layer, math.inf, 2.6)
    assert len(lethal(costmap)[0]) > 0
    say(costmap, layer, 2.5)
    assert costmap.costmap.cost_at(2.5, 0.01) == LETHAL, 'a reading of just max_range is an echo then'


def test_too_near_to_measure_marks_at_min_range():
    costmap, layer = make()
    say(costmap, layer, -math.inf, -math.inf)
    far, _ = lethal(costmap)
    assert costmap.costmap.cost_at(0.16, 0.01) == LETHAL and far.max() < 0.16 + 0.08


def test_a_reading_below_min_range_is_none():
    costmap, layer = make()
    say(costmap, layer, 0.1, 0.0, -0.5)
    assert len(lethal(costmap)[0]) == 0 and layer.counts['below_min_range'] == 3


@pytest.mark.parametrize('readings', [1, 6, 30])
def test_a_ghost_before_the_echo_vanishes_wherever_it_is_about_as_fast_as_it_came(readings):
    for ghost in (0.4, 1.0, 1.6, 2.2):
        costmap, layer = make(use_decay=False)
        for _ in range(readings):
            say(costmap, layer, ghost)
        assert len(lethal(costmap)[0]) > 0
        for _ in range(readings + 2):
            say(costmap, layer, 2.45)
        assert np.abs(lethal(costmap)[0] - 2.45).max() < 0.2, ghost


def test_what_is_seen_again_after_it_was_cleared_is_marked_again_at_once():
    costmap, layer = make()
    for _ in range(30):
        say(costmap, layer, math.inf)
    say(costmap, layer, 1.0)
    assert costmap.costmap.cost_at(1.0, 0.01) == LETHAL


def test_marks_decay_when_nobody_looks_there_any_more():
    costmap, layer = make(pixel_decay=4.0)
    say(costmap, layer, 1.0, t=100.0)
    say(costmap, layer, 1.0, t=103.0)
    costmap.update(106.9, None)
    assert len(lethal(costmap)[0]) > 0
    window = costmap.update(107.1, None)
    assert len(lethal(costmap)[0]) == 0 and window is not None
    assert costmap.update(107.2, None) is None
    lasting, layer = make(use_decay=False)
    say(lasting, layer, 1.0)
    lasting.update(1e6, None)
    assert len(lethal(lasting)[0]) > 0


@given(
    st.lists(st.tuples(st.floats(0.0, 3.0), st.floats(-math.pi, math.pi)), max_size=30),
    st.floats(0.05, 0.4),
    st.floats(0.6, 0.99),
)
def test_no_cell_is_ever_beyond_change(readings, clear, mark):
    costmap, layer = make(clear_threshold=clear, mark_threshold=mark)
    for k, (distance, yaw) in enumerate(readings):
        say(costmap, layer, distance, t=0.1 * k, at=Pose2D(0.0, 0.0, yaw))
    p = layer.probabilities
    assert p.min() > 0.0 and p.max() < 1.0
    assert ((costmap.costmap.costs == LETHAL) == (p > mark)).all()


def test_a_narrow_beam_marks_and_clears_too():
    costmap, layer = make()
    for yaw in np.linspace(-3.0, 3.0, 25):
        say(costmap, layer, 1.7, at=Pose2D(0.01, 0.01, yaw), field_of_view=0.01)
    assert len(lethal(costmap)[0]) >= 25
    for yaw in np.linspace(-3.0, 3.0, 25):
        say(costmap, layer, math.inf, at=Pose2D(0.01, 0.01, yaw), field_of_view=0.01)
    assert len(lethal(costmap)[0]) == 0


def test_a_smaller_inflate_cone_never_reaches_further():
    marked = []
    for share in (1.0, 0.3, 0.0):
        costmap, layer = make(unknown=True, inflate_cone=share)
        say(costmap, layer, *[1.2] * 5)
        marked.append(costmap.costmap.costs != UNKNOWN)
    assert (marked[1] <= marked[0]).all() and (marked[2] <= marked[1]).all()
    assert marked[2].sum() > 20


def test_phi_is_how_far_a_reading_weighs():
    found = {}
    for phi in (0.5, 3.0):
        costmap, layer = make(phi=phi)
        say(costmap, layer, 2.0, 2.0)
        found[phi] = len(lethal(costmap)[0])
    assert found[0.5] == 1 < found[3.0]


def test_sensors_of_fixed_distance_say_only_yes_or_no():
    fixed = dict(min_range=0.8, max_range=0.8)
    costmap, layer = make()
    say(costmap, layer, -math.inf, -math.inf, **fixed)
    assert costmap.costmap.cost_at(0.8, 0.01) == LETHAL
    say(costmap, layer, 0.8, **fixed)
    assert layer.counts['bad_fixed_ranges'] == 1
    say(costmap, layer, math.inf, **fixed)
    assert len(lethal(costmap)[0]) == 0
    costmap, layer = make(input_sensor_type='fixed')
    say(costmap, layer, 1.0)
    assert layer.counts['bad_fixed_ranges'] == 1
    costmap, layer = make(input_sensor_type='VARIABLE')
    say(costmap, layer, 0.8, **fixed)
    assert layer.counts['bad_fixed_ranges'] == 0


def test_the_map_below_is_never_lowered():
    costmap, layer = make()
    layer.parent.costmap.costs[:] = 100
    say(costmap, layer, math.inf)
    x0, y0, xn, yn = costmap.update(0.1, None) or (0, 0, 0, 0)
    assert (costmap.costmap.costs[y0:yn, x0:xn] == 0).all()
    kept = np.full((160, 160), 100, np.uint8)
    layer.update_costs(kept, (0, 0, 160, 160))
    assert (kept == 100).all()


# -- readings that are wrong ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    'wrong, kind',
    [
        (dict(distance=math.nan), 'nan_ranges'),
        (dict(at=Pose2D(math.nan, 0.0, 0.0)), 'bad_poses'),
        (dict(at=Pose2D(0.0, 0.0, math.inf)), 'bad_poses'),
        (dict(at=Pose2D(1e300, 0.0, 0.0)), 'bad_poses'),
        (dict(max_range=1e300), 'bad_limits'),
        (dict(stamp=math.nan), 'bad_poses'),
        (dict(min_range=-0.1), 'bad_limits'),
        (dict(min_range=3.0), 'bad_limits'),
        (dict(max_range=math.inf), 'bad_limits'),
        (dict(max_range=math.nan), 'bad_limits'),
        (dict(min_range=0.0, max_range=0.0), 'bad_limits'),
        (dict(field_of_view=0.0), 'bad_limits'),
        (dict(field_of_view=math.nan), 'bad_limits'),
        (dict(field_of_view=7.0), 'bad_limits'),
        (dict(stamp=4.0), 'old_readings'),
    ],
)
def test_readings_that_make_no_sense_are_dropped_and_counted(wrong, kind):
    costmap, layer = make()
    layer.add_range(reading(math.inf, stamp=5.0))
    layer.add_range(reading(**dict(dict(distance=1.0, stamp=6.0), **wrong)))
    costmap.update(6.0, None)
    assert len(lethal(costmap)[0]) == 0
    assert layer.counts == {kind: 1} and '/a' in layer.problem


def test_readings_off_the_map_and_floods_do_no_harm():
    costmap, layer = make()
    for k in range(MOST_WAITING + 10):
        layer.add_range(reading(1.0, Pose2D(9e5 * (-1) ** k, 1e5, 1.0), 1.0))
    costmap.update(1.0, None)
    assert len(lethal(costmap)[0]) == 0 and layer.counts['overflow'] == 10


def test_switched_off_it_takes_nothing_in_and_does_nothing():
    costmap, layer = make()
    layer.reconfigure(RangeSensorConfig(enabled=False))
    say(costmap, layer, *[1.0] * 5)
    assert len(lethal(costmap)[0]) == 0
    layer.reconfigure(RangeSensorConfig())
    costmap.update(0.1, None)
    assert len(lethal(costmap)[0]) == 0
    say(costmap, layer, 1.0, t=0.2)
    assert len(lethal(costmap)[0]) > 0


def test_when_time_goes_back_old_stamps_hinder_nothing():
    costmap, layer = make(pixel_decay=2.0, no_readings_timeout=1.0)
    say(costmap, layer, 1.0, t=100.0)
    say(costmap, layer, 2.0, t=5.0)
    assert layer.counts['old_readings'] == 1, 'it came before the costmap knew'
    say(costmap, layer, 2.0, t=5.1)
    assert layer.counts['old_readings'] == 1 and costmap.costmap.cost_at(2.0, 0.01) == LETHAL
    costmap.update(8.0, None)
    assert len(lethal(costmap)[0]) == 0


def test_each_silent_sensor_is_told_of_by_name():
    costmap, layer = make(no_readings_timeout=1.0)
    costmap.update(10.0, None)
    say(costmap, layer, 1.0, t=10.5)
    assert costmap.current(10.9) == ''
    assert costmap.current(11.2) == 'range sensor on /b silent for 1.2 s'
    assert costmap.current(13.6) == 'range sensor on /a silent for 3.1 s; range sensor on /b silent for 3.6 s'
    assert make()[0].current(1e6) == ''


# -- passing_memory: somebody who moves leaves no marks ----------------------------------------------------------------


def test_who_passes_leaves_no_marks_and_what_stood_there_before_stays():
    costmap, layer = make(passing_memory=1.0, pixel_decay=60.0)
    for k in range(5):  # a wall behind
        say(costmap, layer, 1.0, t=0.2 * k, at=Pose2D(0.0, 0.0, math.pi))
    for t in (5.0, 5.2, 5.4):
        say(costmap, layer, 1.5, t=t)
    assert {round(far, 1) for far in lethal(costmap)[0]} >= {1.0, 1.5}
    layer.let_pass(5.5)
    for t, distance in ((5.6, 1.3), (5.8, 1.1), (6.0, 0.9), (6.4, 0.9)):
        say(costmap, layer, distance, t=t)
    far, bearing = lethal(costmap)
    assert len(far) and (np.abs(bearing) > 0.5 * math.pi).all(), 'only the wall behind'
    for t in (6.6, 6.8, 7.0):
        say(costmap, layer, 0.9, t=t)
    far, bearing = lethal(costmap)
    assert (np.abs(bearing) < 0.1).any() and abs(far[np.abs(bearing) < 0.1].min() - 0.9) < 0.06, 'what stays is marked'


def test_while_somebody_passes_the_cone_up_to_the_echo_is_free():
    costmap, layer = make(passing_memory=1.0, unknown=True)
    layer.let_pass(0.0)
    for k in range(4):
        say(costmap, layer, 1.5, t=0.2 * k)
    at = costmap.costmap.cost_at
    assert (at(0.5, 0.0), at(1.3, 0.0), at(2.0, 0.0)) == (FREE, FREE, UNKNOWN) and not len(lethal(costmap)[0])


def test_without_it_and_after_the_clock_was_set_back_echoes_mark():
    for memory, back in ((0.0, False), (5.0, True)):
        costmap, layer = make(passing_memory=memory)
        costmap.update(10.0, None)
        layer.let_pass(10.0)
        start = 10.1
        if back:
            costmap.update(1.0, None)
            layer.time_went_back(1.0)
            start = 1.1
        for k in range(4):
            say(costmap, layer, 1.5, t=start + 0.1 * k)
        assert len(lethal(costmap)[0])


# -- free_memory: several views carve an arc ---------------------------------------------------------------------------


def beside(costmap, layer, t, distance, yaw=math.radians(40.0)):
    """A second sensor at the same place, turned aside, says a distance or +Inf."""
    layer.add_range(reading(distance, Pose2D(0.0, 0.0, yaw), t, source='/b'))
    costmap.update(t, None)


@settings(max_examples=60)
@given(st.floats(0.4, 1.5), st.floats(25.0, 45.0), st.sampled_from([-1.0, 1.0]))
def test_what_another_sensor_saw_free_is_not_what_echoes(distance, aside, side):
    costmap, layer = make(free_memory=5.0)
    yaw = side * math.radians(aside)
    beside(costmap, layer, 0.0, math.inf, yaw)
    for k in range(1, 6):
        say(costmap, layer, distance, t=0.1 * k)
    far, bearing = lethal(costmap)
    assert len(far), 'the echo is somewhere'
    assert (np.abs(bearing - yaw) > math.radians(27.0) - 0.06 / far).all(), 'and not in what the other saw free'


def test_without_it_or_when_that_is_long_ago_the_whole_arc_may_echo():
    marked = []
    for memory, t in ((0.0, 0.1), (5.0, 0.1), (5.0, 6.0)):
        costmap, layer = make(free_memory=memory)
        beside(costmap, layer, 0.0, math.inf)
        for k in range(5):
            say(costmap, layer, 1.0, t=t + 0.1 * k)
        marked.append(len(lethal(costmap)[0]))
    assert marked[0] == marked[2] > marked[1] > 0


def test_where_all_of_the_arc_was_seen_free_something_came_there():
    costmap, layer = make(free_memory=5.0)
    say(costmap, layer, math.inf)
    plain, plainly = make()
    say(plain, plainly, math.inf)
    for k in range(1, 6):
        say(costmap, layer, 1.0, t=0.1 * k)
        say(plain, plainly, 1.0, t=0.1 * k)
    assert len(lethal(costmap)[0]) == len(lethal(plain)[0]) > 0


def test_memory_can_be_switched_on_and_off_and_is_cleared():
    costmap, layer = make()
    layer.reconfigure(RangeSensorConfig(topics=('/a', '/b'), free_memory=5.0))
    beside(costmap, layer, 0.0, math.inf)
    layer.clear(0, 0, 160, 160, True)
    for k in range(5):
        say(costmap, layer, 1.0, t=0.1 + 0.1 * k)
    whole = len(lethal(costmap)[0])
    layer.reconfigure(RangeSensorConfig(topics=('/a', '/b')))
    layer.reset()
    for k in range(5):
        say(costmap, layer, 1.0, t=1.0 + 0.1 * k)
    assert len(lethal(costmap)[0]) == whole > 0


def test_memory_moves_with_a_costmap_that_rolls():
    layer = RangeSensorLayer('ultrasonic', RangeSensorConfig(topics=('/a', '/b'), free_memory=100.0))
    costmap = LayeredCostmap(CostmapConfig(width=6.0, height=6.0, rolling_window=True), [layer], np.ones((1, 2)))
    costmap.update(0.0, HERE)
    beside(costmap, layer, 0.0, math.inf)
    costmap.update(1.0, Pose2D(0.7, 0.3, 0.0))
    for k in range(5):
        say(costmap, layer, 1.0, t=1.1 + 0.1 * k)
    _, bearing = lethal(costmap)
    assert len(bearing) and (bearing < math.radians(40.0 - 27.0) + 0.06).all()
