"""What stands beside a robot is drawn on ahead of where it is heard."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_common.planar import compose
from sara_nav.maps.map_io import OCCUPIED
from sara_slam.sonar.doorways import NO_DOORWAYS, Doorways
from sara_slam.sonar.face_search import WITHIN, face, points
from sara_slam.sonar.sonar_config import SonarConfig
from sara_slam.sonar.sonar_slam import SonarSlam
from sara_slam.sonar.walls_ahead import FACE_KEPT_S, same

CONFIG = SonarConfig(range_delay=0.0, body_length=1.08, body_width=0.58)
FRONT, REAR = (0.35, 0.29, 0.5 * math.pi), (-0.35, 0.29, 0.5 * math.pi)
HOME = (0.0, 0.0, 0.0)


def readings(slope, at, count=5, step=0.05, left=True, astern=False):
    """(n, 4) of a sensor that moves along x beside the line y = at - slope x (mirrored to the right), heading 0."""
    x = np.arange(count) * step * (-1.0 if astern else 1.0)
    far = (at - slope * x) / math.hypot(1.0, slope)
    side = 1.0 if left else -1.0
    return np.column_stack((x, np.zeros(count), np.full(count, side * 0.5 * math.pi), far))


@pytest.mark.parametrize('left', [True, False])
@pytest.mark.parametrize('astern', [True, False])
def test_a_flat_thing_that_comes_nearer_is_drawn_on_where_it_is(left, astern):
    toward = -1.0 if astern else 1.0
    rows = readings(toward * 0.3, 0.5, left=left, astern=astern)
    found = face(rows, 0.0, toward)
    assert found is not None and math.isclose(found.slope, 0.3, abs_tol=1e-3)
    x, y = points(found, tuple(rows[-1, :3]), 0.05, 0.8).T
    assert np.abs((0.5 - toward * 0.3 * x) * (1.0 if left else -1.0) - y).max() < 2e-3
    assert (x[-1] - rows[-1, 0]) * toward > 0.7


def test_what_is_alongside_goes_away_or_is_no_line_is_none():
    assert face(readings(0.0, 0.3), 0.0, 1.0) is None
    assert face(readings(-0.3, 0.3), 0.0, 1.0) is None
    assert face(readings(0.9, 0.8), 0.0, 1.0) is None  # the sensors in front hear that
    assert face(readings(0.3, 0.5, count=2), 0.0, 1.0) is None
    assert face(readings(0.3, 0.5, step=0.01), 0.0, 1.0) is None
    bent = readings(0.3, 0.5)
    bent[2, 3] += 3.0 * WITHIN
    assert face(bent, 0.0, 1.0) is None


@given(
    st.lists(st.tuples(*(st.floats(-1e3, 1e3),) * 3, st.floats(0.0, 3.0)), min_size=1, max_size=12), st.floats(-9, 9)
)
def test_any_readings_give_a_finite_line_or_none(rows, yaw):
    found = face(np.array(rows), yaw, 1.0)
    assert found is None or np.isfinite(found).all()


def driven(slope=0.0, at=0.6, until=1.6, opening=(9.0, 9.0), turned=None):
    """A SonarSlam of a robot that drove along x beside the line y = at - slope x with a hole, and what it has on."""
    slam, t = SonarSlam(CONFIG), 0.0
    for x in np.arange(0.0, until, 0.02):
        t += 0.1
        pose = (float(x), 0.0, 0.0)
        slam.on_pose(t, pose)
        for name, mount in (('front', FRONT), ('rear', REAR)):
            sx, sy, _ = compose(pose, mount)
            away = (at - slope * sx - sy) / math.hypot(1.0, slope)
            foot = sx + slope * away
            heard = math.inf if opening[0] < foot < opening[1] else away
            slam.on_range(t - 0.05, name, mount, heard if heard >= 0.2 else -math.inf)
    return slam, float(x)


def occupied(grid):
    """(n, 2) m, middles of the occupied cells of a mask."""
    rows, columns = np.nonzero(grid.data == OCCUPIED)
    return np.column_stack(grid.geometry.to_world(columns, rows))


def test_a_known_wall_goes_on_beyond_the_robots_front():
    slam, x = driven()
    cells = occupied(slam.walls_ahead())
    assert len(cells) and np.abs(cells[:, 1] - 0.6).max() < 0.06
    assert x + 0.54 + 0.6 < cells[:, 0].max() < x + 0.54 + 1.0 and cells[:, 0].min() > x - 0.6


@pytest.mark.parametrize('turned', [0.0, 2.0])
def test_a_known_wall_goes_on_to_the_next_doorway_of_the_map(turned):
    slam, x = driven()
    there = (3.0, -1.0, turned)  # of the filter's frame in the map
    middle, heading = compose(there, (x + 1.0, 0.6, 0.0))[:2], (math.cos(turned), math.sin(turned))
    doorways = Doorways(np.array([middle]), np.array([heading])).seen_from(there)
    cells = occupied(slam._ahead.mask(slam.first_guess, there, doorways))
    along = (cells - compose(there, HOME)[:2]) @ heading
    assert len(cells) and x + 0.45 < along.max() < x + 0.65
    assert len(occupied(slam._ahead.mask(slam.first_guess, there))) > len(cells)


def test_the_doorways_of_a_map_count_once_it_is_settled_to():
    slam, x = driven()
    slam.settle(slam.solved(), Doorways(np.array([(x + 1.0, 0.6)]), np.array([(1.0, 0.0)])))
    assert x + 0.45 < occupied(slam.walls_ahead())[:, 0].max() < x + 0.65


def test_a_wall_that_something_was_heard_through_ends_there():
    slam, x = driven(opening=(2.0, 3.0), until=2.0)
    cells = occupied(slam.walls_ahead())
    assert len(cells) and cells[:, 0].max() < 2.15  # the rear sensor still hears it before the hole


def test_a_wall_that_slopes_to_the_robot_is_drawn_before_its_front():
    slam, x = driven(slope=0.2, at=0.9, until=1.35)
    cells = occupied(slam.walls_ahead())
    line = 0.9 - 0.2 * cells[:, 0]
    ahead = cells[:, 0] > x + 0.54
    assert ahead.any() and np.abs(line - cells[:, 1])[ahead].max() < 0.12
    assert cells[ahead, 1].min() < 0.5


@pytest.mark.parametrize('looked', [True, False])
def test_a_flat_thing_ends_where_another_sensor_looked_through_it(looked):
    """The rear sensor comes to a door's post, and the front one is past it. What it hears last counts."""
    slam, t = SonarSlam(CONFIG), 0.1
    slam.on_pose(t, HOME)
    slam.on_range(t - 0.05, 'front', FRONT, 0.3 if looked else math.inf)
    for x in np.arange(0.0, 0.4, 0.02).tolist():
        t += 0.1
        slam.on_pose(t, (x, 0.0, 0.0))
        slam.on_range(t - 0.05, 'rear', REAR, 0.5 - 0.4 * x)
        slam.on_range(t - 0.05, 'front', FRONT, math.inf if looked else 0.3)
    cells = occupied(slam.walls_ahead())
    assert len(cells) and (cells[:, 0].max() < 0.4) == looked


