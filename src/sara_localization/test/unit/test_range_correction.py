"""The laws of correcting a pose by ranges against a map. Ranges are reckoned here from the walls' equations, not from
the cells.
"""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

sys.path.append(str(Path(__file__).resolve().parent))
from range_world import CELL, CONE, CONFIG, MOUNTS  # noqa: E402

from sara_common.config import ConfigError  # noqa: E402
from sara_common.diagnostics import ERROR, OK, WARN  # noqa: E402
from sara_localization.particles.range_localizer import RangeLocalizer  # noqa: E402
from sara_localization.ranges import map_echo, turn_scale  # noqa: E402
from sara_localization.ranges.map_echo import Cone  # noqa: E402
from sara_localization.ranges.range_config import RangeConfig  # noqa: E402
from sara_localization.ranges.range_correction import RangeCorrection  # noqa: E402
from sara_localization.ranges.range_data import RangeData, RangeMap  # noqa: E402
from sara_localization.ranges.range_status import Heard, status  # noqa: E402
from sara_localization.ranges.turn_scale import TurnScale  # noqa: E402

HALF = 0.5 * CONE
SIZE_X, SIZE_Y = 3.0, 2.6  # m, free inside of the walls of a room that begins at (0, 0)


def room(size_x=SIZE_X, size_y=SIZE_Y, ends=True, origin=(0.0, 0.0, 0.0)):
    """Walls of three cells about a free room; without ends the walls along x go on to the border of the map."""
    nx, ny = round(size_x / CELL), round(size_y / CELL)
    data = np.zeros((ny + 6, nx + 6), np.int8)
    data[:3], data[-3:] = 100, 100
    if ends:
        data[:, :3], data[:, -3:] = 100, 100
    x, y, yaw = origin
    c, s = math.cos(yaw), math.sin(yaw)
    corner = x - 3 * CELL * (c - s), y - 3 * CELL * (s + c), yaw
    return RangeMap.from_occupancy(data, CELL, corner, 65.0)


def compose(a, b):
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]


def heard(pose, mount, size_x=SIZE_X, size_y=SIZE_Y, ends=True):
    """The nearest of the room's walls in the cone, m, or inf."""
    x, y, axis = compose(pose, mount)
    walls = [(y, -math.pi / 2), (size_y - y, math.pi / 2)] + ([(x, math.pi), (size_x - x, 0.0)] if ends else [])
    found = []
    for away, normal in walls:
        off = max(abs(math.remainder(normal - axis, 2 * math.pi)) - HALF, 0.0)
        if off < math.pi / 2 - 1e-6:
            found.append(away / math.cos(off))
    return min(found, default=math.inf)


def data(name, stamp, range_):
    return RangeData(name, stamp, MOUNTS[name], range_, 0.16, 2.5, 2 * HALF)


def ride(correction, error, seconds=40.0, hear=heard, watch=None, centre=(1.5, 1.3)):
    """To and fro, turning, in the room: the dead reckoning is off by `error` from the start, as a frame that lies
    there.
    """
    back = (
        -math.cos(error[2]) * error[0] - math.sin(error[2]) * error[1],
        math.sin(error[2]) * error[0] - math.cos(error[2]) * error[1],
        -error[2],
    )
    true = (*centre, 0.0)
    for k in range(round(seconds * 50)):
        t = 10.0 + k * 0.02
        true = (centre[0] + 0.3 * math.sin(0.5 * (t - 10.0)), centre[1], 0.4 * math.sin(0.3 * (t - 10.0)))
        correction.on_pose(t, compose(back, true))
        if k % 10 == 9:
            for name, mount in MOUNTS.items():
                correction.on_range(data(name, t, hear(true, mount)))
        if watch:
            watch(t, true)
    return true


def off(pose, true):
    return math.dist(pose[:2], true[:2]), abs(math.degrees(math.remainder(pose[2] - true[2], 2 * math.pi)))


