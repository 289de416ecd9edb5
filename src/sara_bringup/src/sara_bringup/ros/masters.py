"""A ROS master of one's own for the length of a run, so that nothing on the machine is disturbed."""

import multiprocessing
import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from sara_common.ports import free_port


def environment() -> dict[str, str]:
    """os.environ with the address of a master on a free port, readable logs and unbuffered output."""
    return {
        **os.environ,
        'PYTHONUNBUFFERED': '1',
        'ROSCONSOLE_FORMAT': '[${severity}] [${node}] ${message}',
        'ROS_MASTER_URI': f'http://localhost:{free_port()}',
    }


@contextmanager
def launched(
    package: str, launch_file: str, arguments: dict[str, Any], env: dict[str, str], **popen
) -> Iterator[subprocess.Popen]:
    """roslaunch with a master at `env`'s address; ended, and waited for, when the block is left."""
    port = env['ROS_MASTER_URI'].rsplit(':', 1)[1]
    process = subprocess.Popen(
        ['roslaunch', '--no-summary', '-p', port, package, launch_file]
        + [f'{name}:={value}' for name, value in arguments.items()],
        env=env,
        **popen,
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


def in_a_process(function: Callable, *arguments) -> Any:
    """function(*arguments) in a process that ends with it: one can be a ROS node only once."""
    with multiprocessing.get_context('fork').Pool(1, maxtasksperchild=1) as pool:
        return pool.apply(function, arguments)