def test_a_flat_thing_that_the_other_sensor_hears_goes_on():
    slam, t = SonarSlam(CONFIG), 0.0
    for x in np.arange(0.0, 0.4, 0.02).tolist():
        t += 0.1
        slam.on_pose(t, (x, 0.0, 0.0))
        for name, mount in (('rear', REAR), ('front', FRONT)):
            slam.on_range(t - 0.05, name, mount, (0.5 - 0.4 * (x + mount[0] + 0.35)) / math.hypot(1.0, 0.4))
    cells = occupied(slam.walls_ahead())
    assert cells[:, 0].max() > 0.38 + 0.54 + 0.3


def test_nothing_stands_where_the_body_was_and_silence_forgets():
    slam, x = driven()
    trail = np.array([(px, 0.6, 0.0) for px in np.arange(0.0, 4.0, 0.1)])
    assert not len(occupied(slam._ahead.mask(trail, HOME)))
    t = 0.1 * 81 + FACE_KEPT_S + 1.0
    for k in range(3):
        slam.on_pose(t + 0.1 * k, (x, 0.0, 0.0))
        slam.on_range(t + 0.1 * k - 0.05, 'front', FRONT, math.inf)
    assert not len(occupied(slam.walls_ahead()))


def beside(poses, ranges, slam=None, since=0.0):
    """A SonarSlam whose front sensor heard one range at each pose, last at which s."""
    slam = slam or SonarSlam(CONFIG)
    for pose, distance in zip(poses, ranges):
        since += 0.1
        slam.on_pose(since, pose)
        slam.on_range(since - 0.05, 'front', FRONT, distance)
    return slam, since


def test_what_is_too_near_to_be_measured_stands_beside_the_robot():
    slam, since = beside([(0.02 * k, 0.0, 0.0) for k in range(5)], [-math.inf] * 5)
    cells = occupied(slam.walls_ahead())
    assert len(cells) and np.abs(cells[:, 1] - 0.44).max() < 0.06 and cells[:, 0].max() > 0.45
    turned = [(0.08, 0.0, 0.05 * k) for k in range(4)]
    slam, since = beside(turned, [-math.inf] * 4, slam, since)
    cells = occupied(slam.walls_ahead())
    assert np.abs(cells[:, 1] - 0.44).max() < 0.06  # it does not turn with the robot
    slam, since = beside([(0.08, 0.0, 0.0)] * 2, [math.inf] * 2, slam, since)
    assert not len(occupied(slam.walls_ahead()))
    way = [(0.08 + 0.1 * k, 0.1 * k, 0.0) for k in range(6)]
    slam, _ = beside(way, [math.inf] * 4 + [-math.inf] * 2, slam, since)  # another thing
    cells = occupied(slam.walls_ahead())
    assert len(cells) and np.abs(cells[:, 1] - 0.79).max() < 0.06