@settings(max_examples=6)
@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.04, 0.04))
def test_exact_ranges_bring_a_shifted_pose_back(x, y, yaw):
    correction = RangeCorrection(CONFIG, room())
    true = ride(correction, (x, y, yaw))
    place, turn = off(correction.pose, true)
    assert place < 0.02 and turn < 0.5
    assert correction.counts['used'] > 50 and correction.sigma[0] < 0.05


def test_what_is_right_stays_right():
    correction = RangeCorrection(CONFIG, room())
    true = ride(correction, (0.0, 0.0, 0.0))
    assert off(correction.pose, true)[0] < 0.01


def turning_ride(correction, scale, seconds=60.0):
    """On the spot, mostly to the left, by a dead reckoning whose turns are `scale` times shorter than the true ones;
    returns the true pose.
    """
    for k in range(round(seconds * 50)):
        t = 10.0 + k * 0.02
        yaw = 0.4 * (t - 10.0) + 0.3 * math.sin(0.7 * t)
        true = (1.5 + 0.2 * math.sin(0.5 * t), 1.3, yaw)
        correction.on_pose(t, (true[0], true[1], math.remainder(yaw / scale, math.tau)))
        if k % 10 == 9:
            for name, mount in MOUNTS.items():
                correction.on_range(data(name, t, heard(true, mount)))
    return true


@settings(max_examples=6, deadline=None)
@given(st.floats(0.985, 1.015))
def test_the_scale_of_turns_is_learned(scale):
    config = replace(CONFIG, turn_scale_sigma=0.01)
    learning, plain = RangeCorrection(config, room()), RangeCorrection(CONFIG, room())
    true = turning_ride(learning, scale)
    learned = learning.turn_scale
    assert learned.scale == pytest.approx(scale, abs=0.002) and 0.0 < learned.sigma < 0.003
    turning_ride(plain, scale)
    assert off(learning.pose, true)[1] < 0.5 * off(plain.pose, true)[1] + 0.1
    assert plain.turn_scale == (1.0, 0.0)
    learning.forget()  # another place: of turns as much is known as before
    assert learning.turn_scale == learned and learning.P[2, 2] == pytest.approx(CONFIG.initial_cov_aa)
    again = RangeCorrection(config, room(), learned)
    assert again.turn_scale == learned


def test_turns_that_no_wall_tells_of_teach_nothing():
    correction = RangeCorrection(replace(CONFIG, turn_scale_sigma=0.01), None)
    turning_ride(correction, 1.01, 5.0)
    assert correction.turn_scale == (1.0, pytest.approx(0.01))


def test_what_was_learned_is_kept(tmp_path):
    path = tmp_path / 'below' / 'scale.yaml'
    assert turn_scale.load(path, 0.01) is None
    turn_scale.save(path, TurnScale(1.0042, 0.001))
    assert turn_scale.load(path, 0.01) == (1.0042, 0.005)  # the gyroscope may have been calibrated since
    assert turn_scale.load(path, 0.001) is None  # which knows as much without
    turn_scale.save(path, TurnScale(0.99, 0.007))
    assert turn_scale.load(path, 0.01) == (0.99, 0.007) and list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(
    'text',
    (
        '',
        '{',
        '[' * 3000,
        'a: 2021-13-01',
        'turn_scale: 1.0',
        'turn_scale: 1.2\nsigma: 0.001',
        'turn_scale: .nan\nsigma: 0.001',
        '[1, 2]',
        '\0',
    ),
)
def test_a_damaged_file_is_told(tmp_path, text):
    (tmp_path / 'scale.yaml').write_text(text)
    with pytest.raises(ValueError, match='scale.yaml'):
        turn_scale.load(tmp_path / 'scale.yaml', 0.01)


