"""The probability of being lost: what raises it, what lowers it, and that amcl finds its place again by it."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).resolve().parent))
from amcl_world import drifting, error, loop, planar, scan, world  # noqa: E402

from sara_common.planar import compose, inverse  # noqa: E402
from sara_localization.particles.amcl import Amcl  # noqa: E402
from sara_localization.particles.amcl_config import AmclConfig  # noqa: E402
from sara_localization.particles.amcl_status import Heard, statuses  # noqa: E402
from sara_localization.particles.lost import LAW, Agreement, Evidence, LostFilter, log_ratio, outside  # noqa: E402

MAP = world()
FITS, AMONG_PEOPLE = Agreement(28, 1, 1, 0), Agreement(20, 0, 10, 0)
THROUGH_WALLS = Agreement(12, 3, 5, 10)
NOTHING = Agreement(0, 0, 0, 0)


def after(*measurements, start=0.5, away=0.0, moved=True):
    lost = LostFilter()
    lost.start(start)
    for agreement in measurements:
        lost.update(Evidence(agreement, away, moved))
    return lost.probability


def test_scans_that_agree_lower_it_and_scans_through_walls_raise_it():
    assert after(*[FITS] * 10) < 0.02
    assert after(*[FITS] * 10, *[THROUGH_WALLS] * 3) > 0.9
    assert after(*[THROUGH_WALLS] * 5, *[FITS] * 10) < 0.05


def test_people_do_not_look_like_being_lost():
    assert after(*[FITS] * 10, *[AMONG_PEOPLE] * 25) < 0.5
    assert log_ratio(AMONG_PEOPLE, *LAW[:2]) < 0.3 * log_ratio(THROUGH_WALLS, *LAW[:2])


def test_no_readings_say_nothing_but_trust_fades():
    assert log_ratio(NOTHING, *LAW[:2]) == 0.0
    assert after(*[FITS] * 10) < after(*[FITS] * 10, *[NOTHING] * 50) < 0.2


def test_the_same_scan_again_at_rest_says_less():
    assert after(FITS) < after(FITS, moved=False) < 0.5


def test_a_rival_place_keeps_it_in_doubt():
    assert after(*[FITS] * 20, away=0.5) == pytest.approx(0.5, abs=0.02)
    assert after(*[FITS] * 20, away=1.0) > 0.99


@pytest.mark.parametrize('start', [0.0, 1.0])
@pytest.mark.parametrize('away', [0.0, 1.0])
def test_it_stays_a_probability(start, away):
    for agreement in (NOTHING, Agreement(10**6, 0, 0, 0), Agreement(0, 0, 0, 10**6)):
        assert 0.0 <= after(*[agreement] * 100, start=start, away=away) <= 1.0


def test_outside_counts_places_and_headings_by_weight():
    poses = np.array([(0.0, 0.0, 3.1), (0.4, 0.0, -3.1), (0.6, 0.0, 3.1), (0.0, 0.0, 2.0)])
    assert outside((0.0, 0.0, 3.1), poses, np.array([0.1, 0.2, 0.3, 0.4])) == pytest.approx(0.7)


def carried_away(seed, **changes):
    """amcl, its probabilities before and after a robot is carried by 5 m, and the error (m) at the end."""
    path = loop(250)
    before, later = path[:40], path[90:]
    amcl = Amcl(AmclConfig(max_particles=5000, min_particles=500, laser_max_beams=30, seed=seed, **changes))
    amcl.set_map(MAP)
    amcl.set_pose(before[0], np.diag(np.square((0.1, 0.1, 0.1))))
    rng = np.random.default_rng(seed)
    said = [[], []]
    odometry = list(drifting(before, rng))
    moves = list(drifting(later, rng))
    odometry += [compose(odometry[-1], compose(inverse(moves[0]), move)) for move in moves]
    for k, (truth, moved) in enumerate(zip(before + later, odometry)):
        result = amcl.on_scan(scan(MAP, truth, moved, rng, count=60))
        said[k >= len(before)].append(amcl.lost.probability)
    end = result.map_from_odom @ planar(moved)
    return amcl, said, error((*end.translation[:2], end.yaw), path[-1])[0]


@pytest.mark.parametrize('seed', range(2))
def test_amcl_notices_that_it_was_carried_away_and_finds_its_place_again(seed):
    amcl, (before, later), off = carried_away(seed)
    assert max(before[10:]) < 0.2 and max(later[:30]) > 0.9
    assert off < 0.25 and later[-1] < 0.2 and amcl.counts['searches'] >= 1


def test_without_recovery_it_says_so_and_keeps_its_particles():
    amcl, (_, later), _ = carried_away(0, lost_recovery=False)
    assert max(later) > 0.9 and not amcl.counts['searches']
    amcl.lost.start(1.0)
    assert statuses(amcl, 1.0, Heard(0.5, 0.0, '/scan'))[0].message.startswith('lost: the pose is wrong')


def test_a_told_pose_is_in_doubt_and_any_place_is_lost():
    amcl = Amcl(AmclConfig())
    assert amcl.lost.probability == 1.0
    amcl.set_map(MAP)
    amcl.set_pose((5.0, 3.0, 0.0), np.diag((0.01, 0.01, 0.01)))
    assert amcl.lost.probability == 0.5
    amcl.on_scan(scan(MAP, (5.0, 3.0, 0.0), (0.0, 0.0, 0.0)))
    assert amcl.lost.probability < 0.2
    amcl.start_anywhere()
    assert amcl.lost.probability == 1.0


def test_while_lost_a_scan_counts_every_second_at_rest():
    amcl = Amcl(AmclConfig(lost_recovery=False))
    amcl.set_map(MAP)
    at_rest = lambda stamp: amcl.on_scan(scan(MAP, (5.0, 3.0, 0.0), (0.0, 0.0, 0.0), stamp=stamp)).counted
    assert at_rest(1.0) and not at_rest(3.0)
    amcl.lost.start(0.99)
    assert not at_rest(1.5) and at_rest(2.5)
