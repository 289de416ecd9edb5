"""Laws of amcl's parts: motion models, likelihoods, number of particles, resampling, clusters."""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parent))
from amcl_world import CELL, MOST, MOUNT, plan, planar, ranges, scan, world  # noqa: E402

from sara_common.planar import compose, wrap
from sara_common.scans import Sweep
from sara_localization.geometry.rigid import Transform
from sara_localization.particles import beams, belief, bins, field, scan_models
from sara_localization.particles.amcl_config import ODOM_MODELS, SCAN_MODELS, AmclConfig
from sara_localization.particles.likelihood import Likelihoods
from sara_localization.particles.motion import MotionNoise, moved
from sara_localization.particles.particle_filter import FIRST, KEPT, ParticleFilter
from sara_localization.ranges.map_echo import FREE
from sara_localization.ranges.range_data import RangeMap

MANY = 40000
angles = st.floats(-math.pi, math.pi)


def noise(model, *alphas):
    return MotionNoise(model, *alphas)


# Motion


@pytest.mark.parametrize('model', ODOM_MODELS)
@given(start=st.tuples(st.floats(-9, 9), st.floats(-9, 9), angles), x=st.floats(-1, 1), y=st.floats(-1, 1), yaw=angles)
def test_without_noise_a_particle_makes_the_odometry_s_step(model, start, x, y, yaw):
    before = (3.0, -2.0, 2.5)
    if model.startswith('diff') and math.hypot(x, y) < 0.01:
        x = y = 0.0
    step = (x, y, yaw)
    (after,) = moved(np.array([start]), before, compose(before, step), noise(model, 0, 0, 0, 0, 0), RNG())
    expected = compose(start, step)
    assert after[:2] == pytest.approx(expected[:2], abs=1e-9)
    assert wrap(after[2] - expected[2]) == pytest.approx(0.0, abs=1e-9)


def RNG(seed=0):
    return np.random.default_rng(seed)


def spread(model, step, alphas, seed=0):
    """Standard deviations (along, across, yaw) after a step from the origin."""
    poses = moved(np.zeros((MANY, 3)), (0.0, 0.0, 0.0), step, noise(model, *alphas), RNG(seed))
    off = poses - np.array(compose((0.0, 0.0, 0.0), step))
    off[:, 2] = wrap(off[:, 2])
    return off.std(0)


@pytest.mark.parametrize('model, power', [('diff', 1.0), ('diff-corrected', 0.5)])
def test_moments_of_the_diff_models(model, power):
    way, a2, a3 = 0.4, 0.02, 0.05
    along, across, yaw = spread(model, (way, 0.0, 0.0), (0.0, a2, a3, 0.0, 0.0))
    assert along == pytest.approx((a3 * way**2) ** power, rel=0.03)
    turn = (a2 * way**2) ** power
    assert across == pytest.approx(way * turn, rel=0.03)
    assert yaw == pytest.approx(math.sqrt(2.0) * turn, rel=0.03)
    turned = 0.6
    _, _, yaw = spread(model, (0.0, 0.0, turned), (0.03, 0.0, 0.0, 0.0, 0.0))
    assert yaw == pytest.approx((0.03 * turned**2) ** power, rel=0.03)
    along, _, _ = spread(model, (0.0, 0.0, turned), (0.0, 0.0, 0.0, 0.03, 0.0))
    assert along == pytest.approx((0.03 * turned**2) ** power, rel=0.03)


@pytest.mark.parametrize('model, power', [('omni', 1.0), ('omni-corrected', 0.5)])
def test_moments_of_the_omni_models(model, power):
    way, turn, a = 0.4, 0.3, (0.01, 0.02, 0.03, 0.04, 0.05)
    along, across, yaw = spread(model, (way, 0.0, turn), a)
    assert along == pytest.approx((a[2] * way**2 + a[0] * turn**2) ** power, rel=0.03)
    assert across == pytest.approx((a[0] * turn**2 + a[4] * way**2) ** power, rel=0.03)
    assert yaw == pytest.approx((a[3] * turn**2 + a[1] * way**2) ** power, rel=0.03)


