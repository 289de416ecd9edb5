"""Malformed, oversized, repeated and out-of-order frames from strangers and from paired pages, and what holds of all
that comes of them.
"""

from __future__ import annotations

import json
import random
import string
from collections import deque
from typing import Any, NamedTuple

from sara_hmi.config.config import ROLES, HmiConfig, NetworkConfig
from sara_hmi.hub.actions import Action, Close, Motion, Order, Send
from sara_hmi.hub.hub import Hub
from sara_hmi.pairing.pairing import ALPHABET, Pairing
from sara_hmi.protocol.frames import NONE, OPS

TOKEN = 'the only one'
CLIENTS = 6
VALUES = (
    None, True, -1, 0, 1, 2, 0.5, -0.5, 1e9, 1e308, -0.0, 2**53, 2**70, '', 'x', 'kitchen', 'error.rate', 'rider', 'en',
    'x' * 5000, '\ud800', [], [0, 0, 0], [1, 2], {}, {'a': 1}, [[[[]]]], TOKEN[:-1], '../../etc/passwd',
    'wall', [[0, 0], [1, 1]],
)  # fmt: skip
FRAGMENTS = (
    '',
    '{',
    '[' * 3000,
    '{"op":' * 300,
    'NaN',
    '{"op":"drive","v":NaN}',
    '\x00',
    '{"op":"stop","op":"go"}',
    '9' * 4000,
)


class Failed(AssertionError):
    """A law was broken; the text holds the seed."""


class Commanded(NamedTuple):
    """A drive frame that was received: when (s), by which client, the time (s) of the beat it names, the motion."""

    t: float
    client: int
    beat: float
    motion: tuple[float, float]


