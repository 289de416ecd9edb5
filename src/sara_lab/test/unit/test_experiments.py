"""The thesis's experiments: what their parts are built of, and each of them on a chair or two, in short."""

import dataclasses
import json
import math
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_bringup.lockstep.localization import Filter
from sara_bringup.paths import config_file
from sara_common.planar import compose
from sara_common.platforms import chosen, folders
from sara_lab.experiments import (
    core,
    courses,
    drives,
    filter_costs,
    in_place,
    orientation,
    pages,
    plotting,
    ranking,
    registry,
    runner,
    school,
    square,
    square_fusions,
    square_odometry,
    turns,
    yaw_at_rest,
)
from sara_lab.experiments.core import CONFIRMED, CONTRADICTED, PARTLY, Case, Experiment, Figure, Report, Row
from sara_lab.experiments.courses import (
    BOTH,
    DEFAULT,
    FILTER,
    LONG,
    OURS,
    SHORT,
    TRUTH,
    VX,
    WHEELS,
    XY,
    XY_VX,
    Course,
    SetUp,
)
from sara_lab.workers.sources import fingerprint, folder_of

SHORT_WAY = Course((1.0, 1.0, 0.0), ((1.6, 1.0, 0.0),), (10.0, 0.0, 0.0))


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Figures of few pixels: what is in them is not looked at here."""
    monkeypatch.setitem(plotting.STYLE, 'figure.dpi', 30)


# What they are built of


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=30))
def test_a_mean_lies_in_its_interval_and_within_the_values(values):
    found = core.spread(values)
    assert (
        min(values) - 1e-9 <= found['low'] <= found['mean'] + 1e-9
        and found['mean'] <= found['high'] + 1e-9 <= max(values) + 2e-9
    )
    assert found == core.spread(values)


def test_what_is_not_known_is_left_out_and_nothing_is_nothing():
    assert (
        core.spread([1.0, math.nan, None, 3.0])['n'] == 2
        and core.spread([])['mean'] is None
        and core.interval(core.spread([])) == '-'
    )


def test_files_hold_plain_rounded_data():
    data = core.rounded({('a', 1): np.array([1.23456789, math.nan]), 'b': np.int64(3), 'c': np.bool_(True), 'd': -1e-9})
    assert json.dumps(data) == json.dumps({"('a', 1)": [1.234568, None], 'b': 3, 'c': True, 'd': 0.0})


def test_bars_in_a_cell_do_not_make_columns():
    assert core.table(('a',), [('|x|',)]).splitlines()[-1] == '| \\|x\\| |'


def test_a_ranking_tells_what_is_beyond_chance():
    random = np.random.default_rng(0)
    good = random.normal(1.0, 0.1, 20)
    text = ranking.ranking({'worse': good + 0.2, 'good': good, 'alike': good + random.normal(0.0, 0.1, 20)})
    assert text.index('good') < text.index('worse') and '< **worse**' in text and not ranking.apart(good, good)


@pytest.mark.parametrize(
    'verdicts, whole',
    (((CONFIRMED, CONFIRMED), CONFIRMED), ((CONFIRMED, CONTRADICTED), PARTLY), ((CONTRADICTED,), CONTRADICTED)),
)
def test_the_verdict_of_all_findings(verdicts, whole):
    assert Report(tuple(('', '', verdict) for verdict in verdicts), ()).verdict == whole


def _draw(path):
    from sara_lab.experiments import plotting

    with plotting.figure(path) as (_, axis):
        axis.plot([0, 1], [0, 1])


def test_pages_and_figures_are_the_same_to_the_byte_when_written_again(tmp_path):
    report = Report(
        (('it does', 'so it does', CONFIRMED),),
        (Row('a', '1 m', '2 m', 'why'),),
        (Figure('fig_4_99', 'a caption', _draw),),
        (('Heading', 'text'),),
        {'x': 1.0 / 3.0},
        ('a fault',),
    )
    experiment = Experiment('E1', 'a title', 'what was done', 3, None, None)
    folders = [tmp_path / name for name in ('one', 'two')]
    for folder in folders:
        names = pages.write(experiment, report, folder, 3)
        pages.summary({'E1': experiment, 'E2': dataclasses.replace(experiment, name='E2')}, folder)
    assert sorted(path.name for path in folders[0].iterdir()) == sorted([*names, 'README.md'])
    for path in folders[0].iterdir():
        assert path.read_bytes() == (folders[1] / path.name).read_bytes(), path.name
    page, summary = ((folders[0] / name).read_text() for name in ('E1.md', 'README.md'))
    for part in (
        'a title',
        'so it does',
        CONFIRMED,
        '- a: **2 m**; thesis: 1 m (why)',
        'fig_4_99.png',
        'a caption',
        '## Heading',
        'a fault',
    ):
        assert part in page
    assert '[E1](E1.md)' in summary and '1 not met' in summary and 'not run' in summary


def _square_of(seed, gain=None):
    return {'value': seed**2, 'gain': gain}


def test_the_number_of_processes_changes_nothing_and_gains_come_of_turns(monkeypatch):
    monkeypatch.setattr(turns, 'case_of', lambda seed: Case(('E6', seed), _square_of, seed, {'gain': 1.0 + seed}))
    cases = [Case(('a', seed), _square_of, seed, gain=seed % 2 == 0) for seed in range(6)]
    found = [runner.run(cases, processes, _Quiet) for processes in (1, 2)]
    assert found[0] == found[1] and list(found[1]) == [case.key for case in cases]
    assert found[0]['a', 4] == {'value': 16, 'gain': 5.0} and found[0]['a', 3]['gain'] is None


def _never(seed, **_):
    raise AssertionError('it was run again')


def test_kept_results_are_taken_again(tmp_path):
    cases = [Case(('a', 'x, y: 1', seed), _square_of, seed) for seed in range(3)]
    first = runner.run(cases, 1, _Quiet, tmp_path / 'kept')
    again = runner.run([dataclasses.replace(case, function=_never) for case in cases], 1, _Quiet, tmp_path / 'kept')
    assert first == again and len(list((tmp_path / 'kept').glob('*/*'))) == 3


class _Quiet:
    def __init__(self, total):
        self.left = total

    def __enter__(self):
        return self

    def update(self):
        self.left -= 1

    def __exit__(self, *_):
        assert self.left == 0


def test_all_ten_are_there_with_keys_of_their_own():
    assert list(registry.EXPERIMENTS) == [f'E{number}' for number in range(1, 11)]
    cases = [case for experiment in registry.EXPERIMENTS.values() for case in experiment.cases(2)]
    for case in cases:
        assert case.seed in (0, 1) and case.key[-1] == case.seed
    alike = {case.key: case for case in cases}
    assert all(
        (case.function, case.options) == (alike[case.key].function, alike[case.key].options) for case in cases
    ), 'one key, one run'


@pytest.mark.parametrize(
    'name', [*courses.FILES.values(), 'thesis_differential', 'thesis_vx_differential', 'thesis_xy_differential']
)
def test_every_fusion_has_its_file(name):
    assert config_file(f'ekf_{name}.yaml', 'sara_localization').exists()


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-180.0, 180.0), st.floats(-180.0, 180.0))
def test_a_course_is_put_on_the_map_and_taken_back(x, y, yaw, turned):
    course = Course((0.0, 0.0, 0.0), (), (3.0, -2.0, turned))
    back = course.back(np.array([course.placed((x, y, yaw))]))[0]
    assert back[:2] == pytest.approx((x, y), abs=1e-9) and math.cos(back[2] - math.radians(yaw)) == pytest.approx(1.0)


# Set-ups, on a way of 0.6 m


def test_the_wheels_are_taken_for_the_pose_or_the_truth_is():
    wheels, truth = (
        drives.course_driven(1, SHORT_WAY, SetUp(OURS, fusion), trace=True)['trace'] for fusion in (WHEELS, TRUTH)
    )
    assert np.abs(wheels['fused'] - wheels['wheels']).max() < 1e-9
    assert np.abs(truth['fused'][:, :2] - truth['true'][:, :2]).max() < 0.06, 'as old as the newest odometry'
    assert (
        set(truth) == {'t', 'true', 'fused', 'wheels', 'imu_yaw', 'imu_rate', 'wheel_rate', 'v', 'w', 'ends'}
        and np.isfinite(truth['imu_rate']).all()
    )


@pytest.mark.parametrize('fusion', (DEFAULT, XY_VX))
def test_no_fusion_is_corrected_by_the_sonars_as_none_is_over_ros(fusion):
    assert type(drives.Recorded(square.SQUARE, 0, SetUp(OURS, fusion), None).localization) is Filter


def test_a_calibrated_chair_s_odometry_turns_as_the_chair_does():
    quarter = Course((0.0, 0.0, 0.0), ((0.0, 0.0, 90.0),), (15.0, 4.0, 0.0))
    wrong, right = (
        drives.course_driven(1, quarter, SetUp(OURS, WHEELS, calibrated=calibrated))['turned']
        for calibrated in ('', courses.GEOMETRY)
    )
    assert wrong['wheels'][0] / wrong['true'][0] > 1.2 and right['wheels'][0] / right['true'][0] == pytest.approx(
        1.0, abs=0.02
    )


def test_the_pose_is_told_to_the_filter_alone_or_to_the_imu_too():
    course = Course((1.0, 1.0, 90.0), ((1.0, 1.0, 100.0),), (10.0, 0.0, 0.0), timeout_s=3.0)
    told, both = (
        drives.Recorded(course, 1, SetUp(OURS, VX, file='thesis_vx_differential', posed=posed), None)
        for posed in (FILTER, BOTH)
    )
    for lockstep in (told, both):
        lockstep.start_up()
        assert math.dist(lockstep.fused[:2], (0.0, 0.0)) < 0.01
        assert 1 <= lockstep.pose_estimate() < drives.CLICKS
        assert math.dist(lockstep.fused[:2], course.placed(course.start)[:2]) < drives.SHOWN_M and lockstep.fused[
            2
        ] == pytest.approx(math.pi / 2, abs=0.05)
    assert told.reader.yaw == pytest.approx(0.0, abs=0.01) and both.reader.yaw == pytest.approx(math.pi / 2, abs=0.01)


def test_whoever_is_steered_by_the_wheels_believes_them():
    lockstep = drives.Recorded(SHORT_WAY, 1, SetUp(OURS, VX, steer_by_wheels=True), None)
    lockstep.start_up()
    lockstep.odometry = (1.0, 0.5, 0.2)
    assert lockstep._map_pose() == pytest.approx(compose(SHORT_WAY.placed(SHORT_WAY.start), (1.0, 0.5, 0.2)))


@pytest.mark.parametrize('planner', (SHORT, LONG))
def test_the_thesis_s_planner_is_read_without_a_warning(planner):
    from sara_common.files import merged
    from sara_common.platforms import parameters
    from sara_nav.config.parameters import Parameters
    from sara_nav.move_base.settings import read_settings

    settings = read_settings(
        Parameters(merged(parameters('sara_nav', 'sara_nav.yaml'), courses.navigation(planner, 0.2)))
    )
    assert (
        settings.local_planner.config.sim_time == courses.SIM_TIMES[planner]
        and settings.local_planner.config.max_vel_theta == 0.2
    )
    assert type(settings.local_planner).plugin_name.endswith('TrajectoryPlannerROS')


# The experiments, in short


def test_madgwick_s_yaw_is_unwrapped_through_half_a_turn():
    yaw = np.linspace(0.0, 350.0, 100)
    sent = ((yaw + 180.0) % 360.0 - 180.0 + 32.768) % 65.536 - 32.768
    assert orientation.unwrapped(sent) == pytest.approx(yaw, abs=1e-9)


def test_madgwick_costs_more_than_the_complementary_filter():
    cost = filter_costs.costs()
    assert cost['madgwick'][0] > 3 * cost['complementary'][0] > 0 and filter_costs.costs() == cost


@pytest.fixture(scope='module', name='sensors')
def sensors_of_a_chair():
    cases = {
        case.key: case for name in ('E1', 'E2', 'E3', 'E4', 'E5', 'E6') for case in registry.EXPERIMENTS[name].cases(1)
    }
    return runner.run(list(cases.values()), 1, _Quiet)


@pytest.mark.parametrize(
    'name, figures',
    (
        ('E1', (1, 2, 3, 4)),
        ('E2', (5, 6, 7, 8)),
        ('E3', (9, 10, 11, 14)),
        ('E4', (12, 13, 15, 18)),
        ('E5', ()),
        ('E6', (17,)),
    ),
)
def test_the_sensors_experiments_on_a_chair(sensors, name, figures, tmp_path):
    experiment = registry.EXPERIMENTS[name]
    report = experiment.report(sensors)
    assert [figure.name for figure in report.figures] == [f'fig_4_{number:02d}' for number in figures]
    pages.write(experiment, report, tmp_path, 1)
    assert len(list(tmp_path.glob('*.png'))) == len(figures)
    json.loads((tmp_path / f'{name}.json').read_text())


def test_sensors_findings_are_what_the_results_say(sensors):
    def with_left(left):
        return {
            key: {**result, 'pc': [{**trial, 'left': left} for trial in result['pc']]} if key[0] == 'yaw' else result
            for key, result in sensors.items()
        }

    good, bad = yaw_at_rest.yaw(with_left(0.0001)), yaw_at_rest.yaw(with_left(0.02))
    assert good.findings[0][2] == CONFIRMED and not good.faults and bad.findings[0][2] == PARTLY and bad.faults
    off = {
        key: {**result, 'marks': {90.0: 90.0, 180.0: 180.0, 270.0: 270.0, 360.0: 360.0}} if key[0] == 'E6' else result
        for key, result in sensors.items()
    }
    assert turns.report(off).faults and not turns.report(sensors).faults


def test_turns_in_place_on_a_chair(tmp_path):
    results = runner.run(
        [case for case in in_place.cases(1) if case.key[1] == 'ours']
        + [
            Case(
                ('E7', 'thesis', way, 0),
                drives.course_driven,
                0,
                {
                    'course': in_place.COURSES[way],
                    'setup': dataclasses.replace(in_place.SETUPS['thesis'], planner=LONG),
                    'trace': True,
                },
            )
            for way in ('left', 'right')
        ],
        1,
        _Quiet,
    )
    report = in_place.report(results)
    assert report.faults == () and report.data['ours']['reached'] == 8
    pages.write(in_place.EXPERIMENT, report, tmp_path, 1)
    assert {path.name for path in tmp_path.glob('*.png')} == {'fig_4_19.png', 'fig_4_20.png'}


def made_up(corner, seen=0.05, straight=0.05, long_way=False, seconds=80.0, goals=4, pace=0.4):
    """A drive's result with these figures, as course_driven gives it, and a trace to draw."""
    t = np.linspace(0.0, seconds, 30)
    path = np.column_stack([np.cos(t), np.sin(t), t / 10.0])
    judged = {
        'reached': goals,
        'position': [seen] * goals,
        'yaw': [0.5] * goals,
        'cross_track_p95': straight,
        'reversals_per_m': 0.3,
        'beyond': 0.0,
    }
    legs = [{'net': -270.0 if long_way else 90.0, 'all': 280.0 if long_way else 92.0, 'least': 90.0}] * goals
    trace = {
        't': t,
        'true': path,
        'fused': path + 0.1,
        'wheels': path + 0.2,
        'imu_yaw': t / 10.0,
        'imu_rate': t * 0.0,
        'wheel_rate': t * 0.0,
        'v': t * 0.0,
        'w': t * 0.0,
        'ends': t[[10, 20]],
    }
    return {
        'contacts': 0,
        'seconds': seconds,
        'texts': [],
        'clicks': 1,
        'true': {**judged, 'position': [corner] * goals},
        'fused': judged,
        'wheels': judged,
        'legs': legs,
        'turned': {
            'true': [70.0, 143.0, 216.0, 285.0],
            'wheels': [90.0, 180.0, 270.0, 360.0],
            'imu': [70.0, 143.0, 216.0, 285.0],
        },
        'turn_acceleration': 0.3,
        'pace': pace,
        'fused_yaw_error': 1.0,
        'fused_end_error': [0.05] * goals,
        'trace': trace,
    }


