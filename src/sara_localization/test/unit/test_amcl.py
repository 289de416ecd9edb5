"""amcl without ROS: it tracks, finds its place, and says what it could not use; parameters; diagnostics."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent))
from amcl_world import drifting, error, loop, planar, scan, world  # noqa: E402

from sara_common.config import ConfigError  # noqa: E402
from sara_common.diagnostics import ERROR, OK, WARN  # noqa: E402
from sara_common.planar import compose, inverse  # noqa: E402
from sara_localization.geometry.rigid import Transform  # noqa: E402
from sara_localization.particles.amcl import Amcl  # noqa: E402
from sara_localization.particles.amcl_config import DYNAMIC, ODOM_MODELS, SCAN_MODELS, AmclConfig  # noqa: E402
from sara_localization.particles.amcl_status import Heard, statuses  # noqa: E402
from sara_localization.ranges.range_data import RangeMap  # noqa: E402

MAP = world()
FEW = dict(min_particles=200, max_particles=2000, laser_max_beams=30, kld_err=0.05)
HERE = (5.0, 3.0, 0.0)
"""A pose in the free space, and of the odometry there."""


def started(pose=None, sigma=(0.2, 0.2, 0.1), map_=MAP, **changes):
    """amcl with a map and an initial pose, and the list of what it says."""
    said = []
    amcl = Amcl(AmclConfig(**{**FEW, **changes}), said.append)
    amcl.set_map(map_)
    if pose is not None:
        assert amcl.set_pose(pose, np.diag(np.square(sigma))) == ''
    return amcl, said


def driven(amcl, path, seed=0, **more):
    """(pose at the end, the last Belief published) of a drive along true poses."""
    rng, last = np.random.default_rng(seed), None
    for truth, odometry in zip(path, drifting(path, rng)):
        result = amcl.on_scan(scan(amcl.map, truth, odometry, rng, **more))
        last = result.pose or last
    end = result.map_from_odom @ planar(odometry)
    return (*end.translation[:2], end.yaw), last


@pytest.mark.parametrize('model', SCAN_MODELS)
@pytest.mark.parametrize('odom', ['diff', 'omni-corrected'])
def test_it_tracks_a_robot_whose_odometry_drifts(model, odom):
    path = loop(120)
    alphas = {f'odom_alpha{k}': 0.01 for k in range(1, 6)} if odom.endswith('corrected') else {}
    amcl, said = started(compose(path[0], (0.2, -0.15, 0.1)), laser_model_type=model, odom_model_type=odom, **alphas)
    pose, found = driven(amcl, path)
    off, turned = error(pose, path[-1])
    assert off < 0.10 and turned < math.radians(3.0) and not said
    assert np.sqrt(np.diag(found.covariance)).max() < 0.3
    assert amcl.counts['updates'] > 30


@pytest.mark.parametrize('origin', [(-4.0, 2.0, 0.0), (3.0, 1.0, -2.0)])
def test_a_map_may_lie_and_be_turned_as_it_likes(origin):
    path = [compose(origin, pose) for pose in loop(80)]
    amcl, _ = started(path[0], map_=world(origin))
    off, turned = error(driven(amcl, path)[0], path[-1])
    assert off < 0.10 and turned < math.radians(3.0)


@pytest.mark.parametrize('seed', range(3))
def test_it_finds_its_place_from_nowhere(seed):
    path = loop(160)
    amcl, _ = started(seed=seed, max_particles=5000, odom_alpha1=0.05, odom_alpha2=0.05, odom_alpha3=0.05)
    assert amcl.start_anywhere() == ''
    pose, found = driven(amcl, path, seed, count=60)
    off, turned = error(pose, path[-1])
    assert off < 0.25 and turned < math.radians(10.0) and found.weight > 0.9
    assert len(amcl.filter.poses) < 2000, 'KLD sampling leaves as many particles as there were'


@pytest.mark.parametrize('least', [100, 500])
def test_it_searches_with_more_particles_than_allowed_until_the_place_is_found(least):
    path = loop(60)
    amcl, _ = started(max_particles=500, min_particles=least, resample_interval=1)
    assert amcl.start_anywhere() == ''
    free = np.count_nonzero(MAP.cells == 0) * MAP.resolution**2
    assert len(amcl.filter.poses) == int(80 * free) > 500 and amcl.filter.is_searching
    heard = Heard(1.0, 0.0, '/scan')
    amcl.on_scan(scan(MAP, path[0], (0.0, 0.0, 0.0)))
    assert 'searching' in statuses(amcl, 1.0, heard)[0].message
    amcl.forget_odometry()
    assert error(driven(amcl, path)[0], path[-1])[0] < 0.2
    assert not amcl.filter.is_searching and len(amcl.filter.poses) <= 500
    assert statuses(amcl, 1.0, heard)[0].level == OK


def carried_away(seed, **changes):
    """Errors (m) at each step of a drive, 0.1 m each, in which the robot is carried by 5 m after 4 m."""
    path = loop(250)
    before, after = path[:40], path[90:]
    changes |= dict(seed=seed, max_particles=5000, min_particles=500, lost_recovery=False)
    amcl, _ = started(before[0], (0.1, 0.1, 0.1), **changes)
    rng = np.random.default_rng(seed)
    driven(amcl, before, seed)
    last = amcl._last  # what the odometry said when it was lifted
    errors = []
    moves = list(drifting(after, rng))
    for truth, odometry in zip(after, (compose(last, compose(inverse(moves[0]), move)) for move in moves)):
        result = amcl.on_scan(scan(MAP, truth, odometry, rng, count=60))
        end = result.map_from_odom @ planar(odometry)
        errors.append(error((*end.translation[:2], end.yaw), truth)[0])
    return errors


@pytest.mark.parametrize('seed', range(2))
def test_a_robot_that_was_carried_away_finds_its_place_by_random_particles(seed):
    assert max(carried_away(seed, recovery_alpha_slow=0.001, recovery_alpha_fast=0.1)[120:]) < 0.25
    assert min(carried_away(seed)[120:]) > 0.5, 'without them it did, too: the test shows nothing'


def test_map_to_odom_makes_the_odometry_agree_with_the_pose():
    amcl, _ = started(HERE)
    tilted = Transform.from_xyz_rpy(-3.0, 2.0, 0.1, 0.02, -0.03, 1.0)
    result = amcl.on_scan(scan(MAP, HERE, (0.0, 0.0, 0.0))._replace(odometry=tilted))
    found = result.map_from_odom @ tilted
    assert found.translation == pytest.approx((*result.pose.pose[:2], 0.0), abs=1e-9)
    assert found.rpy == pytest.approx((0.0, 0.0, result.pose.pose[2]), abs=1e-9)


# When a scan counts


def counted(amcl, *odometries, frame='laser', truth=HERE):
    return [amcl.on_scan(scan(MAP, truth, odometry, frame=frame)).counted for odometry in odometries]


def test_a_scan_counts_first_and_then_when_the_robot_has_moved_or_turned():
    amcl, _ = started(HERE, update_min_d=0.2, update_min_a=0.5)
    moves = [(0, 0, 0), (0.15, 0, 0), (0.21, 0, 0), (0.3, 0.1, 0.0), (0.3, 0.1, 0.4), (0.3, 0.1, 0.6), (0.3, 0.1, 0.7)]
    assert counted(amcl, *moves) == [True, False, True, False, False, True, False]


def test_each_scanner_counts_once_for_a_motion():
    amcl, _ = started(HERE)
    assert counted(amcl, (0, 0, 0)) == [True] and counted(amcl, (0, 0, 0), (0, 0, 0), frame='rear') == [True, False]
    assert counted(amcl, (0.3, 0, 0)) == [True] and counted(amcl, (0.31, 0, 0), frame='rear') == [True]
    assert counted(amcl, (0.32, 0, 0)) == [False] and counted(amcl, (0.32, 0, 0), frame='rear') == [False]


def test_a_forced_update_counts_once_at_rest():
    amcl, _ = started(HERE)
    assert counted(amcl, (0, 0, 0), (0, 0, 0)) == [True, False]
    amcl.force_update()
    assert counted(amcl, (0, 0, 0), (0, 0, 0)) == [True, False]


def test_forced_updates_at_rest_sharpen_the_pose():
    amcl, _ = started(compose(HERE, (0.3, -0.3, 0.1)), (0.4, 0.4, 0.15))
    rng, published = np.random.default_rng(1), []
    for _ in range(20):
        amcl.force_update()
        published.append(amcl.on_scan(scan(MAP, HERE, (0, 0, 0), rng)).pose)
    first, last = (error(belief.pose, HERE) for belief in (published[0], published[-1] or published[-2]))
    assert first[0] > 0.1 and last[0] < 0.07 and last[1] < math.radians(2.0)


def test_a_pose_is_published_first_and_when_particles_were_drawn():
    amcl, _ = started(HERE, resample_interval=3)
    results = [amcl.on_scan(scan(MAP, HERE, (0.3 * k, 0, 0))) for k in range(7)]
    assert [r.pose is not None for r in results] == [True, False, True, False, False, True, False]
    assert all(r.map_from_odom is not None for r in results)


@pytest.mark.parametrize('name, act', [('initialpose', 0), ('set_map', 1)])
def test_an_update_may_be_forced_after_a_pose_or_a_map(name, act):
    amcl, _ = started(HERE, **{f'force_update_after_{name}': True})
    counted(amcl, (0, 0, 0), (0, 0, 0), (0, 0, 0))
    amcl.set_map(MAP) if act else amcl.set_pose(HERE, np.zeros((3, 3)))
    assert counted(amcl, (0, 0, 0), (0, 0, 0), (0, 0, 0)) == ([True, False, False] if act else [True, True, False])


def test_when_the_odometry_begins_anew_its_jump_is_no_motion():
    amcl, _ = started(HERE, (0.05, 0.05, 0.02))
    counted(amcl, (0, 0, 0), (0.3, 0, 0))
    before = amcl.filter.poses.mean(0)
    amcl.forget_odometry()
    assert counted(amcl, (50.0, 0, 0)) == [True]
    assert np.abs(amcl.filter.poses.mean(0) - before).max() < 0.1


@pytest.mark.parametrize('seed', [0, 1])
def test_odometry_that_was_reset_is_noticed_and_the_robot_taken_to_be_where_it_was(seed):
    path, rng = loop(60), np.random.default_rng(seed)
    amcl, said = started(path[0], seed=seed)
    for k, (truth, odometry) in enumerate(zip(path, list(drifting(path, rng)))):
        if k == 30:
            origin = compose(odometry, (-1.0, 2.0, 1.0))
        odometry = compose(inverse(origin), odometry) if k >= 30 else odometry
        result = amcl.on_scan(scan(MAP, truth, odometry, rng, stamp=1.0 + 0.2 * k))
        pose = result.map_from_odom @ planar(odometry)
        off, _ = error((*pose.translation[:2], pose.yaw), truth)
        assert off < 0.4
    assert off < 0.1 and amcl.counts['jump'] == 1 and 'the odometry jumps by' in said[0] and len(said) == 1


def test_the_same_seed_gives_the_same_poses_and_another_does_not():
    path = loop(30)
    poses = [driven(started(path[0], seed=seed)[0], path)[0] for seed in (7, 7, 8)]
    assert poses[0] == poses[1] != poses[2]


# Maps and poses


def test_a_pose_that_comes_before_the_map_waits_for_it():
    amcl = Amcl(AmclConfig(**FEW))
    assert amcl.set_pose((2.0, 1.0, 0.5), np.diag([1e-4, 1e-4, 1e-4])) == ''
    amcl.set_map(MAP)
    assert amcl.filter.poses.mean(0) == pytest.approx((2.0, 1.0, 0.5), abs=0.01)


def test_without_one_it_starts_at_the_initial_pose():
    amcl, _ = started(initial_pose_x=2.0, initial_pose_y=1.0, initial_pose_a=0.5, initial_cov_xx=0.04)
    assert amcl.filter.poses.mean(0) == pytest.approx((2.0, 1.0, 0.5), abs=0.05)
    assert amcl.filter.poses.std(0) == pytest.approx((0.2, 0.5, math.pi / 12.0), rel=0.06)


def test_particles_start_with_the_covariance_that_was_set():
    covariance = np.array([[0.04, 0.02, 0.0], [0.02, 0.09, 0.01], [0.0, 0.01, 0.02]])
    amcl, _ = started(max_particles=40000, min_particles=100)
    assert amcl.set_pose(HERE, covariance) == ''
    assert np.cov(amcl.filter.poses.T) == pytest.approx(covariance, abs=2e-3)


@pytest.mark.parametrize(
    'pose, covariance, word',
    [
        ((math.nan, 0.0, 0.0), np.eye(3), 'no number'),
        ((1e9, 0.0, 0.0), np.eye(3), 'no number'),
        (HERE, np.diag([1.0, math.inf, 1.0]), 'no number'),
        (HERE, np.diag([1.0, -0.1, 1.0]), 'semidefinite'),
    ],
)
def test_a_pose_that_is_none_is_refused_and_changes_nothing(pose, covariance, word):
    amcl, _ = started(HERE)
    before = amcl.filter.poses.copy()
    assert word in amcl.set_pose(pose, covariance)
    assert (amcl.filter.poses == before).all()


def test_another_map_mid_way_leaves_the_particles_and_is_used():
    path = loop(80)
    amcl, said = started(path[0])
    driven(amcl, path[:41])
    where = amcl.filter.poses.mean(0)
    smaller = RangeMap(MAP.cells[:120, :150], MAP.resolution, MAP.origin)
    for map_ in (smaller, MAP):
        amcl.set_map(map_)
        assert amcl.filter.poses.mean(0) == pytest.approx(where)
    amcl.forget_odometry()  # the drive's odometry starts anew
    assert error(driven(amcl, path[40:], seed=1)[0], path[-1])[0] < 0.15 and not said


def test_nowhere_to_start_is_said():
    assert 'no map' in Amcl(AmclConfig()).start_anywhere()
    amcl, _ = started(HERE, map_=RangeMap(np.ones((5, 5), np.uint8), 0.05))
    assert 'no free cell' in amcl.start_anywhere()


# What cannot be used


def test_what_cannot_be_used_is_counted_said_once_and_changes_nothing():
    amcl, said = started(HERE)
    good = scan(MAP, HERE, (0.0, 0.0, 0.0))
    amcl.on_scan(good)
    before = amcl.filter.poses.copy(), amcl.filter.weights.copy()
    faulty = {
        'bad_scan': good._replace(sweep=good.sweep._replace(angle_increment=math.nan)),
        'bad_odometry': good._replace(odometry=Transform((math.nan, 0.0, 0.0))),
        'bad_mount': good._replace(mount=Transform.from_xyz_rpy(0.0, 0.0, 0.0, math.pi / 2)),
    }
    for kind, bad in faulty.items():
        for _ in range(3):
            assert amcl.on_scan(bad) is None
        assert amcl.counts[kind] == 3
    assert amcl.on_scan(good._replace(ended=Transform((0.0, math.inf, 0.0)))) is None
    assert amcl.counts['bad_odometry'] == 4
    assert len(said) == 3 and all(sentence.startswith('laser: ') for sentence in said)
    assert (amcl.filter.poses == before[0]).all() and (amcl.filter.weights == before[1]).all()


def test_a_scan_without_a_usable_range_moves_the_particles_but_does_not_weigh_them():
    amcl, said = started(HERE, resample_interval=10)
    empty = np.full(90, math.nan)
    empty[3] = math.inf
    for k in range(3):
        taken = scan(MAP, HERE, (0.3 * k, 0.0, 0.0))
        amcl.on_scan(taken._replace(sweep=taken.sweep._replace(ranges=empty)))
    assert amcl.counts['no_beams'] == 3 and len(said) == 1 and np.ptp(amcl.filter.weights) == 0.0
    assert amcl.filter.poses.mean(0)[0] == pytest.approx(HERE[0] + 0.6, abs=0.1)


def test_before_the_map_a_scan_is_dropped():
    said = []
    amcl = Amcl(AmclConfig(), said.append)
    assert amcl.on_scan(scan(MAP, HERE, (0, 0, 0))) is None
    assert amcl.counts['no_map'] == 1 and 'before the map' in said[0]


# Parameters


def test_defaults_are_the_peer_s():
    config = AmclConfig.from_params({})
    assert config == AmclConfig()
    assert (config.max_particles, config.laser_max_beams, config.laser_z_hit, config.kld_z) == (5000, 30, 0.95, 0.99)
    assert config.update_min_a == pytest.approx(math.pi / 6) and config.initial_cov_aa == pytest.approx(
        0.0685, abs=1e-4
    )


@pytest.mark.parametrize(
    'params, word',
    [
        ({'laser_model_type': 'beams'}, 'beam'),
        ({'odom_model_type': 'ackermann'}, 'diff-corrected'),
        ({'min_particles': 600, 'max_particles': 500}, 'max_particles'),
        ({'max_particles': 2.5}, 'whole'),
        ({'max_particles': 0}, 'whole'),
        ({'kld_err': 0.0}, 'above 0'),
        ({'laser_sigma_hit': 0}, 'laser_sigma_hit'),
        ({'laser_likelihood_power': 0.0}, 'laser_likelihood_power'),
        ({'odom_alpha3': -0.1}, 'odom_alpha3'),
        ({'odom_alpha3': math.inf}, 'odom_alpha3'),
        ({'recovery_alpha_fast': 1.5}, 'recovery_alpha_fast'),
        ({'resample_interval': 0}, 'resample_interval'),
        ({'laser_z_hit': 0.0, 'laser_z_rand': 0.0}, 'laser_z_rand'),
        ({'laser_min_range': 5.0, 'laser_max_range': 4.0}, 'laser_min_range'),
        ({'global_frame_id': '/odom'}, 'differ'),
        ({'use_map_topic': 'perhaps'}, 'use_map_topic'),
        ({'initial_pose_x': 'here'}, 'initial_pose_x'),
        ({'seed': -1}, 'seed'),
    ],
)
def test_what_cannot_work_is_refused_by_name(params, word):
    with pytest.raises(ConfigError) as caught:
        AmclConfig.from_params(params)
    assert word in str(caught.value)


def test_what_has_no_effect_is_named_and_old_names_are_read():
    config = AmclConfig.from_params(
        {'bag_scan_period': 0.1, 'laser_max_beam': 3, 'beam_skip_error_threshold_': 0.5, 'restore_defaults': False}
    )
    assert config.beam_skip_error_threshold == 0.5
    words = sorted(sentence.split()[0] for sentence in config.warnings)
    assert words == ['bag_scan_period', 'beam_skip_error_threshold_', 'laser_max_beam']


def test_a_saved_pose_that_is_no_number_is_not_taken():
    config = AmclConfig.from_params({'initial_pose_x': math.nan, 'initial_pose_y': 2.0})
    assert config.initial_pose == (0.0, 2.0, 0.0) and 'initial_pose_x' in config.warnings[0]


def test_parameters_may_change_on_the_way():
    path = loop(60)
    amcl, _ = started(path[0])
    driven(amcl, path[:31])
    where = amcl.filter.poses.mean(0)
    changed = replace(amcl.config, laser_model_type='beam', max_particles=300, min_particles=300, laser_max_beams=12)
    amcl.reconfigure(changed)
    assert amcl.filter.poses.mean(0) == pytest.approx(where)
    amcl.forget_odometry()
    assert error(driven(amcl, path[30:], seed=1)[0], path[-1])[0] < 0.2 and len(amcl.filter.poses) == 300
    assert {'max_particles', 'laser_model_type', 'tf_broadcast', 'odom_frame_id'} <= set(DYNAMIC)
    assert not {'initial_pose_x', 'warnings', 'seed'} & set(DYNAMIC)


@pytest.mark.parametrize('model', ODOM_MODELS)
def test_every_motion_model_can_be_set(model):
    assert AmclConfig.from_params({'odom_model_type': model}).odom_model_type == model


# Diagnostics


def test_diagnostics_tell_what_is_waited_for_what_is_faulty_and_how_sure_the_pose_is():
    amcl = Amcl(AmclConfig(**FEW))
    heard = Heard(None, 0.0, '/scan')
    told = lambda now, heard=heard, before=None: statuses(amcl, now, heard, before)
    assert told(1.0)[0][1:3] == (ERROR, 'waiting for the map')
    amcl.set_map(MAP)
    assert told(1.0)[0][1:3] == (WARN, 'waiting for a scan on /scan')
    assert told(16.0)[0].message == 'no scan on /scan for 16 s' and told(1.0)[1].level == WARN
    amcl.set_pose(HERE, np.diag([1.0, 0.01, 0.01]))
    amcl.on_scan(scan(MAP, HERE, (0, 0, 0)))
    now = Heard(2.0, 0.0, '/scan')
    state, deviation = told(2.0, now)
    assert state.level == OK and '2000 particles' in state.message
    assert dict(state.values)['updates'] == '1' and float(dict(state.values)['weight of the pose']) > 0.3
    assert deviation.level == WARN and 'x' in deviation.message and dict(deviation.values)['std_warn_level_x'] == '0.2'
    amcl.trouble('bad_scan', 'bad')
    assert told(2.0, now)[0].message == 'data are faulty: bad_scan 1'
    assert told(2.0, now, dict(amcl.counts))[0].level == OK
    assert told(2.0, now._replace(waiting='no transform'))[0][1:3] == (ERROR, 'no transform')


def test_the_covariance_grows_along_a_corridor_that_looks_the_same_everywhere():
    cells = np.zeros((40, 800), np.uint8)
    cells[:2] = cells[-2:] = 1
    corridor = RangeMap(cells, 0.05)
    amcl, _ = started((20.0, 1.0, 0.0), (0.05, 0.05, 0.02), map_=corridor, odom_alpha3=0.5)
    found = None
    for k in range(40):
        x = 0.3 * k
        taken = scan(corridor, (20.0 + x, 1.0, 0.0), (x, 0.0, 0.0), count=60)
        found = amcl.on_scan(taken).pose or found
    along, across, _ = np.sqrt(found.covariance.diagonal())
    assert along > 0.15 and across < 0.06


def test_planar_is_flat():
    """Of the tests' world: a planar odometry has no height."""
    assert planar((1.0, 2.0, 0.3)).translation == (1.0, 2.0, 0.0)
