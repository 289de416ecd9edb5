"""slam_gmapping without ROS: it corrects the odometry, closes a loop, no false one, and gives the same bytes again."""

import math
from functools import lru_cache

import numpy as np
import pytest
from slam_world import LAP, drifting, planar, ranges, round_trip, scan, sweep, world

from sara_common.planar import compose, inverse
from sara_common.scans import Sweep
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.scan_input import ScanInput
from sara_nav.maps.map_io import OCCUPIED
from sara_slam.graph.loops import LoopRules, LoopSearch
from sara_slam.graph.pose_graph import PoseGraph
from sara_slam.mapping import occupancy
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig
from sara_slam.matching.likelihood_grid import Match

MAP = world()


def driven(way=LAP + 5.0, seed=0, **params):
    """(Slam, true path) of a drive round the block with odometry that drifts."""
    path, slam = round_trip(way), Slam(SlamConfig.from_params({'loop_reach': 2.0, **params}))
    rng = np.random.default_rng(seed)
    for k, (pose, odometry) in enumerate(zip(path, drifting(path))):
        assert slam.on_scan(scan(ranges(MAP, pose, rng), odometry, 1.0 + 0.5 * k)).used
    slam.finish()
    return slam, path


@lru_cache(None)
def once():
    return driven()


def off(slam, path):
    """(n,) m off the true path, the first pose laid on its own."""
    begin = compose(path[0], inverse(slam.poses[0]))
    return np.array([math.dist(compose(begin, pose)[:2], true[:2]) for pose, true in zip(slam.poses, path)])


def test_it_corrects_the_odometry_and_closes_the_loop():
    slam, path = once()
    odometry = drifting(path)
    assert math.dist(odometry[-1][:2], path[-1][:2]) > 1.0
    assert slam.counts['loops'] > 5 and slam.counts['false_loops'] == 0
    errors = off(slam, path)
    assert errors.max() < 0.1 and errors[-10:].max() < 0.08
    x, y, yaw = compose(slam.map_from_odom, odometry[-1])
    assert math.dist((x, y), path[-1][:2]) < 0.08 and abs(math.remainder(yaw - path[-1][2], 2.0 * math.pi)) < 0.02


def test_the_same_input_gives_the_same_bytes():
    slam, path = once()
    again, _ = driven()
    assert np.array(again.poses).tobytes() == np.array(slam.poses).tobytes()
    one, two = slam.map(), again.map()
    assert one.data.tobytes() == two.data.tobytes() and one.geometry == two.geometry and (one.data == OCCUPIED).any()


def test_without_loops_the_graph_stays_as_it_is_driven():
    slam, _ = driven(6.0, loop_closing=False)
    assert slam.counts['loops'] == slam.counts['optimised'] == 0 and not any(edge.loop for edge in slam.graph.edges)


def test_scans_are_used_after_a_way_a_turn_or_a_time():
    slam = Slam(SlamConfig(linearUpdate=0.5, angularUpdate=0.3, temporalUpdate=10.0, throttle_scans=2))
    here = ranges(MAP, (1.0, 1.0, 0.0))
    used = []
    for k, pose in enumerate(
        [(1.0, 1.0, 0.0), (1.4, 1.0, 0.0), (1.5, 1.0, 0.0), (1.5, 1.0, 0.2), (1.5, 1.0, 0.31), (1.5, 1.0, 0.31)]
    ):
        for _ in range(2):  # one of two is thrown away
            used.append(slam.on_scan(scan(here, pose, 1.0 + 2.0 * k)).used)
    assert used[1::2] == [True, False, True, False, True, False] and not any(used[::2])
    assert not slam.on_scan(scan(here, (1.5, 1.0, 0.31), 19.0 - 0.1)).used
    assert slam.on_scan(scan(here, (1.5, 1.0, 0.31), 19.5)).used


