"""drives.course_driven's twin over ROS: the same Course and SetUp, the same figures, by sara.launch with the simulated
chair.

roslaunch and course_node.py run as children with a master of their own, and are ended whatever happens.
"""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from sara_bringup.paths import share
from sara_lab.experiments import courses, drive_data
from sara_lab.ros.experiments.beside import OverRosError, beside
from sara_sim.chair import SimulatedChair
from sara_sim.world.world import World

if TYPE_CHECKING:
    from sara_lab.experiments.courses import Course, SetUp

BUSY = 'the machine is busy'
KEPT_UP = 0.9  # of the asked speed; less is told


def arguments(
    seed: int, course: Course, setup: SetUp, gain: float | None, folder: Path, speed: float
) -> dict[str, Any]:
    """{name: value} for experiment.launch. `folder`: a Path for what belongs to this run alone. Raises OverRosError
    where a set-up cannot be launched.
    """
    if setup.raw_rate:
        raise OverRosError("raw_rate has no launch file: read.py does not publish the chip's own rate")
    tree = courses.navigation(setup.planner, setup.turn_rate)
    x, y, yaw = course.placed(course.start)
    steered = (
        'wheels'
        if setup.fusion == courses.WHEELS or setup.steer_by_wheels
        else 'fake'
        if setup.fusion == courses.TRUTH
        else 'ekf'
    )
    found = {
        'map': share() / 'maps' / f'{course.map}.yaml',
        'x': x,
        'y': y,
        'yaw': yaw,
        'seed': seed,
        'speed': speed,
        'port': folder / 'can',
        'calibration_file': folder / 'calibration.yaml',
        'ekf': setup.localization,
        'localization': steered,
        'posed': setup.posed,
        'filter_beside': str(setup.steer_by_wheels).lower(),
    }
    if tree:
        (folder / 'navigation.yaml').write_text(yaml.safe_dump(tree))
        found['navigation'] = folder / 'navigation.yaml'
    if setup.own_gain and gain is not None:
        found['gain'] = gain
    if setup.calibrated:
        found.update(
            zip(
                ('separation', 'left_radius', 'right_radius'),
                courses.multipliers(setup, SimulatedChair(World.empty(), seed)),
            )
        )
    return found


def course_over_ros(
    seed: int,
    course: Course,
    setup: SetUp,
    gain: float | None = None,
    trace: bool = False,
    speed: float = 2.0,
    say: Callable[[str], None] = lambda text: None,
) -> dict:
    """Drive a Course over ROS with the chair `seed`; the dict that drives.course_driven gives. `speed`: simulated
    seconds per second. `say`: called with each sentence on the way. Raises OverRosError.
    """
    with tempfile.TemporaryDirectory(prefix='sara_') as name:
        folder = Path(name)
        asked = folder / 'course.pickle'
        asked.write_bytes(pickle.dumps((course, setup)))
        seconds = len(course.goals) * (course.timeout_s + course.pause_s) + 40.0
        driven = beside(
            ('sara_bringup', 'experiment.launch', arguments(seed, course, setup, gain, folder, speed)),
            ('sara_lab.ros.experiments.course_node', asked),
            folder,
            seconds / speed,
            say,
        )
    if driven['speed'] < KEPT_UP * speed:
        say(f'{BUSY}: {driven["speed"]:.2f} instead of {speed:g} times real time; figures may suffer')
    return {
        'clicks': driven['clicks'],
        **drive_data.figures(driven['rows'], driven['contacts'], course, driven['goals'], trace),
    }
