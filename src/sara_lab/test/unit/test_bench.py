"""`make bench`: what a row means, what the table says, what the check finds; every cheap bench gives figures."""

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_lab.benches import amcl, baseline, filters, growth, growth_plot, navigation, page, table, yardstick
from sara_lab.benches import costmaps as bench_costmap
from sara_lab.benches import global_planners as bench_planners
from sara_lab.benches import local_planners as bench_local
from sara_lab.benches.peers import peers
from sara_lab.benches.timed import PEERS_YARDSTICK_MS, Limit, Row, Timed, timed

POSITIVE = st.floats(1e-3, 1e6)


def row(name='r', median=10.0, before=PEERS_YARDSTICK_MS, after=PEERS_YARDSTICK_MS, **more):
    return Row.of(Timed(name, 'ms', median, median, 9, **more), 'fake', before, after)


@given(POSITIVE, POSITIVE, POSITIVE, st.booleans())
def test_a_machine_that_is_so_many_times_slower_gives_the_same_ratio(median, peer, slowness, rate):
    here, there = (
        row(median=median, peer=peer, rate=rate),
        row(
            median=median / slowness if rate else median * slowness,
            peer=peer,
            rate=rate,
            before=slowness * PEERS_YARDSTICK_MS,
            after=slowness * PEERS_YARDSTICK_MS,
        ),
    )
    assert there.ratio == pytest.approx(here.ratio) and there.at_peers_speed(there.median) == pytest.approx(median)


def test_a_ratio_below_one_is_faster_than_the_peer_for_times_and_rates():
    assert row(median=5.0, peer=10.0).ratio == pytest.approx(0.5)
    assert row(median=200.0, peer=100.0, rate=True).ratio == pytest.approx(0.5)
    assert row().ratio is None and Row.of(Timed('absent', peer=1.0), 'fake', 1.0, 1.0).ratio is None


def test_what_does_not_depend_on_the_machine_is_not_scaled():
    assert row(median=5.0, peer=10.0, scaled=False, before=1000.0, after=1000.0).ratio == pytest.approx(0.5)


@pytest.mark.parametrize(
    'limit, kept, broken',
    [
        (Limit('ratio', 0.5), dict(median=4.9, peer=10.0), dict(median=5.1, peer=10.0)),
        (Limit('median', 20.0), dict(median=19.0), dict(median=21.0)),
        (Limit('median', 150.0), dict(median=151.0, rate=True), dict(median=149.0, rate=True)),
        (Limit('p99', 20.0), dict(median=19.0), dict(median=21.0)),
        (Limit('memory', 170.0), dict(memory=169.0), dict(memory=171.0)),
    ],
)
def test_limits(limit, kept, broken):
    assert row(limit=limit, **kept).met is True and row(limit=limit, **broken).met is False
    assert row(**kept).met is None and Row.of(Timed('absent', limit=limit), 'fake', 1.0, 1.0).met is None


def test_rows_survive_json():
    for one in (
        row(limit=Limit('ratio', 0.5), peer=3.0, memory=5.0, text='words', rate=True),
        Row.of(Timed('absent', text='why'), 'fake', 90.0, 91.0),
    ):
        assert Row.from_json(json.loads(json.dumps(one.to_json()))) == one


def test_the_99th_percentile_of_a_rate_is_its_slow_end():
    samples = range(1, 102)
    assert timed('t', 'ms', samples).p99 == pytest.approx(100.0) and timed(
        'r', '/s', samples, rate=True
    ).p99 == pytest.approx(2.0)


def test_the_table_has_a_line_for_each_figure_and_says_what_is_not_met_or_not_there():
    rows = [
        row('fast', peer=20.0, limit=Limit('ratio', 0.6)),
        row('slow', median=30.0, peer=20.0, limit=Limit('ratio', 1.0)),
        Row.of(Timed('absent', text='no map'), 'fake', 1.0, 1.0),
    ]
    lines = table.markdown(rows).splitlines()
    assert [line.split(' | ')[0] for line in lines[2:4]] == ['| fast', '| slow']
    assert (
        '| ratio ≤ 0.6 | yes |' in lines[2]
        and '| ratio ≤ 1 | NO |' in lines[3]
        and '- absent: not measured: no map' in lines
    )
    assert all(line.count('|') == lines[0].count('|') for line in lines[:4])
    assert 'not measured: no map' in table.line(rows[2]) and 'NO' in table.line(rows[1])
    written = page.page(rows, 'images/growth.png')
    assert (
        'Not met: slow.' in written and '(images/growth.png)' in written and '- absent: not measured: no map' in written
    )


