"""amcl's covariance against its errors, for robots that err as its parameters say; and how the part judges that."""

import json
import math

import numpy as np
import pytest

from sara_common.planar import wrap
from sara_lab.campaign import amcl_nees as part
from sara_lab.journeys.travel_cases import MAPS
from sara_lab.studies.amcl_consistency import KINDS, MOST, STEP, FairRobot, fair, simulated
from sara_lab.studies.carried import SCANNER, TOLD
from sara_lab.studies.consistency import QUANTILE, interval
from sara_localization.particles.amcl_config import AmclConfig

DEFAULT, PRODUCT = KINDS['likelihood_field'], KINDS['likelihood_field_prob']


def robot(by_field=False, number=0, **parameters):
    return FairRobot('flat', number, AmclConfig.from_params(parameters), by_field)


def last(kind, numbers, steps):
    return float(np.mean([fair(kind, 'hall', number, steps)[-1] for number in numbers]))


def test_the_default_law_is_not_too_sure_and_the_product_of_all_beams_is():
    high = interval(3, 12)[1]
    assert 0.3 < last(DEFAULT, range(12), 16) < high < last(PRODUCT, range(12), 16)


def test_a_world_as_the_law_has_it_and_particles_enough_are_consistent():
    low, high = interval(3, 10)
    assert low < last(KINDS['drawn_by_field'], range(10), 10) < high


def test_a_number_is_a_drive():
    assert fair(DEFAULT, 'flat', 3, 6) == fair(DEFAULT, 'flat', 3, 6) != fair(DEFAULT, 'flat', 4, 6)
    assert max(fair(PRODUCT, 'hall', 0, 20)) <= MOST


def test_its_way_leads_on_and_its_odometry_errs_by_the_alphas():
    exact = robot(**{f'odom_alpha{k}': 0.0 for k in range(1, 5)})
    first = exact.pose[2]
    for _ in range(60):
        before, odometry = exact.pose, exact.odometry
        exact.move()
        assert math.dist(exact.pose[:2], before[:2]) == pytest.approx(STEP)
        assert math.dist(exact.odometry[:2], odometry[:2]) == pytest.approx(STEP)
        assert exact._world.has_room(*exact.pose.tolist(), 0.3, 0.3)
    assert abs(wrap(exact.pose[2] - first - exact.odometry[2])) < 1e-6
    far = robot(odom_alpha3=2.0)
    ways = []
    for _ in range(40):
        before = far.pose
        far.move()
        ways.append(math.dist(far.pose[:2], before[:2]) - STEP)
    assert np.std(ways) == pytest.approx(2.0 * STEP**2, rel=0.3)


def test_where_it_starts_is_drawn_by_what_amcl_is_told():
    off = np.array([one.pose - one.told for one in (robot(number=number) for number in range(60))])
    assert off.std(0) / TOLD == pytest.approx([1.0, 1.0, 1.0], abs=0.25)


def test_its_ranges_err_by_the_parameters():
    one = robot(laser_sigma_hit=0.05, laser_z_hit=1.0, laser_z_rand=0.0)
    x, y, yaw = one.pose.tolist()
    rays = np.column_stack((np.full(201, x), np.full(201, y), yaw + SCANNER.optics.angles))
    walls = one._world.laser(rays, SCANNER.range_max)
    assert np.std(one._about_walls(rays) - walls) == pytest.approx(0.05, rel=0.2)
    silent = robot(laser_model_type='beam', laser_z_hit=0.5, laser_z_max=0.5, laser_z_short=0.0, laser_z_rand=0.0)
    assert np.mean(np.isinf(silent._about_walls(rays))) == pytest.approx(0.5, abs=0.15)
    short = robot(laser_model_type='beam', laser_z_hit=1e-9, laser_z_max=0.0, laser_z_short=1.0, laser_z_rand=1e-9)
    assert (short._about_walls(rays) < walls).all()
    off = robot(laser_z_hit=1e-9, laser_z_rand=1.0)._about_walls(rays)
    assert np.median(off) == pytest.approx(0.5 * SCANNER.range_max, rel=0.2)


def test_a_scan_by_the_field_ends_near_walls():
    one = robot(by_field=True, laser_sigma_hit=0.1, laser_z_hit=1.0, laser_z_rand=0.0)
    sweep = one.sweep(3.0)
    assert sweep.stamp == 3.0 and not sweep.fault and np.isfinite(sweep.ranges).all()
    field = one._field
    x, y, yaw = one.pose.tolist()
    angles = yaw + SCANNER.optics.angles
    ends = np.stack(
        (
            x + SCANNER.x * math.cos(yaw) + sweep.ranges * np.cos(angles),
            y + SCANNER.x * math.sin(yaw) + sweep.ranges * np.sin(angles),
        ),
        1,
    )
    cells = np.floor((ends - (field.place.x, field.place.y)) / field.place.resolution).astype(int)
    assert field.place.resolution * np.sqrt(field.squares[cells[:, 1], cells[:, 0]]).max() < 0.5


def test_the_simulated_robot_errs_less_than_amcl_is_told():
    found = simulated(DEFAULT, 'hall', 0)
    assert np.mean(found) < 1.5 and max(found) < QUANTILE


def result(kind, name, *values):
    return part._result(kind, name, values)


def test_the_part_names_what_is_too_sure():
    kinds = (part.RIGHT, *part.NOT_TOO_SURE)
    good = [result(kind, name, 2.0, 3.0) for kind in kinds for name in MAPS for _ in range(10)]
    lines, figures = part._summary(good)
    assert len(lines) == 28 and part._verdict(figures) == []
    assert figures['beam_all']['mean'] == 3.0 and figures['beam_all']['runs'] == 30
    assert figures['beam_hall']['median'] == 2.5 and figures['beam_hall']['within'] == 1.0
    bad = [result(r['kind'], r['map'], 2.0, 9.0) if r['kind'] == 'beam' else r for r in good]
    sentences = part._verdict(part._summary(bad)[1])
    assert sentences == [
        'beam: mean NEES 9.00, allowed is up to 3.94',
        'beam: 50.0% of the poses are as right as they claim, 95% are asked for',
    ]
    timid = [result(r['kind'], r['map'], 2.0, 1.0) if r['kind'] == part.RIGHT else r for r in good]
    assert part._verdict(part._summary(timid)[1]) == [f'{part.RIGHT}: mean NEES 1.00, allowed are 2.19 to 3.94']


def test_a_result_is_plain_data():
    kept = result('beam', 'flat', 0.12345, MOST)
    assert json.loads(json.dumps(kept)) == kept and kept['nees'] == [0.123, MOST]