def test_what_no_wall_tells_is_not_changed():
    size_x = 40.0
    correction = RangeCorrection(CONFIG, room(size_x, ends=False))
    hear = lambda pose, mount: heard(pose, mount, size_x, ends=False)  # noqa: E731
    true = ride(correction, (0.08, 0.08, 0.0), hear=hear, centre=(20.0, 1.3))
    assert abs(correction.pose[1] - true[1]) < 0.01  # across the corridor: corrected
    assert correction.pose[0] - true[0] == pytest.approx(
        -0.08, abs=0.01
    )  # along it: as wrong as before, and known to be
    assert correction.sigma[0] > math.sqrt(CONFIG.initial_cov_xx)


def test_the_jambs_of_an_opening_tell_the_place_along_a_corridor():
    size_x, low, high = 40.0, 19.6, 20.4
    corridor = room(size_x, ends=False)
    corridor.cells[-3:, round(low / CELL) + 3 : round(high / CELL) + 3] = map_echo.FREE
    x = np.arange(18.0, 22.0, 0.01)
    wall = np.stack([x, np.full(len(x), SIZE_Y)], 1)[(x <= low) | (x >= high)]

    def hear(pose, mount):
        sensor_x, sensor_y, axis = compose(pose, mount)
        away = wall - (sensor_x, sensor_y)
        beside = np.angle(np.exp(1j * (np.arctan2(away[:, 1], away[:, 0]) - axis)))
        there = np.hypot(*away.T)[np.abs(beside) < HALF]
        right = heard(pose, mount, size_x, math.inf, ends=False)
        return min(right, there.min(initial=math.inf))

    found = []
    for sigma in (CONFIG.range_sigma_edge, 0.0):
        correction = RangeCorrection(replace(CONFIG, range_sigma_edge=sigma), corridor)
        true = ride(correction, (0.08, 0.0, 0.0), hear=hear, centre=(19.9, 1.3))
        found.append((abs(correction.pose[0] - true[0]), math.sqrt(correction.P[0, 0])))
    assert found[0][0] < 0.04 and found[0][1] < 0.08
    assert found[1] == (pytest.approx(0.08, abs=0.01), pytest.approx(0.14, abs=0.05))


def test_a_map_turned_with_all_in_it_is_the_same():
    plain, turned = RangeCorrection(CONFIG, room()), RangeCorrection(CONFIG, room(origin=(4.0, -2.0, 0.7)))
    world = (4.0, -2.0, 0.7)
    for k in range(1000):
        t = 10.0 + k * 0.02
        true = (1.5 + 0.3 * math.sin(0.5 * t), 1.3, 0.3 * math.sin(0.3 * t))
        wrong = (true[0] + 0.05, true[1] - 0.04, true[2])
        plain.on_pose(t, wrong)
        turned.on_pose(t, compose(world, wrong))
        if k % 10 == 9:
            for name, mount in MOUNTS.items():
                range_ = heard(true, mount)
                assert plain.on_range(data(name, t, range_)) == turned.on_range(data(name, t, range_))
    assert turned.pose == pytest.approx(compose(world, plain.pose), abs=1e-6)
    assert plain.counts['used'] > 30


@pytest.mark.parametrize('nearer', [0.35, 0.6, 0.9])
def test_what_the_map_does_not_hold_changes_nothing(nearer):
    correction = RangeCorrection(CONFIG, room())
    ride(correction, (0.0, 0.0, 0.0), hear=lambda pose, mount: max(heard(pose, mount) - nearer, 0.2))
    assert correction.offset == (0.0, 0.0, 0.0)
    assert correction.counts['used'] == 0 and correction.counts['shorter'] > 50


def test_a_box_beside_walls_does_not_take_the_pose_along():
    """One sensor hears a box all the time, the others the walls."""
    correction = RangeCorrection(CONFIG, room())
    box = lambda pose, mount: heard(pose, mount) - (0.4 if mount == MOUNTS['left'] else 0.0)  # noqa: E731
    true = ride(correction, (0.05, -0.05, 0.0), hear=box)
    assert off(correction.pose, true)[0] < 0.02


