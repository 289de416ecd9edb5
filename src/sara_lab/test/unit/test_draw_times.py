"""Table and picture of journeys' times, before and after."""

import json

import pytest
from PIL import Image

from sara_lab.campaign.travel_times import time_figures, time_lines
from sara_lab.journeys import draw_times
from sara_lab.judge.time_split import KINDS


def journey(seconds, reached=True):
    split = {**dict.fromkeys(KINDS, 0.0), 'driving': 0.75 * seconds, 'turning': 0.25 * seconds}
    found = {'seconds': seconds, 'ideal': 10.0, 'time_ratio': seconds / 10.0, 'length': 6.0, 'split': split}
    return {'reached': reached, 'judgement': found}


def test_times_of_those_reached_are_summed_and_quick_ones_counted_among_all():
    found = time_figures([journey(15.0), journey(25.0), journey(12.0, reached=False)])
    assert (found['time_s'], found['ideal_s'], found['time_ratio']) == (40.0, 20.0, 2.0)
    assert found['quick'] == pytest.approx(1 / 3) and found['total_speed'] == pytest.approx(12.0 / 40.0)
    assert sum(found['split_s'].values()) == pytest.approx(40.0)
    assert time_figures([journey(9.0, reached=False)]) == {} and time_lines({'true_flat': {}}) == []
    assert ' 2.00 ' in time_lines({'true_flat': found})[1]


def test_the_command_prints_a_table_and_draws_a_picture(tmp_path, capsys):
    for name, seconds in (('before', 40.0), ('after', 15.0)):
        row = time_figures([journey(seconds)])
        (tmp_path / f'{name}.json').write_text(json.dumps({'travel': {'true_flat': row, 'true_all': row, 'cases': 1}}))
    draw_times.main([str(tmp_path / 'before.json'), str(tmp_path / 'after.json'), '--out', str(tmp_path)])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 4 and lines[2] == '| true pose, flat | 10 | 4.00 | 1.50 | 0 % | 100 % | 0.15 | 0.40 |'
    assert len({line.count('|') for line in lines}) == 1
    assert Image.open(tmp_path / 'travel_times.png').width > 300
    (tmp_path / 'before.json').write_text('{"travel": {}}')
    with pytest.raises(SystemExit, match='no group of journeys was timed'):
        draw_times.main([str(tmp_path / 'before.json'), '--out', str(tmp_path)])
