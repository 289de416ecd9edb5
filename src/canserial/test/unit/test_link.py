"""The link over an adapter that this test breaks at will: no frame from before a loss is sent after it; threads that
die come back.
"""

import threading
import time
from collections import Counter

import pytest

from canserial.adapter import link as link_module
from canserial.adapter.adapter import AdapterConfig, AdapterError, NoDriver
from canserial.adapter.link import Link
from canserial.frame import Frame


class Fake:
    """An adapter: `plugged` and `stuck` are set by the test."""

    def __init__(self, **settings):
        self.config = AdapterConfig(**settings)
        self.counters = Counter()
        self.plugged, self.is_open = True, False
        self.free = threading.Event()
        self.free.set()
        self.sent, self.incoming, self.opened, self.driver = [], [], 0, True

    def open(self):
        if not self.driver:
            raise NoDriver('no such library')
        if not self.plugged:
            raise AdapterError('no such file')
        self.is_open = True
        self.opened += 1

    def receive(self, timeout, clock):
        time.sleep(0.002)
        if not self.plugged:
            raise AdapterError('device disconnected')
        if self.incoming:
            item = self.incoming.pop(0)
            if isinstance(item, Exception):
                raise item
            return item
        return None

    def send(self, frame):
        self.free.wait(5.0)
        if not self.plugged:
            raise AdapterError('device disconnected')
        self.sent.append(frame)

    def ask_status(self):
        pass

    def close(self):
        self.is_open = False


def until(condition):
    end = time.monotonic() + 10.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.002)
    assert condition()


@pytest.fixture
def start(monkeypatch):
    monkeypatch.setattr(link_module, 'FIRST_BACK_OFF', 0.01)
    links = []

    def make(fake, on_frame=lambda frame: None):
        said = []
        link = Link(fake, on_frame, lambda: 0.0, lambda level, sentence: said.append((level, sentence)))
        link.start()
        links.append((link, fake))
        return link, said

    yield make
    for link, fake in links:
        fake.free.set()
        link.stop()
        assert not fake.is_open


def test_frames_pass_both_ways(start):
    got, fake = [], Fake()
    link, _ = start(fake, got.append)
    until(lambda: fake.is_open)
    frames = [Frame(number, b'') for number in range(20)]
    fake.incoming += frames
    for frame in frames:
        link.send(frame)
    until(lambda: got == frames and fake.sent == frames)


def test_a_stuck_adapter_does_not_hold_up_who_sends_and_the_newest_frames_are_kept(start):
    fake = Fake(transmit_queue=5, transmit_max_age=60.0)
    link, _ = start(fake)
    until(lambda: fake.is_open)
    fake.free.clear()
    link.send(Frame(0, b''))
    until(lambda: len(link.queue) == 0)
    for number in range(1, 101):
        link.send(Frame(number, b''))
    fake.free.set()
    until(lambda: len(fake.sent) == 6)
    assert [frame.id for frame in fake.sent] == [0, 96, 97, 98, 99, 100]
    assert link.all_counters['transmit_queue_full'] == 95


def test_no_frame_from_before_a_loss_goes_out_after_it(start):
    fake = Fake(transmit_max_age=60.0)
    link, said = start(fake)
    until(lambda: fake.is_open)
    fake.free.clear()
    for number in range(10):
        link.send(Frame(number, b''))
    fake.plugged = False
    fake.free.set()
    until(lambda: not fake.is_open)
    link.send(Frame(50, b''))
    fake.plugged = True
    until(lambda: fake.opened == 2)
    link.send(Frame(99, b''))
    until(lambda: fake.sent)
    assert [frame.id for frame in fake.sent] == [99]
    assert link.all_counters['not_sent_closed'] == 1
    assert link.all_counters['reconnections'] == 1
    levels = [level for level, _ in said if 'is not sent' not in _]
    assert levels == ['info', 'warn', 'info']
    assert (
        'is lost: device disconnected. Waiting for it.'
        in [sentence for level, sentence in said if 'lost' in sentence][0]
    )


def test_a_missing_adapter_is_told_once_and_found(start):
    fake = Fake()
    fake.plugged = False
    link, said = start(fake)
    until(lambda: 'missing' in link.error)
    time.sleep(0.1)
    assert [level for level, _ in said] == ['warn']
    fake.plugged = True
    until(lambda: link.error == '')


@pytest.mark.parametrize('kill', ['receive', 'publish', 'send', 'status'])
def test_threads_that_die_are_told_and_started_anew(start, kill):
    got, fake = [], Fake()

    def on_frame(frame):
        if frame.data == b'die':
            raise RuntimeError('injected')
        got.append(frame)

    link, said = start(fake, on_frame)
    until(lambda: fake.is_open)
    if kill == 'receive':
        fake.incoming.append(RuntimeError('injected'))
    elif kill == 'publish':
        fake.incoming.append(Frame(1, b'die'))
    elif kill == 'send':
        fake.send, working = (lambda frame: 1 / 0), fake.send
        link.send(Frame(1, b''))
    else:
        fake.ask_status = lambda: 1 / 0
    until(lambda: not all(thread.is_alive() for thread in link._threads.values()))
    if kill == 'send':
        fake.send = working
    fake.ask_status = lambda: None
    link.supervise()
    assert link.counters['threads_restarted'] == 1
    assert any(level == 'error' and 'died of' in sentence for level, sentence in said)
    until(lambda: fake.is_open)
    fake.incoming.append(Frame(5, b''))
    link.send(Frame(6, b''))
    until(lambda: got[-1:] == [Frame(5, b'')] and fake.sent[-1:] == [Frame(6, b'')])


def test_listening_only_counts_and_tells_once(start):
    fake = Fake(listen_only=True)
    link, said = start(fake)
    until(lambda: fake.is_open)
    for _ in range(5):
        link.send(Frame(1, b''))
    link.send(Frame(0x800, b''))
    assert link.counters['not_sent_listen_only'] == 5 and link.counters['not_sent_invalid'] == 1
    assert fake.sent == [] and len(link.queue) == 0
    assert sum('listens only' in sentence for level, sentence in said) == 1


def test_a_missing_driver_ends_it(start):
    fake = Fake()
    fake.driver = False
    link, said = start(fake)
    until(lambda: said)
    assert said[0][0] == 'fatal' and 'no such library' in said[0][1]
    assert fake.opened == 0
