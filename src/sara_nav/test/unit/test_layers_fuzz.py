"""Whatever sensors, maps and poses say, a costmap stays one: no crash, no cost off its cells, and it works
afterwards.
"""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sara_common.planar import Pose2D
from sara_nav.costmaps.costmap import LETHAL, InflationConfig
from sara_nav.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from sara_nav.costmaps.layers.inflation import InflationLayer
from sara_nav.costmaps.layers.obstacle import ObstacleLayer
from sara_nav.costmaps.layers.obstacle_config import ObstacleConfig, SourceConfig
from sara_nav.costmaps.layers.range_sensor import RangeReading, RangeSensorConfig, RangeSensorLayer
from sara_nav.costmaps.layers.static import StaticLayer
from sara_nav.costmaps.observations import CloudLayout, Observation, ObservationError, cloud_points, scan_points
from sara_nav.grids.grid import GridError, GridGeometry
from sara_nav.maps.map_io import GridMap, MapError

number = st.one_of(
    st.floats(), st.floats(-10.0, 10.0), st.sampled_from([0.0, 1.0, math.nan, math.inf, -math.inf, 1e300])
)
sound = st.floats(-4.0, 4.0)
pose = st.one_of(st.none(), st.builds(Pose2D, number, number, number), st.builds(Pose2D, sound, sound, sound))
a_range = st.one_of(
    st.builds(RangeReading, st.sampled_from(['/a', '/b']), *[number] * 8),
    st.builds(
        RangeReading,
        st.just('/a'),
        number,
        sound,
        sound,
        sound,
        number,
        st.just(0.2),
        st.just(2.0),
        st.floats(0.01, 6.0),
    ),
)
seen = st.builds(
    Observation,
    st.sampled_from(['scan', 'nobody']),
    number,
    st.tuples(number, number, number),
    st.lists(st.tuples(number, number, number), max_size=5).map(lambda p: np.array(p).reshape(-1, 3)),
)
change = st.tuples(
    st.integers(-3, 12), st.integers(-3, 12), st.integers(0, 4), st.integers(0, 4), st.integers(-128, 127)
)
new_map = st.tuples(st.integers(0, 12), st.integers(0, 12), number, number, number, number)
step = st.tuples(
    number,
    pose,
    st.lists(a_range, max_size=4),
    st.lists(seen, max_size=2),
    st.none() | change,
    st.none() | new_map,
    st.none() | pose,
)


def make(rolling):
    layers = [
        StaticLayer('map'),
        ObstacleLayer(
            'scan',
            ObstacleConfig(
                sources=(SourceConfig('scan', clearing=True, observation_persistence=1.0),),
                pixel_decay=2.0,
                passing_memory=0.5,
                mark_after=0.3,
            ),
        ),
        RangeSensorLayer('range', RangeSensorConfig(ignore_seen=True)),
        InflationLayer('inflation', InflationConfig(0.5)),
    ]
    return LayeredCostmap(
        CostmapConfig(rolling_window=rolling, resolution=0.25, width=4.0, height=3.0, origin_x=-2.0, origin_y=-1.5),
        layers,
        np.array([[0.4, 0.2], [0.4, -0.2], [-0.4, 0.0]]),
    )


@settings(max_examples=120)
@given(st.booleans(), st.lists(step, max_size=6))
def test_nothing_breaks_a_costmap(rolling, steps):
    costmap = make(rolling)
    layers = costmap.layers
    for t, at, ranges, observations, update, chart, frame in steps:
        for reading in ranges:
            layers['range'].add_range(reading)
        for observation in observations:
            layers['scan'].add_observation(observation)
        try:
            if chart is not None:
                layers['map'].set_map(
                    GridMap(np.zeros((chart[1], chart[0]), np.int8), GridGeometry(*chart[:5]), chart[5])
                )
            if update is not None:
                layers['map'].update_map(update[0], update[1], np.full(update[2:4], update[4]))
        except (MapError, GridError):
            pass
        if frame is not None:
            layers['map'].set_frame(frame)
        costmap.update(t if math.isfinite(t) else 0.0, at)
        costs = costmap.costmap.costs
        assert costs.dtype == np.uint8 and costs.shape == costmap.geometry.shape
    t = (costmap.updated_at or 0.0) + 100.0
    middle = Pose2D(
        costmap.geometry.origin_x + 0.5 * costmap.geometry.size[0],
        costmap.geometry.origin_y + 0.5 * costmap.geometry.size[1],
        0.0,
    )
    if costmap.geometry.resolution == 0.25 and abs(middle.x) < 1e3 and abs(middle.y) < 1e3 and t < 1e6:
        costmap.reset()
        costmap.update(t, None)
        layers['range'].time_went_back(t)
        layers['range'].add_range(RangeReading('/a', t, middle.x, middle.y, 0.0, 0.6, 0.1, 2.0, 0.5))
        costmap.update(t, None)
        assert costmap.costmap.cost_at(middle.x + 0.6, middle.y + 1e-3) in (LETHAL, None)


@given(st.lists(number, max_size=8), number, number, number, number, st.booleans())
def test_a_scan_gives_points_or_is_refused(ranges, start, increment, low, high, infinity):
    try:
        points = scan_points(ranges, start, increment, low, high, infinity)
    except ObservationError:
        return
    assert points.shape[1] == 3 and len(points) <= len(ranges)


@given(
    st.binary(max_size=100),
    st.integers(0, 9),
    st.integers(0, 9),
    st.integers(0, 40),
    st.integers(0, 200),
    st.lists(st.tuples(st.integers(0, 60), st.integers(0, 9)), min_size=3, max_size=3),
    st.booleans(),
)
def test_a_cloud_gives_points_or_is_refused(data, width, height, point_step, row_step, places, big):
    try:
        points = cloud_points(data, CloudLayout(width, height, point_step, row_step, dict(zip('xyz', places)), big))
    except ObservationError:
        return
    assert points.shape == (width * height, 3)
