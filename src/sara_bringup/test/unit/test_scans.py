"""The laser scanner in lockstep: to gate and costmaps, each point at its place; without it, nothing of it."""

import pytest

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_common.planar import Pose2D, compose, inverse
from sara_common.platforms import parameters
from sara_control.gate.gate_config import SafetyConfig
from sara_sim.world.obstacles import Obstacle

HALL = share() / 'maps' / 'hall.yaml'
LAYER = {
    'plugins': [{'name': 'laser', 'type': 'costmap_2d::ObstacleLayer'}],
    'laser': {
        'observation_sources': 'scan',
        'scan': {'topic': '/scan', 'data_type': 'LaserScan', 'marking': True, 'clearing': True, 'obstacle_range': 3.0},
    },
}


@pytest.mark.parametrize('frame', ['map', 'odom'])
def test_a_post_is_marked_where_it_stands_though_the_chair_turns(frame):
    navigation = {'local_costmap': {'global_frame': frame, **LAYER}, 'global_costmap': LAYER}
    lockstep = Lockstep(HALL, (3.0, 4.0, 0.0), 0, localization='fake', navigation=navigation, scan=True)
    lockstep.chair.world.obstacles.add(Obstacle('post', at=(5.0, 4.2), radius=0.15))
    lockstep.start_up()
    begin, lockstep.pilot = lockstep.time, lambda _: (0.0, 0.4)
    while lockstep.time < begin + 1.5:
        lockstep.step()
    costmap = lockstep.move_base.local_costmap
    costmap.update(lockstep.time, None)
    y, x = (costmap.costmap.costs == 254).nonzero()
    places = [costmap.geometry.to_world(int(column), int(row)) for column, row in zip(x, y)]
    if frame == 'odom':
        odom_from_map = compose(lockstep.odometry, inverse(lockstep.chair.pose))
        post = compose(odom_from_map, (5.0, 4.2, 0.0))[:2]
    else:
        post = 5.0, 4.2
    near = [((px - post[0]) ** 2 + (py - post[1]) ** 2) ** 0.5 for px, py in places]
    near = [distance for distance in near if distance < 0.6]
    # In odom the wheels' slip turns what was marked before: a quarter of 0.5 rad, at 2 m.
    assert near and min(near) > 0.05 and max(near) < (0.25 if frame == 'map' else 0.35)
    assert lockstep.wheels.guard.zones.scan.live and lockstep.chair.velocity[1] > 0.2
    assert not any('scan' in kind for kind in lockstep.wheels.guard.dropped)


def test_a_door_of_080_that_the_map_does_not_show_is_driven_through_at_once():
    lockstep = Lockstep(HALL, (2.5, 4.0, 0.0), 0, localization='fake', scan=True)
    for name, side in (('left', 1.0), ('right', -1.0)):
        lockstep.chair.world.obstacles.add(Obstacle(name, at=(5.0, 4.0 + 1.15 * side), size=(0.1, 1.5)))
    lockstep.start_up()
    begin = lockstep.time
    lockstep.move_base.set_goal(Pose2D(6.5, 4.0, 0.0), begin)
    while lockstep.result is None and lockstep.time < begin + 14.0:
        lockstep.step()
        assert abs(lockstep.chair.pose[1] - 4.0) < 0.1, 'it does not go round the wall'
    assert lockstep.result is not None and lockstep.result.text == 'Goal reached.'
    assert not lockstep.chair.contacts


def test_without_it_no_part_knows_of_one():
    lockstep = Lockstep(HALL, (3.0, 4.0, 0.0), 0, localization='fake')
    assert lockstep.chair.scanner is lockstep.scans is lockstep.wheels.guard.zones.scan is None


def test_the_planner_counts_with_the_gate_s_law():
    scan, zones = (
        getattr(SafetyConfig.from_params(parameters('sara_control', 'safety.yaml')), n) for n in ('scan', 'zones')
    )
    planner = parameters('sara_nav', 'scan.yaml')['RotateThenPursue']
    assert planner['ahead_reaction_time'] == pytest.approx(scan.reaction_time + zones.ease)
    assert planner['ahead_stop_distance'] == scan.stop_distance