def test_without_walls_nothing_is_changed_to_the_last_digit():
    empty = RangeMap.from_occupancy(np.zeros((400, 400), np.int8), CELL, (-10.0, -10.0, 0.0), 65.0)
    correction = RangeCorrection(CONFIG, empty)
    ride(correction, (0.0, 0.0, 0.0), seconds=5.0)
    assert correction.offset == (0.0, 0.0, 0.0)
    assert correction.counts['used'] == 0 and correction.counts['not_predicted'] > 0


def test_the_unknown_predicts_nothing():
    map_ = room()
    map_.cells[map_.cells == map_echo.OCCUPIED] = map_echo.UNKNOWN
    correction = RangeCorrection(CONFIG, map_)
    ride(correction, (0.05, 0.0, 0.0), seconds=5.0)
    assert correction.counts['used'] == 0 and correction.offset == (0.0, 0.0, 0.0)


def test_what_is_given_out_moves_no_faster_than_allowed():
    correction, last = RangeCorrection(CONFIG, room()), []
    err = (0.1, 0.1, 0.03)

    def watch(t, true):
        # Where a robot that stands would be shown: the correction's own motion.
        shown = compose(correction.offset, correction.dead_reckoned)
        if last:
            before = compose(last[0], correction.dead_reckoned)
            assert math.dist(shown[:2], before[:2]) <= CONFIG.max_correction_rate * 0.02 + 1e-9
            assert abs(shown[2] - before[2]) <= CONFIG.max_correction_turn_rate * 0.02 + 1e-9
        last[:] = [correction.offset]

    true = ride(correction, err, watch=watch)
    shown = compose(correction.offset, correction.dead_reckoned)
    assert off(shown, true)[0] < 0.02


def test_a_wall_must_be_heard_twice():
    correction = RangeCorrection(CONFIG, room())
    pose = (1.5, 1.3, 0.0)
    correction.on_pose(1.0, pose)
    assert correction.on_range(data('left', 1.0, 1.05)) == 'first'
    assert correction.pose == pose
    correction.on_pose(1.2, pose)
    assert correction.on_range(data('left', 1.2, 0.4)) == 'shorter'  # and forgets the one before
    assert correction.on_range(data('left', 1.2, 1.05)) == 'first'
    correction.on_pose(1.4, pose)
    assert correction.on_range(data('left', 1.4, 1.05)) == 'used'
    assert correction.pose[1] < 1.3
    correction.on_pose(1.6, pose)
    assert correction.on_range(data('left', 1.6, 1.05)) == 'same_place'  # it has not moved: nothing new


def test_late_readings_are_put_where_the_robot_was():
    late = RangeCorrection(replace(CONFIG, range_delay=0.3), room())
    pending = []
    for k in range(1500):
        t = 10.0 + k * 0.02
        true = (1.5 + 0.3 * math.sin(0.8 * t), 1.3, 0.3 * math.sin(0.5 * t))
        late.on_pose(t, true)
        if k % 10 == 9:
            pending.append([(name, heard(true, mount)) for name, mount in MOUNTS.items()])
        if k % 10 == 4 and len(pending) > 1:
            for name, range_ in pending[-2 if len(pending) > 1 else -1]:
                late.on_range(data(name, t, range_))
    assert off(late.pose, true)[0] < 0.01 and late.counts['used'] > 50