def nine(**fusion):
    """Results of E9 as the thesis found them; `fusion`: other results by name."""
    found = {
        (VX, SHORT): made_up(3.0),
        (XY, SHORT): made_up(2.0, long_way=True),
        (XY_VX, SHORT): made_up(0.8, straight=0.1, long_way=True),
        (XY_VX, LONG): made_up(0.8, straight=0.02, pace=0.3),
        (VX, LONG): made_up(0.1, pace=0.3),
    }
    found.update(fusion.get('other', {}))
    return {
        ('E9', *key, seed): found.get((key[2], key[1]), made_up(0.1)) for key in square.setups_9() for seed in (0, 1)
    }


def test_verdicts_of_the_fusions_follow_the_results(tmp_path):
    report = square_fusions.fusions(nine())
    verdicts = [verdict for _, _, verdict in report.findings]
    assert verdicts[:3] == [CONFIRMED, CONFIRMED, CONFIRMED] and verdicts[4:6] == [CONFIRMED, CONFIRMED]
    other = square_fusions.fusions(
        nine(other={(VX, SHORT): made_up(0.05), (XY, SHORT): made_up(0.5), (XY_VX, LONG): made_up(0.8, straight=0.3)})
    )
    assert [verdict for _, _, verdict in other.findings][:3] == [CONTRADICTED, PARTLY, CONTRADICTED] and other.findings[
        4
    ][2] == PARTLY
    pages.write(square_fusions.EXPERIMENT, report, tmp_path, 2)
    assert {f'fig_4_{number}.png' for number in range(24, 40)} <= {path.name for path in tmp_path.glob('*.png')}


