"""One rosbridge connection: its frames, what it may, and what it has subscribed to."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, Protocol

from sara_common.config import is_number
from sara_hmi.config.config import CARER, RIDER, RosbridgeConfig
from sara_hmi.rosbridge.messages import MessageError

JSON, CBOR = 'none', 'cbor'
FORMATS = (JSON, CBOR)
Answer = Callable[[bool, Any], None]


class RosSide(Protocol):
    """What a Bridge needs of ROS. `connection` is told of what fails, and of messages."""

    def advertise(self, connection: object, topic: str, kind: str) -> None:
        """Be ready to publish."""

    def unadvertise(self, connection: object, topic: str) -> None:
        """No longer."""

    def publish(self, connection: object, topic: str, message: Any) -> None:
        """Publish plain data on a topic that was advertised."""

    def subscribe(self, connection: object, topic: str, kind: str, form: str) -> None:
        """Call `offer` of the connection for each message, encoded in that format. kind: "" for whichever it is."""

    def unsubscribe(self, connection: object, topic: str) -> None:
        """No longer."""

    def call(self, connection: object, service: str, arguments: Any, answer: Answer) -> None:
        """Call a service, and then answer(done, plain data or a sentence)."""


def on_list(name: str, patterns: Iterable[str]) -> bool:
    """Whether a name is one of these; * stands for anything."""
    return any(fnmatchcase(name, pattern) for pattern in patterns)


@dataclass
class Subscription:
    """Of one topic. throttle: s between two messages. waiting: encoded messages, the oldest first."""

    form: str
    throttle: float
    waiting: deque
    ids: set = field(default_factory=set)
    last: float = -1e9


class Bridge:
    """role: of the page's protocol. connection: whom `ros` calls back. send(frame): a dictionary to the client."""

    def __init__(
        self,
        config: RosbridgeConfig,
        role: str,
        ros: RosSide,
        connection: object,
        send: Callable[[dict[str, Any]], None],
    ) -> None:
        self._config, self._role, self._ros, self._send = config, role, ros, send
        self._connection = connection
        self._advertised: dict[str, str] = {}
        self._subscribed: dict[str, Subscription] = {}
        self._ops: dict[str, Callable[[dict], None]] = {
            'advertise': self._advertise,
            'unadvertise': self._unadvertise,
            'publish': self._publish,
            'subscribe': self._subscribe,
            'unsubscribe': self._unsubscribe,
            'call_service': self._call,
            'set_level': lambda frame: None,  # errors and warnings are all there is, and both are always told
        }

    def receive(self, text: str) -> None:
        """A text frame."""
        try:
            frame = json.loads(text)
        except (ValueError, RecursionError):
            frame = None
        if not isinstance(frame, dict) or not isinstance(frame.get('op'), str):
            self._status('the frame is no JSON object with an op', None)
            return
        handle = self._ops.get(frame['op'])
        if handle is None:
            self._status(f'there is no op {frame["op"][:40]!r}; there are {", ".join(self._ops)}', frame)
            return
        try:
            handle(frame)
        except MessageError as error:
            self._status(f'{frame["op"]}: {error}', frame)

    def end(self) -> None:
        """The connection is gone."""
        for topic in list(self._advertised):
            self._ros.unadvertise(self._connection, topic)
        for topic in list(self._subscribed):
            self._ros.unsubscribe(self._connection, topic)
        self._advertised.clear()
        self._subscribed.clear()

    def offer(self, t: float, topic: str, form: str, encoded: str | bytes) -> bool:
        """A message has come at t (s), encoded; whether it waits for `take` now."""
        held = self._subscribed.get(topic)
        if held is None or held.form != form or 0.0 <= t - held.last < held.throttle:
            return False
        held.last = t
        held.waiting.append(encoded)
        return True

    def take(self) -> str | bytes | None:
        """The next encoded message to send, in turn among the topics; None where nothing waits."""
        for topic, held in self._subscribed.items():
            if held.waiting:
                self._subscribed[topic] = self._subscribed.pop(topic)  # last in turn
                return held.waiting.popleft()
        return None

    # Ops

    def _advertise(self, frame):
        topic, kind = self._name(frame, 'topic'), self._name(frame, 'type', 'type')
        self._permit(topic, self._config.publish, 'publish', moves=True)
        self._ros.advertise(self._connection, topic, kind)
        self._advertised[topic] = kind

    def _unadvertise(self, frame):
        topic = self._name(frame, 'topic')
        if self._advertised.pop(topic, None) is not None:
            self._ros.unadvertise(self._connection, topic)

    def _publish(self, frame):
        topic = self._name(frame, 'topic')
        self._permit(topic, self._config.publish, 'publish', moves=True)
        if topic not in self._advertised:
            raise MessageError(f'{topic} was not advertised on this connection')
        self._ros.publish(self._connection, topic, frame.get('msg', {}))

    def _subscribe(self, frame):
        topic = self._name(frame, 'topic')
        self._permit(topic, self._config.subscribe, 'subscribe')
        form, throttle = frame.get('compression', JSON), frame.get('throttle_rate', 0)
        length = frame.get('queue_length', 0)
        if form not in FORMATS:
            raise MessageError(f'compression {str(form)[:20]!r} is not there, allowed are {" and ".join(FORMATS)}')
        for name, value in (('throttle_rate', throttle), ('queue_length', length)):
            if not (is_number(value) and 0 <= value <= 1e9):
                raise MessageError(f'{name} is {str(value)[:20]}, allowed are numbers of 0 or more')
        if frame.get('fragment_size') is not None:
            self._status('fragment_size has no effect: messages come whole', frame, 'warning')
        if topic not in self._subscribed and len(self._subscribed) >= self._config.subscriptions:
            raise MessageError(f'{self._config.subscriptions} topics are subscribed to; more are not allowed')
        kind = frame.get('type') or ''
        if not isinstance(kind, str):
            raise MessageError('type is no text')
        held = self._subscribed.pop(topic, None)
        ids = {*(held.ids if held else ()), str(frame.get('id', ''))}
        self._ros.subscribe(self._connection, topic, kind, form)
        waiting = deque(maxlen=max(1, min(int(length), self._config.queue)))
        self._subscribed[topic] = Subscription(form, throttle / 1000.0, waiting, ids)

    def _unsubscribe(self, frame):
        topic = self._name(frame, 'topic')
        held = self._subscribed.get(topic)
        if held is None:
            return
        held.ids.discard(str(frame['id'])) if 'id' in frame else held.ids.clear()
        if not held.ids:
            del self._subscribed[topic]
            self._ros.unsubscribe(self._connection, topic)

    def _call(self, frame):
        service = self._name(frame, 'service')
        answer = {'op': 'service_response', 'service': service}
        if 'id' in frame:
            answer['id'] = frame['id']

        def done(result: bool, values: Any) -> None:
            self._send({**answer, 'values': values, 'result': result})

        try:
            self._permit(service, self._config.call, 'call', moves=not service.startswith('/rosapi/'))
            arguments = frame.get('args', {})
            if service in ('/rosapi/get_param', '/rosapi/has_param') and isinstance(arguments, dict):
                self._permit(self._name(arguments, 'name'), self._config.params, 'read')
            self._ros.call(self._connection, service, arguments, done)
        except MessageError as error:
            done(False, str(error))

    def _name(self, frame, field, what='name'):
        name = frame.get(field)
        if not (isinstance(name, str) and 0 < len(name) <= 200 and name.isprintable()):
            raise MessageError(f'{field} is {str(name)[:40]!r}, allowed is a {what}')
        return name if name.startswith('/') or what != 'name' else f'/{name}'

    def _permit(self, name, allowed, verb, moves=False):
        if moves and self._role not in (CARER, RIDER):
            raise MessageError(f'who may only look may not {verb} {name}')
        if not on_list(name, allowed):
            raise MessageError(f'{name} is not on the list of what may be {_DONE[verb]} (rosbridge in config/hmi.yaml)')

    def _status(self, text, frame, level='error'):
        status = {'op': 'status', 'level': level, 'msg': text}
        if frame is not None and 'id' in frame:
            status['id'] = frame['id']
        self._send(status)


_DONE = {'publish': 'published', 'subscribe': 'subscribed to', 'call': 'called', 'read': 'read'}