def test_the_page_is_short_and_is_that_of_the_kept_figures():
    docs = Path(__file__).parents[4] / 'docs'
    rows = [Row.from_json(entry) for entry in json.loads((docs / 'bench.json').read_text())['rows']]
    assert len(page.summary(rows)) <= 28
    assert page.page(rows, 'images/bench_growth.png') == (docs / 'bench.md').read_text()


def test_a_line_of_several_cases_gives_their_range_and_says_how_many_a_limit_is_for():
    rows = [
        row('plan on a: GlobalPlanner', 2.0),
        row('plan on b: GlobalPlanner', 4.0, limit=Limit('median', 3.0)),
        row('planning by P, 2 x 2 cells'),
    ]
    (line,) = [line for line in page.page(rows, None).splitlines() if 'GlobalPlanner' in line and line.startswith('|')]
    assert line == '| plan: GlobalPlanner (2) | 2\N{EN DASH}4 ms | 4 |  | ≤ 3 ms (1 of 2) |'


def test_the_check_names_what_got_slower_in_yardsticks_and_nothing_else():
    known = [row('same'), row('slower'), row('rate', 100.0, rate=True), row('heavier', memory=100.0), row('gone')]
    now = [
        row('same', 20.0, before=242.0, after=242.0),  # the machine is half as fast, the figure is the same
        row('slower', 10.0, before=80.0, after=80.0),  # the machine is faster, the figure is not
        row('rate', 60.0, rate=True),
        row('heavier', memory=150.0),
        row('new', 1000.0),
    ]
    found = baseline.slower(now, known, 0.3)
    assert [(entry.name, entry.what) for entry in found] == [
        ('slower', 'median'),
        ('rate', 'median'),
        ('heavier', 'memory'),
    ]
    assert found[0].factor == pytest.approx(121.0 / 80.0) and 'slower' in str(found[0])
    assert baseline.missing(now, known) == ['gone']
    assert not baseline.slower(now, known, 0.7)


def test_the_yardstick_is_the_same_work_every_time():
    assert yardstick.work() == yardstick.work() and yardstick.measure(times=1) > 0.0


def test_growth_is_told_by_its_exponent(tmp_path):
    rows = [row(f'planning by P, {side} x {side} cells', 1e-3 * side * side) for side in (100, 200, 400)] + [
        row('filtering a second, 1 input'),
        row('filtering a second, 2 inputs', 20.0),
    ]
    found = growth.series(rows)
    assert growth.exponent(found['planning']['planning by P']) == pytest.approx(1.0) and growth.exponent(
        found['filtering']['filtering a second']
    ) == pytest.approx(1.0)
    assert growth_plot.draw(rows, tmp_path / 'g.png') and (tmp_path / 'g.png').stat().st_size > 10_000
    assert not growth_plot.draw([row('frames decoded')], tmp_path / 'none.png')


def test_every_figure_of_the_peers_is_there():
    figures = peers()
    assert figures['yardstick_ms'] == PEERS_YARDSTICK_MS
    assert set(navigation.LOCAL_CASES) <= set(bench_local.CASES) and set(navigation.LOCAL_CASES.values()) <= set(
        figures['local_planner']
    )
    columns = {peer for _, _, peer in bench_planners.CASES.values() if peer}
    assert all(columns <= set(entry) for entry in figures['plan_ms_median'].values())
    assert sorted(bench_costmap.PEER_MS.values()) == sorted(figures['inflation_1000x1000_ms'].values())
    assert set(bench_costmap.PEER_MS) <= set(bench_costmap.CASES)
    assert all(set(filters.COLUMNS.values()) <= set(figures['filter_us_per_call'][kind]) for kind in ('ekf', 'ukf'))


def test_a_map_that_is_not_there_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(navigation, 'plan_folders', lambda: [tmp_path])
    rows = list(navigation.global_planners())
    assert [one.name for one in rows] == [f'plan on {name}' for name in peers()['plan_ms_median']]
    assert all(one.skipped and str(tmp_path) in one.text for one in rows)


@pytest.mark.parametrize(
    'figures',
    [
        lambda: filters.frames(50, 2),
        lambda: filters.filter_core(20, 2),
        lambda: growth.planning((120,), 1),
        lambda: growth.filtering((1, 2), 0.2, 1),
        lambda: growth.windows((4.0,), 3),
        lambda: amcl.update(1),
        lambda: amcl.growth((50, 100), (3, 6), 1),
    ],
    ids=['frames', 'filter_core', 'planning', 'filtering', 'windows', 'amcl', 'amcl_growth'],
)
def test_cheap_benches_give_figures(figures):
    found = list(figures())
    assert found and all(one.median > 0.0 and one.runs > 0 and one.unit for one in found)
    assert len({one.name for one in found}) == len(found)
