"""The map builder with ultrasonic sensors alone, in a building of two rooms, and its parts."""

import math

import numpy as np
import pytest
import sonar_world
from sonar_world import DEPTH, DOOR, MIDDLE, MOUNTS, THICK, WIDTH

from sara_common.planar import compose, inverse, wrap
from sara_nav.maps.map_io import FREE, OCCUPIED
from sara_slam.sonar import arrow_system, evidence_grid, wall_search
from sara_slam.sonar.doorways import Doorways, doorways, in_doorway
from sara_slam.sonar.drawing import Directions
from sara_slam.sonar.echo_points import other_points
from sara_slam.sonar.forward_model import (
    EDGE,
    NEARER,
    SILENT,
    Heard,
    driven_over,
    glances,
    looked_through,
    unexplained,
)
from sara_slam.sonar.free_space import known_free
from sara_slam.sonar.short_walls import short_walls
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.sonar_slam import SonarSlam
from sara_slam.sonar.wall_filter import POSE, WallFilter, foot


def wall_pieces(*args):
    """(n, 4): those of all walls."""
    return np.concatenate(evidence_grid.wall_pieces(*args))


@pytest.fixture(scope='module')
def driven():
    """(SonarSlam, what it solved, its map, true poses) after a drive."""
    slam = SonarSlam(SonarConfig())
    true = sonar_world.drive(slam, 1)
    solved = slam.solved()
    return slam, solved, slam.map(solved), true


def true_at(slam, true):
    """(n, 3): true poses at the graph's, in the frame of the first."""
    numbers = np.round(np.array(slam.stamps) / sonar_world.TICK).astype(int)
    return np.array([compose(inverse(true[0]), pose) for pose in true[numbers]])


def in_building(grid, value, first):
    """(n, 2) m: cells of a value, where they are in the building."""
    rows, columns = np.nonzero(grid.data == value)
    x, y = grid.geometry.origin_x + 0.05 * (columns + 0.5), grid.geometry.origin_y + 0.05 * (rows + 0.5)
    c, s = math.cos(first[2]), math.sin(first[2])
    return np.stack((first[0] + c * x - s * y, first[1] + s * x + c * y), 1)


def off_walls(points):
    """(n,) m to the building's nearest wall."""
    a, along = sonar_world.FACES[:, 0], sonar_world.FACES[:, 1] - sonar_world.FACES[:, 0]
    share = (((points[:, None] - a) * along).sum(2) / (along**2).sum(1)).clip(0.0, 1.0)
    return np.hypot(*np.moveaxis(points[:, None] - a - share[..., None] * along, 2, 0)).min(1)


def test_walls_hold_the_way_where_the_odometry_loses_it(driven):
    slam, solved, _, true = driven
    there = true_at(slam, true)
    by_odometry = np.hypot(*(np.array(slam.nodes) - there)[:, :2].T)
    by_walls = np.hypot(*(solved.poses - there)[:, :2].T)
    assert by_odometry.max() > 0.2
    assert by_walls.max() < 0.08
    assert np.degrees(np.abs(wrap(solved.poses[:, 2] - there[:, 2]))).max() < 1.0


def test_the_scales_of_the_odometry_are_learned(driven):
    _, solved, _, _ = driven
    assert solved.scales[0] == pytest.approx(sonar_world.TURNS, abs=0.008)
    assert solved.scales[1] == pytest.approx(sonar_world.WAYS, abs=0.008)


def test_what_is_occupied_is_wall_and_the_walls_are_there(driven):
    _, _, grid, true = driven
    occupied = in_building(grid, OCCUPIED, true[0])
    off = off_walls(occupied)
    assert np.median(off) < 0.04
    assert (off > 0.15).sum() < 0.01 * (grid.data == FREE).sum()
    for place in ((2.0, 0.0), (2.0, DEPTH), (0.0, 2.0), (6.0, 0.0), (6.0, DEPTH), (WIDTH, 2.0), (MIDDLE - THICK, 1.0)):
        assert np.hypot(*(occupied - place).T).min() < 0.10, place


def test_the_door_stays_open(driven):
    _, _, grid, true = driven
    for value, some in ((OCCUPIED, False), (FREE, True)):
        x, y = in_building(grid, value, true[0]).T
        between = (np.abs(x - MIDDLE) < 0.3) & (y > DOOR[0] + 0.1) & (y < DOOR[1] - 0.1)
        assert between.any() == some


