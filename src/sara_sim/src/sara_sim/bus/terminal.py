"""A pseudo-terminal whose far end is found under a fixed name, as a serial adapter would be.

Nothing here blocks: what the reader does not take in time is dropped, whole frames at a time, and counted by the
caller.
"""

from __future__ import annotations

import array
import fcntl
import os
import select
import termios
import tty

# What may wait for a slow reader before frames are dropped.
MAX_PENDING = 2048


class PortError(OSError):
    """The name for the port cannot be used."""


class Terminal:
    """`path`: the symbolic link to the slave. Use as a context manager, or `close` it."""

    def __init__(self, path: str):
        self.path = path
        self._pending = bytearray()
        if os.path.lexists(path) and not os.path.islink(path):
            raise PortError(f'port is {path!r} but that exists and is not a link to a pseudo-terminal.')
        self._master, self._slave = os.openpty()
        try:
            # Held open here too: the terminal outlives a PC side that closes and reopens it.
            tty.setraw(self._slave)
            os.set_blocking(self._master, False)
            self.device = os.ttyname(self._slave)
            fresh = f'{path}.{os.getpid()}'
            os.symlink(self.device, fresh)
            os.replace(fresh, path)
        except OSError as error:
            os.close(self._master)
            os.close(self._slave)
            raise PortError(f'port is {path!r} but a link cannot be made there: {error.strerror}.') from error

    def __enter__(self) -> Terminal:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """Remove the link, if it is still ours, and the terminal."""
        try:
            if os.readlink(self.path) == self.device:
                os.unlink(self.path)
        except OSError:
            pass  # somebody removed it: nothing is left to do
        os.close(self._master)
        os.close(self._slave)

    def read(self, timeout: float) -> bytes:
        """What has been written to the far end, waiting at most `timeout` s for the first byte."""
        try:
            if not select.select([self._master], [], [], max(timeout, 0.0))[0]:
                return b''
            return os.read(self._master, 4096)
        except (BlockingIOError, InterruptedError):
            return b''
        except OSError:
            return b''

    def write(self, data: bytes) -> bool:
        """Hand bytes to the far end. False: they were dropped, since earlier ones still wait for a reader."""
        if self._pending:
            self._flush()
        if len(self._pending) + len(data) > MAX_PENDING:
            return False
        self._pending += data
        self._flush()
        return True

    def unread(self) -> int:
        """Bytes that the far end was sent and has not read yet."""
        waiting = array.array('i', [0])
        fcntl.ioctl(self._slave, termios.FIONREAD, waiting)
        return waiting[0] + len(self._pending)

    def discard(self) -> None:
        """Forget what the far end has not read."""
        self._pending.clear()
        termios.tcflush(self._slave, termios.TCIFLUSH)

    def _flush(self) -> None:
        try:
            while self._pending:
                del self._pending[: os.write(self._master, self._pending)]
        except (BlockingIOError, InterruptedError):
            pass  # the reader is behind: the rest goes with the next bytes
        except OSError:
            self._pending.clear()
