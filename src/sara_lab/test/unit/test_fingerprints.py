"""Fingerprints of drives: the same drive has the same one, another drive is named with how far apart the two end."""

import dataclasses
import json

import pytest

from sara_bringup.lockstep.lockstep import Lockstep
from sara_bringup.paths import share
from sara_lab.campaign import fingerprints
from sara_lab.campaign.fingerprints import DRIVES, KINDS, Drive, Fingerprint
from sara_lab.campaign.hazards import HAZARDS


def short(seed, turn_rate=0.0):
    """A second of the chair `seed` from its start, and a second with a pilot."""
    lockstep = Lockstep(share() / 'maps' / 'hall.yaml', (3.0, 5.0, 0.0), seed, localization='fake')
    lockstep.start_up()
    lockstep.pilot = lambda now: (0.3, turn_rate)
    for _ in range(200):
        lockstep.step()


@pytest.fixture
def kinds(monkeypatch):
    monkeypatch.setitem(KINDS, 'short', short)


@pytest.fixture(scope='module')
def found():
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(KINDS, 'short', short)
        drives = [Drive('short', (0,)), Drive('short', (1,))]
        return [fingerprints.fingerprints(drives) for _ in range(2)]


def test_the_same_drives_have_the_same_fingerprints(found):
    first, second = found
    assert first == second and fingerprints.differences(first, second) == []
    assert list(first) == ['short 0', 'short 1'] and first['short 0'].hash != first['short 1'].hash
    assert first['short 0'].steps > 200 and len(first['short 0'].hash) == fingerprints.DIGITS


def test_a_drive_that_differs_is_named_with_how_far_apart_it_ends(found):
    after = {**found[0], 'short 1': fingerprints.fingerprint(lambda: short(1, 0.3))}
    (sentence,) = fingerprints.differences(found[0], after)
    assert sentence.startswith('short 1: ends 0.0') and ' deg from before' in sentence
    assert not sentence.split(' and ')[1].startswith('0 deg')


def test_steps_and_drives_that_are_missing_are_named():
    one = Fingerprint('0' * 16, 100, (1.0, 2.0, 3.1, 0.0, 0.0))
    longer = dataclasses.replace(one, steps=101, end=(1.0, 2.5, -3.1, 0.0, 0.0))
    (sentence,) = fingerprints.differences({'a': one}, {'a': longer})
    assert sentence == 'a: ends 0.5 m and 4.77 deg from before, 100 steps became 101'
    (sentence,) = fingerprints.differences({}, {'b': one})
    assert sentence.startswith('b: not among')


def test_a_difference_in_the_middle_is_found_though_the_end_is_the_same():
    one = Fingerprint('0' * 16, 100, (1.0, 2.0, 3.1, 0.0, 0.0))
    (sentence,) = fingerprints.differences({'a': one}, {'a': dataclasses.replace(one, hash='1' * 16)})
    assert sentence == 'a: ends 0 m and 0 deg from before'


def test_what_is_written_is_read_again_to_the_last_bit(found, tmp_path):
    fingerprints.write(tmp_path / 'new' / 'f.json', found[0])
    assert fingerprints.read(tmp_path / 'new' / 'f.json') == found[0]
    for text in ('{', '[]', '{"a": {}}', json.dumps({'a': 1})):
        (tmp_path / 'bad.json').write_text(text)
        with pytest.raises(ValueError, match='holds no fingerprints'):
            fingerprints.read(tmp_path / 'bad.json')


@pytest.mark.parametrize('turn_rate, status', ((0.0, 0), (0.3, 1)))
def test_the_command_compares(tmp_path, capsys, monkeypatch, kinds, turn_rate, status):
    monkeypatch.setattr(fingerprints, 'DRIVES', (Drive('short', (2,)),))
    fingerprints.main(['--out', str(tmp_path / 'f.json'), '--processes', '1'])
    assert 'short 2' in capsys.readouterr().out
    monkeypatch.setitem(KINDS, 'short', lambda seed: short(seed, turn_rate))
    with pytest.raises(SystemExit) as ended:
        fingerprints.main(['--compare', str(tmp_path / 'f.json'), '--processes', '1'])
    assert ended.value.code == status
    assert ('DIFFERS: short 2: ends' in capsys.readouterr().out) == bool(status)


@pytest.mark.parametrize('words', (['no such drive'], ['--processes', '0'], ['--compare', '/no/such/file.json']))
def test_what_cannot_be_done_is_refused(words):
    with pytest.raises(SystemExit) as ended:
        fingerprints.main(words)
    assert ended.value.code == 2


def test_a_drive_without_a_step_has_no_fingerprint():
    with pytest.raises(ValueError, match='no step'):
        fingerprints.fingerprint(lambda: None)


def test_names_are_their_own_and_hazards_exist():
    names = [drive.name for drive in DRIVES]
    assert len(set(names)) == len(names) == 32 and set(fingerprints.HAZARDS) <= set(HAZARDS)
    assert {drive.kind for drive in DRIVES} == set(KINDS)