@pytest.mark.parametrize('model', ODOM_MODELS)
def test_driving_back_is_as_sure_as_driving_forward(model):
    alphas = (0.2, 0.0, 0.1, 0.1, 0.1)
    assert spread(model, (-0.4, 0.0, 0.0), alphas) == pytest.approx(spread(model, (0.4, 0.0, 0.0), alphas), abs=1e-3)


# Beams


def sweep(measured, increment=0.02, least=0.1, most=MOST):
    n = len(measured)
    return Sweep(1.0, -1.0, -1.0 + increment * (n - 1), increment, 0.0, least, most, np.asarray(measured, float))


def test_beams_are_spread_over_those_that_say_something():
    measured = np.full(100, math.inf)
    measured[::5] = 2.0
    measured[3], measured[4] = math.nan, -math.inf
    chosen = beams.chosen(sweep(measured), planar((0, 0, 0)), beams.BeamChoice(20))
    assert chosen.directions == pytest.approx(-1.0 + 0.02 * np.arange(0, 100, 5))
    assert chosen.ranges == pytest.approx(np.full(20, 2.0))
    few = beams.chosen(sweep(measured), planar((0, 0, 0)), beams.BeamChoice(3))
    assert few.directions == pytest.approx([-1.0, -1.0 + 0.02 * 50, -1.0 + 0.02 * 95], abs=0.11)
    silent = beams.chosen(sweep(measured), planar((0, 0, 0)), beams.BeamChoice(200, silent=True))
    assert len(silent.ranges) == 98 and np.count_nonzero(silent.ranges == MOST) == 78


def test_limits_of_the_range_are_the_narrower_ones():
    measured = [0.05, 0.2, 0.5, 3.0, 5.0, 9.0]
    chosen = beams.chosen(sweep(measured), planar((0, 0, 0)), beams.BeamChoice(10, 0.3, 4.0))
    assert chosen.ranges == pytest.approx([0.5, 3.0]) and chosen.most == 4.0
    assert beams.chosen(sweep(measured), planar((0, 0, 0)), beams.BeamChoice(10, 0.01, 99.0)).most == MOST


def test_beams_of_a_robot_that_moves_end_where_they_met_a_wall():
    motion, rays = (0.12, -0.05, 0.3), 60
    s = sweep(np.full(rays, 1.0), increment=2.0 / (rays - 1))
    angles_, shares = s.angle_min + s.angle_increment * np.arange(rays), np.linspace(0.0, 1.0, rays)
    seen = [compose(tuple(share * part for part in motion), MOUNT) for share in shares]
    wall = 2.0  # m ahead, square to the robot at the first ray
    measured = [(wall - x) / math.cos(yaw + a) for (x, _, yaw), a in zip(seen, angles_)]
    s = s._replace(ranges=np.array(measured))
    points = beams.chosen(s, planar(MOUNT), beams.BeamChoice(rays), motion).points
    assert points[:, 0] == pytest.approx(wall)
    sideways = [y + r * math.sin(yaw + a) for (_, y, yaw), a, r in zip(seen, angles_, measured)]
    assert points[:, 1] == pytest.approx(sideways)
    assert np.ptp(beams.chosen(s, planar(MOUNT), beams.BeamChoice(rays)).points[:, 0]) > 0.3


def test_beams_without_an_echo_turn_with_the_robot_and_stay_without():
    s = sweep([math.inf, math.inf, 0.99 * MOST])
    found = beams.chosen(s, planar((0, 0, 0)), beams.BeamChoice(9, silent=True), (-1.0, 0.0, 0.2))
    assert found.ranges[:2].tolist() == [MOST, MOST] and found.ranges[2] < MOST
    assert found.directions[0] == -1.0 and found.directions[1] > -0.98


