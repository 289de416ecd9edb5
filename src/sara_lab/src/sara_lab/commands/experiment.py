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
from sara_bringup.paths import config_file
from sara_common import platforms
from sara_lab.experiments.missions import EXPERIMENTS, run
from sara_lab.workers import cluster_command

SPEED = 2.0  # simulated seconds per second, over ROS


def _process_age_s():
    """Seconds since this process was started (Linux: /proc/self/stat, field 22), interpreter and imports included."""
    import os

    ticks = int(Path('/proc/self/stat').read_text().rsplit(')', 1)[1].split()[19])
    return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf('SC_CLK_TCK')


def square(arguments: argparse.Namespace) -> list[str]:
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


def sensors(arguments: argparse.Namespace) -> list[str]:
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


def thesis(arguments: argparse.Namespace) -> list[str]:
    """`experiment E1` to `E10`, and `all`: lockstep runs over several chairs, pages, figures and JSON; with --ros some
    of them over ROS too. Exit status 0 if what must hold does.
    """
    from sara_lab.commands.thesis import run

    return run(arguments, arguments.speed or SPEED)


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


def main() -> None:
    """Exit status 1 and a sentence per fault where the acceptance is not met."""
    parser = argparse.ArgumentParser(prog='experiment', description=__doc__)
    names = parser.add_subparsers(dest='name', required=True)
    _add_drives(names)
    for name in (*(f'E{number}' for number in range(1, 11)), 'all'):
        _add_thesis(names, name)
    arguments = parser.parse_args()
    if arguments.function is thesis:
        arguments.where = cluster_command.asked(parser, arguments, arguments.processes)
    if arguments.function is thesis and not arguments.ros and (arguments.only or arguments.speed):
        parser.error('--only and --speed go with --ros: in lockstep all set-ups are driven, as fast as can be')
    faults = arguments.function(arguments)
    for fault in faults:
        print(f'NOT MET: {fault}', file=sys.stderr)
    sys.exit(1 if faults else 0)


def _add_drives(names):
    """The sub-commands square and sensors."""
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
    platforms.add_option(names.choices['square'])
    names.choices['square'].add_argument('--ekf', choices=('default', 'thesis'), default='default')
    names.choices['sensors'].add_argument('--chairs', type=_count, default=10, help='how many, from --seed on')


def _add_thesis(names, name):
    """The sub-command of an experiment, or of all."""
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
    sub.add_argument('--processes', type=_count, default=2, help='at the same time; the result does not depend on it')
    sub.add_argument('--out', type=Path, help='folder for pages, figures and JSON; docs/experiments without it')
    sub.add_argument(
        '--keep',
        type=Path,
        help=(
            "folder where each run's result is kept and taken from again while the code is the same: to go on "
            'after an interruption'
        ),
    )
    cluster_command.add_options(sub)
    _add_ros(sub)


def _add_ros(sub):
    """The options of runs over ROS."""
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
