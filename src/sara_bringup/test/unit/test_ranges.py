"""What the sonars see arrives in move_base's costmaps, at its place."""

import math
from types import SimpleNamespace

import pytest

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.lockstep.ranges import mountings
from sara_bringup.paths import share
from sara_common.planar import compose, inverse
from sara_common.platforms import chosen, load
from sara_sim.world.obstacles import Obstacle

HALL = share() / 'maps' / 'hall.yaml'


def test_the_urdf_says_where_the_sensors_sit():
    places = mountings(load('sara'))
    assert len(places) == 10
    assert places['scan'] == (0.5, 0.0, 0.0)
    assert places['SDI'] == pytest.approx((0.54, 0.18, math.radians(10.0)), abs=1e-6)
    assert places['STD'] == pytest.approx((-0.54, -0.18, math.radians(-170.0)), abs=1e-6)


def test_what_the_urdf_leaves_out_is_zero_and_what_is_no_number_is_refused():
    urdf = '<robot><joint type="fixed"><parent link="base_link"/><child link="A_frame"/>{}</joint></robot>'
    for origin, place in (
        ('', (0.0, 0.0, 0.0)),
        ('<origin xyz="1 2 3"/>', (1.0, 2.0, 0.0)),
        ('<origin rpy="0 0 1"/>', (0.0, 0.0, 1.0)),
    ):
        assert mountings(SimpleNamespace(urdf=urdf.format(origin))) == {'A': place}
    with pytest.raises(ValueError, match='A_frame nowhere'):
        mountings(SimpleNamespace(urdf=urdf.format('<origin xyz="1 2"/>')))


@pytest.mark.parametrize('frame', ['map', 'odom'])
def test_a_post_that_the_map_does_not_show_is_marked_where_it_stands(frame):
    sonars = chosen().sonars
    along = [name for name, place in sonars.items() if abs(place.x) == 0.5 * chosen().body.length]  # at both ends
    sensor = sonars[max(along, key=lambda name: (sonars[name].x, sonars[name].y))]  # the left one in front
    layer = {
        'plugins': [{'name': 'ultrasonic', 'type': 'range_sensor_layer::RangeSensorLayer'}],
        'ultrasonic': {'topics': [f'/{name}_range' for name in along], 'pixel_decay': 3.0},
    }
    navigation = {'local_costmap': {'global_frame': frame, **layer}, 'global_costmap': layer}
    lockstep = Lockstep(HALL, (3.0, 4.0, 0.0), 0, localization='fake', navigation=navigation)
    lockstep.chair.world.obstacles.add(Obstacle('post', at=(3.0 + sensor.x + 1.46, 4.0 + sensor.y), radius=0.15))
    while lockstep.time < 25.0:
        lockstep.step()
    here = lockstep.chair.pose
    for costmap, base in (
        (lockstep.move_base.local_costmap, lockstep.odometry if frame == 'odom' else here),
        (lockstep.move_base.global_costmap, here),
    ):
        y, x = (costmap.layers['ultrasonic'].probabilities > 0.8).nonzero()
        g = costmap.geometry
        marked = {compose(inverse(base), (*g.to_world(int(column), int(row)), 0.0))[:2] for column, row in zip(x, y)}
        away = [(ahead - sensor.x, left) for ahead, left in marked]
        assert any(1.26 < ahead < 1.41 and abs(left - sensor.y) < 0.1 for ahead, left in away)  # the post's near side
        assert not any(0.06 < ahead < 1.06 and abs(left) < 0.3 for ahead, left in away)


def test_a_costmap_in_a_frame_that_nobody_knows_is_refused():
    with pytest.raises(ValueError, match="global_frame is 'world'"):
        Lockstep(HALL, (3.0, 4.0, 0.0), 0, navigation={'local_costmap': {'global_frame': 'world'}})