def test_the_same_input_gives_the_same_bytes(driven):
    _, solved, grid, _ = driven
    again = SonarSlam(SonarConfig())
    sonar_world.drive(again, 1)
    made = again.solved()
    assert all(a.tobytes() == b.tobytes() for a, b in zip(solved, made))
    assert again.map(made).data.tobytes() == grid.data.tobytes()


def test_bad_input_is_counted_and_changes_nothing(driven):
    slam, faulty = SonarSlam(SonarConfig()), SonarSlam(SonarConfig())
    for target in (slam, faulty):
        for number in range(40):
            if target is faulty:
                target.on_pose(math.nan, (0.0, 0.0, 0.0))
                target.on_pose(0.1 * number, (0.0, math.inf, 0.0))
                target.on_range(0.1 * number, 'front', MOUNTS['front'], math.nan)
                target.on_range(math.inf, 'front', MOUNTS['front'], 1.0)
            target.on_pose(0.1 * number, (0.04 * number, 0.0, 0.0))
            target.on_range(0.1 * number + 0.3, 'left_front', MOUNTS['left_front'], 0.7)
    assert (faulty.counts['bad_pose'], faulty.counts['bad_range']) == (80, 80)
    assert faulty.kept == slam.kept
    assert faulty.map().data.tobytes() == slam.map().data.tobytes()


@pytest.mark.parametrize('ahead', [0.2, 0.6, 5.0, 9.9])
def test_a_sensor_whose_clock_is_ahead_silences_no_other(ahead):
    """Readings come as they are made, with stamps that are later by range_delay than what they heard."""
    kept, toward = [], []
    for late in (0.0, ahead):
        slam, true = SonarSlam(SonarConfig()), sonar_world.way()[:300].tolist()
        for number, pose in enumerate(true):
            slam.on_pose(sonar_world.TICK * number, compose(inverse(true[0]), pose))
            for name, mount in MOUNTS.items():
                if number >= 3:
                    stamp = sonar_world.TICK * number - 0.01 + (late if name == 'front' else 0.0)
                    slam.on_range(stamp, name, mount, sonar_world.heard(compose(true[number - 3], mount)))
            toward.append(slam._ahead._toward)
        kept.append(sum(reading.name != slam._numbers['front'] for reading in slam.kept))
    assert kept[0] == kept[1] > 1400 and len(slam.filter.walls) >= 3
    assert set(toward) == {1.0}


def test_without_a_reading_there_is_no_map():
    with pytest.raises(ValueError, match='no map before the first reading'):
        SonarSlam(SonarConfig()).map()


def test_silence_alone_makes_a_map_without_walls():
    slam = SonarSlam(SonarConfig())
    for number in range(20):
        slam.on_pose(0.1 * number, (0.04 * number, 0.0, 0.0))
        slam.on_range(0.1 * number + 0.3, 'front', MOUNTS['front'], math.inf)
    data = slam.map().data
    assert (data == FREE).any()
    assert not (data == OCCUPIED).any()


def a_filter():
    """A WallFilter that has moved, and knows a wall."""
    known = WallFilter(SonarConfig())
    known.move((0.5, 0.1, 0.4))
    known.add((math.radians(-80.0), -0.9), np.diag([1e-4, 1e-4]), (-0.5, 0.5))
    return known


def test_the_derivatives_of_a_reading_are_those_of_the_distance():
    known, mount = a_filter(), MOUNTS['left_front']
    at, H = known._jacobian(mount, 0)

    def distance():
        x, y, axis = known.sensor(mount)
        return float(foot(known.walls, x, y, axis)[0][0])

    for place, slope in zip(at.tolist(), H.tolist()):
        before = distance()
        known.x[place] += 1e-6
        assert (distance() - before) / 1e-6 == pytest.approx(slope, abs=1e-5)
        known.x[place] -= 1e-6


def test_a_reading_makes_the_pose_more_certain_and_the_covariance_stays_one():
    known, mount = a_filter(), MOUNTS['left_front']
    for _ in range(20):
        known.move((0.05, 0.0, 0.02))
    before = known.P.copy()
    known.see(0, mount, 0.6)
    assert np.trace(known.P) < np.trace(before)
    assert np.allclose(known.P, known.P.T, atol=1e-12)
    assert np.linalg.eigvalsh(known.P).min() > -1e-12


@pytest.mark.parametrize('off, wall', [(-0.1, -1), (-0.03, 0), (0.0, 0), (0.03, 0), (0.1, -1)])
def test_what_stands_a_little_before_a_known_wall_is_not_that_wall(off, wall):
    """Each time it was taken for the wall it would turn the robot a little more."""
    known, mount = a_filter(), MOUNTS['left_front']
    x, y, axis = known.sensor(mount)
    away = float(foot(known.walls, x, y, axis)[0][0])
    assert known.matched(mount, away + off) == wall