def test_a_flat_thing_is_found_from_a_turn_towards_it_after_any_time_beside_it():
    """The robot stood beside it, away from it, and turns to it in place."""
    away, yaws = 0.65, np.concatenate((np.arange(0.0, -0.2, -0.02), np.full(60, -0.2), np.arange(-0.2, 0.38, 0.02)))
    heard_at = yaws - 0.5 * np.diff(yaws, prepend=0.0)
    far = [away - compose((0.0, 0.0, yaw), FRONT)[1] for yaw in heard_at.tolist()]
    slam, _ = beside([(0.0, 0.0, yaw) for yaw in yaws.tolist()], far)
    cells = occupied(slam.walls_ahead())
    front = compose((0.0, 0.0, float(yaws[-1])), (0.54, 0.29, 0.0))
    ahead = cells[:, 0] > front[0]
    assert ahead.any() and np.abs(cells[ahead, 1] - away).max() < 0.08


@pytest.mark.parametrize('known', [True, False])
def test_a_post_of_a_doorway_of_the_map_does_not_go_on(known):
    """The front sensor comes to a post, which seems to come nearer."""
    middle, post = (1.0, 0.0), (1.0, 0.45)
    x = np.arange(0.0, 0.64, 0.02)
    reach = np.hypot(post[0] - x - FRONT[0], post[1] - FRONT[1])
    far = np.where(np.arccos((post[1] - FRONT[1]) / reach) < math.radians(30.0), reach, math.inf)
    slam, _ = beside([(px, 0.0, 0.0) for px in x.tolist()], far.tolist())
    doorways = Doorways(np.array([middle]), np.array([(0.0, 1.0)])) if known else NO_DOORWAYS
    cells = occupied(slam._ahead.mask(slam.first_guess, HOME, doorways))
    assert np.isfinite(far).sum() > 3 and len(cells)
    behind = cells[(cells[:, 0] > 1.1) & (np.abs(cells[:, 1] - 0.44) < 0.06)]  # it may be longer than a post, beside
    assert (len(behind) == len(cells)) == known


@pytest.mark.parametrize('toward', [(1.0, 0.1), (-1.0, 0.1)])
@pytest.mark.parametrize('tangent', [(0.0, 1.0), (0.0, -1.0)])
@pytest.mark.parametrize(
    ('beyond', 'aside', 'post'),
    [
        (-0.35, 0.4, False),
        (-0.25, 0.4, True),
        (0.1, -0.4, True),
        (0.15, 0.4, False),
        (0.0, 0.2, False),
        (0.0, 0.7, False),
    ],
)
def test_posts_stand_before_the_walls_line_and_in_it(beyond, aside, post, tangent, toward):
    doors = Doorways(np.array([(2.0, 1.0)]), np.array([tangent]))
    place = np.array((2.0 + math.copysign(beyond, beyond * toward[0]), 1.0 + aside))
    assert bool(len(doors.with_post_at(place, np.array(toward)).middles)) == post


@pytest.mark.parametrize(('line', 'goes_on'), [(0.2, True), (0.7, False)])
def test_what_is_beside_a_doorway_goes_on_once_the_robot_is_past_the_walls_line(line, goes_on):
    """A gap between two tables is a doorway, too, whose posts are as long as the tables."""
    x = np.arange(0.0, 0.4, 0.05)
    far = (0.72 - 0.3 * (x + FRONT[0]) - FRONT[1]) / math.hypot(1.0, 0.3)
    slam, _ = beside([(px, 0.0, 0.0) for px in x.tolist()], far.tolist())
    for tangent in ((0.0, 1.0), (0.0, -1.0)):
        doorways = Doorways(np.array([(line, 0.0)]), np.array([tangent]))
        cells = occupied(slam._ahead.mask(slam.first_guess, HOME, doorways))
        assert bool(len(cells)) == goes_on
        assert not goes_on or cells[:, 0].max() > x[-1] + 0.54 + 0.2


