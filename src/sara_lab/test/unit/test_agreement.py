"""Drives over ROS beside those in lockstep: what is compared, when it agrees, where it is kept and shown."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_lab.experiments import agreement, courses, drive_data, in_place, pages, registry, school, square
from sara_lab.experiments.agreement import OFF, REACHED, SECONDS, Compared
from sara_lab.experiments.as_nodes import AsNodes
from sara_lab.experiments.core import CONFIRMED, Experiment, Report
from sara_lab.judge.judgement import Goal
from sara_lab.ros.experiments import course_over_ros as over_ros

REPORT = Report((('a', 'b', CONFIRMED),), ())
SET_UP = ('E7', 'ours', 'left')


def runs(values, figure=OFF, first=0):
    return {(*SET_UP, seed): {figure: float(value)} for seed, value in enumerate(values, first)}


@given(st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=20), st.floats(-2.9, 2.9))
def test_within_three_deviations_it_agrees_and_beyond_it_does_not(values, off):
    deviation = np.std(values, ddof=1)
    if deviation < 1e-3:
        return
    mean = float(np.mean(values))
    assert Compared(tuple(values), (mean, mean + off * deviation)).agrees
    assert not Compared(tuple(values), (mean, mean + 3.1 * deviation)).agrees
    assert not Compared(tuple(values), (mean - 3.1 * deviation,)).agrees


def test_where_all_chairs_are_alike_it_must_be_that():
    assert Compared((4.0, 4.0, 4.0), (4.0,)).agrees and not Compared((4.0, 4.0, 4.0), (4.0, 3.0)).agrees


def test_one_chair_tells_nothing_of_a_spread():
    assert Compared((1.0,), (1.0,)).agrees is None
    report = agreement.with_ros(REPORT, 'E7', runs([1.0]), runs([7.0]))
    assert report.faults == () and 'One chair in lockstep' in report.sections[0][1]


def test_what_disagrees_is_a_fault_and_stands_out():
    lockstep = {key: {**figures, REACHED: 4.0} for key, figures in runs([0.01, 0.02, 0.03]).items()}
    good, bad = (
        agreement.with_ros(
            REPORT, 'E7', lockstep, {key: {**figures, REACHED: reached} for key, figures in runs([off, off]).items()}
        )
        for off, reached in ((0.02, 4.0), (0.09, 3.0))
    )
    assert good.faults == () and '2 of 2 figures agree' in good.sections[0][1] and '**' not in good.sections[0][1]
    assert (
        len(bad.faults) == 2
        and 'ours, left: goals reached 3, 3 instead of 4 ± 0 (4 to 4)' in bad.faults[1]
        and '**0.090, 0.090; 0.020 ± 0.010** (0.010 to 0.030)' in bad.sections[0][1]
    )
    assert (
        good.data['over_ros']['E7 / ours / left'][OFF.name]['agrees']
        and not bad.data['over_ros']['E7 / ours / left'][OFF.name]['agrees']
    )


def test_without_a_run_over_ros_the_report_stays_as_it_is():
    assert agreement.with_ros(REPORT, 'E7', runs([1.0, 2.0]), {}) is REPORT
    assert agreement.compare(runs([1.0, 2.0]), {('E7', 'thesis', 'left', 0): {OFF: 1.0}}) == {}, (
        'nothing to compare it with'
    )


def test_what_was_run_before_is_kept_and_what_is_run_again_replaced(tmp_path):
    agreement.store('E7', tmp_path / 'new', runs([1.0, 2.0]), 2.0)
    agreement.store('E7', tmp_path / 'new', runs([5.0, 6.0], first=1), 2.0)
    assert (
        agreement.load('E7', tmp_path / 'new') == runs([1.0, 5.0, 6.0]) and agreement.load('E9', tmp_path / 'new') == {}
    )


def test_the_page_shows_it(tmp_path):
    report = agreement.with_ros(REPORT, 'E7', runs([1.0, 2.0, 3.0]), runs([2.5]))
    pages.write(Experiment('E7', 'a title', 'what was done', 3, None, None), report, tmp_path, 3)
    assert (
        '## Over ROS' in (tmp_path / 'E7.md').read_text() and '2.500; 2.000 ± 1.000' in (tmp_path / 'E7.md').read_text()
    )


def test_the_figures_of_a_drive_are_those_of_its_path():
    t = np.arange(0.0, 10.0, 0.02)
    yaw = np.radians(np.clip(t * 18.0, 0.0, 90.0))
    rows = np.zeros((len(t), drive_data.COLUMNS))
    rows[:, 0], rows[:, 1], rows[:, 3], rows[:, 6], rows[:, 9] = t, 0.1, yaw, yaw + math.radians(2.0), 1.27 * yaw
    goal = Goal((0.0, 0.0, math.radians(90.0)), 0.0, 8.0, True, '', 9.0, (0.0, 0.0), 0.0)
    found = agreement.of_drive(drive_data.figures(rows, 3, in_place.COURSES['left'], (goal,)))
    wanted = {
        REACHED: 1.0,
        OFF: 0.1,
        agreement.YAW: 0.0,
        agreement.HEADING: 2.0,
        agreement.TURNED: 1.27,
        SECONDS: 9.98,
        agreement.CONTACTS: 3.0,
    }
    assert {figure: found[figure] for figure in wanted} == pytest.approx(wanted, abs=1e-6)


def test_what_the_issue_names_is_run_over_ros_if_nobody_chooses():
    chosen = {
        name: [case.key for case in experiment.cases(1) if experiment.over_ros and experiment.over_ros(case.key)]
        for name, experiment in registry.EXPERIMENTS.items()
    }
    assert (
        len(chosen['E7']) == len(in_place.cases(1))
        and len(chosen['E8']) == len(square.cases_8(1))
        and len(chosen['E10']) == len(school.cases(1))
    )
    assert ('E9', 'square', courses.OURS, courses.DEFAULT, 0) in chosen['E9'] and len(chosen['E9']) == 3


def test_every_driven_set_up_has_a_launch(tmp_path):
    for name in ('E7', 'E8', 'E9', 'E10'):
        for case in registry.EXPERIMENTS[name].cases(1):
            found = over_ros.arguments(3, case.options['course'], case.options['setup'], 1.083, tmp_path, 2.0)
            setup = case.options['setup']
            assert (
                found['seed'] == 3
                and found['localization'] in ('ekf', 'fake', 'wheels')
                and (found.get('gain') == 1.083) == setup.own_gain
            )
            assert 'navigation' in found and ('separation' in found) == bool(setup.calibrated)
    with pytest.raises(over_ros.OverRosError, match='raw_rate'):
        over_ros.arguments(3, case.options['course'], dataclasses.replace(setup, raw_rate=True), None, tmp_path, 2.0)


def test_drives_over_ros_are_compared_with_lockstep_that_has_the_timing_of_nodes_and_the_page_is_not_made_of_it():
    e9 = registry.EXPERIMENTS['E9']
    key = ('E9', 'square', courses.OURS, courses.DEFAULT)
    cases = agreement.references(e9, {(*key, 0): {}})
    assert [case.key for case in cases] == [(agreement.AS_NODES, *key, seed) for seed in range(agreement.CHAIRS)] and {
        case.options['kind'] for case in cases
    } == {AsNodes}
    assert (
        agreement.references(registry.EXPERIMENTS['E4'], {case.key: {} for case in registry.EXPERIMENTS['E4'].cases(1)})
        == []
    ), 'there is no drive in it'
    told = dataclasses.replace(e9, figures=lambda result: {SECONDS: result})
    own = e9.cases(2)
    results = {**{case.key: 1.0 for case in own}, **{case.key: 2.0 for case in cases}}
    found = agreement.side(told, own, results)
    assert {found[(*key, seed)][SECONDS] for seed in range(agreement.CHAIRS)} == {2.0} and sum(
        figures[SECONDS] == 1.0 for figures in found.values()
    ) == len(own) - 2


def test_the_timers_of_nodes_have_phases_of_their_own_and_hear_what_was_sent_in_the_step_before():
    course, setup = in_place.COURSES['left'], in_place.SETUPS['ours']

    class Watched(AsNodes):
        """When navigation, filter and wheels had their turn, and what was heard until then."""

        def __init__(self, *arguments):
            super().__init__(*arguments)
            self.heard, self.turns = 0, {'navigation': [], 'filter': []}

        def _on_reading(self, reading):
            self.heard = self.tick
            super()._on_reading(reading)

        def _navigate(self, now):
            self.turns['navigation'].append((self.tick, self.heard))

        def _localize(self, now):
            self.turns['filter'].append((self.tick, self.heard))

    phases = set()
    for seed in range(6):
        runs_ = [Watched(course, seed, setup, 1.08) for _ in range(2)]
        for run in runs_:
            for _ in range(200):
                run.step()
        turns = runs_[0].turns
        assert turns == runs_[1].turns, 'the same chair has the same phases'
        assert {b - a for (a, _), (b, _) in zip(turns['navigation'], turns['navigation'][1:])} == {5} and {
            b - a for (a, _), (b, _) in zip(turns['filter'], turns['filter'][1:])
        } == {2}
        assert all(heard < tick for turn in turns.values() for tick, heard in turn) and any(
            heard == tick - 1 for turn in turns.values() for tick, heard in turn
        )
        phases.add((turns['navigation'][0][0], turns['filter'][0][0]))
    assert len(phases) > 2