def test_a_wall_found_again_is_the_one_that_is_known():
    known = a_filter()
    assert known.add((math.radians(-80.5), -0.92), np.diag([1e-4, 1e-4]), (-0.3, 0.8)) == 0
    assert len(known.walls) == 1
    assert known.add((math.radians(100.0), -0.9), np.diag([1e-4, 1e-4]), (-0.5, 0.5)) == 1  # faces the other way
    assert len(known.x) == POSE + 4


def test_a_wall_about_square_to_the_first_is_held_square():
    known = a_filter()
    assert known.add((math.radians(13.0), -0.9), np.diag([1e-3, 1e-4]), (-0.3, 0.3)) == 1
    assert known.square.tolist() == [False, True]
    assert wrap(known.walls[1, 0] - known.walls[0, 0] - 0.5 * math.pi) == pytest.approx(0.0, abs=math.radians(0.5))


def test_a_long_slanting_wall_is_one_of_its_own():
    known = a_filter()
    assert known.add((math.radians(-50.0), -0.9), np.diag([1e-4, 1e-4]), (-0.9, 0.9)) == 1
    assert known.square.tolist() == [False, False]
    assert known.walls[1, 0] == pytest.approx(math.radians(-50.0) + 0.4)


def test_walls_are_held_square_to_those_that_most_was_seen_of():
    """A first wall that is none, 0.4 m of a corner's echoes, holds nothing once long walls are square to each other."""
    known = WallFilter(SonarConfig())
    known.add((math.radians(-25.0), -0.9), np.diag([1e-4, 1e-4]), (-0.2, 0.2))
    assert known.reference == 0 and known.believed.tolist() == [True]
    assert known.add((math.radians(20.0), -0.9), np.diag([1e-4, 1e-4]), (-0.7, 0.7)) == 1
    assert known.reference == 0  # 1.0 m more is not enough to be sure
    assert known.add((math.radians(113.0), -0.9), np.diag([1e-3, 1e-4]), (-0.9, 0.9)) == 2
    assert known.reference == 1
    assert known.square.tolist() == [False, False, True]
    assert known.believed.tolist() == [False, True, True]
    assert wrap(known.walls[2, 0] - known.walls[1, 0] - 0.5 * math.pi) == pytest.approx(0.0, abs=math.radians(1.0))
    matched = [known.matched((0.0, 0.0, math.radians(angle)), 0.9) for angle in (155.0, -160.0)]
    assert matched == [-1, 1]
    assert Directions(known.square, known.reference, known.believed).order() == [1, 2]


def test_short_walls_that_agree_outweigh_two_edges_that_came_first():
    """Two edges that are square to each other by chance; the walls of the room are short as long as it turns."""
    known, sharp = WallFilter(SonarConfig()), np.diag([1e-4, 1e-4])
    room = [math.radians(angle) for angle in (20.0, 110.0, -160.0, -70.0)]
    known.add((math.radians(-25.0), -0.9), sharp, (-0.5, 0.5))
    assert known.add((math.radians(63.0), -0.9), sharp, (-0.5, 0.5)) == 1 and known.square[1]
    for _ in range(5):  # heard again, one counts once
        assert known.add((room[0], -1.0), sharp, (-0.4, 0.5)) == -1
    assert known.add((room[1], -1.1), sharp, (-0.5, 0.4)) == -1
    found = [known.add((theta, -1.2), sharp, (-0.45, 0.45)) for theta in room[2:]]
    assert found == [-1, 2] and known.reference == 2
    assert known.believed.tolist() == [False, False, True]
    assert known.add((room[0], -1.0), sharp, (-0.4, 0.5)) == 3 and known.square[3]


def test_a_wall_that_was_off_by_more_than_its_error_is_held_square_once_it_is_not():
    known, sharp = WallFilter(SonarConfig()), np.diag([1e-6, 1e-6])
    known.add((math.radians(-25.0), -0.9), sharp, (-1.0, 1.0))
    assert known.add((math.radians(65.8), -0.9), sharp, (-1.0, 1.0)) == 1 and not known.square[1] and known.believed[1]
    for _ in range(20):  # heard again, as the heading is known better
        assert known.add((math.radians(65.0), -0.9), 25.0 * sharp, (-1.0, 1.0)) == 1
    assert known.square[1]