def test_faulty_data_are_dropped_and_counted():
    correction = RangeCorrection(CONFIG)
    correction.on_pose(1.0, (1.5, 1.3, 0.0))
    assert correction.on_range(data('left', 1.0, 1.0)) == 'no_map'
    correction.map = room()
    good = data('left', 1.0, 1.0)
    for bad in (
        good._replace(range=math.nan),
        good._replace(stamp=math.nan),
        good._replace(stamp=math.inf),
        good._replace(field_of_view=0.0),
        good._replace(field_of_view=math.nan),
        good._replace(mount=(math.nan, 0.0, 0.0)),
    ):
        assert correction.on_range(bad) == 'bad_range'
    assert correction.on_range(good._replace(stamp=0.5)) == 'waiting'  # the dead reckoning has just begun
    assert correction.on_range(good._replace(stamp=3.0)) == 'no_pose'
    for far in (math.inf, -math.inf, 0.1, 2.45, -1.0):
        assert correction.on_range(good._replace(range=far)) == 'out_of_span'
    correction.on_pose(math.nan, (0.0, 0.0, 0.0))
    correction.on_pose(2.0, (math.inf, 0.0, 0.0))
    assert (
        correction.counts['bad_pose'] == 2
        and correction.counts['bad_range'] == 6
        and correction.counts['out_of_span'] == 5
    )
    assert correction.pose == (1.5, 1.3, 0.0) and correction.offset == (0.0, 0.0, 0.0)


@pytest.mark.parametrize('gap', [1.05, 60.0])
def test_dead_reckoning_that_comes_late_once_costs_a_robot_that_stood_nothing(gap):
    correction = RangeCorrection(CONFIG, room())
    for k in range(20):
        correction.on_pose(0.02 * k, (3.0, 1.0, 0.0))
    correction.start_at((1.5, 1.3, 1.5), np.diag((4e-4, 4e-4, 1e-4)))
    correction.on_pose(0.4, (3.0, 1.0, 0.0))
    correction.on_pose(0.4 + gap, (3.0, 1.0, 0.0))
    assert correction.pose == pytest.approx((1.5, 1.3, 1.5)) and not correction.counts['jumped']
    assert correction.sigma[0] == pytest.approx(0.02)


def test_who_is_put_elsewhere_is_believed_anew():
    correction = RangeCorrection(CONFIG, room())
    ride(correction, (0.08, 0.05, 0.0))
    assert correction.offset != (0.0, 0.0, 0.0)
    correction.on_pose(60.0, (2.0, 1.0, 1.0))
    assert correction.pose == (2.0, 1.0, 1.0) and correction.counts['jumped'] == 1
    heard = Heard(60.0, 60.0)
    assert status('range_localization', correction, 60.0, heard, {}).level == WARN
    assert correction.sigma[0] == pytest.approx(math.sqrt(CONFIG.initial_cov_xx))
    correction.on_pose(20.0, (2.1, 1.0, 1.0))  # the clock went back
    assert correction.pose == (2.1, 1.0, 1.0) and correction.counts['jumped'] == 1


@pytest.mark.parametrize('found', (False, True))
@pytest.mark.parametrize('gap, step', ((0.02, 0.4), (3.5, 0.1), (-1.5, 0.0), (0.02, -0.4)))
def test_a_step_of_the_dead_reckoning_keeps_the_correction_and_makes_it_less_sure(found, gap, step):
    """A filter that takes back what it has predicted, a gap, a clock set back: nobody has put the robot anywhere."""
    localizer = RangeLocalizer(CONFIG, room(20.0, 20.0))
    correction = localizer.correction
    for k in range(100):
        localizer.on_pose(0.02 * k, (1.0 + 0.01 * k, 1.0, 0.0))
    if found:
        correction.start_at((12.0, 8.0, 2.0), np.diag((4e-4, 4e-4, 1e-4)))
    else:
        correction.offset = correction._wanted = (0.3, -0.2, 0.1)
    offset, variance, (x, y, yaw) = correction.offset, correction.P[0, 0], correction.dead_reckoned
    localizer.on_pose(1.98 + gap, (x + step, y, yaw))
    assert correction.offset == offset and not localizer.searching and correction.counts['stepped'] == 1
    assert correction.P[0, 0] >= variance + step**2
    heard = Heard(2.0, 2.0)
    assert status('range_localization', correction, 2.0, heard, {}).level == WARN


