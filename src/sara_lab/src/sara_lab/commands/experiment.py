"""`experiment NAME`: the thesis's experiments in lockstep, without ROS, and over ROS with --ros; a table or JSON on
stdout, figures in a folder, progress on stderr.
"""

import argparse
import json
import sys
import time
from pathlib import Path

from sara_bringup.missions.mission import load_mission
from sara_bringup.missions.report import figures, table, verdict
from sara_bringup.paths import config_file, share
from sara_lab.experiments.missions import EXPERIMENTS, run

SPEED = 2.0  # simulated seconds per second, over ROS


def _process_age_s():
    """Seconds since this process was started (Linux: /proc/self/stat, field 22), interpreter and imports included."""
    import os

    ticks = int(Path('/proc/self/stat').read_text().rsplit(')', 1)[1].split()[19])
    return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf('SC_CLK_TCK')


def square(arguments):
    """`experiment square`. Exit status 0 if the drive meets the square's acceptance; with --ekf thesis, which is there
    for comparison, if it ran.
    """
    result, lockstep = run(
        'square', arguments.seed, arguments.ekf, lambda text: print(text, file=sys.stderr, flush=True)
    )
    age = _process_age_s()
    print(
        (
            f"{lockstep.time:.1f} s of the chair's time in {age:.2f} s, start of the process included: "
            f'{lockstep.time / age:.1f} times real time'
        ),
        file=sys.stderr,
    )
    from sara_lab.judge.drives import track_of
    from sara_lab.judge.judge import judge

    world = lockstep.chair.drive.world
    found = judge(track_of(result), world)
    print(
        json.dumps({**result.to_json(), 'judgement': found.to_json()})
        if arguments.json
        else f'{table(result)}\n\n{found.table()}',
        flush=True,
    )
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
        figures(result, arguments.out, (world.occupied, world.resolution, world.origin))
        (arguments.out / f'square_{arguments.ekf}.json').write_text(json.dumps(result.to_file_data()))
    faults = verdict(result, len(load_mission(config_file(EXPERIMENTS['square'])).goals))
    return faults if arguments.ekf == 'default' else []


def sensors(arguments):
    """`experiment sensors`. Exit status 0 if the chips give the thesis's figures."""
    from tqdm import tqdm

    from sara_lab.experiments import sensor_report

    seeds = range(arguments.seed, arguments.seed + arguments.chairs)
    chairs = sensor_report.run(seeds, lambda numbers: tqdm(numbers, unit='chair'))
    print(json.dumps(sensor_report.to_json(chairs)) if arguments.json else sensor_report.table(chairs), flush=True)
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
        sensor_report.figures(chairs[0], arguments.out)
    return sensor_report.verdict(chairs)


def pages_folder():
    """Where the pages of the experiments belong: docs/experiments of the workspace, or of the working directory where
    there is none.
    """
    docs = share().parents[1] / 'docs'
    return (docs if docs.is_dir() else Path('docs')) / 'experiments'


def thesis(arguments):
    """`experiment E1` to `E10`, and `all`: lockstep runs over several chairs, pages, figures and JSON; with --ros some
    of them over ROS too. Exit status 0 if what must hold does.
    """
    from tqdm import tqdm

    from sara_lab.experiments import agreement, pages, runner
    from sara_lab.experiments.registry import EXPERIMENTS as known

    chosen = list(known.values()) if arguments.name == 'all' else [known[arguments.name]]
    seeds = {experiment.name: arguments.seeds or experiment.seeds for experiment in chosen}
    folder, faults, failed = arguments.out or pages_folder(), [], []
    if arguments.ros:
        failed = _over_ros(arguments, chosen, folder)
    over_ros = {
        experiment.name: agreement.load(experiment.name, folder) or agreement.load(experiment.name, pages_folder())
        for experiment in chosen
    }
    cases = {
        case.key: case
        for experiment in chosen
        for case in (
            *experiment.cases(seeds[experiment.name]),
            *agreement.references(experiment, over_ros[experiment.name]),
        )
    }
    costs = {}
    results = runner.run(
        list(cases.values()),
        arguments.processes,
        lambda total: tqdm(total=total, unit='run', smoothing=0.05),
        arguments.keep,
        costs,
    )
    for experiment in chosen:
        report = experiment.report(results)
        if experiment.figures:
            report = agreement.with_ros(
                report,
                experiment.name,
                agreement.side(experiment, experiment.cases(seeds[experiment.name]), results),
                over_ros[experiment.name],
            )
        written = pages.write(experiment, report, folder, seeds[experiment.name])
        cost = sum(costs.get(case.key, 0.0) for case in experiment.cases(seeds[experiment.name]))
        print(
            (
                f'{experiment.name}, {experiment.title}: {report.verdict} ({seeds[experiment.name]} chairs, '
                f'{cost:.0f} s of CPU; {folder / written[0]}, {len(report.figures)} figures)'
            ),
            flush=True,
        )
        faults += [f'{experiment.name}: {fault}' for fault in report.faults]
    pages.summary(known, folder)
    return faults + failed


