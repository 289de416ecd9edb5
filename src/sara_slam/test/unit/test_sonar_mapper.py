"""The map builder with ultrasonic sensors in service: odometry that begins anew, journals, parameters."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import sonar_world
import yaml

from sara_common.config import ConfigError
from sara_common.planar import compose, inverse
from sara_slam.mapping.journal import Journal, JournalError
from sara_slam.sonar.mapper import SILENT_S, MapperError, SonarMapper
from sara_slam.sonar.node_config import SonarNodeConfig
from sara_slam.sonar.sonar_config import SonarConfig

TRUE = sonar_world.way()
PART = 200
MOVED = (3.0, -2.0, 1.0)


def heard(mapper, begin, end, odometry_in=(0.0, 0.0, 0.0), later=0.0):
    """Let a mapper hear a part of the way, without noise; odometry_in: (x, y, yaw) of the way's frame in the
    odometry's; later: s on its clock.
    """
    for number in range(begin, end):
        stamp = sonar_world.TICK * number + later
        pose = TRUE[number].tolist()
        mapper.on_pose(stamp, compose(odometry_in, pose))
        for name, mount in sonar_world.MOUNTS.items():
            mapper.on_range(stamp + sonar_world.DELAY, name, mount, sonar_world.heard(compose(pose, mount)))


def map_bytes(mapper):
    return mapper.snapshot().map().data.tobytes()


def in_map(mapper, number):
    """Where the map builder has the robot at a place of the way, whose frame is the odometry's."""
    return compose(mapper.map_from_odom, tuple(TRUE[number].tolist()))


def test_a_map_is_gone_on_with_as_if_nothing_had_been(tmp_path):
    whole = SonarMapper(SonarConfig())
    heard(whole, 0, 2 * PART)
    heard(SonarMapper(SonarConfig(), journal=Journal(tmp_path / 'state')), 0, PART + 15)  # a second is not written yet
    again = SonarMapper(SonarConfig(), journal=Journal(tmp_path / 'state'))
    assert len(again.slam.nodes) > 0.8 * PART * sonar_world.STEP / 0.15
    heard(again, PART + 15, 2 * PART)
    assert math.dist(in_map(again, 2 * PART - 1)[:2], in_map(whole, 2 * PART - 1)[:2]) < 0.05
    assert again.counts['joined'] == 0


def test_what_was_written_makes_the_same_map(tmp_path):
    mapper = SonarMapper(SonarConfig(), journal=Journal(tmp_path / 'state'))
    heard(mapper, 0, PART)
    mapper._keep()
    assert map_bytes(SonarMapper(SonarConfig(), journal=Journal(tmp_path / 'state'))) == map_bytes(mapper)


@pytest.mark.parametrize('later', [-15.0, 0.0, SILENT_S + 1000.0])
def test_where_the_odometry_begins_anew_the_robot_stands_where_it_stopped(later):
    said = []
    mapper = SonarMapper(SonarConfig(), said.append)
    heard(mapper, 0, PART)
    heard(mapper, PART, 2 * PART, compose(MOVED, inverse(tuple(TRUE[PART].tolist()))), later)
    assert mapper.counts['joined'] == 1
    assert len(said) == 1
    there = compose(mapper.map_from_odom, compose(MOVED, inverse(tuple(TRUE[PART].tolist()))))
    true = compose(inverse(tuple(TRUE[0].tolist())), tuple(TRUE[2 * PART - 1].tolist()))
    assert math.dist(compose(there, tuple(TRUE[2 * PART - 1].tolist()))[:2], true[:2]) < 0.12


def test_a_map_gone_on_with_has_no_pose_until_the_odometry_tells_whether_it_began_anew(tmp_path):
    heard(SonarMapper(SonarConfig(), journal=Journal(tmp_path / 'state')), 0, PART)
    again = SonarMapper(SonarConfig(), journal=Journal(tmp_path / 'state'))
    stopped = compose(again.slam.map_from_odom, again._last[1])
    assert again.map_from_odom is None
    again.on_range(5000.0, 'front', (0.5, 0.1, 0.0), 1.0)
    again.on_pose(math.nan, (0.0, 0.0, 0.0))
    assert again.map_from_odom is None
    again.on_pose(5000.0, (0.0, 0.0, 0.0))
    assert again.counts['joined'] == 1 and again.map_from_odom == pytest.approx(stopped)


def test_the_pose_goes_on_from_what_was_solved():
    mapper = SonarMapper(SonarConfig())
    heard(mapper, 0, PART)
    solved = mapper.snapshot().solved()
    mapper.settle(solved)
    node = len(solved.poses) - 1
    moved = compose(inverse(mapper.slam.nodes[node]), mapper.slam._here)
    assert math.dist(in_map(mapper, PART - 1)[:2], compose(tuple(solved.poses[node].tolist()), moved)[:2]) < 0.06


def test_what_is_no_pose_and_no_range_is_counted_and_not_written(tmp_path):
    mapper = SonarMapper(SonarConfig(), journal=Journal(tmp_path / 'state'))
    heard(mapper, 0, 20)
    mapper.on_pose(math.nan, (0.0, 0.0, 0.0))
    mapper.on_pose(3.0, (math.inf, 0.0, 0.0))
    mapper.on_range(3.0, 'front', (0.5, 0.1, 0.0), math.nan)
    assert (mapper.counts['bad_pose'], mapper.counts['bad_range']) == (2, 1)
    mapper._keep()
    for record in Journal(tmp_path / 'state').records:
        assert np.isfinite(record.arrays['poses']).all()
        assert not np.isnan(record.arrays['ranges']).any()


