"""`same_drive`: every process is like no other, and a drive that differs in one of them is seen."""

import pytest

from sara_lab.campaign import same_drive
from sara_lab.campaign.fingerprints import Fingerprint

ONE = Fingerprint('0' * 16, 100, (0.0, 0.0, 0.0, 0.0, 0.0))
OTHER = Fingerprint('1' * 16, 100, (0.0, 0.0, 0.0, 0.0, 0.0))


def test_every_process_has_other_memory_and_hashes_and_a_seed_draws_the_same_again():
    def seen(seed):
        ways = []
        same_drive.again('a drive', 20, seed, lambda name, environment, busy: ways.append((environment, busy)) or ONE)
        return sorted((one['MALLOC_PERTURB_'], one['PYTHONHASHSEED'], busy) for one, busy in ways)

    assert seen(1) == seen(1) != seen(2)
    assert len({hashes for _, hashes, _ in seen(1)}) == 20 and len({memory for memory, _, _ in seen(1)}) > 10
    assert {busy for _, _, busy in seen(1)} == {0, 1, 2}


@pytest.mark.parametrize('odd, status', [(-1, 0), (3, 1)])
def test_a_process_that_drives_otherwise_is_told_by_the_exit_status(monkeypatch, capsys, odd, status):
    numbers = iter(range(10))
    found = [OTHER if number == odd else ONE for number in numbers]
    monkeypatch.setattr(same_drive, 'again', lambda *_: same_drive.Counter(found))
    with pytest.raises(SystemExit) as end:
        same_drive.main(['--count', '10'])
    assert end.value.code == status
    assert f'in {9 if status else 10} of 10 processes' in capsys.readouterr().out


def test_what_a_process_of_its_own_inherits_reaches_it(monkeypatch, tmp_path):
    script = (
        'import json, os, sys; from pathlib import Path\n'
        "one = dict(hash=os.environ['MALLOC_PERTURB_'], steps=1, end=[0, 0, 0, 0, 0])\n"
        'Path(sys.argv[sys.argv.index("--out") + 1]).write_text(json.dumps({sys.argv[1]: one}))'
    )
    monkeypatch.setattr(same_drive, 'FINGERPRINTS', script)
    assert same_drive.alone('a drive', {'MALLOC_PERTURB_': '77'}, busy=1).hash == '77'