@given(st.floats(-3, 3), st.floats(-3, 3), angles)
def test_beams_end_where_the_mount_says_also_upside_down(x, y, yaw):
    s = sweep(np.linspace(1.0, 2.0, 9))
    upright = beams.chosen(s, planar((x, y, yaw)), beams.BeamChoice(9)).points
    expected = [compose((x, y, yaw), (r * math.cos(a), r * math.sin(a), 0.0))[:2] for a, r in zip(ANGLES, s.ranges)]
    assert upright == pytest.approx(np.array(expected))
    over = beams.chosen(s, Transform.from_xyz_rpy(x, y, 0.0, math.pi, 0.0, yaw), beams.BeamChoice(9)).points
    expected = [compose((x, y, yaw), (r * math.cos(a), -r * math.sin(a), 0.0))[:2] for a, r in zip(ANGLES, s.ranges)]
    assert over == pytest.approx(np.array(expected))


ANGLES = -1.0 + 0.02 * np.arange(9)


def test_a_scanner_that_leans_is_projected_onto_the_floor_and_one_that_looks_down_is_refused():
    s = sweep(np.full(21, 2.0))
    leaning = beams.chosen(
        s._replace(angle_min=-0.2, angle_max=0.2), Transform.from_xyz_rpy(0, 0, 0, 0.0, 0.5, 0.0), beams.BeamChoice(21)
    ).points
    assert leaning[10] == pytest.approx([2.0 * math.cos(0.5), 0.0], abs=1e-9)
    assert beams.is_level(Transform.from_xyz_rpy(0, 0, 0, math.pi, 0.3, 1.0))
    assert not beams.is_level(Transform.from_xyz_rpy(0, 0, 0, 0.0, math.pi / 2, 0.0))


# Measurement models


def likelihoods(model, map_, pose, poses, **changes):
    config = AmclConfig(laser_model_type=model, laser_max_beams=60, **changes)
    scans = scan_models.ScanModel(config, map_)
    taken = scan(map_, pose, (0.0, 0.0, 0.0))
    return scans.scan(beams.chosen(taken.sweep, taken.mount, scans.choice)).likelihoods(np.array(poses, float))


@pytest.mark.parametrize('model', SCAN_MODELS)
@pytest.mark.parametrize('origin', [(0.0, 0.0, 0.0), (-7.0, 3.0, 2.1)])
def test_a_scan_fits_best_where_it_was_taken(model, origin):
    map_ = world(origin)
    pose = compose(origin, (5.2, 3.1, 0.7))
    aside = [(0.3, 0, 0), (-0.3, 0, 0), (0, 0.3, 0), (0, -0.3, 0), (0, 0, 0.2), (0, 0, -0.2), (0, 0, math.pi)]
    found = likelihoods(model, map_, pose, [pose, *(compose(pose, a) for a in aside)])
    assert found.values[0] > 1.01 * found.values[1:].max() and found.fits[0] > 1.01 * found.fits[1:].max()


def test_the_likelihood_field_is_its_formula():
    """One beam that ends at a known distance from the only wall."""
    cells = np.full((40, 40), FREE, np.uint8)
    cells[:, 30] = 1
    map_ = RangeMap(cells, 0.1, (0.0, 0.0, 0.0))
    c = AmclConfig(laser_z_hit=0.9, laser_z_rand=0.1, laser_sigma_hit=0.3)
    for model, law in (('likelihood_field', lambda p: 1.0 + p**3), ('likelihood_field_prob', None)):
        scans = scan_models.ScanModel(replace(c, laser_model_type=model), map_)
        beam = beams.Beams(0.0, 0.0, np.array([0.0]), np.array([1.0]), 5.0)
        poses = np.array([[x, 2.05, 0.0] for x in (2.05, 1.55, 1.05, 3.55)])  # ends in cells 30, 25, 20, outside
        found = scans.scan(beam).likelihoods(poses)
        p = 0.9 * np.exp(-0.5 * (np.array([0.0, 0.5, 1.0, 2.0]) / 0.3) ** 2) + 0.1 / 5.0
        assert found.values == pytest.approx(law(p) if law else p / p.max())
        best = 0.9 + 0.1 / 5.0
        assert found.fits == pytest.approx((p / best) ** 3 if law else p / best)