@pytest.mark.parametrize(('seconds', 'used'), [(-1.0, 1), (0.0, 6), (1.0, 3)])
def test_at_rest_scans_are_used_for_time_alone(seconds, used):
    slam, here = Slam(SlamConfig(temporalUpdate=seconds)), ranges(MAP, (1.0, 1.0, 0.0))
    assert sum(slam.on_scan(scan(here, (1.0, 1.0, 0.0), 1.0 + 0.5 * k)).used for k in range(6)) == used


def test_what_cannot_be_used_is_dropped_and_told_once_and_nothing_is_lost():
    said, good = [], ranges(MAP, (1.0, 1.0, 0.0))
    slam = Slam(SlamConfig(), said.append)
    assert slam.on_scan(scan(good, (1.0, 1.0, 0.0))).used
    nan = float('nan')
    bad = [
        ScanInput('laser', sweep(good)._replace(angle_increment=0.0), Transform(), planar((2.0, 1.0, 0.0))),
        ScanInput('laser', sweep(good)._replace(range_max=nan), Transform(), planar((2.0, 1.0, 0.0))),
        ScanInput('laser', sweep(good), Transform(), planar((nan, 1.0, 0.0))),
        ScanInput('laser', sweep(good), Transform(), planar((1e12, 1.0, 0.0))),
        ScanInput('laser', sweep(good), Transform.from_xyz_rpy(pitch=1.5), planar((2.0, 1.0, 0.0))),
    ]
    for scan_input in bad * 3:
        assert slam.on_scan(scan_input) is None
    assert (slam.counts['bad_scan'], slam.counts['bad_odometry'], slam.counts['bad_mount']) == (6, 6, 3)
    assert len(said) == 3 and all(sentence.startswith('laser: ') for sentence in said)
    assert len(slam.poses) == 1 and slam.on_scan(scan(ranges(MAP, (1.4, 1.0, 0.0)), (1.4, 1.0, 0.0))).used


def test_a_scan_whose_end_nobody_knows_is_told_of_and_taken_at_its_stamp():
    said = []
    measured = ranges(MAP, (1.0, 1.0, 0.0))
    slow = scan(measured, (1.0, 1.0, 0.0))
    slow = slow._replace(sweep=slow.sweep._replace(time_increment=0.1))
    for config, told in ((SlamConfig(), 1), (SlamConfig(deskew=False), 0)):
        slam = Slam(config, said.append)
        assert slam.on_scan(slow).used and slam.counts['not_deskewed'] == told
    assert len(said) == 1 and 'time_increment' in said[0]


def test_a_thin_wall_is_not_taken_for_its_own_back():
    """Seen from both sides, a wall of 0.1 m stays two surfaces."""
    x, rng = np.arange(-3.0, 3.0, 0.05), np.random.default_rng(2)
    slam = Slam(SlamConfig(loop_closing=False, maxRange=20.0))
    for k, (y, odometry) in enumerate([(1.0, 0.0), (0.6, 0.4), (-0.6, 1.66), (-1.0, 2.06)]):
        side = math.copysign(0.05, y)  # of the wall's face; the odometry lags behind by 0.06 m through the door
        angles = np.arctan2(side - y, x)
        order = np.argsort(angles)
        distances = (np.hypot(x, side - y) + 0.005 * rng.standard_normal(len(x)))[order]
        even = np.linspace(angles[order][0], angles[order][-1], 200)
        measured = np.interp(even, angles[order], distances)
        step = float(even[1] - even[0])
        taken = Sweep(1.0 + k, float(even[0]), float(even[-1]), step, 0.0, 0.05, 10.0, measured)
        slam.on_scan(ScanInput('laser', taken, Transform(), planar((0.0, 1.0 - odometry, 0.0))))
    assert slam.poses[1][1] == pytest.approx(0.6, abs=0.02)
    assert slam.poses[3][1] - slam.poses[2][1] == pytest.approx(-0.4, abs=0.02)
    assert slam.poses[2][1] == pytest.approx(-0.66, abs=0.02)  # as the odometry has it: the back tells nothing


