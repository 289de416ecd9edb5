"""The square in lockstep: it meets its acceptance for two chairs (the campaign: three), and a seed says everything."""

import json
import math

import numpy as np
import pytest
from steady import whole

from sara_bringup.lockstep.localization import Filter
from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.missions.drive import Drive
from sara_bringup.missions.mission import MissionError, load_mission
from sara_bringup.missions.report import figures, table, verdict
from sara_bringup.paths import config_file, share
from sara_common.platforms import chosen
from sara_lab.experiments.missions import run
from sara_lab.journeys.squares import square

SEEDS = range(whole(3, 2))
GOALS = len(load_mission(config_file('square.yaml')).goals)


@pytest.fixture(scope='module')
def drives():
    return {seed: run('square', seed)[0] for seed in SEEDS}


@pytest.mark.parametrize('seed', SEEDS)
def test_square_meets_its_acceptance(drives, seed):
    assert verdict(drives[seed], GOALS) == []


def test_same_seed_same_drive_to_the_last_digit(drives):
    again, _ = run('square', 1)
    assert json.dumps(again.to_json()) == json.dumps(drives[1].to_json())
    assert again.samples == drives[1].samples


def test_another_seed_another_drive(drives):
    assert drives[0].to_json()['corners'] != drives[1].to_json()['corners']


def test_thesis_set_loses_the_square_and_the_verdict_says_so():
    drive, _ = run('square', 0, 'thesis')
    assert any('true position' in fault for fault in verdict(drive, GOALS))


def test_json_has_what_it_promises(drives):
    data = drives[0].to_json()
    assert {'experiment', 'seed', 'sim_time_s', 'contacts', 'corners'} <= set(data)
    assert [set(corner) >= {'asked', 'true', 'estimated', 'odometry'} for corner in data['corners']] == [True] * GOALS
    assert data['corners'][0]['asked'] == [5.0, 1.0, 90.0]


def test_file_round_trip(drives):
    drive = drives[0]
    again = Drive.from_file_data(json.loads(json.dumps(drive.to_file_data())))
    assert again.to_json() == drive.to_json()


def test_table_and_figures(drives, tmp_path):
    assert table(drives[0]).count('\n') == GOALS + 3
    figures(drives[0], tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {'square_default_paths.png', 'square_default_yaw.png'}


def test_verdict_finds_each_fault():
    drive = Drive('square', 0, (0.0, 0.0, 0.0))
    drive.add_sample(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    drive.add_sample(1.0, (1.0, 0.0, 0.5), (1.0, 0.0, 0.0), (1.0, 0.0, 0.5))
    drive.add_corner((5.0, 1.0, math.pi), False, 'blocked')
    drive.contacts = 2
    faults = ' '.join(verdict(drive, GOALS))
    for word in ('1 of 4', 'not reached: blocked', 'true position', 'true yaw', 'fused yaw', 'odometry', '2 contacts'):
        assert word in faults


@pytest.mark.parametrize(
    'content',
    (
        'start: [0, 0, 0]',
        '{start: [0, 0, 0], corners: [[1, 2]], leg_timeout_s: 1}',
        '{start: [0, 0, 0], corners: [], leg_timeout_s: 1}',
        '{start: [.nan, 0, 0], corners: [[1, 2, 3]], leg_timeout_s: 1}',
        '{start: [0, 0, 0], corners: 7, leg_timeout_s: 1}',
        '{start: [0, 0, 0], corners: [[1, 2, 3]], leg_timeout_s: soon}',
        '{start: [0, 0, 0], corners: [[1, 2, 3]], leg_timeout_s: 0}',
        'a sentence',
        '',
        '{',
    ),
)
def test_bad_mission_is_refused_by_name(tmp_path, content):
    path = tmp_path / 'mission.yaml'
    path.write_text(content)
    with pytest.raises(MissionError, match='mission.yaml'):
        load_mission(path)


def test_a_mission_that_is_not_there_is_named(tmp_path):
    with pytest.raises(MissionError, match='nowhere.yaml cannot be read'):
        load_mission(tmp_path / 'nowhere.yaml')


def test_a_chair_drives_with_the_gain_that_was_found_for_it():
    its_own = chosen().parameters('read')['default_gain']
    lockstep = Lockstep(share() / 'maps' / 'room.yaml', (1.0, 1.0, 0.0), 0, gain=1.09)
    assert lockstep.reader.gain == 1.09
    assert Lockstep(share() / 'maps' / 'room.yaml', (1.0, 1.0, 0.0), 0).reader.gain == its_own


def test_filterpys_filter_drives_the_same_square():
    def prepare(lockstep):
        variances = lockstep.reader.config.variances
        lockstep.localization = Filter((1.0, 1.0, 0.0), 'ekf', 'default', variances, backend='filterpy')

    compiled, _ = square('left', 'fused', 0)
    driven, _ = square('left', 'fused', 0, prepare=prepare)
    assert verdict(driven, GOALS) == []
    np.testing.assert_allclose([s[1] for s in driven.samples], [s[1] for s in compiled.samples], atol=1e-6)
