"""Costmaps: the fall-off of costs, the static layer, and the peer's grids."""

import math
import pathlib

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from sara_nav.costmaps import costmap as cm

REFERENCE = np.load(pathlib.Path(__file__).parents[1] / 'data' / 'costmap_reference.npz')
small = hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=14)
grids = hnp.arrays(np.uint8, small, elements=st.sampled_from([0, 0, 0, 0, 0, 100, 253, 254, 255]))


@given(grids, st.floats(0.0, 1.0), st.floats(0.0, 20.0), st.booleans())
def test_inflation_never_lowers_a_known_cost_and_keeps_obstacles(costs, radius, scaling, unknown_too):
    result = cm.inflate(costs, 0.1, 0.25, cm.InflationConfig(radius, scaling, unknown_too))
    known = costs != cm.UNKNOWN
    assert (result[known] >= costs[known]).all()
    assert ((result == cm.LETHAL) == (costs == cm.LETHAL)).all()


@given(grids)
def test_inflation_does_not_care_which_way_the_map_lies(costs):
    config = cm.InflationConfig(0.5, 3.0)
    turned = cm.inflate(np.ascontiguousarray(np.rot90(costs)), 0.1, 0.25, config)
    assert (turned == np.rot90(cm.inflate(costs, 0.1, 0.25, config))).all()


@given(st.floats(0.0, 3.0), st.floats(0.0, 3.0), st.floats(0.1, 20.0))
def test_costs_fall_with_distance(a, b, scaling):
    near, far = cm.cost_of_distance([min(a, b), max(a, b)], 0.3, scaling)
    assert near >= far
    assert (near == cm.LETHAL) == (min(a, b) == 0.0)


def test_costs_at_known_distances():
    costs = cm.cost_of_distance([0.0, 0.1, 0.3, 0.4, 1.3], 0.3, 2.0)
    assert costs.tolist() == [254, 253, 253, math.floor(252 * math.exp(-0.2)), math.floor(252 * math.exp(-2.0))]


def test_inflation_agrees_with_the_peer():
    """The peer's wave mistakes the distance in rare cells, ours is exact: 99.98 % of all cells are equal, and none of
    ours is lower by more than 1 but for unknown cells that the exact distance makes known."""
    cells = different = 0
    for number in range(20):
        resolution, radius, scaling, unknown_too, inscribed, _ = REFERENCE[f'infl_{number:02}_params']
        before = REFERENCE[f'infl_{number:02}_in']
        config = cm.InflationConfig(radius, scaling, bool(unknown_too))
        ours = cm.inflate(before, resolution, inscribed, config).astype(int)
        theirs = REFERENCE[f'infl_{number:02}_out'].astype(int)
        assert ((ours >= theirs - 1) | (before == cm.UNKNOWN)).all(), number
        cells += ours.size
        different += (ours != theirs).sum()
    assert different <= 0.0002 * cells


def test_static_layer():
    data = np.array([[-1, 0, 50, 99, 100]], np.int8)
    assert cm.static_costs(data).tolist() == [[255, 0, 0, 0, 254]]
    assert cm.static_costs(data, cm.StaticLayerConfig(track_unknown_space=False)).tolist() == [[0, 0, 0, 0, 254]]
    assert cm.static_costs(data, cm.StaticLayerConfig(trinary_costmap=False)).tolist() == [[255, 0, 127, 251, 254]]
    assert cm.static_costs(data, cm.StaticLayerConfig(lethal_cost_threshold=50)).tolist() == [[255, 0, 254, 254, 254]]


def test_what_means_unknown_can_be_chosen_and_nothing_else_becomes_free_for_it():
    data = np.array([[-1, 0, 50, 100, -56]], np.int8)
    assert cm.static_costs(data, cm.StaticLayerConfig(unknown_cost_value=255)).tolist() == [[255, 0, 0, 254, 254]]
    assert cm.static_costs(data, cm.StaticLayerConfig(unknown_cost_value=50)).tolist() == [[254, 0, 255, 254, 254]]


def test_published_scale():
    scaled = cm.to_occupancy(np.arange(256, dtype=np.uint8))
    assert (scaled[0], scaled[253], scaled[254], scaled[255]) == (0, 99, 100, -1)
    assert scaled[1] == 1 and scaled[252] == 98
    assert (np.diff(scaled[1:253].astype(int)) >= 0).all()


def test_unknown_cells_near_free_ones_can_be_taken_for_free():
    costs = np.full((7, 9), cm.UNKNOWN, np.uint8)
    costs[3, 2], costs[3, 5] = cm.FREE, cm.LETHAL
    found = cm.freed(costs, 0.1, 0.2)
    rows, columns = np.nonzero(found == cm.FREE)
    near = np.hypot(*(np.mgrid[:7, :9] - np.array([3, 2])[:, None, None])) <= 2.0
    assert set(zip(rows, columns)) == set(zip(*np.nonzero(near)))
    assert found[3, 5] == cm.LETHAL and (costs == cm.FREE).sum() == 1
    assert (cm.freed(np.full((3, 3), cm.UNKNOWN, np.uint8), 0.1, 0.2) == cm.UNKNOWN).all()


def test_bad_settings_are_named():
    assert 'free_margin' in cm.StaticLayerConfig(free_margin=-0.1).faults()[0]
    assert 'inflation_radius' in cm.InflationConfig(inflation_radius=-1.0).faults()[0]
    assert 'cost_scaling_factor' in cm.InflationConfig(cost_scaling_factor=math.nan).faults()[0]
    assert 'lethal_cost_threshold' in cm.StaticLayerConfig(lethal_cost_threshold=0).faults()[0]
