"""A map is gone on with after the program was killed: nothing that was written is lost, and the robot finds itself."""

import math
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from slam_world import LAP, drifting, ranges, round_trip, scan, world

from sara_common.planar import compose, inverse
from sara_slam.mapping import journal as journals
from sara_slam.mapping.journal import Journal, JournalError
from sara_slam.mapping.slam import Slam
from sara_slam.mapping.slam_config import SlamConfig

MAP = world()
CONFIG = SlamConfig(loop_reach=2.0)
WAY = LAP + 5.0


def drive(slam, first, last, seed=0, begin=(0.0, 0.0, 0.0)):
    """Scans of the round trip; the odometry begins at another pose. Returns the true path."""
    path, rng = round_trip(WAY), np.random.default_rng(seed)
    odometry = drifting(path)
    moved = compose(begin, inverse(odometry[first]))
    for k in range(first, min(last, len(path))):
        slam.on_scan(scan(ranges(MAP, path[k], rng), compose(moved, odometry[k]), 1.0 + 2.0 * k))
    return path


@pytest.fixture(scope='module')
def whole(tmp_path_factory):
    """(a Slam after the whole round trip, its journal's file)."""
    path = tmp_path_factory.mktemp('journal') / 'state.slam'
    slam = Slam(CONFIG, journal=Journal(path))
    drive(slam, 0, 10_000)
    return slam, path


@pytest.mark.parametrize('every', [1, 1000])
def test_the_graph_comes_back_as_it_was(whole, tmp_path, monkeypatch, every):
    monkeypatch.setattr(journals, 'POSES_EVERY', every)
    path = tmp_path / 'state'
    slam = Slam(CONFIG, journal=Journal(path))
    drive(slam, 0, 10_000)
    again = Slam(CONFIG, journal=Journal(path))
    assert slam.counts['optimised'] >= 3
    assert np.array(again.poses) == pytest.approx(np.array(slam.poses), abs=1e-6)
    assert len(again.graph.edges) == len(slam.graph.edges)
    assert again.map().data.tobytes() == slam.map().data.tobytes()
    assert again.map_from_odom is None and again._postponed == slam._postponed


@pytest.mark.parametrize('begin', [(0.0, 0.0, 0.0), (5.0, -3.0, 2.0)])
def test_the_robot_finds_itself_and_the_map_goes_on(tmp_path, begin):
    path = tmp_path / 'state'
    drive(Slam(CONFIG, journal=Journal(path)), 0, 40)
    slam = Slam(CONFIG, journal=Journal(path))
    true = drive(slam, 46, 10_000, seed=1, begin=begin)  # 1.8 m on, and the odometry anew
    assert slam.map_from_odom is not None and len(slam.poses) == len(true) - 6
    start = compose(true[0], inverse(slam.poses[0]))
    off = [math.dist(compose(start, pose)[:2], there[:2]) for pose, there in zip(slam.poses, true[:40] + true[46:])]
    assert max(off) < 0.12 and slam.counts['not_found'] == 0


def test_where_nothing_fits_it_waits_and_tells(tmp_path):
    path, said = tmp_path / 'state', []
    drive(Slam(CONFIG, journal=Journal(path)), 0, 20)
    slam = Slam(CONFIG, said.append, Journal(path))
    rng = np.random.default_rng(5)
    for k in range(4):
        result = slam.on_scan(scan(rng.uniform(0.3, 9.0, 120), (0.0, 0.0, 0.0), 100.0 + 0.6 * k))
        assert result == (None, False, False)
    assert slam.counts['not_found'] == 2 and len(said) == 1 and len(slam.poses) == 20  # it tries once a second
    empty = slam.on_scan(scan(np.full(120, np.inf), (0.0, 0.0, 0.0), 200.0))
    assert empty.map_from_odom is None
    drive(slam, 20, 30)
    assert slam.map_from_odom is not None and len(slam.poses) == 30


@pytest.mark.parametrize('seed', range(4))
def test_a_damaged_end_costs_what_is_behind_it_and_no_more(whole, tmp_path, seed):
    _, path = whole
    content, rng = path.read_bytes(), np.random.default_rng(seed)
    cut = int(rng.integers(len(content)))
    damaged = bytearray(content[:cut] if seed % 2 else content)
    if not seed % 2:
        damaged[cut] ^= 0xFF
    (tmp_path / 'state').write_bytes(damaged)
    try:
        journal = Journal(tmp_path / 'state')
    except JournalError:
        assert cut < 4  # of the first mark
        return
    held = len(journal.records)
    assert journal.cut == len(damaged) - (tmp_path / 'state').stat().st_size
    slam = Slam(CONFIG, journal=journal)
    assert len(slam.scans) <= held and np.isfinite(np.array(slam.poses)).all()
    records = Journal(path).records
    kept = sum(record.kind == 'scan' for record in records[:held])
    assert len(slam.scans) == kept
    if slam.scans:
        k = len(slam.scans)
        drive(slam, k, k + 4)
        assert len(slam.scans) > k


def test_another_file_is_refused_and_stays_as_it_is(tmp_path):
    path = tmp_path / 'mine.txt'
    path.write_text('something else')
    with pytest.raises(JournalError, match='something else than the state'):
        Journal(path)
    assert path.read_text() == 'something else'
    with pytest.raises(JournalError, match='cannot be opened'):
        Journal(tmp_path / 'no' / 'state')


