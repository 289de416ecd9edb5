"""All connections: who they are, what they may, and what comes of each of their frames."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sara_hmi.config.config import HmiConfig
from sara_hmi.hub.actions import Action, Close, Motion, Order, Send, Show, Store, error
from sara_hmi.hub.driving import Driving
from sara_hmi.hub.tasks import Tasks
from sara_hmi.pairing.pairing import Pairing, dumps
from sara_hmi.protocol.frames import NONE, OPS, VERSION, ProtocolError, parse
from sara_hmi.protocol.limits import Bucket
from sara_hmi.sessions.sessions import Session

ALWAYS = ('stop', 'halt')  # is done even where too many frames have come
ASSIST = ('override', 'help')  # of shared control: where there is a driver, the driver's alone
TASKS = (
    *('go', 'pause', 'resume', 'cancel', 'pose', 'profile', 'override', 'help'),
    *('place', 'rename', 'delete', 'edit', 'unedit', 'save_map', 'say'),
)


@dataclass
class Client:
    """One connection. local: of this computer. role: none until it has said hello and is known."""

    number: int
    local: bool
    began: float
    bucket: Bucket
    faults: Bucket
    role: str = NONE
    name: str = ''
    language: str = 'en'
    greeted: bool = False
    told_of_rate: bool = False


class Hub:
    """Frames in, actions out. Times `t` are of the steady clock; `date()` is s since 1970, for the tokens."""

    def __init__(self, config: HmiConfig, pairing: Pairing, date: Callable[[], float]) -> None:
        self._config, self._pairing, self._date = config, pairing, date
        self.clients: dict[int, Client] = {}
        self._numbers = 0
        self.driving = Driving(config)
        self.tasks = Tasks(config.robot)

    def connect(self, t: float, local: bool) -> Client:
        """A connection begins."""
        self._numbers += 1
        limits = self._config.limits
        client = Client(
            self._numbers,
            local,
            t,
            Bucket(limits.frames_per_s, limits.frames_burst),
            Bucket(limits.faults_per_s, limits.faults),
        )
        self.clients[client.number] = client
        return client

    def disconnect(self, number: int) -> list[Action]:
        """A connection is gone."""
        return self.driving.leave(number) if self.clients.pop(number, None) else []

    def step(self, t: float) -> list[Action]:
        """What is due at t (s)."""
        actions = self.driving.step(t)
        for client in list(self.clients.values()):
            if not client.greeted and not 0.0 <= t - client.began < self._config.network.hello_s:
                actions += [error(client.number, 'error.hello_first'), Close(client.number)]
        return actions

    def due(self, t: float) -> float:
        """When `step` is to be called next (s)."""
        return self.driving.due(t)

    def receive(self, t: float, number: int, text: str) -> list[Action]:
        """A text frame of a client."""
        client = self.clients.get(number)
        if client is None:
            return []
        in_time = client.bucket.take(t)
        try:
            frame = parse(text)
        except ProtocolError as fault:
            return self._fault(t, client, fault.key, fault.of, fault.values, quiet=not in_time)
        if not in_time and frame.op not in ALWAYS:
            quiet, client.told_of_rate = client.told_of_rate, True
            return self._fault(t, client, 'error.rate', frame.op, quiet=quiet)
        if client.role not in OPS[frame.op].who:
            key = 'error.hello_first' if not client.greeted else 'error.pair_first' if client.role == NONE else ''
            return self._fault(t, client, key or 'error.may_not', frame.op)
        if not client.greeted and frame.op != 'hello':
            return self._fault(t, client, 'error.hello_first', frame.op)
        client.told_of_rate = client.told_of_rate and not in_time
        return self._heed(t, client, frame)

    def refuse(self, t: float, number: int, key: str) -> list[Action]:
        """Something came that is no text frame, or is too long."""
        client = self.clients.get(number)
        return self._fault(t, client, key) if client else []

    def _fault(self, t, client, key, of='', values=None, quiet=False):
        actions: list[Action] = [] if quiet else [error(client.number, key, of, values)]
        if not client.faults.take(t):
            actions += [error(client.number, 'error.faults'), Close(client.number)]
        return actions

    def _heed(self, t, client, frame):
        """A frame that its sender may send."""
        number, driving, op = client.number, self.driving, frame.op
        if op in TASKS:
            other = driving.driver not in (None, number) and (driving.moving or op in ASSIST)
            return self.tasks.heed(number, frame, driving.stopped, other)
        if op in ('hello', 'pair', 'invite'):
            return {'hello': self._hello, 'pair': self._pair, 'invite': self._invite}[op](t, client, frame)
        return {
            'echo': lambda: [Send(number, {'op': 'echo', 't': frame.get('t')})],
            'take': lambda: driving.take(t, number),
            'release': lambda: driving.release(number),
            'grant': lambda: driving.answer(number, frame),
            'refuse': lambda: driving.answer(number, frame),
            'drive': lambda: driving.drive(t, number, frame),
            'halt': lambda: driving.halt(number, frame),
            'stop': lambda: [*driving.stop(), Order(number, 'stop')],
            'reset': lambda: [Order(number, 'reset')],
        }[op]()

    def role_of(self, local: bool, token: str) -> str:
        """The role of a connection that shows a token, or ""."""
        if local:
            return self._config.sessions.local_role
        known = self._pairing.known(self._date(), token) if token else None
        return known.role if known else NONE

    def _hello(self, t, client, frame):
        if client.greeted:
            return self._fault(t, client, 'error.hello_twice', 'hello')
        if frame.get('version') != VERSION:
            return [*self._fault(t, client, 'error.version', 'hello', {'version': VERSION}), Close(client.number)]
        client.greeted = True
        client.name, client.language = frame.get('name', ''), frame.get('language', 'en')
        client.role = self.role_of(client.local, frame.get('token', ''))
        return self._admit(client)

    def _pair(self, t, client, frame):
        token, answer = self._pairing.pair(t, self._date(), frame.get('code'), client.name)
        if token is None:
            return self._fault(t, client, answer, 'pair')
        client.role = client.role if client.local else token.role
        paired = Send(client.number, {'op': 'paired', 'token': answer, 'role': token.role})
        return [Store(dumps(self._pairing.tokens)), paired, *self._admit(client)]

    def _admit(self, client):
        """Tells a client what it is, and makes it a session where it may look."""
        actions = []
        if client.role != NONE:
            actions = self.driving.join(Session(client.number, client.role, client.name))
        welcome = {'op': 'welcome', 'session': client.number, 'role': client.role, 'version': VERSION}
        if client.role == NONE:
            return [Send(client.number, welcome)]
        welcome |= {
            'driver': self.driving.driver,
            **self.tasks.profile_fields(),
            'profiles': self.tasks.profile_names(),
            'body': list(self._config.robot.body),
        }
        return [*actions, Send(client.number, welcome), Order(client.number, 'catch_up')]

    def _invite(self, t, client, frame):
        if not client.local:
            return self._fault(t, client, 'error.may_not', 'invite')
        if self._config.network.is_local:
            return [error(client.number, 'error.no_network', 'invite')]
        code = self._pairing.invite(t, frame.get('role'))
        return [Show(client.number, code, frame.get('role'), self._config.pairing.code_s)]

    def end(self) -> list[Action]:
        """The server ends: the chair is not driven any more."""
        return [action for action in self.driving.stop() if isinstance(action, Motion)]
