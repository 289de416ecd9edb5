"""A filter in the C++ amcl's tests: it is given odometry and scans of one time, told what the test tells, and judged by
the test's own tolerance.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from sara_common.planar import compose
from sara_lab.campaign import amcl as part
from sara_lab.studies import amcl_trial
from sara_lab.studies.amcl_drives import AMCL_TESTS, Told
from sara_localization.geometry.rigid import Transform
from sara_localization.particles.amcl import Result
from sara_sim.robot.script import Go

SHORT = replace(
    AMCL_TESTS['rosie_multilaser'],
    start=(45.0, 18.7, 0.0),
    told=(Told((45.0, 18.7, 0.0)),),
    target=(46.5, 18.7, 0.0),
    motions=(Go(3.0, v=0.5),),
    seconds=6.0,
)


class Knowing:
    """In the place of Amcl: its map -> odom is the true one, or what `off` (x, y, yaw) makes of it."""

    off = (0.0, 0.0, 0.0)

    def __init__(self, config):
        self.config, self.told, self.scans, self.anywhere = config, [], [], 0

    def set_map(self, world_map):
        return '' if world_map.cells.size else 'no cells'

    def set_pose(self, pose, covariance):
        self.told.append((pose, np.diag(covariance)))

    def start_anywhere(self):
        self.anywhere += 1

    def on_scan(self, scan):
        self.scans.append(scan)
        x, y, yaw = compose((45.0, 18.7, 0.0), self.off)
        return Result(Transform.from_xyz_rpy(x, y, 0.0, 0.0, 0.0, yaw), True, None)


@pytest.fixture
def knowing(monkeypatch):
    made = []

    def make(config):
        made.append(Knowing(config))
        return made[-1]

    monkeypatch.setattr(amcl_trial, 'Amcl', make)
    monkeypatch.setattr(Knowing, 'off', Knowing.off)
    return made


EXACT = replace(
    SHORT,
    robot=replace(SHORT.robot, odom_error=(0.0, 0.0), odom_noise=(0.0, 0.0, 0.0, 0.0), scanners=SHORT.robot.scanners),
)


def tried(test, seed=0):
    return amcl_trial.trial(test, *amcl_trial.maps(), seed)


def test_who_knows_the_way_passes(knowing):
    found = tried(EXACT)
    assert found['faults'] == [] and found['true'] < 1e-6 and found['known_from'] == pytest.approx(0.05)
    assert found['x'] < 0.1 and found['y'] < 0.01 and found['yaw'] < 0.01
    assert knowing[0].config.laser_max_beams == 30 and knowing[0].config.odom_model_type == 'omni'
    assert knowing[0].anywhere == 0 and len(knowing[0].told) == 1


@pytest.mark.parametrize(('off', 'name'), [((0.9, 0.0, 0.0), 'x'), ((0.0, -0.8, 0.0), 'y'), ((0.0, 0.0, 0.5), 'yaw')])
def test_an_estimate_beyond_the_tolerance_is_named(knowing, monkeypatch, off, name):
    monkeypatch.setattr(Knowing, 'off', off)
    found = tried(EXACT)
    assert [fault.split()[0] for fault in found['faults']][0] == name and found['known_from'] is None


def test_each_scan_comes_with_the_odometry_of_its_time_and_its_own_mount(knowing):
    test = replace(
        EXACT, robot=replace(EXACT.robot, scanners=tuple(replace(s, sweep=0.04) for s in EXACT.robot.scanners))
    )
    tried(test)
    scans = knowing[0].scans
    assert {scan.frame for scan in scans} == {'laser_0', 'laser_1'}
    for scan in scans:
        assert scan.mount.translation[0] == pytest.approx(0.05 if scan.frame == 'laser_0' else -0.2)
        way = scan.odometry.translation[0]
        steady = scan.sweep.stamp - 1.5  # 0.5 m/s from 1.5 s on, 1 m/s2 before
        if 1.5 <= scan.sweep.stamp <= 3.9:
            assert way == pytest.approx(0.125 + 0.5 * steady, abs=0.01)


def test_a_test_without_a_start_searches_everywhere(knowing):
    tried(replace(EXACT, told=()))
    assert knowing[0].anywhere == 1 and knowing[0].told == []


def test_a_late_pose_is_moved_on_by_the_odometry_since_its_stamp(knowing):
    late = Told((10.0, 5.0, math.pi / 2), at=5.0, stamp=0.2, variances=(0.1, 0.2, 0.3))
    tried(replace(EXACT, told=(*EXACT.told, late)))
    (first, _), (moved, variances) = knowing[0].told
    assert first == (45.0, 18.7, 0.0)
    assert moved == pytest.approx((10.0, 6.5, math.pi / 2), abs=0.02)
    assert variances == pytest.approx((0.1, 0.2, 0.3))


def test_the_part_counts_and_asks_for_all_but_two_in_a_hundred_of_the_global_start():
    def result(name, seed, faults=()):
        known = None if faults else 2.0 + 0.01 * seed
        off = {'x': 0.1, 'y': 0.1, 'yaw': 0.1, 'true': 0.1}
        return {'test': name, 'seed': seed, **off, 'known_from': known, 'faults': list(faults)}

    good = [result(name, seed) for name in AMCL_TESTS for seed in range(100)]
    lines, figures = part._summary(good)
    assert len(lines) == 12 and part._verdict(figures) == []
    assert [name for name, row in figures.items() if 'known_from_s' in row] == ['global_localization_stage']
    assert sum('known after 2.495 s, p95 2.941, worst 2.990' in line for line in lines) == 1
    for name, bad, met in (
        ('global_localization_stage', 2, True),
        ('global_localization_stage', 3, False),
        ('small_loop_prf', 1, False),
    ):
        results = [r for r in good if r['test'] != name or r['seed'] >= bad] + [
            result(name, s, ['x']) for s in range(bad)
        ]
        found = part._verdict(part._summary(results)[1])
        assert (found == []) == met and all(name in sentence for sentence in found)


def test_a_filter_without_an_estimate_fails(knowing, monkeypatch):
    monkeypatch.setattr(Knowing, 'on_scan', lambda self, scan: None)
    found = tried(EXACT)
    assert found['faults'] == ['there is no estimate']
    lines, figures = part._summary([found])
    assert figures['rosie_multilaser']['passed'] == 0 and part._verdict(figures)


def test_our_amcl_finds_rosie(knowing, monkeypatch):
    monkeypatch.undo()
    assert tried(SHORT, seed=1)['faults'] == []