def test_two_programs_do_not_write_into_one_file(tmp_path, monkeypatch):
    monkeypatch.setattr(journals, 'LEAVES_S', 0.1)
    path = tmp_path / 'state'
    hold = f'from sara_slam.mapping.journal import Journal; held = Journal({str(path)!r}); print(flush=True); input()'
    with subprocess.Popen([sys.executable, '-c', hold], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        with pytest.raises(JournalError, match='state is in use'):
            Journal(path)
        other.communicate(b'\n')
    Journal(path)


def test_the_map_of_another_program_is_refused_and_stays_as_it_is(tmp_path):
    path = tmp_path / 'state'
    Journal(path).append('heard', {'poses': np.zeros((3, 4))})
    before = path.read_bytes()
    with pytest.raises(JournalError, match='state holds a map that was not made by a laser scanner'):
        Slam(CONFIG, journal=Journal(path))
    assert path.read_bytes() == before


def test_a_full_disk_is_told_and_mapping_goes_on():
    said = []
    slam = Slam(CONFIG, said.append, Journal('/dev/null'))
    slam._journal._file.close()
    slam._journal._file = open('/dev/full', 'ab', buffering=0)  # noqa: SIM115
    drive(slam, 0, 5)
    assert len(slam.scans) == 5 and len(said) == 1 and 'No space' in said[0]


@pytest.fixture
def disk():
    """A function that lets files grow to so many bytes, as on a full disk: a write takes what there is room for."""
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (hard if size is None else size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
    signal.signal(signal.SIGXFSZ, before)


def test_a_record_that_is_written_in_part_is_taken_back(tmp_path, disk):
    path = tmp_path / 'state'
    journal = Journal(path)
    for k in range(5):
        journal.append('loop', {'number': np.full(100, k)})
    disk(path.stat().st_size + 300)
    with pytest.raises(JournalError, match='state cannot be written: there was room for a part'):
        journal.append('loop', {'number': np.full(100, 5)})
    disk(None)
    for k in range(6, 9):
        journal.append('loop', {'number': np.full(100, k)})
    again = Journal(path)
    assert [record.arrays['number'][0] for record in again.records] == [0, 1, 2, 3, 4, 6, 7, 8] and not again.cut


def test_a_disk_that_fills_up_within_a_record_is_told_and_mapping_goes_on(tmp_path, disk):
    path, said = tmp_path / 'state', []
    slam = Slam(CONFIG, said.append, Journal(path))
    drive(slam, 0, 5)
    disk(path.stat().st_size + 300)
    drive(slam, 5, 10)
    assert len(slam.scans) == 10 and len(said) == 1 and said[0].endswith('after a restart the map ends here')
    again = Journal(path)
    assert len(again.records) >= 5 and not again.cut


def test_a_record_too_long_to_be_read_again_is_not_written(tmp_path, monkeypatch):
    monkeypatch.setattr(journals, 'LONGEST', 1000)
    journal = Journal(tmp_path / 'state')
    with pytest.raises(JournalError, match='a record of .* bytes, allowed are 1000'):
        journal.append('loop', {'number': np.zeros(1000)})
    journal.append('loop', {'number': np.zeros(1)})
    assert len(Journal(tmp_path / 'state').records) == 1


KILLED = """
import sys
sys.path[:0] = [{here!r}]
from test_resuming import CONFIG, WAY, Journal, Slam, drifting, drive, round_trip
slam = Slam(CONFIG, journal=Journal({path!r}))
print('ready', flush=True)
k = len(slam.scans)
while k < {last}:
    drive(slam, k, k + 1, begin=drifting(round_trip(WAY))[k])
    print(len(slam.scans), flush=True)
    k += 1
print('done', flush=True)
"""
KILLS = int(os.environ.get('SLAM_KILLS', '3'))


def test_killed_at_random_moments_it_loses_nothing_that_was_driven(tmp_path):
    """A drive by processes that are killed (SIGKILL), each of which goes on where the last one ended. SLAM_KILLS=50
    kills more often.
    """
    rng, path, kills, last = np.random.default_rng(7), tmp_path / 'state', 0, 60
    while True:
        script = KILLED.format(here=str(Path(__file__).resolve().parent), path=str(path), last=last)
        with subprocess.Popen([sys.executable, '-c', script], stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout.readline() == 'ready\n'
            told, wanted = 0, int(rng.integers(1, max(2, 2 * last // (KILLS + 1))))
            for line in process.stdout:
                if line == 'done\n':
                    break
                told, wanted = int(line), wanted - 1
                if wanted == 0 and kills < KILLS:
                    time.sleep(float(rng.uniform(0.0, 0.02)))
                    process.send_signal(signal.SIGKILL)
                    kills += 1
            over = line == 'done\n'
        if over:
            break
        held = sum(record.kind == 'scan' for record in Journal(path).records)
        assert held >= told, 'a key scan that was taken is lost'
    slam = Slam(CONFIG, journal=Journal(path))
    true = round_trip(WAY)
    start = compose(true[0], inverse(slam.poses[0]))
    off = [math.dist(compose(start, pose)[:2], there[:2]) for pose, there in zip(slam.poses, true)]
    assert kills == KILLS or last == len(slam.poses)
    assert len(slam.poses) == last and max(off) < 0.15