@pytest.mark.parametrize('heard, on', [(1.2, 0.35), (2.0, 0.7)])
def test_long_walls_go_on_farther(heard, on):
    along = np.arange(0.0, heard, 0.05)
    pieces = wall_pieces(SonarConfig(), side(along), np.array([[-0.5 * math.pi, -1.0]]))
    assert pieces[:, 0].max() == pytest.approx(along[-1] + on, abs=0.06)


def test_a_short_slanting_wall_is_none():
    known = a_filter()
    assert known.add((math.radians(-50.0), -0.9), np.diag([1e-4, 1e-4]), (-0.3, 0.3)) == -1
    assert len(known.walls) == 1


def test_search_finds_a_wall_among_clutter():
    random = np.random.default_rng(4)
    x = np.linspace(0.0, 1.5, 20)
    sensors = np.stack((x, 0.1 * x, np.full(20, 0.5 * math.pi + 0.1)), 1)
    theta, rho = -0.5 * math.pi + 0.05, -1.2
    ranges = np.cos(theta) * sensors[:, 0] + np.sin(theta) * sensors[:, 1] - rho + random.normal(0.0, 0.01, 20)
    ranges[::5] = random.uniform(0.4, 2.0, 4)
    found = wall_search.search(sensors, ranges, math.radians(30.0), 0.02)
    assert found.theta == pytest.approx(theta, abs=0.03)
    assert found.rho == pytest.approx(rho, abs=0.03)
    assert len(found.members) >= 14


def test_search_takes_no_corner_for_a_wall():
    x = np.linspace(-0.5, 0.5, 26)
    sensors = np.stack((x, np.zeros(26), np.full(26, 0.5 * math.pi)), 1)
    assert wall_search.search(sensors, np.hypot(x, 1.0), math.radians(30.0), 0.02) is None


def test_nothing_stands_where_the_robot_was():
    poses = np.array([[1.0, 2.0, 0.5 * math.pi]])
    places = np.array([[1.0, 2.5], [1.0, 1.5], [1.25, 2.0], [1.35, 2.0], [1.0, 2.6], [1.5, 2.0]])
    assert driven_over(SonarConfig(body_length=1.08, body_width=0.58), poses, places).tolist() == [
        True,
        True,
        True,
        False,
        False,
        False,
    ]


def test_no_wall_goes_on_into_a_doorway_that_the_robot_passed():
    along = np.arange(0.0, 2.0, 0.05)
    pieces = np.stack((along, np.full(40, 1.0), np.zeros(40), np.ones(40)), 1)  # y = 1
    config = SonarConfig(body_length=1.08, body_width=0.58)
    through, beside = np.array([[0.9, 0.9, 1.5]]), np.array([[0.9, 0.6, 0.0]])
    left = along[~in_doorway(config, through, pieces)]
    assert left[left < 0.9].max() == pytest.approx(0.5) and left[left > 0.9].min() == pytest.approx(1.3)
    assert not in_doorway(config, beside, pieces).any()
    assert not len(in_doorway(config, through, pieces[:0]))


def by_a_door(wide, looked=True):
    """Echoes of the wall y = 1 with a gap about x = 2, seen squarely from every 0.05 m, and readings through the gap
    of a sensor in front of it."""
    along = np.arange(0.025, 4.0, 0.05)
    along = along[np.abs(along - 2.0) > 0.5 * wide]
    x, y = np.append(along, (3 * [2.0] if looked else [])), np.append(0.0 * along, (3 * [0.6] if looked else []))
    sensors = np.stack((x, y, np.full(len(x), 0.5 * math.pi)), 1)
    return Heard(sensors, np.where(y > 0.0, 1.5, 1.0))


def drawn(heard):
    """m along the wall y = 1 of the occupied cells there."""
    poses = np.column_stack((heard.sensors[:, :2], np.zeros(len(heard.ranges))))
    grid, _ = evidence_grid.draw(SonarConfig(), heard, np.array([[-0.5 * math.pi, -1.0]]), poses)
    x, y = grid.geometry.to_world(*np.nonzero(grid.data == OCCUPIED)[::-1])
    return np.sort(x[np.abs(y - 1.0) < 0.15])


@pytest.mark.parametrize('wide', (0.68, 0.8, 1.0))
def test_a_doorway_is_drawn_as_wide_as_a_wheelchair_needs(wide):
    along = drawn(by_a_door(wide))
    left, right = along[along < 2.0].max(), along[along > 2.0].min()
    assert 0.78 < right - left - 0.05 < max(wide, 0.8) + 0.06


