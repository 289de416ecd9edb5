"""A ROS master of one's own for the length of a measurement, so that nothing on the machine is disturbed."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager

from sara_common.ports import free_port

PATIENCE = 20.0  # s


@contextmanager
def own_master() -> Iterator[int]:
    """Start a master on a free port and point this process's environment at it; gives the port."""
    import rosgraph  # this module is imported where ROS is not, too

    port = free_port()
    os.environ['ROS_MASTER_URI'] = f'http://localhost:{port}'
    with subprocess.Popen(['rosmaster', '--core', '-p', str(port)], stdout=subprocess.DEVNULL) as master:
        try:
            while not rosgraph.is_master_online():
                time.sleep(0.1)
            yield port
        finally:
            master.terminate()  # SIGINT is ignored by what a shell started in the background, and by its children


@contextmanager
def running(*command, **popen) -> Iterator[subprocess.Popen]:
    """A process for the length of a block: interrupted, and waited for; ended where it does not mind."""
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, **popen) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                process.terminate()
