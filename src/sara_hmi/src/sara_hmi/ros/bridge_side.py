"""ROS for the rosbridge endpoint: topics and services by name and type, in threads of its own."""

from __future__ import annotations

import json
import queue
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import roslib.message
import rospy
import rosservice
from rospy.numpy_msg import numpy_msg

from sara_hmi.config.config import RosbridgeConfig
from sara_hmi.ros.rosapi import Rosapi
from sara_hmi.rosbridge import cbor, text
from sara_hmi.rosbridge.bridge import CBOR, Answer
from sara_hmi.rosbridge.messages import MessageError, fill, to_plain
from sara_hmi.web.bridge_socket import BridgeConnection

SERVICE_THREADS = 4


class BridgeSide:
    """Carries out what connections ask for, in one thread and in their order; services in threads beside it.

    post(function, ...): calls a function in the server's thread.
    """

    def __init__(self, config: RosbridgeConfig, post: Callable[..., None]) -> None:
        self._config, self._post = config, post
        self._rosapi = Rosapi()
        self._work: queue.Queue[Callable[[], None]] = queue.Queue(maxsize=1000)
        self._calls: queue.Queue[Callable[[], None]] = queue.Queue(maxsize=100)
        self._publishers: dict[str, tuple[rospy.Publisher, set]] = {}
        self._subscribers: dict[str, rospy.Subscriber] = {}
        self._forms: dict[str, dict[BridgeConnection, str]] = {}
        for jobs in (self._work, *[self._calls] * SERVICE_THREADS):
            threading.Thread(target=self._run, args=(jobs,), name='rosbridge', daemon=True).start()

    @staticmethod
    def _run(jobs):
        while not rospy.is_shutdown():
            jobs.get()()

    def _later(self, connection, what, function, *arguments):
        def work() -> None:
            try:
                function(*arguments)
            except Exception as error:  # whatever a message holds: the thread serves all connections
                self._post(connection.fail, f'{what}: {error}')

        try:
            self._work.put_nowait(work)
        except queue.Full:
            connection.fail(f'{what}: too much waits to be done')

    # Publishing

    def advertise(self, connection: BridgeConnection, topic: str, kind: str) -> None:
        """Be ready to publish."""
        self._later(connection, 'advertise', self._advertise, connection, topic, kind)

    def _advertise(self, connection, topic, kind):
        held = self._publishers.get(topic)
        if held is not None and held[0].data_class._type != kind:
            raise MessageError(f'{topic} is advertised as {held[0].data_class._type}, not as {kind}')
        if held is None:
            held = (rospy.Publisher(topic, _message_class(kind), queue_size=10, tcp_nodelay=True), set())
            self._publishers[topic] = held
        held[1].add(connection)

    def unadvertise(self, connection: BridgeConnection, topic: str) -> None:
        """No longer."""
        self._later(connection, 'unadvertise', self._unadvertise, connection, topic)

    def _unadvertise(self, connection, topic):
        publisher, owners = self._publishers.get(topic, (None, set()))
        owners.discard(connection)
        if publisher is not None and not owners:
            del self._publishers[topic]
            publisher.unregister()

    def publish(self, connection: BridgeConnection, topic: str, message: Any) -> None:
        """Publish plain data on a topic that was advertised."""
        self._later(connection, 'publish', self._publish, topic, message)

    def _publish(self, topic, data):
        if topic not in self._publishers:
            raise MessageError(f'{topic} could not be advertised')
        publisher = self._publishers[topic][0]
        message = fill(publisher.data_class(), data, _make)
        if publisher.data_class._has_header and not message.header.stamp:
            message.header.stamp = rospy.Time.now()
        publisher.publish(message)

    # Subscribing

    def subscribe(self, connection: BridgeConnection, topic: str, kind: str, form: str) -> None:
        """Call `offer` of the connection for each message, encoded in that format."""
        self._later(connection, 'subscribe', self._subscribe, connection, topic, kind, form)

    def _subscribe(self, connection, topic, kind, form):
        known = self._rosapi.topic_type(topic)
        if not (kind or known):
            raise MessageError(f'{topic} is not there; with a type it is waited for')
        if kind and known and kind != known:
            raise MessageError(f'{topic} is {known}, not {kind}')
        data_class = numpy_msg(_message_class(kind or known))
        self._forms.setdefault(topic, {})[connection] = form
        held = self._subscribers.pop(topic, None)
        self._subscribers[topic] = rospy.Subscriber(topic, data_class, partial(self._on_message, topic), queue_size=1)
        if held is not None:  # a new one, so that a latched message comes to who subscribes now
            held.unregister()

    def unsubscribe(self, connection: BridgeConnection, topic: str) -> None:
        """No longer."""
        self._later(connection, 'unsubscribe', self._unsubscribe, connection, topic)

    def _unsubscribe(self, connection, topic):
        forms = self._forms.get(topic, {})
        forms.pop(connection, None)
        if not forms and topic in self._subscribers:
            self._subscribers.pop(topic).unregister()
            self._forms.pop(topic, None)

    def _on_message(self, topic, message):
        """Encode once for all."""
        forms = dict(self._forms.get(topic, {}))
        if not forms:
            return
        frame = {'op': 'publish', 'topic': topic, 'msg': to_plain(message)}
        encoded = {form: (cbor if form == CBOR else text).dumps(frame) for form in set(forms.values())}
        for connection, form in forms.items():
            self._post(connection.offer, topic, form, encoded[form])

    # Services

    def call(self, connection: BridgeConnection, service: str, arguments: Any, answer: Answer) -> None:
        """Call a service, and then answer(done, plain data or a sentence) in the server's thread."""

        def work() -> None:
            try:
                result: tuple[bool, Any] = (True, self._call(service, arguments))
            except (MessageError, rospy.ROSException, rospy.ServiceException, rosservice.ROSServiceException) as error:
                result = (False, str(error))
            except Exception as error:  # as above
                result = (False, f'{service}: {error}')
            self._post(answer, *result)

        try:
            self._calls.put_nowait(work)
        except queue.Full:
            answer(False, 'too many services are waited for')

    def _call(self, service, arguments):
        if service.startswith('/rosapi/'):
            return self._rosapi.call(service.removeprefix('/rosapi/'), arguments)
        rospy.wait_for_service(service, self._config.service_s)
        kind = rosservice.get_service_class_by_name(service)
        request = kind._request_class()
        if isinstance(arguments, list):
            if len(arguments) > len(request.__slots__):
                raise MessageError(
                    f'{service} takes {len(request.__slots__)} arguments: {", ".join(request.__slots__)}'
                )
            arguments = dict(zip(request.__slots__, arguments))
        response = rospy.ServiceProxy(service, kind)(fill(request, arguments, _make))
        return json.loads(text.dumps(to_plain(response)))


def _message_class(kind):
    try:
        found = roslib.message.get_message_class(kind)
    except (ValueError, ImportError):
        found = None
    if found is None:
        raise MessageError(f'there is no message type {kind}')
    return found


def _make(kind: str) -> Any:
    """A new message, time or duration of a type's name."""
    return {'time': rospy.Time, 'duration': rospy.Duration}.get(kind, lambda: _message_class(kind)())()
