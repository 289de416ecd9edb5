"""drives.course_driven's twin over ROS: the same Course and SetUp, the same figures, by sara.launch with the simulated
chair.

roslaunch and course_node.py run as children with a master of their own, and are ended whatever happens.
"""

import pickle
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import yaml

from sara_bringup.paths import share
from sara_bringup.ros.masters import environment, launched
from sara_lab.experiments import drives
from sara_sim.chair import SimulatedChair
from sara_sim.world.world import World

START_UP_S = 180.0  # of the wall clock
BUSY = 'the machine is busy'
KEPT_UP = 0.9  # of the asked speed; less is told
SLOWEST = 0.2  # of the asked speed: a busy machine makes the simulated clock wait
COLOUR = re.compile(r'\x1b\[[0-9;]*[A-Za-z]|\x1b\][^\x07]*\x07')  # of a terminal
END_S = 20.0  # of the wall clock, for a child to end when it is told to


class OverRosError(RuntimeError):
    """A run over ROS that came to nothing; the text is a sentence, with the last words of whoever failed."""


def arguments(seed, course, setup, gain, folder, speed):
    """{name: value} for experiment.launch. `folder`: a Path for what belongs to this run alone. Raises OverRosError
    where a set-up cannot be launched.
    """
    if setup.raw_rate:
        raise OverRosError("raw_rate has no launch file: read.py does not publish the chip's own rate")
    tree = drives.navigation(setup.planner, setup.turn_rate)
    x, y, yaw = course.placed(course.start)
    steered = (
        'wheels'
        if setup.fusion == drives.WHEELS or setup.steer_by_wheels
        else 'fake'
        if setup.fusion == drives.TRUTH
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
                drives.multipliers(setup, SimulatedChair(World.empty(), seed)),
            )
        )
    return found


def course_over_ros(seed, course, setup, gain=None, trace=False, speed=2.0, say=lambda text: None):
    """Drive a Course over ROS with the chair `seed`; the dict that drives.course_driven gives. `speed`: simulated
    seconds per second. `say`: called with each sentence on the way. Raises OverRosError.
    """
    with tempfile.TemporaryDirectory(prefix='sara') as name:
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
        **drives.figures(driven['rows'], driven['contacts'], course, driven['goals'], trace),
    }


def beside(launch, node, folder, seconds, say):
    """Start a launch (package, file, {argument: value}) and a module of ours beside it (name, words; the last, a file
    for its pickled result, is added), with a master of their own; what it leaves.
    `folder`: for them alone. `seconds`: of the wall clock that it should take. Raises OverRosError.
    """
    came, log, words, env = folder / 'result.pickle', folder / 'launch.log', folder / 'node.log', environment()
    came.unlink(missing_ok=True)
    with (
        log.open('w') as told,
        words.open('w') as said,
        launched(*launch, env, stdout=told, stderr=subprocess.STDOUT) as roslaunch,
    ):
        child = subprocess.Popen(
            [sys.executable, '-m', *map(str, node), str(came)], env=env, stdout=said, stderr=subprocess.STDOUT
        )
        try:
            _watch(roslaunch, child, log, words, time.monotonic() + START_UP_S + seconds / SLOWEST, say)
        finally:
            _end(child)
    if not came.exists():
        raise OverRosError(f'the run over ROS left no result (status {child.returncode}): {_last(words)}')
    return pickle.loads(came.read_bytes())


def run_case(case, gain, speed, say):
    """A Case over ROS; what its function gives in lockstep, as far as its experiment's `figures` need it. Raises
    OverRosError.
    """
    if case.function is not drives.course_driven:
        from sara_lab.ros.experiments import bench_over_ros

        return bench_over_ros.run_case(case, speed, say)
    return course_over_ros(case.seed, gain=gain, speed=speed, say=say, **{**case.options, 'trace': False})


def _watch(roslaunch, child, log, words, until, say):
    """Until the child has ended. Raises OverRosError where the launch ends before, or nothing comes of it."""
    said = ''
    while child.poll() is None:
        if roslaunch.poll() is not None:
            raise OverRosError(
                f'roslaunch ended with status {roslaunch.returncode} before the run was over: {_last(log)}'
            )
        if time.monotonic() > until:
            raise OverRosError(f'the run over ROS did not end in time; its last words: {_last(words)}')
        text = _last(words, '')
        if text != said:
            said = text
            say(text)
        time.sleep(0.2)


def _end(child):
    if child.poll() is None:
        child.terminate()
    try:
        child.wait(END_S)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()


def _last(path, nothing='it said nothing'):
    """What a log has to say of a failure: the last line of the worst kind."""
    lines = [COLOUR.sub('', line).strip() for line in path.read_text(errors='replace').splitlines()]
    lines = [
        line for line in lines if line and not line.startswith('The traceback for')
    ]  # of roslaunch, behind what it has to say
    for worst in ('RLException', '[FATAL]', '[ERROR]', ''):
        found = [line for line in lines if line.startswith(worst)]
        if found:
            return found[-1]
    return nothing