def test_what_nobody_looked_through_is_no_doorway():
    along = drawn(by_a_door(0.6, looked=False))
    assert np.diff(along).max() < 0.06  # no door is so narrow: it is wall


def test_ends_narrow_a_doorway_and_a_post_in_its_middle_does_not():
    wall = np.array([(x, 1.0, 0.0, -1.0) for x in np.arange(0.0, 4.0, 0.05) if abs(x - 2.0) > 0.36])
    doors = doorways(SonarConfig(), by_a_door(0.7), [wall, wall[:1], wall[:0]], 0.05)
    assert np.allclose(doors.middles, (2.0, 1.0), atol=0.03) and np.allclose(np.abs(doors.tangents), (1.0, 0.0))
    places = np.array([(2.0, 1.0), (1.7, 1.05), (2.37, 0.95), (2.45, 1.0), (1.7, 1.2)])
    assert doors.ends(places).tolist() == [False, True, True, False, False]


@pytest.mark.parametrize('walls', ([], [np.empty((0, 4))]))
def test_without_walls_there_are_no_doorways(walls):
    doors = doorways(SonarConfig(), by_a_door(0.7), walls, 0.05)
    assert not len(doors.middles) and doors.ends(np.zeros((2, 2))).tolist() == [False, False]


@pytest.mark.parametrize(('body_width', 'way'), ((0.58, 0.74), (0.3, 0.46), (0.75, 0.8), (0.0, 0.8)))
def test_the_way_through_a_doorway_is_as_wide_as_the_body_needs(body_width, way):
    doors = Doorways(np.array([[2.0, 1.0]]), np.array([[0.0, 1.0]]))
    along = np.arange(-0.5, 0.5, 0.01)
    held = doors.hold(np.column_stack((np.full(100, 2.05), 1.0 + along)), body_width)
    assert abs(held.sum() * 0.01 - way) < 0.02 and not doors.hold(np.array([[2.2, 1.0]]), body_width).any()


def test_a_piece_that_is_looked_through_is_not_there():
    wall = np.array([[-0.5 * math.pi, -1.0]])  # y = 1, seen from below
    along = np.linspace(0.0, 3.0, 61)
    sensors = np.stack((along, np.zeros(61), np.full(61, 0.5 * math.pi)), 1)
    ranges = np.ones(61)
    whole = wall_pieces(SonarConfig(), Heard(sensors, ranges), wall)
    assert (np.diff(np.sort(whole[:, 0])) < 0.06).all()
    ranges[(along > 1.3) & (along < 1.7)] = 2.0
    holed = wall_pieces(SonarConfig(), Heard(sensors, ranges), wall)
    in_front = holed[holed[:, 1] < 1.5]
    assert not ((in_front[:, 0] > 1.2) & (in_front[:, 0] < 1.8)).any()


@pytest.mark.parametrize(('far', 'goes_on'), [(math.inf, True), (2.0, False)])
def test_a_wall_goes_on_though_an_echo_or_two_got_lost_but_not_where_something_farther_was_heard(far, goes_on):
    along = np.r_[np.linspace(0.0, 2.0, 161), 2.15, 2.2]
    sensors = np.stack((along, 0.0 * along, np.full(163, 0.5 * math.pi)), 1)
    ranges = np.r_[np.ones(161), far, far]
    pieces = wall_pieces(SonarConfig(), Heard(sensors, ranges), np.array([[-0.5 * math.pi, -1.0]]))
    ends = pieces[np.abs(pieces[:, 1] - 1.0) < 0.1, 0].max()
    assert ends > 2.2 if goes_on else ends < 2.1


@pytest.mark.parametrize(('far', 'counts'), [(math.inf, SILENT), (2.0, 1.0)])
def test_nobody_looks_through_a_wall_at_what_is_behind_it(far, counts):
    piece = np.array([[1.0, 1.0, -1.0, 0.0]])
    heard = Heard(np.array([[0.0, 0.0, 0.25 * math.pi]]), np.array([far]))
    looks = glances(SonarConfig(), heard, piece)
    along = np.arange(0.2, 1.0, 0.05)
    wall = np.stack((along, 0.0 * along + 0.5, 0.0 * along, 0.0 * along - 1.0), 1)
    beside = wall + (0.0, 1.0, 0.0, 0.0)
    for before, count in ((np.empty((0, 4)), counts), (wall, 0.0), (beside, counts)):
        assert looked_through(SonarConfig(), heard, piece, looks, before).tolist() == [count]


