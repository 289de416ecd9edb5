"""Runs a launch and a module of ours side by side with a ROS master of their own, and ends them in any case."""

import pickle
import re
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from sara_bringup.ros.masters import environment, launched

START_UP_S = 180.0  # of the wall clock
SLOWEST = 0.2  # of the asked speed: a busy machine makes the simulated clock wait
COLOUR = re.compile(r'\x1b\[[0-9;]*[A-Za-z]|\x1b\][^\x07]*\x07')  # of a terminal
END_S = 20.0  # of the wall clock, for a child to end when it is told to


class OverRosError(RuntimeError):
    """A run over ROS that came to nothing; the text is a sentence, with the last words of whoever failed."""


def beside(
    launch: tuple[str, str, dict[str, Any]], node: tuple, folder: Path, seconds: float, say: Callable[[str], None]
) -> Any:
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