def _over_ros(arguments, chosen, folder):
    """Run what is chosen over ROS and put its figures beside the pages; sentences about what came to nothing."""
    import signal

    from tqdm import tqdm

    from sara_lab.experiments import agreement, runner, turns
    from sara_lab.ros.experiments.beside import OverRosError
    from sara_lab.ros.experiments.course_over_ros import BUSY
    from sara_lab.ros.experiments.run_case import run_case

    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that what was started is ended
    speed = arguments.speed or SPEED
    cases = [
        (experiment, case)
        for experiment in chosen
        if experiment.over_ros
        for case in experiment.cases(arguments.ros)
        if (any(word in case.key for word in arguments.only) if arguments.only else experiment.over_ros(case.key))
    ]
    if not cases:
        return [
            'nothing is there to run over ROS'
            + f': no set-up is called {" or ".join(arguments.only)}' * bool(arguments.only)
        ]
    gains = runner.run(
        [turns.case_of(seed) for seed in sorted({case.seed for _, case in cases if case.gain})],
        arguments.processes,
        lambda total: tqdm(total=total, unit='gain', disable=not total),
        arguments.keep,
    )
    failed, done_before = [], {}
    with tqdm(total=len(cases), unit='run over ROS', smoothing=0.05) as done:
        for experiment, case in cases:
            name = ' '.join(map(str, case.key))
            done.set_description(name)

            def say(text, name=name):
                done.set_postfix_str(text)
                if text.startswith(BUSY):
                    tqdm.write(f'{name}: {text}', file=sys.stderr)

            try:
                if case.key not in done_before:  # E1 and E2, E4 and E5 have their runs in common
                    done_before[case.key] = run_case(
                        case, gains['E6', case.seed]['gain'] if case.gain else None, speed, say
                    )
                result = done_before[case.key]
                agreement.store(experiment.name, folder, {case.key: experiment.figures(result)}, speed)
            except OverRosError as error:
                failed.append(f'{name}: {error}')
                tqdm.write(failed[-1], file=sys.stderr)
            done.update()
    return failed


def _count(text):
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f'{number}, allowed are whole numbers of 1 or more')
    return number


def _speed(text):
    speed = float(text)
    if not 0.0 < speed <= 100.0:
        raise argparse.ArgumentTypeError(f'{text}, allowed are numbers above 0, 100 at most')
    return speed


def main():
    """Exit status 1 and a sentence per fault where the acceptance is not met."""
    parser = argparse.ArgumentParser(prog='experiment', description=__doc__)
    names = parser.add_subparsers(dest='name', required=True)
    for name, function, text in (
        ('square', square, "the thesis's square, driven by the whole stack"),
        (
            'sensors',
            sensors,
            "E1, E2, E3 and E6: the IMU at rest and in full turns, beside the thesis's tables 4.1 to 4.11",
        ),
    ):
        sub = names.add_parser(name, help=text, description=function.__doc__)
        sub.set_defaults(function=function)
        sub.add_argument('--seed', type=int, default=0, help='which chair is drawn')
        sub.add_argument('--json', action='store_true', help='JSON on stdout instead of the table')
        sub.add_argument('--out', type=Path, help='folder for figures and results')
    for name in (*(f'E{number}' for number in range(1, 11)), 'all'):
        sub = names.add_parser(
            name,
            help='E1 to E10' if name == 'all' else f"the thesis's experiment {name}: page, figures and JSON",
            description=thesis.__doc__,
        )
        sub.set_defaults(function=thesis)
        sub.add_argument(
            '--seeds',
            type=_count,
            help="how many chairs, from seed 0 on; without it, as many as each experiment's page tells",
        )
        sub.add_argument(
            '--processes', type=_count, default=2, help='at the same time; the result does not depend on it'
        )
        sub.add_argument('--out', type=Path, help='folder for pages, figures and JSON; docs/experiments without it')
        sub.add_argument(
            '--ros',
            type=_count,
            nargs='?',
            const=1,
            metavar='CHAIRS',
            help=(
                'run set-ups over ROS too, by the same descriptions, with so many chairs (1), and compare; about a '
                'minute a run'
            ),
        )
        sub.add_argument(
            '--only',
            nargs='+',
            default=(),
            metavar='NAME',
            help=(
                'with --ros: the set-ups of these names (ours, thesis, left, default, ...), not those that each '
                'experiment chooses'
            ),
        )
        sub.add_argument('--speed', type=_speed, help=f'with --ros: simulated seconds per second ({SPEED:g})')
        sub.add_argument(
            '--keep',
            type=Path,
            help=(
                "folder where each run's result is kept and taken from again while the code is the same: to go on "
                'after an interruption'
            ),
        )
    names.choices['square'].add_argument('--ekf', choices=('default', 'thesis'), default='default')
    names.choices['sensors'].add_argument('--chairs', type=_count, default=10, help='how many, from --seed on')
    arguments = parser.parse_args()
    if arguments.function is thesis and not arguments.ros and (arguments.only or arguments.speed):
        parser.error('--only and --speed go with --ros: in lockstep all set-ups are driven, as fast as can be')
    faults = arguments.function(arguments)
    for fault in faults:
        print(f'NOT MET: {fault}', file=sys.stderr)
    sys.exit(1 if faults else 0)