def test_the_beam_model_is_its_formula():
    cells = np.full((40, 40), FREE, np.uint8)
    cells[:, 30] = 1
    map_ = RangeMap(cells, 0.1, (0.0, 0.0, 0.0))
    c = AmclConfig(laser_model_type='beam', laser_sigma_hit=0.3, laser_lambda_short=0.5)
    scans = scan_models.ScanModel(c, map_)
    for measured in (1.0, 0.6, 1.4, 5.0):
        beam = beams.Beams(0.5, 0.0, np.array([0.0]), np.array([measured]), 5.0)
        (found,) = scans.scan(beam).likelihoods(np.array([[1.5, 2.05, 0.0]])).values
        off = measured - 1.0
        p = 0.95 * math.exp(-0.5 * (off / 0.3) ** 2)
        p += 0.1 * 0.5 * math.exp(-0.5 * measured) if off < 0 else 0.0
        p += 0.05 if measured == 5.0 else 0.05 / 5.0
        assert found == pytest.approx(1.0 + p**3, rel=1e-6)


@pytest.mark.parametrize('model', SCAN_MODELS)
def test_a_scan_s_likelihood_is_raised_to_a_power(model):
    map_, pose = world(), (5.2, 3.1, 0.7)
    poses = RNG().normal(pose, (0.3, 0.3, 0.2), (200, 3))
    plain = likelihoods(model, map_, pose, poses)
    for power in (0.3, 1.0, 5.0):
        found = likelihoods(model, map_, pose, poses, laser_likelihood_power=power)
        assert (found.fits == plain.fits).all()
        assert found.values / found.values.max() == pytest.approx((plain.values / plain.values.max()) ** power)
    extreme = likelihoods(model, map_, pose, poses, laser_likelihood_power=100.0).values
    assert np.isfinite(extreme).all() and extreme.max() == 1.0


@given(st.integers(0, 2**31))
def test_logarithms_of_many_beams_do_not_underflow(seed):
    logarithms = RNG(seed).uniform(-5000.0, -900.0, 30)
    found = Likelihoods.of_logarithms(logarithms, 500, 0.9)
    assert found.values.max() == 1.0 and np.isfinite(found.values).all() and (found.fits > 0.0).all()


def test_beams_that_the_map_does_not_hold_are_skipped():
    map_, pose = world(), (5.2, 3.1, 0.7)
    scans = scan_models.ScanModel(AmclConfig(laser_model_type='likelihood_field_prob', do_beamskip=True), map_)
    taken = scan(map_, pose, (0.0, 0.0, 0.0))
    taken.sweep.ranges[:20] = 0.4  # somebody stands there, far from any wall
    chosen = beams.chosen(taken.sweep, taken.mount, beams.BeamChoice(90))
    measured = scans.scan(chosen)
    used = measured.used(np.array([pose] * 50))
    assert not used[:20].any() and used[20:].sum() > 65
    apart = np.array([pose, (1.0, 1.0, 0.0)])
    assert measured.used(apart).all(), 'beams are skipped although the particles are apart'
    lost = scan_models.ScanModel(
        AmclConfig(laser_model_type='likelihood_field_prob', do_beamskip=True, beam_skip_error_threshold=0.1), map_
    )
    assert lost.scan(chosen).used(np.array([pose] * 50)).all(), 'most beams are skipped'


# The number of particles, drawing, clusters


@pytest.mark.parametrize('quantile, error', [(0.99, 0.01), (2.326, 0.05)])
@pytest.mark.parametrize('k', [2, 5, 60])
def test_the_number_of_samples_is_fox_s(k, quantile, error):
    x = 1.0 - 2.0 / (9.0 * (k - 1)) + math.sqrt(2.0 / (9.0 * (k - 1))) * quantile
    assert bins.wanted_samples(k, error, quantile) == math.ceil((k - 1) / (2.0 * error) * x**3)
    assert bins.wanted_samples(1, error, quantile) == 0


def test_samples_stop_when_the_filled_bins_have_enough():
    one = np.zeros((500, 3))
    assert bins.enough(one, 100, 0.01, 0.99) == 100
    x = RNG().integers(0, 8, 5000) * 0.5 + 0.25
    poses = np.stack((x, np.zeros(5000), np.zeros(5000)), 1)
    found = bins.enough(poses, 100, 0.01, 0.99)
    filled = len(set(x[:found]))
    assert filled == 8 and found == max(100, bins.wanted_samples(8, 0.01, 0.99))
    assert bins.enough(poses[:200], 100, 0.001, 3.0) == 200