def test_odometry_alone_fails_and_calibrated_does_not_in_truth():
    results = runner.run(square.cases_8(2), 1, _Quiet)
    report = square_odometry.odometry_alone(results)
    low, high = report.data['gain_error_range']
    least, most = report.data['gain_error_range_radii_known']
    assert low < least and most < high and least >= 1.25 and most <= 1.30, (
        'what is left when the radii are known is the slip'
    )
    assert (
        report.faults == ()
        and report.data['last_corner_m']['ours']['mean'] > 2.0
        and report.data['last_corner_m']['ours, calibrated']['mean'] < 0.1
    )


def test_verdicts_of_the_differential_settings_follow_the_results(tmp_path):
    def results(true, false):
        return {
            ('E10', *key, seed): made_up(true if key[1] == school.TRUE else false, straight=true / 10.0, goals=1)
            for key in school.SETUPS
            for seed in (0, 1)
        }

    as_thesis, otherwise = school.report(results(5.0, 0.1)), school.report(results(0.1, 5.0))
    assert as_thesis.findings[1][2] == CONFIRMED and otherwise.findings[1][2] == CONTRADICTED
    pages.write(school.EXPERIMENT, as_thesis, tmp_path, 2)
    assert {f'fig_4_{number}.png' for number in range(40, 44)} <= {path.name for path in tmp_path.glob('*.png')}


