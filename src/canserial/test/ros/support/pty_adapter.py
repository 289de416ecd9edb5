"""For the rostests: a Lawicel adapter of a few lines on a pseudo-terminal, and waiting."""

import os
import pty
import select
import threading
import time
import tty


class PtyAdapter:
    """Answers like the adapter; `lines` holds the frames it was given to send, `commands` everything else."""

    WAIT = 0.05  # s between two calls of `say` while nothing is heard

    def __init__(self, path):
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.path, self.lines, self.commands = path, [], []
        self.plugged = True
        self.thread = threading.Thread(target=self.work, daemon=True)
        self.thread.start()
        os.symlink(os.ttyname(self.slave), path)

    def say(self):
        """Called between two lines that are heard."""

    def answer(self, line):
        """What the adapter says to a line."""
        if line[:1] == b't':
            self.lines.append(line)
            return b'z\r'
        self.commands.append(line)
        return b'\r'

    def work(self):
        buffer = b''
        while self.plugged:
            self.say()
            # Never inside read() when it is unplugged: that would hold the terminal open.
            if not select.select([self.master], [], [], self.WAIT)[0]:
                continue
            buffer += os.read(self.master, 4096)
            *complete, buffer = buffer.split(b'\r')
            for line in complete:
                os.write(self.master, self.answer(line))

    def unplug(self):
        self.plugged = False
        self.thread.join()
        os.unlink(self.path)
        os.close(self.slave)
        os.close(self.master)

    def send(self, *lines):
        os.write(self.master, b''.join(line + b'\r' for line in lines))


def wait_until(condition, seconds=20.0):
    """Whether the condition came true in time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and not condition():
        time.sleep(0.01)
    return condition()