def test_readings_without_odometry_are_dropped_and_counted():
    mapper = SonarMapper(SonarConfig())
    for number in range(3000):
        mapper.on_range(0.1 * number, 'front', (0.5, 0.1, 0.0), 1.0)
    assert mapper.counts['no_pose'] == 2000
    assert len(mapper._ranges) == 1000


def test_a_full_disk_is_told_and_the_map_goes_on(tmp_path):
    said = []
    journal = Journal(tmp_path / 'state')
    journal._file = open('/dev/full', 'wb', buffering=0)  # noqa: SIM115
    mapper = SonarMapper(SonarConfig(), said.append, journal)
    heard(mapper, 0, 40)
    assert mapper.counts['not_kept'] == 1
    assert 'cannot be written' in said[0]
    assert len(mapper.slam.kept) > 100


def test_a_damaged_end_is_cut_off(tmp_path):
    path = tmp_path / 'state'
    heard(SonarMapper(SonarConfig(), journal=Journal(path)), 0, 60)
    content = path.read_bytes()
    path.write_bytes(content[:-7])
    cut = SonarMapper(SonarConfig(), journal=Journal(path))
    assert 0 < len(cut.slam.kept) < 60 * len(sonar_world.MOUNTS)
    assert len(path.read_bytes()) < len(content) - 7


def test_a_journal_of_something_else_is_refused(tmp_path):
    (tmp_path / 'text').write_text('resolution: 0.05\n')
    with pytest.raises(JournalError, match='something else'):
        Journal(tmp_path / 'text')
    journal = Journal(tmp_path / 'scans')
    journal.append('loop', {'first': np.zeros(1)})
    with pytest.raises(MapperError, match='not made by ultrasonic sensors'):
        SonarMapper(SonarConfig(), journal=Journal(tmp_path / 'scans'))


def test_entropy_grows_without_walls():
    mapper = SonarMapper(SonarConfig())
    assert mapper.entropy == -math.inf
    values = []
    for number in range(60):
        mapper.on_pose(0.1 * number, (0.04 * number, 0.0, 0.02 * number))
        mapper.on_range(0.1 * number + 0.3, 'front', (0.5, 0.1, 0.0), math.inf)
        if number in (20, 59):
            values.append(mapper.entropy)
    assert values[0] < values[1]


def test_parameters_have_the_defaults_that_the_file_explains():
    params = yaml.safe_load((Path(__file__).resolve().parents[2] / 'config' / 'slam_sonar.yaml').read_text())
    config = SonarNodeConfig.from_params({**params, 'range_topics': ['a', 'b']})
    assert config.range_topics == ('a', 'b')
    assert not config.warnings
    bare = SonarNodeConfig.from_params({'range_topics': ['a', 'b']})
    assert config.delay == bare.delay == 0.05
    for name in SonarConfig.__dataclass_fields__:
        assert getattr(config.model, name) == pytest.approx(getattr(bare.model, name), rel=4e-3), name
        assert name in params


@pytest.mark.parametrize(
    ('params', 'sentence'),
    [
        ({}, 'range_topics is .*allowed is a list of one topic or more'),
        ({'range_topics': ['a', 'a']}, 'each once'),
        ({'range_topics': ['a'], 'resolution': 0.0}, 'resolution is 0'),
        ({'range_topics': ['a'], 'field_of_view': 4.0}, 'field_of_view is 4'),
        ({'range_topics': ['a'], 'range_min_range': 3.0}, 'range_min_range is 3, allowed is less than'),
        ({'range_topics': ['a'], 'map_frame': 'odom'}, 'must differ'),
        ({'range_topics': ['a'], 'tf_delay': 'soon'}, 'tf_delay is'),
        ({'range_topics': ['a'], 'body_width': -1.0}, 'body_width is -1'),
    ],
)
def test_bad_parameters_are_refused_in_words(params, sentence):
    with pytest.raises(ConfigError) as refused:
        SonarNodeConfig.from_params(params)
    assert any(re.search(sentence, fault) for fault in refused.value.faults), refused.value.faults


def test_what_is_no_parameter_is_told():
    config = SonarNodeConfig.from_params({'range_topics': ['a'], 'particles': 30})
    assert config.warnings == ('particles is no parameter of slam_sonar: ignored.',)


@pytest.mark.parametrize('ahead', [3600.0, 15.0])
def test_a_sensor_whose_clock_is_ahead_costs_the_others_nothing(ahead):
    kept = []
    for name in (None, 'right'):
        mapper = SonarMapper(SonarConfig())
        for number in range(1, 1500):
            mapper.on_pose(0.05 * number, (0.01 * number, 0.0, 0.0))
            mapper.on_range(0.05 * number - 0.02, 'left', (0.2, 0.3, math.pi / 2), 0.5)
            if name and (number == 100 or ahead < 100.0):
                mapper.on_range(0.05 * number + ahead, name, (0.2, -0.3, -math.pi / 2), 0.5)
        kept.append(len(mapper.slam.kept))
    assert kept[0] == kept[1] > 1000


def test_of_a_robot_that_stands_no_more_is_kept_than_says_something_new():
    """It would be a gigabyte in some hours."""
    kept = []
    for minutes in (2, 4):
        mapper = SonarMapper(SonarConfig())
        for number in range(1, 600 * minutes):
            way = min(0.02 * number, 1.0)
            mapper.on_pose(0.1 * number, (way, 0.0, 0.0))
            mapper.on_range(0.1 * number - 0.05, 'left', (0.2, 0.3, math.pi / 2), 0.5)
        kept.append(len(mapper.slam.kept))
    assert kept[0] == kept[1] < 500
