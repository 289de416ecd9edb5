"""The bench of navigation: ratios are what they say, and every peer's figure it looks for is there."""
import pytest

from sara_bringup import bench_navigation
from sara_bringup.bench_navigation import Row
from sara_nav import bench_costmap, bench_local, bench_planners


def test_a_ratio_compares_multiples_of_each_machines_yardstick():
    row = Row("r", 10.0, 5.0)
    assert row.ratio(100.0, 100.0) == pytest.approx(2.0)
    assert row.ratio(200.0, 100.0) == pytest.approx(1.0)      # a machine half as fast
    assert Row("r", 10.0).ratio(1.0, 1.0) is None and Row("r", None, 5.0).ratio(1.0, 1.0) is None


def test_lines_say_what_there_is():
    assert bench_navigation.line(Row("with a peer", 1.0, 2.0, "text"), 1.0, 1.0).split() == ["with", "a", "peer", "1.000", "2.000", "0.50", "text"]
    assert bench_navigation.line(Row("without", 1.0), 1.0, 1.0).split() == ["without", "1.000"]
    assert bench_navigation.line(Row("absent", text="the map is not there"), 1.0, 1.0).split(maxsplit=1) == ["absent", "the map is not there"]


def test_every_figure_of_the_peers_is_there():
    figures = bench_navigation.peers()
    assert set(bench_navigation.LOCAL_CASES) <= set(bench_local.CASES) and set(bench_navigation.LOCAL_CASES.values()) <= set(figures["local_planner"])
    columns = {peer for _, _, peer in bench_planners.CASES.values() if peer}
    assert all(columns <= set(entry) for entry in figures["plan_ms_median"].values())
    assert sorted(bench_costmap.PEER_MS.values()) == sorted(figures["inflation_1000x1000_ms"].values())


def test_a_map_that_is_not_there_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(bench_navigation, "plan_folders", lambda: [tmp_path])
    rows = list(bench_navigation.planners(bench_navigation.peers()))
    assert [row.name for row in rows] == [f"plan on {name}" for name in ("depot", "warehouse", "willow", "own_office", "own_comb", "100by100_15")]
    assert all(row.ours is None and str(tmp_path) in row.text for row in rows)
