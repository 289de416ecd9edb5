"""Rows of drives in Parquet, and the questions about them."""

import json
import math

import pytest

from sara_lab.campaign.results import command
from sara_lab.campaign.results.question import Drives, QuestionError, answer, parsed
from sara_lab.campaign.results.rows import Origin, commit, rows, tables, write

ORIGIN = Origin('sara', 'abc', '1234567')


def result(name, mode, seed):
    """What a journey might give."""
    return {
        'map': name,
        'mode': mode,
        'number': seed,
        'reached': seed % 2 == 0,
        'contacts': [{'with': 'wall'}] * (seed % 3),
        'start': [1.0, 2.0, 0.0],
        'judgement': {'gap_min': 0.1 * seed, 'seconds': None if seed else math.nan, 'last_metre': [2.5] * seed},
        'faults': [],
        'commit': 'fedcba9',
    }


def made(count):
    """{case: result} of `count` drives on two maps in two modes."""
    return {
        f'travel_{name}_{mode}_{seed}': result(name, mode, seed)
        for seed in range(count // 4)
        for name in ('school', 'hall')
        for mode in ('fused', 'true')
    }


def written(tmp_path, count):
    """A campaign's folder: journeys, and another part with columns of other kinds."""
    write(tmp_path / 'sara_abc' / 'travel.parquet', rows(ORIGIN, 'travel', made(count)))
    pillars = {f'pillars_{n}': {'map': 'hall', 'reached': 10 - n, 'contacts': [], 'code': 'x'} for n in range(3)}
    write(tmp_path / 'sara_abc' / 'pillars.parquet', rows(ORIGIN, 'pillars', pillars))
    return tmp_path


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    return written(tmp_path_factory.mktemp('campaign'), 10_000)


def asked(folder, text):
    drives = Drives(tables([folder]))
    return answer(parsed(text, drives), drives).to_pylist()


def test_a_row_has_every_figure_and_where_it_is_from():
    found = rows(ORIGIN, 'travel', made(12))
    assert found[8] == {
        'platform': 'sara',
        'sources': 'abc',
        'commit': 'fedcba9',
        'part': 'travel',
        'case': 'travel_school_fused_2',
        'seed': 2,
        'map': 'school',
        'mode': 'fused',
        'number': 2,
        'reached': True,
        'contacts': 2,
        'judgement.gap_min': 0.2,
        'judgement.seconds': None,
        'faults': 0,
    }
    assert rows(ORIGIN, 'square', {'square_7': {'faults': []}})[0]['seed'] == 7
    assert rows(ORIGIN, 'compass', {'compass': {}})[0] == {
        **vars(ORIGIN),
        'part': 'compass',
        'case': 'compass',
        'seed': None,
    }
    assert commit()


def test_ten_thousand_drives_are_asked_for_contacts_by_seed(folder):
    found = asked(folder, 'school, fused, contacts by seed')
    assert [line['seed'] for line in found] == list(range(2500))
    assert found[5] == {
        'seed': 5.0,
        'drives': 1,
        'contacts_count': 1,
        'contacts_sum': 2.0,
        'contacts_mean': 2.0,
        'contacts_min': 2.0,
        'contacts_max': 2.0,
    }


def test_filters_of_a_column_are_alternatives_and_figures_are_found_by_their_last_name(folder):
    assert asked(folder, 'school, hall, fused')[0]['drives'] == 5000
    assert asked(folder, 'hall, seed=2') == [{'drives': 3}]  # of pillars one
    assert asked(folder, 'travel, pillars, x') == [{'drives': 3}]
    line = asked(folder, 'travel, seed=3, gap_min by mode')[1]
    assert line['mode'] == 'true' and line['judgement.gap_min_mean'] == pytest.approx(0.3)
    assert asked(folder, 'reached by part') == [
        {'part': 'pillars', 'drives': 3, **dict(zip(_of('reached'), (3, 27.0, 9.0, 8.0, 10.0)))},
        {'part': 'travel', 'drives': 10_000, **dict(zip(_of('reached'), (10_000, 5000.0, 0.5, 0.0, 1.0)))},
    ]
    assert asked(folder, 'travel, part=pillars')[0]['drives'] == 10_003
    assert asked(folder, 'part=nothing, contacts')[0]['drives'] == 0


def _of(figure):
    return [f'{figure}_{of}' for of in ('count', 'sum', 'mean', 'min', 'max')]


@pytest.mark.parametrize(
    ('question', 'said'),
    [
        ('scool, fused', "nothing is called 'scool'; did you mean school"),
        ('school by sed', 'did you mean seed'),
        ('school by', 'no column'),
        ('school by seed by map', 'once'),
        ('mode by seed', 'mode holds texts'),
        ('seed=first', 'numbers'),
        ('colour=red', "nothing is called 'colour'"),
    ],
)
def test_what_nothing_is_called_is_refused_with_what_there_is(folder, question, said):
    with pytest.raises(QuestionError, match=said):
        asked(folder, question)


def test_a_name_that_two_columns_end_with_is_refused(tmp_path):
    write(tmp_path / 'sara_abc' / 'a.parquet', rows(ORIGIN, 'a', {'a_0': {'one': {'gap': 1}, 'two': {'gap': 2}}}))
    with pytest.raises(QuestionError, match=r'one\.gap, two\.gap'):
        asked(tmp_path, 'gap')


def test_the_newest_rows_of_a_part_are_asked_or_all(tmp_path, capsys):
    folder = written(tmp_path, 40)
    newer = rows(Origin('sara', 'def', '1'), 'travel', {'travel_school_fused_0': result('school', 'fused', 0)})
    write(folder / 'sara_def' / 'travel.parquet', newer)
    command.main(['travel', '--in', str(folder), '--json'])
    assert json.loads(capsys.readouterr().out) == [{'drives': 1}]
    command.main(['travel', 'by', 'sources', '--in', str(folder), '--all', '--csv'])
    assert capsys.readouterr().out.split() == ['sources,drives', 'abc,40', 'def,1']


def test_the_command_says_what_there_is_and_refuses(folder, capsys):
    command.main(['--in', str(folder)])
    said = capsys.readouterr().out
    assert 'map: hall, school' in said and 'case: 10003 texts' in said and 'judgement.gap_min' in said
    command.main(['school, fused, contacts by mode', '--in', str(folder)])
    out, whence = capsys.readouterr()
    assert out.split()[-7:] == ['fused', '2500', '2500', '2499', '0.9996', '0', '2']
    assert 'travel on sara: 2500 drives of sources abc, commit fedcba9' in whence
    for question, where in (('nothing', folder), ('school', folder / 'empty')):
        with pytest.raises(SystemExit) as status:
            command.main([question, '--in', str(where)])
        assert status.value.code == 2 and capsys.readouterr().err.startswith('results: ')


def test_a_file_that_is_no_parquet_is_refused(tmp_path, capsys):
    folder = written(tmp_path, 4)
    (folder / 'sara_abc' / 'broken.parquet').write_bytes(b'PAR1 nonsense')
    with pytest.raises(SystemExit):
        command.main(['school', '--in', str(folder)])
    assert 'broken.parquet' in capsys.readouterr().err