@pytest.mark.parametrize('tangent', [(0.0, 1.0), (0.0, -1.0)])
@pytest.mark.parametrize('askew', [0.2, -0.2])
def test_what_is_too_near_at_a_post_may_be_as_long_as_a_table(tangent, askew):
    """A robot drives askew between two tables; its front sensor comes to the first one's end."""
    slam, x = driven(at=0.9)
    poses = [compose((x, 0.0, askew), (0.02 * step, 0.0, 0.0)) for step in range(4)]
    first, last = (np.array(compose(pose, FRONT)[:2]) for pose in (poses[0], poses[-1]))
    slam, _ = beside(poses, [-math.inf] * 4, slam, 100.0)
    doorways = Doorways((first + (0.0, -0.40))[None], np.array([tangent]))
    cells = occupied(slam._ahead.mask(slam.first_guess, HOME, doorways))
    cells = cells[(np.hypot(*(cells - last).T) < 0.7) & (cells[:, 1] < 0.8)]
    assert len(doorways.with_post_at(last, np.array((1.0, 0.0))).middles) and len(cells)
    assert cells[:, 0].min() > first[0] + 0.05 and cells[:, 0].max() > last[0] + 0.4
    assert np.abs(cells[:, 1] - first[1] - 0.15 * math.cos(askew)).max() < 0.06  # where it was first


def test_what_came_nearer_does_so_where_it_is_too_near_to_be_measured():
    slope, at, steps = 0.25, 0.66, 12
    x = 0.05 * np.arange(steps)
    far = (at - slope * (x + FRONT[0]) - FRONT[1]) / math.hypot(1.0, slope)
    assert (far[-3:] < 0.2).all() and (far[:-3] >= 0.2).sum() > 3
    slam, _ = beside([(px, 0.0, 0.0) for px in x.tolist()], np.where(far < 0.2, -math.inf, far).tolist())
    cells = occupied(slam.walls_ahead())
    ahead = cells[:, 0] > x[-1] + 0.54
    assert ahead.any() and np.abs(at - slope * cells[:, 0] - cells[:, 1])[ahead].max() < 0.08
    assert cells[:, 0].max() > x[-1] + 0.54 + 0.2


def test_something_unknown_stands_square_to_the_walls():
    slam, x = driven(at=0.9)
    turned, since = (x, 0.0, 0.2), 100.0
    front = compose(turned, FRONT)
    slam, _ = beside([turned] * 3, [-math.inf] * 3, slam, since)
    cells = occupied(slam.walls_ahead())
    cells = cells[np.hypot(*(cells - front[:2]).T) < 0.4]
    assert len(cells) and np.ptp(cells[:, 1]) < 0.06


@pytest.mark.parametrize('y', [0.0, 1.3])
def test_a_wall_that_a_sensor_does_not_look_at_is_not_what_is_too_near_to_be_measured(y):
    """It looks along the wall, before it, or behind its line."""
    slam, x = driven()
    turned = (x, y, 0.5 * math.pi)
    front = compose(turned, FRONT)
    slam, _ = beside([turned] * 3, [-math.inf] * 3, slam, 100.0)
    cells = occupied(slam.walls_ahead())
    assert ((np.abs(cells[:, 0] - front[0] + 0.15) < 0.05) & (np.abs(cells[:, 1] - front[1] - 0.1) < 0.05)).any()


def test_the_mask_lies_in_the_map():
    slam, _ = driven()
    here = occupied(slam.walls_ahead())
    there = occupied(slam._ahead.mask(slam.first_guess, (1.0, 2.0, 0.5 * math.pi)))
    turned = np.column_stack((1.0 - here[:, 1], 2.0 + here[:, 0]))
    off = np.hypot(*(there[:, None] - turned[None]).transpose(2, 0, 1)).min(1)
    assert len(there) and off.max() < 0.08


def test_a_mask_is_the_same_until_something_changes():
    slam, _ = driven()
    mask, empty = slam.walls_ahead(), SonarSlam(CONFIG).walls_ahead()
    assert same(mask, slam.walls_ahead()) and not same(None, mask) and not same(mask, empty)
    assert empty.data.shape == (1, 1) and not len(occupied(empty))


@pytest.mark.parametrize('yaw', [0.0, 0.3, -0.4, 2.0])
def test_a_robot_that_stands_looks_where_it_drove(yaw):
    """Its odometry is the same to the last bit, of which a relation makes 1e-16 m."""
    slam = SonarSlam(CONFIG)
    ways = np.concatenate([np.full(20, 0.0), np.arange(0.0, 2.0, 0.015), np.full(40, 2.0)])
    drove = 20 + len(np.arange(0.0, 2.0, 0.015))
    for number, way in enumerate(ways):
        slam.on_pose(0.05 * number, (1.3 + way * math.cos(yaw), 2.7 + way * math.sin(yaw), yaw))
        slam.on_range(0.05 * number - 0.02, 'front', FRONT, 0.5)
        if number == drove - 1:
            before = occupied(slam.walls_ahead())
    after = occupied(slam.walls_ahead())
    assert len(before) and len(after) and abs(before[:, 0].max() - after[:, 0].max()) < 0.1