@pytest.mark.parametrize('value', [np.nan, np.inf, 0.0, -1.0, 1e9])
def test_scans_without_an_echo_leave_the_pose_to_the_odometry(value):
    slam = Slam(SlamConfig())
    for k in range(5):
        pose = (1.0 + 0.4 * k, 1.0, 0.1 * k)
        result = slam.on_scan(scan(np.full(120, value), pose, float(k)))
    assert result.used and slam.counts['no_points'] == 4
    assert compose(result.map_from_odom, pose) == pytest.approx(pose)
    assert (slam.map().data != OCCUPIED).all() and slam.entropy > Slam(SlamConfig()).entropy


def test_a_scan_that_fits_nowhere_leaves_the_pose_to_the_odometry():
    slam, rng = Slam(SlamConfig()), np.random.default_rng(5)
    slam.on_scan(scan(ranges(MAP, (1.0, 1.0, 0.0)), (1.0, 1.0, 0.0)))
    slam.on_scan(scan(rng.uniform(0.2, 9.0, 120), (1.4, 1.0, 0.0), 2.0))
    assert slam.counts['no_fit'] == 1 and slam.poses[1] == pytest.approx((1.4, 1.0, 0.0))


@pytest.mark.parametrize('jump', [(5000.0, -20.0, 2.0), None], ids=['far away', 'back to 0'])
def test_a_jump_of_the_odometry_that_nobody_tells_of_is_no_motion(jump):
    """Back to 0: the wheels' controller was started anew."""
    path, said, rng = round_trip(14.0), [], np.random.default_rng(1)
    slam, begins = Slam(SlamConfig(), said.append), 15 if jump else 28
    jump = jump or inverse(path[begins])
    for k, pose in enumerate(path):
        odometry = pose if k < begins else compose(jump, pose)
        slam.on_scan(scan(ranges(MAP, pose, rng), odometry, 1.0 + k))
    assert off(slam, path).max() < 0.08 and slam.counts['jump'] == 1
    assert len(said) == 1 and said[0].startswith('the odometry jumps by ')


def test_odometry_that_begins_anew_near_its_origin_is_told_by_its_turn():
    """The robot is back where it was switched on, turned by half a turn, as the wheels' controller begins anew."""
    there = [(1.0 + 0.1 * k, 1.0, 0.0) for k in range(20)]
    about = [(2.9, 1.0, 0.1 * k) for k in range(1, 32)]
    back = [(2.9 - 0.1 * k, 1.0, 3.1) for k in range(1, 16)]
    on = [(1.4 + 0.1 * k, 1.0, 3.1 + 0.1 * k) for k in range(20)]
    path, begins, said = there + about + back + on, len(there + about + back), []
    slam = Slam(SlamConfig(), said.append)
    for k, pose in enumerate(path):
        odometry = compose(inverse(path[0] if k < begins else path[begins]), pose)
        slam.on_scan(scan(ranges(MAP, pose), odometry, 1.0 + 0.1 * k))
    x, y, yaw = compose(path[0], compose(slam.map_from_odom, odometry))
    assert math.dist((x, y), path[-1][:2]) < 0.08 and abs(math.remainder(yaw - path[-1][2], 2.0 * math.pi)) < 0.03
    assert slam.counts['jump'] == 1 and said == ['the odometry jumps by 0.4 m and 3.1 rad: that is no motion']


def test_a_map_of_odometry_that_begins_far_off_begins_at_0():
    slam = Slam(SlamConfig())
    slam.on_scan(scan(ranges(MAP, (1.0, 1.0, 0.0)), (440_000.0, 4_480_000.0, 0.5)))
    assert slam.poses == [(0.0, 0.0, 0.5)] and slam.map().data.size < 200_000
    assert compose(slam.map_from_odom, (440_000.0, 4_480_000.0, 0.5)) == pytest.approx((0.0, 0.0, 0.5), abs=1e-6)