@given(st.integers(0, 2**31), st.floats(-50, 50), st.floats(-50, 50), angles)
def test_bins_do_not_depend_on_where_in_the_world_particles_are(seed, x, y, yaw):
    """Clusters of two heaps stay two, wherever these lie; also across the seam of the yaw."""
    rng = RNG(seed)
    heap = rng.normal(0.0, 0.02, (40, 3))
    poses = np.concatenate((heap + (x, y, yaw), heap + (x + 3.0, y, yaw)))
    poses[:, 2] = wrap(poses[:, 2])
    labels, count = bins.clusters(poses)
    assert count == 2 and len(set(labels[:40])) == 1 == len(set(labels[40:])) and labels[0] != labels[40]


def test_the_mean_and_covariance_of_a_cluster_across_the_seam_of_the_yaw():
    rng = RNG()
    sigma = np.array([0.05, 0.08, 0.06])
    poses = rng.standard_normal((MANY, 3)) * sigma + (2.0, 1.0, math.pi)
    poses[:, 2] = wrap(poses[:, 2])
    weights = np.full(MANY, 1.0 / MANY)
    found = belief.belief(poses, weights)
    assert found.pose[:2] == pytest.approx((2.0, 1.0), abs=0.003)
    assert abs(wrap(found.pose[2] - math.pi)) < 0.003
    assert found.covariance == pytest.approx(np.diag(sigma**2), abs=2e-4)
    assert found.clusters == 1 and found.weight == pytest.approx(1.0)


def test_of_two_clusters_the_heavier_is_the_pose_and_both_are_in_its_covariance():
    heavy, light = np.full((60, 3), (1.0, 1.0, 0.0)), np.full((40, 3), (5.0, 1.0, 3.0))
    poses = np.concatenate((light, heavy))
    found = belief.belief(poses, np.full(100, 0.01))
    assert found.pose == pytest.approx((1.0, 1.0, 0.0)) and found.weight == pytest.approx(0.6)
    assert found.cluster_covariance == pytest.approx(np.zeros((3, 3)), abs=1e-12)
    assert found.covariance[0, 0] == pytest.approx(0.4 * 16.0) and found.covariance[2, 2] == pytest.approx(0.4 * 9.0)


def heap(weights, **changes):
    config = AmclConfig(min_particles=len(weights), max_particles=len(weights), **changes)
    particles = ParticleFilter(config, RNG())
    particles.poses = np.stack((np.arange(len(weights)) * 10.0, np.zeros(len(weights)), np.zeros(len(weights))), 1)
    particles.weights = np.asarray(weights, float) / np.sum(weights)
    return particles


def test_drawing_is_unbiased():
    weights = np.array([1.0, 2.0, 3.0, 4.0] * 10)
    counts = np.zeros(40)
    particles = heap(weights)
    poses, normal = particles.poses, particles.weights
    for _ in range(2000):
        particles.poses, particles.weights = poses, normal
        assert particles.resample(None)
        counts += np.bincount((particles.poses[:, 0] / 10.0).astype(int), minlength=40)
        assert particles.weights == pytest.approx(np.full(40, 1.0 / 40))
    expected = 2000 * 40 * normal
    chi_square = float(((counts - expected) ** 2 / expected).sum())
    assert chi_square < 39 + 4.0 * math.sqrt(2.0 * 39)


def test_of_particles_that_weigh_the_same_none_is_lost_and_the_order_is_random():
    particles = heap([1.0] * 500)
    before = particles.poses.copy()
    particles.resample(None)
    after = particles.poses
    assert sorted(after[:, 0]) == sorted(before[:, 0]) and abs(np.corrcoef(after[:, 0], before[:, 0])[0, 1]) < 0.2


def test_selective_resampling_waits_until_few_particles_count():
    assert not heap([1.0] * 10, selective_resampling=True).resample(None)
    assert heap([1.0] * 10).resample(None)
    assert heap([1.0] + [1e-3] * 9, selective_resampling=True).resample(None)