class Trial:
    """One hub, its random clients, and the judge. strangers: nobody is of this computer, and nobody has a token."""

    def __init__(self, seed: int, strangers: bool) -> None:
        self.random, self._strangers = random.Random(seed), strangers
        config = HmiConfig(network=NetworkConfig(address='0.0.0.0'))
        self._config = config
        pairing = Pairing(config.pairing, self.random.randrange, lambda: TOKEN)
        self.hub = Hub(config, pairing, lambda: self.t)
        self.hub.tasks.places, self.hub.tasks.assisted = {'kitchen': (1.0, 2.0, 0.0)}, True
        self.hub.tasks.helps, self.hub.tasks.edits = ('kitchen',), ()
        self.t = 1000.0
        if strangers:
            pairing.invite(self.t, 'rider')
        self._beats: dict[int, dict[int, float]] = {}
        self._drives: dict[int, float] = {}  # how often each client drives, rather than sending anything
        self._commands: deque[Commanded] = deque(maxlen=400)
        self._moving = False
        self.heard = self.motions = 0

    def run(self, count: int) -> int:
        """So many frames; how many actions came of them."""
        for _ in range(count):
            self.t += self.random.choice((0.0, 0.0, 0.001, 0.02, 0.05, 0.3))
            clients = list(self.hub.clients)
            if len(clients) < CLIENTS or self.random.random() < 0.01:
                self._connect()
            elif self.random.random() < 0.01:
                self._leave(self.random.choice(clients))
            self._judge(self.hub.step(self.t))
            clients = list(self.hub.clients)
            driver = self.hub.driving.driver
            if clients:
                self._receive(driver if driver and self.random.random() < 0.5 else self.random.choice(clients))
        for client in list(self.hub.clients):
            self._leave(client)
        if self._moving:
            raise Failed('the chair moves although everybody has gone')
        return self.heard

    def _connect(self):
        client = self.hub.connect(self.t, local=not self._strangers and self.random.random() < 0.6)
        self._beats[client.number] = {}
        self._drives[client.number] = self.random.choice((0.3, 0.99))
        if self.random.random() < 0.8:
            hello = {'op': 'hello', 'version': 1, 'token': 'x'}
            self._judge(self.hub.receive(self.t, client.number, json.dumps(hello)))

    def _leave(self, client):
        self._judge(self.hub.disconnect(client))
        self._beats.pop(client, None)
        self._drives.pop(client, None)

    def _receive(self, client):
        text = self._text(client)
        try:
            frame = json.loads(text)
            beat = self._beats[client].get(frame['n'])
            if frame['op'] == 'drive' and beat is not None:
                self._commands.append(Commanded(self.t, client, beat, (frame['v'], frame['w'])))
        except (ValueError, TypeError, KeyError, RecursionError):
            pass  # no command, and the hub has to see that
        self._judge(self.hub.receive(self.t, client, text))

    def _text(self, client):
        if self.random.random() < self._drives[client]:
            return json.dumps(self._drive(client))
        draw = self.random.random()
        if draw < 0.1:
            return self.random.choice(FRAGMENTS)
        if draw < 0.2:
            return ''.join(self.random.choice(string.printable) for _ in range(self.random.randrange(80)))
        op = self.random.choice(list(OPS))
        fields = {name: self._value(name) for name in (*OPS[op].needs, *OPS[op].may) if self.random.random() < 0.9}
        if self.random.random() < 0.2:
            fields[self.random.choice(('op', 'x', 'seq'))] = self._value('x')
        text = json.dumps({'op': op, **fields})
        return text if self.random.random() < 0.95 else text[: self.random.randrange(len(text))]

    def _drive(self, client):
        """What a page that drives sends, mostly in order and in time."""
        draw = self.random.random()
        seq = int(self.t * 1000) + self.random.randrange(-20, 100)
        if draw < 0.2:
            return {'op': self.random.choice(('take', 'take', 'release', 'reset'))}
        if draw < 0.25:
            return {'op': 'halt', 'seq': seq}
        known = list(self._beats[client]) or [0]
        beat = self.random.choice((known[-1], known[-1], known[-1], self.random.choice(known), 10**9))
        w = self.random.choice((0.0, 0.5, 0.5, 0.5, 1.5 if draw > 0.95 else 0.0))
        return {'op': 'drive', 'seq': seq, 't': 0, 'n': beat, 'v': self.random.uniform(-1.0, 1.0), 'w': w}

    def _value(self, name):
        if self.random.random() < 0.6:
            good = {
                'version': 1, 'name': 'kitchen', 'place': 'kitchen', 'to': 'hall', 'pose': [1, 2, 0], 'role': 'look',
                'session': self.random.randrange(1, 99), 'seq': self.random.randrange(10**6), 't': 0, 'n': 3, 'v': 0.5,
                'w': 0.5, 'on': True, 'key': 'goal.going', 'values': {}, 'language': 'en', 'token': 'x',
                'code': ''.join(self.random.choice(ALPHABET) for _ in range(8)),
            }  # fmt: skip
            if name in good:
                return good[name]
        return self.random.choice(VALUES)

    # The judge

    def _judge(self, actions: list[Action]) -> None:
        self.heard += len(actions)
        for action in actions:
            if self._strangers and not isinstance(action, (Send, Close)):
                raise Failed(f'a stranger caused {action}')
            if isinstance(action, Motion):
                self._moves(action)
            elif isinstance(action, Order):
                self._ordered(action)
            elif isinstance(action, Send):
                self._sent(action)
            elif isinstance(action, Close) and action.client in self.hub.clients:
                self._leave(action.client)
        if any(client.role not in (*ROLES, NONE) for client in self.hub.clients.values()):
            raise Failed('a role that is none')

    def _ordered(self, order: Order) -> None:
        driver = self.hub.driving.driver
        if order.op == 'reset':
            self.hub.driving.stopped = False  # as the robot answers
        elif order.op in ('override', 'help') and driver not in (None, order.client):
            raise Failed(f'client {order.client} took the help from {driver}, who has the controls')

    def _sent(self, action: Send) -> None:
        frame: dict[str, Any] = action.frame
        json.dumps(frame, allow_nan=False)
        if frame['op'] == 'beat' and action.client in self._beats:
            self._beats[action.client][frame['n']] = self.t

    def _moves(self, motion: Motion) -> None:
        if motion == (0.0, 0.0):
            if not self._moving:
                raise Failed(f'a second zero at {self.t}')
            self._moving = False
            return
        fresh = self._config.freshness
        for command in reversed(self._commands):
            if command.motion == tuple(motion) and command.client == self.hub.driving.driver:
                if self.t - command.beat > fresh.oldest_s + 1e-9 or self.t - command.t > fresh.hold_s + 1e-9:
                    raise Failed(f'{command} was published at {self.t}')
                self._moving = True
                self.motions += 1
                return
        raise Failed(f'nobody commanded {motion}, published at {self.t}')


def fuzz_hub(count: int, seed: int, strangers: bool) -> int:
    """So many frames; returns how many actions came of them. Raises Failed, or what the hub raised, with the seed."""
    try:
        return Trial(seed, strangers).run(count)
    except Exception as error:
        raise Failed(
            f'seed {seed}, {"strangers" if strangers else "pages"}: {type(error).__name__}: {error}'
        ) from error
