"""Work shared out among processes: the same results, and nothing lost when these are killed or fail."""

import json
import os
import signal
import sys

import pyarrow.parquet as pq
import pytest

from sara_lab.campaign import campaign
from sara_lab.campaign.part import Part
from sara_lab.workers.processes import WorkersError, cores, each


def killed_once(folder, item):
    """What a process does that is killed while it is at item 3 for the first time."""
    mark = folder / 'killed'
    if item == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    with (folder / 'log').open('a') as log:
        log.write(f'{item}\n')
    return item * item


@pytest.mark.parametrize('processes', [1, 2, 5])
def test_each_item_is_done_once_whatever_the_number_of_processes(processes):
    assert dict(each(lambda item: item * item, range(12), processes)) == {item: item * item for item in range(12)}
    assert list(each(lambda item: item, [], processes)) == []


def test_what_a_killed_process_was_at_is_done_again(tmp_path):
    assert dict(each(lambda item: killed_once(tmp_path, item), range(8), 2)) == {item: item * item for item in range(8)}
    assert {int(line) for line in (tmp_path / 'log').read_text().split()} == set(range(8))


def test_processes_that_are_killed_again_and_again_are_an_error():
    with pytest.raises(WorkersError, match='killed 3 times'):
        list(each(lambda item: os.kill(os.getpid(), signal.SIGKILL), range(2), 2))


def test_a_fault_of_the_work_comes_through():
    def work(item):
        if item == 1:
            raise ValueError('item 1')

    for processes in (1, 2):
        with pytest.raises(ValueError, match='item 1'):
            list(each(work, range(3), processes))


def test_a_campaign_is_the_same_with_any_number_of_workers_and_goes_on_where_it_was(tmp_path, monkeypatch, capsys):
    def part(seeds, folder):
        cases = {
            f'square_{seed}': lambda seed=seed: {'faults': ['odd'] * (seed % 2), 'n': seed} for seed in range(seeds)
        }
        return Part(cases, lambda results: (['a line'], {'sum': sum(result['n'] for result in results)}))

    def run(*arguments):
        monkeypatch.setattr(sys, 'argv', ['campaign', 'square', '--seeds', '5', *map(str, arguments)])
        with pytest.raises(SystemExit) as status:
            campaign.main()
        return status.value.code

    monkeypatch.setitem(campaign.PARTS, 'square', part)
    made = []
    for workers in (1, 3):
        out = tmp_path / str(workers)
        assert run('--out', out, '--json', out / 'figures.json', '--workers', workers) == 1  # odd ones failed
        made.append({path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob('*.json')})
    assert made[0] == made[1] and len(made[0]) == 6
    assert json.loads((out / 'figures.json').read_text())['square']['sum'] == 10
    assert pq.read_table(next(out.rglob('square.parquet'))).select(['seed', 'n', 'faults']).to_pylist() == [
        {'seed': n, 'n': n, 'faults': n % 2} for n in range(5)
    ]
    monkeypatch.setattr(campaign, 'write_whole', None)  # nothing is run, or written, again
    assert run('--out', out) == 1 and 'a line' in capsys.readouterr().out
    assert run('--workers', 0) == 2 and 1 <= cores() <= os.cpu_count()