def test_who_was_found_by_a_search_and_jumps_is_searched_for_again_where_it_was():
    localizer = RangeLocalizer(CONFIG, room(20.0, 20.0))
    for k in range(100):
        localizer.on_pose(0.02 * k, (1.0 + 0.01 * k, 1.0, 0.0))
    localizer.correction.start_at((12.0, 8.0, 2.0), np.diag((4e-4, 4e-4, 1e-4)))
    localizer.on_pose(2.0, (7.0, -3.0, 1.0))
    assert localizer.searching and localizer.correction.pose == pytest.approx((12.0, 8.0, 2.0))
    localizer.forget()  # set_pose: the dead reckoning is in the map now
    localizer.on_pose(2.02, (9.0, 9.0, 0.0))
    assert not localizer.searching and localizer.correction.pose == (9.0, 9.0, 0.0)


def test_the_covariance_of_what_is_given_out_holds_how_far_it_is_off_the_estimate():
    correction = RangeCorrection(CONFIG, room())
    for k in range(3):
        correction.on_pose(0.02 * k, (1.5, 1.3, 0.0))
    correction._wanted = (0.3, -0.1, 0.0)
    assert correction.P_given_out[0, 0] == pytest.approx(correction.P[0, 0] + 0.09)
    assert correction.P_given_out[0, 1] == pytest.approx(correction.P[0, 1] - 0.03)
    correction.offset = correction._wanted
    assert (correction.P_given_out == correction.P).all()


@settings(max_examples=60)
@given(st.floats(0.4, SIZE_X - 0.4), st.floats(0.4, SIZE_Y - 0.4), st.floats(-math.pi, math.pi))
def test_a_predicted_plane_is_where_the_wall_is_and_its_slopes_are_right(x, y, yaw):
    map_ = room()
    shift = 3 * CELL
    some, none = np.diag([0.01, 0.01, 0.01]), np.zeros((3, 3))

    def at(x, y, yaw, axes=none):
        sx, sy, axis = compose((x, y, yaw), MOUNTS['left'])
        base, sensor = (x + shift, y + shift), (sx + shift, sy + shift, axis)
        return map_echo.predict(map_.cells, CELL, base, sensor, Cone(HALF, 2.5, 0.03), axes)

    sensor = compose((x, y, yaw), MOUNTS['left'])
    what, distance, *slopes = at(x, y, yaw, some)
    if what != map_echo.PLANE or not (0.0 < sensor[0] < SIZE_X and 0.0 < sensor[1] < SIZE_Y):
        return
    assert distance == pytest.approx(heard((x, y, yaw), MOUNTS['left']), abs=0.005)
    h = 0.004
    for k, step in enumerate(np.eye(3) * h):
        moved = at(x + step[0], y + step[1], yaw + step[2])
        assert moved[0] == map_echo.PLANE
        assert (moved[1] - distance) / h == pytest.approx(slopes[k], abs=0.15)


@pytest.mark.parametrize('left', (48, 58))
def test_what_is_no_plane_at_the_border_of_the_cone_is_not_predicted(left):
    cells = np.zeros((120, 120), np.uint8)
    cells[40:, left:] = map_echo.OCCUPIED  # the sensor looks along it
    what, distance, _ = map_echo.echo(cells, CELL, (2.0, 2.2, math.pi / 2), Cone(HALF, 2.5, 0.03))
    assert what == map_echo.AMBIGUOUS and math.isnan(distance)


@pytest.mark.parametrize(
    'columns, x',
    ((slice(39, 41), 2.0), (slice(42, None), 2.1), (slice(43, None), 2.15), (slice(None, 38), 1.9)),
)
def test_a_post_and_the_end_of_a_wall_are_edges(columns, x):
    cells = np.zeros((120, 120), np.uint8)
    cells[60:62, columns] = map_echo.OCCUPIED
    what, distance, direction = map_echo.echo(cells, CELL, (2.0, 2.2, math.pi / 2), Cone(HALF, 2.5, 0.03))
    assert what == map_echo.EDGE
    assert distance == pytest.approx(math.hypot(x - 2.0, 0.8), abs=0.01)
    assert direction == pytest.approx(math.atan2(0.8, x - 2.0), abs=0.05)


