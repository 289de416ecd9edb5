"""An adapter kept alive: found, opened, read, written, lost and found again, by two threads that are watched. No ROS.

The receiving thread opens the adapter and hands on what comes; when it fails, it closes it and tries again with growing
pauses. The sending thread empties the queue. Whoever sends never waits for the adapter. Pauses are wall time: an
adapter knows of no other.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress

from canserial.adapter.adapter import Adapter, AdapterError, BadFrame, NoDriver, check
from canserial.adapter.transmit import TransmitQueue
from canserial.frame import Frame

FIRST_BACK_OFF, LAST_BACK_OFF = 0.2, 2.0  # s
TIMEOUT = 0.1  # s, how long a thread may take to notice that it is to end


class Link:
    """Runs one Adapter.

    on_frame(frame) is called from the receiving thread; clock() stamps the frames (s); report(level, sentence) gets
    what happens, level 'info', 'warn', 'error' or 'fatal' (the last: give up). `error` says why nothing flows, '' when
    the adapter is open.
    `counters`: `reconnections`, `threads_restarted`, and frames not sent by cause (`not_sent_closed`, `_invalid`,
    `_listen_only`,
    `_failed`); those of the adapter and of the queue are beside them, see `all_counters`.
    """

    def __init__(
        self,
        adapter: Adapter,
        on_frame: Callable[[Frame], None],
        clock: Callable[[], float],
        report: Callable[[str, str], None],
    ) -> None:
        self.adapter, self.config = adapter, adapter.config
        self.queue = TransmitQueue(self.config.transmit_queue, self.config.transmit_max_age)
        self.counters = Counter(reconnections=0, threads_restarted=0)
        self.where = f'{self.config.interface} adapter on {self.config.port}'
        self.error = f'the {self.where} is not opened yet'
        self._on_frame, self._clock, self._report = on_frame, clock, report
        self._stopping = threading.Event()
        self._gate = threading.Lock()  # held while sending, opening and closing
        self._loops = {'can-receive': self._receive, 'can-transmit': self._transmit}
        self._threads, self._deaths = {}, {}
        self._told = set()

    @property
    def all_counters(self) -> dict[str, int]:
        """One dictionary of everything that is counted."""
        queue = {f'transmit_queue_{name}': self.queue.counters[name] for name in ('full', 'too_old', 'discarded')}
        return {**self.counters, **self.adapter.counters, **queue, 'transmit_queue_waiting': len(self.queue)}

    def start(self) -> None:
        """Begin; returns at once."""
        for name in self._loops:
            self._start(name)

    def supervise(self) -> None:
        """Start anew what died; call it now and then."""
        for name, thread in list(self._threads.items()):
            if not thread.is_alive() and not self._stopping.is_set():
                self.counters['threads_restarted'] += 1
                self._report(
                    'error', f'the thread {name} died of {self._deaths.get(name, "an unknown cause")}: started anew'
                )
                self._start(name)

    def stop(self) -> None:
        """End both threads and close the adapter."""
        self._stopping.set()
        for thread in self._threads.values():
            thread.join(2.0)

    def send(self, frame: Frame) -> None:
        """Queue a Frame to be sent; never waits, never raises. What cannot be sent is counted, logged once a kind."""
        epoch = self.queue.epoch
        try:
            check(frame)
        except BadFrame as error:
            self._not_sent('invalid', str(error))
            return
        if self.config.listen_only:
            self._not_sent('listen_only', 'the adapter listens only (listen_only is true)')
        elif not self.adapter.is_open:
            self.counters['not_sent_closed'] += 1  # reported when the adapter was lost
        else:
            self.queue.put(frame, time.monotonic(), epoch)

    def _not_sent(self, kind, reason):
        self.counters[f'not_sent_{kind}'] += 1
        if kind not in self._told:
            self._told.add(kind)
            self._report('warn', f'a frame is not sent: {reason}. Further ones are counted only.')

    def _start(self, name):
        def run() -> None:
            try:
                self._loops[name]()
            except Exception as error:  # whatever it is: supervise() reports it and starts the thread anew
                self._deaths[name] = f'{type(error).__name__}: {error}'

        self._threads[name] = threading.Thread(target=run, name=name, daemon=True)
        self._threads[name].start()

    def _receive(self):
        back_off, said, just_lost = FIRST_BACK_OFF, None, False
        try:
            while not self._stopping.is_set():
                opened = None
                try:
                    with self._gate:
                        self.adapter.open()
                        self.queue.discard()
                    opened, said = time.monotonic(), None
                    self.error = ''
                    self._report(
                        'info',
                        f'the {self.where} is open at {self.config.bitrate} bit/s'
                        + (', listening only' if self.config.listen_only else ''),
                    )
                    self._pump()
                except NoDriver as error:
                    self.error = f'the {self.where} cannot be used on this machine: {error}'
                    self._report('fatal', self.error)
                    return
                except AdapterError as error:
                    self.error = f'the {self.where} is {"missing" if opened is None else "lost"}: {error}'
                    self._close()
                    if opened is not None:
                        self.counters['reconnections'] += 1
                        if time.monotonic() - opened > LAST_BACK_OFF:
                            back_off = FIRST_BACK_OFF
                    if self.error != said:
                        said = self.error
                        if not just_lost:  # that it is missing after it was lost is no news
                            self._report('warn', f'{said}. Waiting for it.')
                        just_lost = opened is not None
                    self._stopping.wait(back_off)
                    back_off = min(2.0 * back_off, LAST_BACK_OFF)
        finally:
            self._close()

    def _pump(self):
        while not self._stopping.is_set():
            frame = self.adapter.receive(TIMEOUT, self._clock)
            if frame is not None:
                self._on_frame(frame)

    def _transmit(self):
        while not self._stopping.is_set():
            frame, epoch = self.queue.take(time.monotonic, TIMEOUT)
            with self._gate:
                if not self.adapter.is_open:
                    self.counters['not_sent_closed'] += frame is not None
                    continue
                if frame is not None and epoch != self.queue.epoch:
                    self.queue.counters['discarded'] += 1
                    continue
                try:
                    if frame is not None:
                        self.adapter.send(frame)
                except AdapterError as error:
                    self._not_sent('failed', f'the {self.where} did not take it: {error}')
                with suppress(AdapterError):  # the receiving thread finds out and reports
                    self.adapter.ask_status()

    def _close(self):
        with self._gate:
            self.adapter.close()
            self.queue.discard()
