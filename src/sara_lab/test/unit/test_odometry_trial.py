"""calibrate_odometry on the simulated chair, and the campaign that runs it over many."""

import json
import sys

import pytest
from steady import whole

from sara_lab.campaign import campaign, parts
from sara_lab.campaign.odometry_trial import TIMES_BETTER, trial
from sara_lab.campaign.part import Part


def only(monkeypatch, made):
    """The campaign has these parts alone."""
    found = {name: lambda seeds, folder, part=part: part for name, part in made.items()}
    for module in (campaign, parts):
        monkeypatch.setattr(module, 'PARTS', found)


@pytest.mark.parametrize('seed', range(whole(3, 1)))
def test_track_and_radii_are_found_and_the_square_closes(seed):
    result = trial(seed)
    assert result['faults'] == []
    assert max(result['before']) > TIMES_BETTER * max(result['after'])


@pytest.mark.parametrize('faults, status', (([], 0), (['too late'], 1)))
def test_the_campaign_says_what_failed_and_is_resumed(tmp_path, monkeypatch, capsys, faults, status):
    runs = []
    part = Part(
        {'a_case': lambda: runs.append(1) or {'faults': faults}}, lambda results: (['a line'], {'number': len(results)})
    )
    only(monkeypatch, {'one': part})
    words = ['campaign', '--workers', '1', '--out', str(tmp_path), '--json', str(tmp_path / 'all.json')]
    monkeypatch.setattr(sys, 'argv', words)
    for _ in range(2):
        with pytest.raises(SystemExit) as ended:
            campaign.main()
        assert ended.value.code == status
    assert len(runs) == 1
    assert ('NOT MET: a_case: too late' in capsys.readouterr().out) == bool(faults)
    summary = json.loads((tmp_path / 'all.json').read_text())
    assert set(summary) == {'one'} and summary['one'].pop('commit')
    assert summary['one'] == {'seeds': 50, 'cases': 1, 'failed': ['a_case'] if faults else [], 'number': 1}


def test_parts_that_are_not_run_keep_their_figures(tmp_path, monkeypatch):
    part = Part({'a_case': lambda: {'faults': []}}, lambda results: ([], {}))
    only(monkeypatch, {'one': part, 'two': part})
    (tmp_path / 'all.json').write_text(json.dumps({'one': {'commit': 'old'}, 'two': {'commit': 'old'}, 'gone': {}}))
    monkeypatch.setattr(sys, 'argv', ['campaign', 'two', '--out', str(tmp_path), '--json', str(tmp_path / 'all.json')])
    with pytest.raises(SystemExit):
        campaign.main()
    summary = json.loads((tmp_path / 'all.json').read_text())
    assert set(summary) == {'one', 'two'} and summary['one']['commit'] == 'old' and summary['two']['commit'] != 'old'


def test_an_unknown_part_is_named(monkeypatch, capsys):
    monkeypatch.setattr(sys, 'argv', ['campaign', 'nonsense'])
    with pytest.raises(SystemExit):
        campaign.main()
    assert 'nonsense' in capsys.readouterr().err