def test_weights_are_products_that_add_up_to_1():
    particles = heap([1.0, 1.0, 2.0])
    assert particles.weigh(Likelihoods(np.array([3.0, 1.0, 1.0]), np.array([0.3, 0.1, 0.1])))
    assert particles.weights == pytest.approx([0.5, 1.0 / 6.0, 1.0 / 3.0])
    assert particles.slow == particles.fast == pytest.approx(0.5 * 0.3 + 0.5 * 0.1)
    assert not particles.weigh(Likelihoods(np.zeros(3), np.zeros(3)))
    assert particles.weights == pytest.approx([1.0 / 3.0] * 3)


def test_random_particles_come_when_scans_fit_worse_than_they_did():
    particles = heap([1.0] * 1000, recovery_alpha_slow=0.001, recovery_alpha_fast=0.1)
    fits = [0.8] * 20 + [0.2] * 5
    slow = fast = 0.0
    for k, fit in enumerate(fits):
        assert particles.random_share == pytest.approx(0.0) or k > 20
        particles.weigh(Likelihoods(np.ones(1000), np.full(1000, fit)))
        slow, fast = (old + max(a, 1.0 / (k + 1)) * (fit - old) for old, a in ((slow, 0.001), (fast, 0.1)))
    assert particles.random_share == pytest.approx(1.0 - fast / slow) and 0.1 < particles.random_share < 0.5
    share = particles.random_share
    particles.resample(lambda count: np.full((count, 3), -7.0))
    assert np.mean(particles.poses[:, 0] == -7.0) == pytest.approx(share, abs=0.06)


class HalfFits:
    """A measurement that fits poses of x < 50 m by 0.8 and the others by 0.6."""

    def likelihoods(self, poses):
        fits = np.where(poses[:, 0] < 50.0, 0.8, 0.6)
        return Likelihoods(fits, fits)


def test_a_search_draws_by_the_fit_and_keeps_its_share_of_what_there_was():
    rng, count = RNG(3), 4000
    anywhere = lambda number: np.stack((rng.uniform(0.0, 100.0, number), *np.zeros((2, number))), 1)
    better = math.exp(FIRST * 0.8) / (math.exp(FIRST * 0.8) + math.exp(FIRST * 0.6))
    particles = heap([1.0] * count)
    particles.start_where_it_fits(anywhere, HalfFits(), 2 * count)
    assert len(particles.poses) == count and np.mean(particles.poses[:, 0] < 50.0) == pytest.approx(better, abs=0.02)
    particles.poses[:] = (-7.0, 0.0, 0.0)
    particles.search(anywhere, HalfFits(), count, 2 * count)
    old = particles.poses[:, 0] == -7.0
    assert old.mean() == pytest.approx(KEPT, abs=1e-3)
    assert np.mean(particles.poses[~old, 0] < 50.0) == pytest.approx(better, abs=0.03)


@given(st.floats(-5, 5), st.floats(-5, 5), angles, st.integers(0, 2**31))
def test_random_poses_are_on_free_cells(x, y, yaw, seed):
    map_ = world((x, y, yaw))
    free = field.free_cells(map_)
    assert len(free) == np.count_nonzero(plan() == 0)
    for pose in field.random_poses(map_, free, 50, RNG(seed)).tolist():
        place = compose((0.0, 0.0, 0.0), _inverse(map_.origin, pose))
        assert plan()[int(place[1] / CELL), int(place[0] / CELL)] == 0


def _inverse(origin, pose):
    c, s = math.cos(origin[2]), math.sin(origin[2])
    dx, dy = pose[0] - origin[0], pose[1] - origin[1]
    return c * dx + s * dy, c * dy - s * dx, 0.0


def test_the_world_s_rays_end_on_its_walls():
    """Of the test itself: from the middle, straight along x."""
    (found,) = ranges(world(), (5.0, 3.0, 0.0), [0.0])
    assert found == pytest.approx(9.9 - 5.0 - MOUNT[0], abs=1e-6)