@pytest.mark.parametrize(
    'params, words',
    [
        ({}, 'range_topics'),
        ({'range_topics': ['/a', '/b', '/a']}, 'twice'),
        ({'range_topics': 'SDI_range'}, 'range_topics'),
        ({'range_topics': ['/a'], 'gate': 0.0}, 'gate'),
        ({'range_topics': ['/a'], 'range_min_range': 3.0}, 'range_min_range'),
        ({'range_topics': ['/a'], 'odom_alpha1': -1.0}, 'odom_alpha1'),
        ({'range_topics': ['/a'], 'update_min_d': 'far'}, 'update_min_d'),
        ({'range_topics': ['/a'], 'turn_scale_sigma': -0.1}, 'turn_scale_sigma'),
        ({'range_topics': ['/a'], 'turn_scale_file': 3}, 'turn_scale_file'),
        ({'range_topics': ['/a'], 'base_frame_id': 'map'}, 'must differ'),
        ({'range_topics': ['/a'], 'map_occupied_above': 100.0}, 'map_occupied_above'),
    ],
)
def test_bad_settings_are_told(params, words):
    with pytest.raises(ConfigError) as told:
        RangeConfig.from_params(params)
    assert any(words in fault for fault in told.value.faults)


def test_settings_are_taken_and_unknown_ones_told():
    config = RangeConfig.from_params(
        {'range_topics': ['/a', '/b'], 'range_delay': 0.3, 'global_frame_id': '/world', 'laser_max_range': 2.0}
    )
    assert config.range_topics == ('/a', '/b') and config.range_delay == 0.3 and config.global_frame_id == 'world'
    assert config.warnings == ('laser_max_range is no parameter of range_localization: ignored.',)


def test_maps_that_are_none_are_refused():
    for cells, resolution, origin in (
        (np.zeros((0, 0)), 0.05, (0, 0, 0)),
        (np.zeros(9), 0.05, (0, 0, 0)),
        (np.zeros((3, 3)), 0.0, (0, 0, 0)),
        (np.zeros((3, 3)), 0.05, (math.nan, 0, 0)),
        (np.zeros((3, 3)), 1e300, (0, 0, 0)),
        (np.zeros((3, 3)), 1e-30, (0, 0, 0)),
        (np.zeros((3, 3)), 0.05, (1e15, 0, 0)),
    ):
        with pytest.raises(ValueError):
            RangeMap.from_occupancy(cells, resolution, origin, 65.0)


def test_diagnostics_say_what_is_waited_for():
    correction = RangeCorrection(CONFIG)
    assert status('n', correction, 1.0, Heard()).message == 'waiting for the map'
    correction.map = room()
    assert status('n', correction, 1.0, Heard())[1:3] == (ERROR, 'waiting for dead reckoning on odom')
    assert status('n', correction, 9.0, Heard(8.9, 1.0)).level == WARN
    assert status('n', correction, 9.0, Heard(8.9, 8.9, 'no transform odom -> base_link'))[1:3] == (
        ERROR,
        'no transform odom -> base_link',
    )
    ride(correction, (0.05, 0.0, 0.0))
    told = status('n', correction, 50.0, Heard(50.0, 50.0))
    assert told.level == OK and dict(told.values)['used'] == str(correction.counts['used'])
    correction.on_range(data('left', math.nan, 1.0))
    assert status('n', correction, 50.0, Heard(50.0, 50.0)).level == WARN
    assert status('n', correction, 50.0, Heard(50.0, 50.0), before=dict(correction.counts)).level == OK
