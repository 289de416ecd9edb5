"""Runs a node of the low level on a real clock: a 10 ms loop around a pure object, with the CAN bus, a log and a clean
end.

The loop keeps its phase: a late turn is followed by one on time, and turns that were missed are counted, not repeated.
The CAN adapter is kept alive by canserial's Link, whose threads only queue frames; everything else happens in the loop.
"""

from __future__ import annotations

import argparse
import queue
import re
import signal
import sys
import time
from collections.abc import Callable, Iterable
from contextlib import suppress

from canserial.adapter.adapter import Adapter, AdapterConfig
from canserial.adapter.link import Link
from canserial.dbc.bus import BusDescription, BusError
from canserial.frame import Frame
from sara_common.config import ConfigError
from sara_lowlevel.hardware import HardwareError

PERIOD_S = 0.01
BITRATE = 500000
_MAX_INCOMING = 1000


def adapter_config(text: str) -> AdapterConfig:
    """Of INTERFACE:CHANNEL or INTERFACE:CHANNEL@BITRATE, as python-can names them. Raises ConfigError."""
    interface, colon, channel = text.partition(':')
    channel, at, rate = channel.rpartition('@') if '@' in channel else (channel, '', '')
    if not colon or not channel or (at and not rate.isdigit()):
        raise ConfigError(
            f'--can is {text!r}, allowed is INTERFACE:CHANNEL[@BITRATE], such as socketcan:can0, '
            'slcan:/dev/ttyUSB0@500000 or udp_multicast:239.74.163.2'
        )
    config = AdapterConfig(interface=interface, port=channel, bitrate=int(rate) if rate else BITRATE)
    for remark in config.remarks if rate else ():
        print(f'note: {remark}', file=sys.stderr)
    return config


def common_arguments(parser: argparse.ArgumentParser) -> None:
    """The options every command has."""
    parser.add_argument(
        '--can',
        required=True,
        metavar='INTERFACE:CHANNEL[@BITRATE]',
        help='the CAN adapter, as python-can names it: socketcan:can0, slcan:/dev/canusb, udp_multicast:239.74.163.2',
    )
    parser.add_argument(
        '--dbc',
        default='',
        help="bus description: name of a DBC file of the platform, or a path (the platform's own); +compass behind it, "
        "or alone: with the magnetometer's frame",
    )
    parser.add_argument('--record', metavar='FILE', help='log frames sent and received to FILE, as candump -l does')


class Recorder:
    """candump's log format: (seconds) channel id#data. A full disk ends the recording, not the node."""

    def __init__(self, name: str, channel: str, wall_clock: Callable[[], float] = time.time) -> None:
        try:
            self._file = open(name, 'w', encoding='ascii')  # noqa: SIM115 (it stays open as long as the node runs)
        except OSError as error:
            raise HardwareError(f'--record {name}: {error.strerror}') from error
        self._channel, self._clock = channel, wall_clock
        self.problem = ''

    def write(self, frame: Frame) -> None:
        """One line."""
        if self._file is None:
            return
        identifier = f'{frame.id:08X}' if frame.extended else f'{frame.id:03X}'
        try:
            self._file.write(f'({self._clock():.6f}) {self._channel} {identifier}#{frame.data.hex().upper()}\n')
        except OSError as error:
            self.problem = f'the recording ended: {error.strerror}'
            self._file = None

    def close(self) -> None:
        """Write out what is left."""
        file, self._file = self._file, None
        if file is not None:
            try:
                file.close()
            except OSError as error:
                self.problem = f'the recording ended: {error.strerror}'