def test_the_command_writes_its_page_and_the_summary(tmp_path, monkeypatch, capsys):
    from sara_lab.commands import experiment

    monkeypatch.setattr('sys.argv', ['experiment', 'E6', '--seeds', '1', '--processes', '1', '--out', str(tmp_path)])
    with pytest.raises(SystemExit) as ended:
        experiment.main()
    assert ended.value.code == 0 and 'E6, full turns' in capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} == {'E6.md', 'E6.json', 'fig_4_17.png', 'README.md'}


def test_a_default_that_fails_is_not_met():
    lost = nine()
    for key in lost:
        if key[1:4] == ('square', OURS, DEFAULT):
            lost[key] = {**lost[key], 'true': {**lost[key]['true'], 'reached': 3}}
    assert any('default' in fault for fault in square_fusions.fusions(lost).faults)


def _robot(seed):
    return {'robot': chosen().name}


def test_what_is_kept_of_one_robot_is_not_taken_for_another(tmp_path, monkeypatch):
    for name in ('sara', 'kate'):
        monkeypatch.setenv('SARA_PLATFORM', name)
        assert runner.run([Case(('X', 0), _robot, 0)], 1, keep=tmp_path) == {('X', 0): {'robot': name}}


def test_a_robot_s_folder_outside_the_packages_is_part_of_the_key(tmp_path, monkeypatch):
    mary = tmp_path / 'mary'
    shutil.copytree(folders()['kate'], mary)
    monkeypatch.setenv('SARA_PLATFORM', str(mary))
    before, path = folder_of(tmp_path), mary / 'platform.yaml'
    path.write_text(path.read_text() + '\n# another\n')
    assert folder_of(tmp_path) != before and folder_of(tmp_path).name.startswith('mary_')


def test_results_of_other_code_are_not_taken(tmp_path, monkeypatch):
    (tmp_path / 'pkg' / 'src' / 'experiments').mkdir(parents=True)
    (tmp_path / 'pkg' / 'test').mkdir()
    sources = {
        name: tmp_path / 'pkg' / name for name in ('src/a.py', 'b.yaml', 'src/experiments/pages.py', 'test/c.py')
    }
    for path in sources.values():
        path.write_text('1')
    prints = {'': fingerprint(tmp_path)}
    for name, path in sources.items():
        path.write_text('2')
        prints[name] = fingerprint(tmp_path)
    assert len({prints[''], prints['src/a.py'], prints['b.yaml']}) == 3
    assert prints['b.yaml'] == prints['src/experiments/pages.py'] == prints['test/c.py'], 'what only draws and writes'
    case = Case(('a', 0), _square_of, 0)
    costs = {}
    for code, ran in (('one', True), ('one', False), ('two', True)):
        monkeypatch.setattr(runner, 'folder_of', lambda out, code=code: out / code)
        costs.clear()
        runner.run([case], 1, _Quiet, tmp_path / 'kept', costs)
        assert (case.key in costs) == ran
