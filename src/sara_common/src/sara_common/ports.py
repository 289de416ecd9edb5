"""TCP ports for programs that are started for a while."""

from __future__ import annotations

import contextlib
import itertools
import os
import socket

_PORTS = itertools.count(12_000 + 16 * (os.getpid() % 1250))


def free_port() -> int:
    """A TCP port of this machine that nobody listens on; below those (32768 and up) that the kernel gives to whoever
    asks for any, or another program may have it before the one that is started listens.
    """
    while True:
        port = next(_PORTS)
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind(('', port))
            return port