@pytest.mark.parametrize('field_of_view', (0.6, 1.05, 2.0, 4.0))
def test_what_a_cone_holds_is_found_wherever_it_looks(field_of_view):
    """Every reading against every piece, as the definitions have it."""
    rng, config = np.random.default_rng(1), SonarConfig(field_of_view=field_of_view)
    x, y, axis = rng.uniform(-2.0, 2.0, (2, 300)).tolist() + [rng.uniform(-7.0, 7.0, 300)]
    sensors, ranges = np.column_stack((x, y, axis)), rng.choice((0.05, 0.6, 1.2, 2.3, math.inf), 300)
    normals = rng.uniform(-math.pi, math.pi, 200)
    pieces = np.column_stack((rng.uniform(-2.5, 2.5, (200, 2)), np.cos(normals), np.sin(normals)))
    pieces[:20, 2:] = 0.0
    dx, dy = (pieces[:, at] - sensors[:, at : at + 1] for at in (0, 1))
    far, off = np.hypot(dx, dy), np.abs(wrap(np.arctan2(dy, dx) - sensors[:, 2:]))
    facing = -(np.cos(sensors[:, 2:]) * pieces[:, 2] + np.sin(sensors[:, 2:]) * pieces[:, 3])
    half, reach = 0.5 * field_of_view, np.minimum(ranges, config.range_max_range)[:, None] - NEARER
    steep = (facing > math.cos(config.steepest - EDGE)) | (pieces[:, 2] == 0.0) & (pieces[:, 3] == 0.0)
    looks = (reach > 0.1) & (far <= reach) & steep & (off < half - EDGE)
    found = glances(config, Heard(sensors, ranges), pieces)
    assert sorted(zip(found.reading, found.piece)) == list(zip(*np.nonzero(looks))) and looks.sum() > 30
    about = np.abs(far - ranges[:, None]) < NEARER
    of = (about & (facing > math.cos(config.steepest + EDGE)) & (off < half + EDGE)).any(1)
    used = (ranges >= config.range_min_range) & (ranges <= config.range_max_range)
    rest = unexplained(config, Heard(sensors, ranges), pieces)
    assert np.array_equal(rest.sensors, sensors[used & ~of]) and (used & of).sum() > 30


def side(x, y=0.0):
    """Echoes of the wall y = 1 at sensors below it."""
    sensors = np.stack((x, np.full(len(x), y), np.full(len(x), 0.5 * math.pi + 0.1)), 1)
    return Heard(sensors, np.full(len(x), 1.0 - y))


def test_a_short_wall_is_found_in_echoes_from_several_places():
    rest = side(np.linspace(0.0, 0.3, 8))
    lines, spans = short_walls(SonarConfig(), rest, math.pi)
    assert np.allclose(wrap(lines - (-0.5 * math.pi, 0.0)), (0.0, -1.0), atol=0.01)
    assert np.allclose(spans, (0.0, 0.3))
    pieces = wall_pieces(SonarConfig(), rest, np.array([[math.pi, -9.0]]))
    assert np.allclose(pieces[:, 1], 1.0, atol=0.01)
    assert np.ptp(pieces[:, 0]) == pytest.approx(0.3 + 2 * evidence_grid.GOES_ON * evidence_grid.PIECE)


@pytest.mark.parametrize(
    'rest',
    (side(np.full(20, 0.1)), side(np.linspace(0.0, 0.3, 5)), side(np.linspace(0.0, 0.2, 20), -1.3)),
    ids=('place', 'few', 'far'),
)
def test_echoes_of_one_place_or_a_few_are_no_short_wall(rest):
    assert not len(short_walls(SonarConfig(), rest, 0.0)[0])


def test_readings_in_two_rows_are_no_short_wall_between_them():
    """Their median, 0.044 m from either row, is near no reading."""
    rest = side(np.linspace(0.0, 0.3, 8))
    rest = rest._replace(ranges=np.where(np.arange(8) % 2, 1.049, 0.961))
    assert not len(short_walls(SonarConfig(), rest, math.pi)[0])
    more = Heard(np.vstack((rest.sensors, rest.sensors)), np.concatenate((rest.ranges, rest.ranges)))
    lines, _ = short_walls(SonarConfig(), more, math.pi)
    assert sorted(np.round(-lines[:, 1], 3)) == [0.961, 1.049]