def test_what_does_not_fit_into_memory_is_told_and_not_on_the_map(monkeypatch):
    monkeypatch.setattr(occupancy, 'MOST_CELLS', 100_000)
    said = []
    slam = Slam(SlamConfig(), said.append)
    slam.on_scan(scan(ranges(MAP, (1.0, 1.0, 0.0)), (1.0, 1.0, 0.0)))
    before = slam.map()
    slam.forget_odometry()
    slam.graph.poses.append((900.0, 0.0, 0.0))
    slam.scans.append(slam.scans[0])
    assert slam.map().data.tobytes() == before.data.tobytes() and slam.counts['map_full'] == 1 and len(said) == 1


def test_a_jump_of_the_odometry_that_is_told_of_does_no_harm():
    path, slam, rng = round_trip(9.0), Slam(SlamConfig()), np.random.default_rng(1)
    for k, pose in enumerate(path):
        if k == 15:
            slam.forget_odometry()
        odometry = pose if k < 15 else compose((50.0, -20.0, 2.0), pose)
        slam.on_scan(scan(ranges(MAP, pose, rng), odometry, 1.0 + k))
    assert off(slam, path).max() < 0.08


def test_scans_of_another_number_of_rays_are_taken_as_they_come():
    """gmapping refuses them."""
    path, slam, rng = round_trip(6.0), Slam(SlamConfig()), np.random.default_rng(1)
    for k, (pose, odometry) in enumerate(zip(path, drifting(path))):
        slam.on_scan(scan(ranges(MAP, pose, rng, 120 if k % 2 else 77), odometry, 1.0 + k))
    assert off(slam, path).max() < 0.1


class NeverSeen:
    """In place of a LikelihoodGrid: a match at a place that is given."""

    def __init__(self, pose, response=0.9, agreement=1.0):
        self._match = Match(pose, np.eye(3) * 1e-4, response, 100.0, agreement)

    def match(self, points, predicted, window):
        return self._match


def searched(off_each, rules=LoopRules(), **match):
    """[hypotheses counted after each scan] of a long way back to the start, whose matches are off so (x, y, yaw)."""
    graph = PoseGraph()
    graph.add_node((0.0, 0.0, 0.0))
    way = [(float(k), 0.0, 0.0) for k in range(1, 41)] + [(40.0 - k, 0.5, 0.0) for k in range(41)]
    counted, search = [], LoopSearch(graph, rules, lambda nodes, pose, margin: NeverSeen(place[0], **match))
    for pose in way:
        new = graph.add_node(pose)
        graph.add_edge(new - 1, new, pose, np.eye(3) * 1e-4)
        if len(graph.poses) > 60:
            number = len(graph.poses) - 61
            place = [compose(pose, off_each[number % len(off_each)])]
            counted.append(search.found(np.ones((20, 2))))
    return counted


def test_a_loop_of_an_uncertain_place_counts_when_several_scans_bear_it_out():
    counted = searched([(0.3, 0.1, 0.02)])
    assert [len(found) for found in counted[:3]] == [0, 0, 0] and len(counted[3]) == 4
    assert {hypothesis.new for hypothesis in counted[3]} == {60, 61, 62, 63}


def test_loops_that_contradict_each_other_do_not_count():
    apart = [(0.4 * k % 2.0 - 0.8, 0.0, 0.0) for k in range(5)]
    assert sum(map(len, searched(apart))) == 0


@pytest.mark.parametrize('match', [{'response': 0.4}, {'agreement': 0.8}, {'agreement': math.nan}])
def test_loops_that_fit_badly_or_look_through_walls_do_not_count(match):
    assert sum(map(len, searched([(0.3, 0.1, 0.02)], **match))) == 0


def test_a_loop_further_off_than_the_place_can_be_does_not_count():
    assert sum(map(len, searched([(4.0, 0.0, 0.0)]))) == 0


def test_a_sweep_with_the_wrong_size_is_no_scan():
    wrong = Sweep(1.0, -1.0, 1.0, 0.1, 0.0, 0.1, 10.0, np.ones(5))
    assert Slam(SlamConfig()).on_scan(ScanInput('laser', wrong, Transform(), Transform())) is None
