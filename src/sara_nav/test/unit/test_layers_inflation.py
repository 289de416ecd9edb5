"""The inflation layer: costmap_2d's own tests rebuilt from their description, with footprints of half sides in
metres.
"""

import math
import sys
from pathlib import Path

import numpy as np

from sara_nav.costmaps.costmap import FREE, INSCRIBED, LETHAL, UNKNOWN, InflationConfig, cost_of_distance
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig, SourceConfig
from sara_nav.grids.footprint import radii

sys.path.append(str(Path(__file__).resolve().parent))
from ten_by_ten import AT_ORIGIN, count, make, see  # noqa: E402  pylint: disable=wrong-import-position


def box(half_length, half_width):
    return np.array(
        [[half_width, half_length], [half_width, -half_length], [-half_width, -half_length], [-half_width, half_length]]
    )


def inflated(half_length, half_width, radius, static=False, scaling=1.0, **parameters):
    """Return (costmap, obstacle layer) with inflation; the robot's footprint is not cleared, as in the peer's tests its
    outline lies partly off the map and then clears nothing."""
    return make(
        static,
        footprint=box(half_length, half_width),
        more=[InflationLayer('inflation', InflationConfig(radius, scaling))],
        footprint_clearing_enabled=False,
        **parameters,
    )


def test_a_robot_next_to_an_obstacle_can_still_move():
    costmap, layer = inflated(2.1, 2.3, 4.1)
    see(layer, 0, 0, 1.0)
    costmap.update(0.0, AT_ORIGIN)
    costs = costmap.costmap.costs
    assert costs[0, :3].tolist() == [LETHAL, INSCRIBED, INSCRIBED] and costs[1, 1] == INSCRIBED
    assert costs[0, 3] < INSCRIBED and costs[1, 2] < INSCRIBED


def test_inflation_makes_nothing_unknown():
    costmap, layer = inflated(2.1, 2.3, 4.1)
    see(layer, 0, 0, 1.0)
    costmap.update(0.0, AT_ORIGIN)
    assert count(costmap, UNKNOWN) == 0


def test_costs_follow_the_formula_far_out():
    far = SourceConfig('far', clearing=True, obstacle_range=100.0, raytrace_range=100.0)
    layer = ObstacleLayer('obstacles', ObstacleConfig(sources=(far,), footprint_clearing_enabled=False))
    costmap = LayeredCostmap(
        CostmapConfig(resolution=1.0, width=100.0, height=100.0),
        [layer, InflationLayer('inflation', InflationConfig(10.5, 1.0))],
        box(5.0, 6.25),
    )
    see(layer, 50, 50, 1.0)
    costmap.update(0.0, AT_ORIGIN)
    costs = costmap.costmap.costs
    for i in range(6):
        assert min(costs[50, 50 + i], costs[50, 50 - i], costs[50 + i, 50], costs[50 - i, 50]) >= INSCRIBED
    for i in range(6, 12):
        assert costs[50, 50 + i] == math.floor(252 * math.exp(-(i - 5.0))) == cost_of_distance(i, 5.0, 1.0)


def test_no_cost_is_too_low_whatever_the_order_of_obstacles():
    costmap, layer = inflated(2.1, 2.3, 4.1)
    see(layer, 4, 4, 1.0)
    see(layer, 5, 5, 1.0)
    costmap.update(0.0, AT_ORIGIN)
    for y, x in np.ndindex(10, 10):
        distance = min(math.hypot(x - 4, y - 4), math.hypot(x - 5, y - 5))
        assert costmap.costmap.costs[y, x] == (cost_of_distance(distance, 2.1, 1.0) if distance <= 5 else 0)


def test_obstacles_of_map_and_sensors_are_inflated():
    costmap, layer = inflated(1, 1, 1, static=True)
    costmap.update(0.0, AT_ORIGIN)
    assert (count(costmap, LETHAL), count(costmap, INSCRIBED)) == (20, 28)
    see(layer, 0, 0, 0.4)
    costmap.update(0.1, AT_ORIGIN)
    assert count(costmap, LETHAL) + count(costmap, INSCRIBED) == 51
    see(layer, 2, 0)
    costmap.update(0.2, AT_ORIGIN)
    assert count(costmap, LETHAL) + count(costmap, INSCRIBED) == 54
    see(layer, 1, 9)
    costmap.update(0.3, AT_ORIGIN)
    assert costmap.costmap.costs[9, :3].tolist() == [INSCRIBED, LETHAL, INSCRIBED]
    see(layer, 0, 9)
    costmap.update(0.4, AT_ORIGIN)
    assert costmap.costmap.costs[9, 0] == LETHAL


def test_inflated_cells_are_no_obstacles_themselves():
    costmap, layer = inflated(1, 1, 1, static=True)
    for x, y in ((1, 1), (2, 1), (2, 2)):
        see(layer, x, y, 1.0)
    costmap.update(0.0, AT_ORIGIN)
    assert costmap.costmap.costs[3, 2:4].tolist() == [INSCRIBED, INSCRIBED]


def test_inflation_over_an_empty_map_and_again_without_a_change():
    costmap, layer = inflated(1, 1.75, 3)
    assert count(costmap, FREE) == 100
    see(layer, 5, 5, 1.0)
    for t in (0.0, 0.1):
        costmap.update(t, AT_ORIGIN)
        assert (100 - count(costmap, FREE), count(costmap, LETHAL), count(costmap, INSCRIBED)) == (29, 1, 4)


def test_the_inscribed_radius_is_that_of_the_footprint():
    costmap, _ = inflated(2.1, 2.3, 4.1)
    assert (costmap.inscribed_radius, costmap.circumscribed_radius) == radii(box(2.1, 2.3))


def test_switched_off_nothing_is_inflated():
    costmap, layer = inflated(1, 1, 3)
    see(layer, 5, 5, 1.0)
    costmap.update(0.0, AT_ORIGIN)
    around = costmap.layers['inflation']
    around.reconfigure(InflationConfig(3.0, 1.0, enabled=False))
    costmap.update(0.1, AT_ORIGIN)
    assert count(costmap, FREE) == 99
    around.reconfigure(InflationConfig(3.0, 1.0))
    costmap.update(0.2, AT_ORIGIN)
    assert count(costmap, FREE) == 71