@pytest.mark.parametrize('corner', (False, True))
def test_echoes_of_a_corner_far_off_are_no_short_wall(corner):
    """2.3 m ahead of sensors that pass within 0.4 m to either side of it: the way there is 2.30 to 2.33 m."""
    rng = np.random.default_rng(3)
    rest = side(np.linspace(-0.4, 0.4, 12), -1.3)
    rest = rest._replace(ranges=np.hypot(2.3, rest.sensors[:, 0] * corner) + rng.normal(0.0, 0.005, 12))
    assert len(short_walls(SonarConfig(), rest, math.pi)[0]) == (not corner)


@pytest.mark.parametrize('looked', (False, True))
def test_a_wall_goes_on_a_little_unless_somebody_looked_through(looked):
    heard = side(np.linspace(0.0, 2.0, 41))
    if looked:
        sensors = np.vstack((heard.sensors, *(2 * [(2.15, 0.0, 0.5 * math.pi)])))
        heard = Heard(sensors, np.append(heard.ranges, (2.0, 2.0)))
    pieces = wall_pieces(SonarConfig(), heard, np.array([[-0.5 * math.pi, -1.0]]))
    assert (pieces[:, 0].max() > 2.15) != looked


def test_a_wall_goes_on_to_one_that_crosses_it_and_not_behind():
    along = np.linspace(-1.5, 0.7, 45)
    up = np.stack((along, np.zeros(45), np.full(45, 0.5 * math.pi)), 1)
    right = np.stack((np.zeros(45), np.linspace(-0.5, 1.5, 45), np.zeros(45)), 1)
    heard = Heard(np.vstack((up, right)), np.ones(90))
    pieces = wall_pieces(SonarConfig(), heard, np.array([[-0.5 * math.pi, -1.0], [math.pi, -1.0]]))
    assert 0.97 < pieces[np.abs(pieces[:, 1] - 1.0) < 0.01, 0].max() < 1.06


@pytest.mark.parametrize(('long', 'goes_on'), [(1.2, 0.35), (1.6, 0.7)])
def test_a_wall_that_is_longer_than_a_table_goes_on_farther_and_a_row_of_tables_does_not(long, goes_on):
    """0.8 m lie between them, which was looked through."""
    begins = np.arange(3) * (long + 0.8)
    heard = side(np.concatenate([begin + np.arange(0.0, long, 0.05) for begin in begins]))
    between = np.column_stack((np.repeat(begins - 0.4, 2), np.zeros(6), np.full(6, 0.5 * math.pi)))
    heard = Heard(np.vstack((heard.sensors, between)), np.append(heard.ranges, np.full(6, 2.5)))
    pieces = wall_pieces(SonarConfig(), heard, np.array([[-0.5 * math.pi, -1.0]]))
    of = pieces[np.abs(pieces[:, 1] - 1.0) < 0.03, 0]
    assert of.max() - begins[-1] - long == pytest.approx(goes_on, abs=0.1)


@pytest.mark.parametrize(
    ('wide', 'more', 'known'),
    [
        (1.8, [], False),
        (1.8, [(2.0, 0.4, 0.5 * math.pi, 2.0)], True),  # it looked through
        (1.8, [(2.0, 0.4, 0.5 * math.pi, math.inf)], True),
        (1.8, [(2.0, 1.7, -0.5 * math.pi, 1.5)], True),  # it went through from behind, where it would hear nothing
        (1.8, [(2.0, 0.4, 0.5 * math.pi, 0.4)], False),  # it heard something in front
        (2.2, [], True),
    ],
)
def test_a_wide_hole_of_which_nobody_knows_anything_is_wall(wide, more, known):
    along = np.r_[np.arange(0.0, 1.0, 0.05), np.arange(1.0 + wide, 2.0 + wide, 0.05)]
    heard, (x, y, axis, ranges) = side(along), np.array(more).reshape(-1, 4).T
    heard = Heard(np.vstack((heard.sensors, np.column_stack((x, y, axis)))), np.append(heard.ranges, ranges))
    pieces = wall_pieces(SonarConfig(), heard, np.array([[-0.5 * math.pi, -1.0]]))
    of = pieces[np.abs(pieces[:, 1] - 1.0) < 0.03]
    gap = np.diff(np.sort(of[:, 0])).max()
    assert gap > 0.35 if known else gap < 0.06
    assert 1.0 + wide < of[:, 0].max() < 2.55 + wide


def test_a_wide_hole_of_a_slanted_wall_stays():
    along = np.r_[np.arange(0.0, 1.0, 0.05), np.arange(2.5, 3.5, 0.05)]
    pieces = wall_pieces(SonarConfig(), side(along), np.array([[0.4, 9.0], [-0.5 * math.pi, -1.0]]))
    assert np.diff(np.sort(pieces[np.abs(pieces[:, 1] - 1.0) < 0.03, 0])).max() > 0.5


