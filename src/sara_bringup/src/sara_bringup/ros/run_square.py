"""`make run`: starts the simulated chair and the whole stack, drives the square, and shows what came of it.

Twice, with the default fusion and with the thesis's; the second is printed beside the first, whatever it gives.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from sara_bringup.missions.drive import Drive
from sara_bringup.missions.mission import load_mission
from sara_bringup.missions.report import figures, table, verdict
from sara_bringup.paths import config_file, share
from sara_bringup.ros.masters import environment, launched
from sara_common import platforms
from sara_sim.world.world import World


def drive(ekf: str, out: Path, seed: int, speed: float, rviz: bool) -> Drive | None:
    """Launch the stack with a ROS master of its own and run square.py; the Drive, or None if it left no result."""
    result = out / f'square_{ekf}.json'
    result.unlink(missing_ok=True)
    env = environment()
    with tempfile.TemporaryDirectory(prefix='sara_') as folder:
        arguments = {
            'ekf': ekf,
            'seed': seed,
            'speed': speed,
            'rviz': str(rviz).lower(),
            'port': f'{folder}/can',
            'record': 'true',
            'bag': out / f'square_{ekf}.bag',
            'ranges': 'false',
        }  # wheels and gyro alone, as the thesis drove it
        with launched('sara_bringup', 'sara.launch', arguments, env):
            subprocess.run(
                [
                    'rosrun',
                    'sara_bringup',
                    'square.py',
                    f'_result:={result}',
                    f'_seed:={seed}',
                    f'_ekf:={ekf}',
                    '__name:=square',
                ],
                check=False,
                env=env,
            )
    if not result.exists():
        return None
    return Drive.from_file_data(json.loads(result.read_text()))


def main() -> None:
    """Exit status 0 if the default fusion's drive meets the square's acceptance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--out', type=Path, default=Path('out'), help='folder for figures, bags and results')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--speed', type=float, default=2.0, help='simulated seconds per second')
    platforms.add_option(parser)
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    world = World.from_yaml(share() / 'maps' / 'room.yaml')
    goals = len(load_mission(config_file('square.yaml')).goals)
    rviz = bool(os.environ.get('DISPLAY'))
    drives = {}
    for ekf in ('default', 'thesis'):
        print(
            (
                f'== driving the square with ekf:={ekf}, {arguments.speed:g} times real time, '
                f'{"with" if rviz else "without"} RViz'
            ),
            flush=True,
        )
        drives[ekf] = drive(ekf, out, arguments.seed, arguments.speed, rviz)
        if drives[ekf] is not None and drives[ekf].samples:
            figures(drives[ekf], out, (world.occupied, world.resolution, world.origin))
    for result in drives.values():
        if result is not None:
            print(f'\n{table(result)}')
    written = sorted(path.name for path in out.glob('square_*.*'))
    print(f'\nin {os.path.relpath(out)}/: {", ".join(written)}')
    faults = (
        ['no result: the drive did not end by itself']
        if drives['default'] is None
        else verdict(drives['default'], goals)
    )
    for fault in faults:
        print(f'NOT MET: {fault}')
    print('the square: ' + ('failed' if faults else 'driven'))
    print('drive it on a touch screen: roslaunch sara_bringup sara.launch hmi:=true, then open http://localhost:8080')
    sys.exit(1 if faults else 0)