class Runner:
    """One node's loop.

    `step(t, frames)`: called every 10 ms with seconds since the start and the frames received since the last call;
    returns frames to send.
    `status()`: what the node says of itself, a short text. `at_end()`: called first of all when the loop ends, however
    it does.
    `received`, `late`: counts.
    """

    def __init__(
        self,
        name: str,
        can: AdapterConfig,
        step: Callable[[float, list[Frame]], Iterable[Frame]],
        status: Callable[[], str],
        recorder: Recorder | None = None,
        at_end: Callable[[], object] = lambda: None,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.name, self.received, self.late = name, 0, 0
        self._step, self._status, self._recorder, self._at_end = step, status, recorder, at_end
        self._clock, self._sleep = clock, sleep
        self._start = clock()
        self._incoming: queue.SimpleQueue = queue.SimpleQueue()
        self._link = Link(Adapter(can), self._on_frame, self._time, self._report)
        # UDP multicast brings back what was sent; an identifier on a CAN bus has one sender, so ours need not be taken.
        self._own: set | None = set() if can.interface == 'udp_multicast' else None
        self._stopping = False
        self._failed = False
        self._terminal = sys.stderr.isatty()
        self._shown = ''

    def say(self, text: str) -> None:
        """A line on stderr, above the status line."""
        self._print(('\r\033[K' if self._terminal else '') + f'{self.name}: {text}\n')

    def stop(self, *_) -> None:
        """End the loop after this turn (a signal handler too)."""
        self._stopping = True

    def run(self) -> int:
        """The loop, until SIGINT, SIGTERM or SIGHUP (status 0) or until the adapter can never work (1)."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, self.stop)
        self._link.start()
        turn, shown = 0, -1
        try:
            while not self._stopping:
                now = self._time()
                late = int(now / PERIOD_S) - turn
                if late > 0:
                    self.late += late
                    turn += late
                self._turn(now)
                if int(now) != shown:
                    shown = int(now)
                    self._link.supervise()
                    self._show()
                turn += 1
                self._sleep(max(turn * PERIOD_S - self._time(), 0.0))
        finally:
            self._at_end()
            self._link.stop()
            if self._recorder is not None:
                self._recorder.close()
        self.say(f'ended after {self._time():.0f} s: {self.summary()}')
        return 1 if self._failed else 0

    def summary(self) -> str:
        """The counts and what the node says."""
        trouble = f', {self.late} turns missed' if self.late else ''
        counters = self._link.all_counters
        lost = {
            key: value for key, value in counters.items() if value and key.startswith(('not_sent', 'transmit_queue'))
        }
        trouble += ''.join(f', {value} {key}' for key, value in lost.items())
        return f'{counters.get("sent", 0)} frames sent, {self.received} received{trouble}; {self._status()}'

    def _turn(self, now: float) -> None:
        received = []
        while not self._incoming.empty():
            received.append(self._incoming.get())
        self.received += len(received)
        frames = self._step(now, received)
        for frame in frames:
            self._link.send(frame)
        if self._own is not None:
            self._own.update(frame.id for frame in frames)
        if self._recorder is not None:
            for frame in (*received, *frames):
                self._recorder.write(frame)
            if self._recorder.problem:
                self.say(self._recorder.problem)
                self._recorder = None

    def _time(self) -> float:
        return self._clock() - self._start

    def _on_frame(self, frame: Frame) -> None:
        if (self._own is None or frame.id not in self._own) and self._incoming.qsize() < _MAX_INCOMING:
            self._incoming.put(frame)

    def _report(self, level: str, sentence: str) -> None:
        hint = ''
        if 'Permission denied' in sentence:
            hint = ' Have you been added to the group dialout? sudo usermod -aG dialout $USER, then log in anew.'
        elif 'socketcan' in sentence and ('No such device' in sentence or 'down' in sentence):
            hint = ' Is it up? sudo ip link set can0 up type can bitrate 500000'
        self.say(sentence + hint)
        if level == 'fatal':
            self._failed = True
            self._stopping = True

    def _print(self, text: str) -> None:
        """On stderr. A full disk or a pipe that nobody reads any more ends the log, not the node."""
        with suppress(OSError):
            print(text, end='', file=sys.stderr, flush=True)

    def _show(self) -> None:
        if self._terminal:
            self._print(f'\r\033[K{self.name}: {self._time():.0f} s, {self.summary()}')
            return
        # In a log: what is new, not what only counts on.
        kind = re.sub(r'\d+', '#', self._status())
        if kind != self._shown:
            self._shown = kind
            self.say(self._status())


def main_of(run: Callable[[list[str] | None], int], arguments: list[str] | None = None) -> None:
    """Runs a command and turns what its user can mend into one line and status 2."""
    try:
        status = run(arguments)
    except (HardwareError, ConfigError, BusError) as error:
        print(f'error: {error}', file=sys.stderr)
        status = 2
    sys.exit(status)


def bus_named(name: str) -> BusDescription:
    """The name of a DBC file of the platform, or a path; '': the platform's own. Raises BusError."""
    return BusDescription.named(name) if name else BusDescription.default()
