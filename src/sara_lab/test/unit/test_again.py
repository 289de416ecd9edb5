"""A drive made again from its row: the same figures, or what differs, or why it cannot be made."""

import sys

import pytest

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_common.planar import Pose2D
from sara_lab.campaign import campaign, parts
from sara_lab.campaign.part import Part
from sara_lab.campaign.results.recorded import recorded
from sara_lab.campaign.results.rows import Origin, rows, tables
from sara_lab.commands import again
from sara_lab.commands.again import drive_of

GOAL = Pose2D(6.0, 4.0, 0.0)


def short(seed, seconds=2.0):
    """A drive of some seconds towards a goal."""
    lockstep = Lockstep(share() / 'maps' / 'doorway.yaml', (8.0, 4.0, 3.0), seed, localization='fake')
    lockstep.start_up()
    lockstep.move_base.set_goal(GOAL, lockstep.time)
    for _ in range(round(100 * seconds)):
        lockstep.step()
    return {'pose': list(lockstep.chair.pose), 'x': lockstep.chair.pose[0], 'nothing': None, 'faults': []}


def part(make):
    return lambda seeds, _folder: Part({f'square_{n}': lambda n=n: make(n) for n in range(seeds)}, lambda _: ([], {}))


@pytest.fixture
def made(tmp_path, monkeypatch):
    """A campaign of one short drive and, as another part, one that is none; returns its folder."""
    monkeypatch.setitem(parts.PARTS, 'square', part(short))
    monkeypatch.setitem(parts.PARTS, 'nees', lambda *_: Part({'nees': lambda: {'faults': []}}, lambda _: ([], {})))
    monkeypatch.setattr(
        sys, 'argv', ['campaign', 'square', 'nees', '--seeds', '1', '--workers', '1', '--out', str(tmp_path)]
    )
    with pytest.raises(SystemExit) as status:
        campaign.main()
    assert status.value.code == 0
    return tmp_path


def run(capsys, made, *words):
    """(exit status, stdout, stderr) of `again`."""
    try:
        again.main([*words, '--in', str(made)])
        status = 0
    except SystemExit as ended:
        status = ended.code
    return (status, *capsys.readouterr())


def test_a_drive_is_made_again_drawn_compared_and_refused(made, monkeypatch, capsys, tmp_path):
    picture = tmp_path / 'path.png'
    status, out, _ = run(capsys, made, 'square_0', '--figure', str(picture))
    assert status == 0 and out.endswith('figures and the file are the same\n')
    assert picture.read_bytes().startswith(b'\x89PNG')
    status, _, said = run(capsys, made, 'nees', '--figure', str(picture))
    assert status == 2 and 'no drive of the whole stack in lockstep' in said
    status, _, said = run(capsys, made, 'square_7')
    assert status == 2 and 'no row is called square_7' in said
    monkeypatch.setitem(parts.PARTS, 'square', part(lambda n: {**short(n), 'x': 1.0}))
    status, out, _ = run(capsys, made, 'square_0')
    assert status == 1 and 'DIFFERS: x was 7.' in out and 'square_0.json holds something else' in out
    monkeypatch.setattr(again, 'fingerprint', lambda: 'abc')
    status, _, said = run(capsys, made, 'square_0')
    assert status == 2 and 'is of sources ' in said and 'these are sources abc (commit ' in said


def test_what_is_recorded_is_the_drive(made):
    found = again.find('square_0', tables([made]), next(made.glob('*/square.parquet')).parent.name.split('_')[1])
    result, recording = recorded(drive_of(found.row, made))
    last = recording.samples[-1]
    assert list(last.true) == pytest.approx(result['pose'], abs=0.05) and last.contacts == 0
    assert [goal for _, goal in recording.goals] == [tuple(GOAL)] and recording.ends == []
    assert {round(b.t - a.t, 6) for a, b in zip(recording.samples, recording.samples[1:])} == {0.05}
    assert last.asked is not None and recording.samples[0].asked is None


def test_a_run_of_an_experiment_is_found_by_its_row():
    row = rows(Origin('sara', 'abc', '1'), 'E6', {'E6 1': {'seed': 1}})[0]
    assert 'gain' in drive_of(row, None)()
    with pytest.raises(again.AgainError, match='no experiment E6'):
        drive_of({**row, 'case': 'E6 nobody'}, None)