def test_what_fans_of_readings_went_through_is_free_up_to_what_stands_there():
    heard = Heard(np.array([(0.0, 0.0, 0.0), (0.0, 3.0, 0.0)]), np.array((2.0, math.inf)))
    places = np.array([(1.5, 0.02), (1.5, 0.238), (1.5, 0.6), (2.2, 0.02), (1.3, 3.02), (1.7, 3.02), (-0.5, 0.02)])
    free = [True, True, False, False, True, False, False]
    assert known_free(SonarConfig(), heard, np.empty((0, 2)), places).tolist() == free
    post = np.column_stack((np.full(40, 1.0), np.arange(-1.0, 1.0, 0.05)))
    assert known_free(SonarConfig(), heard, post, places).tolist() == [False, False, *free[2:]]
    assert known_free(SonarConfig(), heard, post, places[:0]).tolist() == []


@pytest.mark.parametrize('turned', (0.2, 0.4, 0.25 * math.pi))
def test_nothing_slips_through_a_slanting_wall(turned):
    """Its cells touch each other by their corners."""
    c, s = math.cos(turned), math.sin(turned)
    along = np.arange(-2.0, 2.0, 0.05)
    wall, behind = (np.column_stack((c * along - s * y, s * along + c * y)) for y in (0.0, 0.3))
    heard = side(np.linspace(-1.0, 1.0, 200), -1.0)
    x, y, axis = heard.sensors.T
    heard = Heard(np.column_stack((c * x - s * y, s * x + c * y, axis + turned)), np.full(200, 1.6))
    assert known_free(SonarConfig(), heard, np.empty((0, 2)), behind).sum() > 30
    assert not known_free(SonarConfig(), heard, wall, behind).any()


@pytest.mark.parametrize('looked', (False, True))
def test_two_walls_meet_in_a_corner_unless_somebody_looked_through(looked):
    walls = np.array([[-0.5 * math.pi, -1.0], [math.pi, -1.0]])  # y = 1 seen from below, x = 1 seen from the left
    along = np.linspace(-1.0, 0.7, 35)
    up = np.stack((along, np.zeros(35), np.full(35, 0.5 * math.pi)), 1)
    right = np.stack((np.zeros(35), along, np.zeros(35)), 1)
    sensors, ranges = np.vstack((up, right)), np.ones(70)
    if looked:
        sensors = np.vstack((sensors, *(2 * [(0.9, 0.5, 0.5 * math.pi)])))
        ranges = np.append(ranges, (2.0, 2.0))
    pieces = wall_pieces(SonarConfig(), Heard(sensors, ranges), walls)
    of_first = pieces[np.abs(pieces[:, 1] - 1.0) < 0.01]
    assert (of_first[:, 0].max() > 0.97) != looked
    if not looked:  # and neither goes on behind the other
        assert pieces[:, :2].max(0) == pytest.approx(1.0, abs=0.06)


def test_a_corner_that_many_arcs_meet_in_is_a_point():
    corner = np.array((1.0, 1.0))
    places = np.stack((np.linspace(0.4, 1.6, 25), np.zeros(25)), 1)
    ranges = np.hypot(*(corner - places).T)
    heard = Heard(np.hstack((places, np.full((25, 1), 0.5 * math.pi))), ranges)
    points = other_points(SonarConfig(), heard, np.empty((0, 4)), np.empty((0, 3)))
    assert np.hypot(*(points[0] - corner)) < 0.08
    over_it = other_points(
        SonarConfig(body_length=1.08, body_width=0.58), heard, np.empty((0, 4)), np.array([[0.9, 1.0, 0.0]])
    )
    assert (np.hypot(*(over_it - corner).T) > 0.08).all()


def test_a_chain_with_a_border_is_solved():
    random = np.random.default_rng(2)
    n, m, wide = 12, 3, 4
    J = np.zeros((40, n + m))
    for row in range(40):
        at = random.integers(0, n - 1)
        J[row, at : min(at + wide, n)] = random.normal(size=min(wide, n - at))
        J[row, n:] = random.normal(size=m)
    N, right = J.T @ J + np.eye(n + m), random.normal(size=n + m)
    band = np.zeros((wide, n))
    for below in range(wide):
        band[below, : n - below] = np.diag(N[:n, :n], -below)
    found = arrow_system.solve(band, N[:n, n:].copy(), N[n:, n:].copy(), right)
    assert np.allclose(found, np.linalg.solve(N, right))
