"""rosbridge v2 without ROS: what may be done, what is refused in words, queues, JSON and CBOR."""

import base64
import json
import math
import struct

import cbor2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_hmi.config.config import RosbridgeConfig
from sara_hmi.rosbridge import cbor, text
from sara_hmi.rosbridge.bridge import Bridge
from sara_hmi.rosbridge.messages import MessageError, fill, to_plain

CONFIG = RosbridgeConfig(
    publish=('/goal', '/say/*'),
    subscribe=('*',),
    call=('/plan', '/rosapi/*'),
    params=('/open/*',),
    queue=3,
    subscriptions=2,
)
# RFC 8949, appendix A
VECTORS = [
    (0, '00'),
    (23, '17'),
    (24, '1818'),
    (100, '1864'),
    (1000, '1903e8'),
    (1000000, '1a000f4240'),
    (1000000000000, '1b000000e8d4a51000'),
    (18446744073709551615, '1bffffffffffffffff'),
    (-1, '20'),
    (-100, '3863'),
    (-1000, '3903e7'),
    (1.1, 'fb3ff199999999999a'),
    (-4.1, 'fbc010666666666666'),
    (False, 'f4'),
    (True, 'f5'),
    (None, 'f6'),
    (b'', '40'),
    (b'\x01\x02\x03\x04', '4401020304'),
    ('', '60'),
    ('IETF', '6449455446'),
    ('\u00fc', '62c3bc'),
    ([], '80'),
    ([1, [2, 3], [4, 5]], '8301820203820405'),
    ({}, 'a0'),
    ({'a': 1, 'b': [2, 3]}, 'a26161016162820203'),
    ([0] * 24, '9818' + 24 * '00'),
]


@pytest.mark.parametrize('value, wanted', VECTORS)
def test_cbor_is_that_of_the_standard(value, wanted):
    assert cbor.dumps(value).hex() == wanted


@pytest.mark.parametrize(
    'kind, tag',
    [('u2', 69), ('u4', 70), ('u8', 71), ('i1', 72), ('i2', 77), ('i4', 78), ('i8', 79), ('f4', 85), ('f8', 86)],
)
@pytest.mark.parametrize('order', ['<', '>'])
def test_arrays_are_typed_and_little_endian(kind, tag, order):
    made = cbor.dumps(np.array([1, 2, 3], order + kind))
    size = 3 * int(kind[1])
    assert made[:3] == bytes([0xD8, tag, 0x40 | size]) if size < 24 else made[:4] == bytes([0xD8, tag, 0x58, size])
    assert np.frombuffer(made[-size:], '<' + kind).tolist() == [1, 2, 3]


def test_bytes_and_truth_values_in_arrays():
    assert cbor.dumps(np.array([1, 2], np.uint8)).hex() == '420102'
    assert cbor.dumps(np.array([True, False])).hex() == '82f5f4'
    with pytest.raises(TypeError):
        cbor.dumps(object())


def test_cbor_of_a_message_is_read_again():
    message = {
        'header': {'seq': np.uint32(7)},
        'ok': np.True_,
        'x': np.float64(0.1),
        'data': np.array([-1, 100], np.int8),
    }
    read = cbor2.loads(cbor.dumps({'op': 'publish', 'msg': message}))['msg']
    assert (read['header'], read['ok'], read['x']) == ({'seq': 7}, True, 0.1)
    assert (read['data'].tag, np.frombuffer(read['data'].value, np.int8).tolist()) == (72, [-1, 100])


@given(
    st.recursive(
        st.none()
        | st.booleans()
        | st.integers(-(2**63), 2**63)
        | st.floats(allow_nan=False, allow_infinity=False)
        | st.text(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    )
)
def test_json_is_that_of_python(value):
    assert json.loads(text.dumps(value)) == json.loads(json.dumps(value))


def test_json_of_arrays_and_of_what_json_has_not():
    values = {
        'a': np.arange(10000, dtype=np.int8),
        'b': b'\x00\xff',
        'c': math.nan,
        'd': np.array([1.5, math.inf, 2.0]),
    }
    read = json.loads(text.dumps(values))
    assert read['a'] == values['a'].tolist() and base64.b64decode(read['b']) == b'\x00\xff'
    assert read['c'] is None and read['d'] == [1.5, None, 2.0]
    assert text.dumps([np.array([], np.int8), np.array([1, 2], np.uint8), np.float64(1.5)]) == '[[],"AQI=",1.5]'


class Time:
    """As genpy's."""

    __slots__ = ('secs', 'nsecs')

    def __init__(self, secs=0, nsecs=0):
        self.secs, self.nsecs = secs, nsecs


class Point:
    """As genpy makes messages."""

    __slots__ = ('x', 'y')
    _slot_types = ('float64', 'int8')

    def __init__(self):
        self.x, self.y = 0.0, 0


class Path:
    """Every kind of field."""

    __slots__ = ('stamp', 'name', 'on', 'at', 'points', 'data', 'three', 'levels')
    _slot_types = ('time', 'string', 'bool', 'a/Point', 'a/Point[]', 'uint8[]', 'float32[3]', 'int16[]')

    def __init__(self):
        self.stamp, self.name, self.on, self.at = Time(), '', False, Point()
        self.points, self.data, self.three, self.levels = [], b'', [0.0] * 3, []


def make(_kind):
    return Point()


FULL = {
    'stamp': {'secs': 3, 'nsecs': 4},
    'name': 'ü',
    'on': True,
    'at': {'x': 1.5, 'y': -128},
    'points': [{'x': 1.0, 'y': 2}],
    'data': b'\x01\x02',
    'three': [1.0, 2.0, 3.0],
    'levels': [-32768, 32767],
}


def test_a_message_is_filled_and_read_again():
    given = {**FULL, 'data': 'AQI='}
    assert to_plain(fill(Path(), given, make)) == FULL
    assert fill(Path(), {'data': [1, 2]}, make).data == b'\x01\x02'
    assert math.isnan(fill(Point(), {'x': None}, make).x)
    assert to_plain(fill(Path(), {}, make)) == to_plain(Path())


@pytest.mark.parametrize(
    'data, word',
    [
        ([], 'the message is'),
        ({'z': 1}, 'no field z'),
        ({'at': {'z': 1}}, 'no field at.z'),
        ({'at': 3}, 'at. is 3'),
        ({'name': 3}, 'name is 3'),
        ({'on': 'yes'}, "on is 'yes'"),
        ({'at': {'y': 128}}, 'at.y is 128'),
        ({'at': {'y': 1.5}}, 'at.y is 1.5'),
        ({'at': {'x': 'a'}}, "at.x is 'a'"),
        ({'at': {'x': math.inf}}, 'at.x is inf'),
        ({'points': {}}, 'points is {}'),
        ({'points': [1]}, 'points[0]. is 1'),
        ({'data': '*'}, 'data is no base64'),
        ({'data': [256]}, 'data[0] is 256'),
        ({'three': [1, 2]}, 'three has 2'),
        ({'levels': 'AQI='}, 'levels is'),
        ({'stamp': 3}, 'stamp is 3'),
        ({'stamp': {'secs': 1}}, 'stamp is'),
        ({'stamp': {'secs': 2**40, 'nsecs': 0}}, 'stamp'),
        ({'on': None}, 'on is None'),
        ({'at': {'y': True}}, 'at.y is True'),
    ],
)
def test_what_does_not_fit_is_named(data, word):
    with pytest.raises(MessageError) as error:
        fill(Path(), data, make)
    assert word in str(error.value)


class Desk:
    """A Bridge, and a ROS side that writes down."""

    def __init__(self, role='rider'):
        self.sent, self.did = [], []
        self.bridge = Bridge(CONFIG, role, self, 'me', self.sent.append)

    def __getattr__(self, name):
        return lambda *arguments: self.did.append((name, *arguments))

    def send(self, op, **fields):
        before = len(self.sent)
        self.bridge.receive(json.dumps({'op': op, **fields}))
        return self.sent[before:]


def test_advertise_publish_unadvertise():
    desk = Desk()
    assert desk.send('advertise', topic='goal', type='a/Point') == []
    assert desk.send('publish', topic='/goal', msg={'x': 1}) == []
    assert desk.send('unadvertise', topic='/goal') == []
    assert desk.did == [
        ('advertise', 'me', '/goal', 'a/Point'),
        ('publish', 'me', '/goal', {'x': 1}),
        ('unadvertise', 'me', '/goal'),
    ]
    assert 'was not advertised' in desk.send('publish', topic='/goal', id='p')[0]['msg']


@pytest.mark.parametrize(
    'op, fields, word',
    [
        ('advertise', {'topic': '/cmd_vel', 'type': 'a/B'}, '/cmd_vel is not on the list of what may be published'),
        ('publish', {'topic': '/cmd_vel', 'msg': {}}, '/cmd_vel is not on the list of what may be published'),
        ('advertise', {'topic': '/goal'}, 'type is'),
        ('advertise', {'topic': 3, 'type': 'a/B'}, 'topic is'),
        ('subscribe', {'topic': ''}, 'topic is'),
        ('subscribe', {'topic': '/x', 'compression': 'png'}, "compression 'png' is not there"),
        ('subscribe', {'topic': '/x', 'throttle_rate': -1}, 'throttle_rate is -1'),
        ('subscribe', {'topic': '/x', 'queue_length': 'a'}, 'queue_length is a'),
        ('subscribe', {'topic': '/x', 'type': 3}, 'type is no text'),
        ('fly', {}, "no op 'fly'"),
    ],
)
def test_what_is_refused_is_refused_in_words(op, fields, word):
    desk = Desk()
    (status,) = desk.send(op, id='7', **fields)
    assert (status['op'], status['level'], status['id']) == ('status', 'error', '7') and word in status['msg']
    assert desk.did == []


@pytest.mark.parametrize('given', ['', '[]', '{}', '{"op": 1}', '[' * 5000, '\x00'])
def test_what_is_no_frame(given):
    desk = Desk()
    desk.bridge.receive(given)
    assert 'no JSON object' in desk.sent[0]['msg'] and desk.did == []


def test_who_looks_may_look():
    desk = Desk('look')
    assert 'may only look' in desk.send('advertise', topic='/goal', type='a/B')[0]['msg']
    assert desk.send('call_service', service='/plan', id='1')[0]['result'] is False
    desk.send('subscribe', topic='/x')
    desk.send('call_service', service='/rosapi/get_param', args={'name': '/open/a'})
    assert [did[0] for did in desk.did] == ['subscribe', 'call']


def test_services():
    desk = Desk()
    desk.send('call_service', service='/plan', args={'a': 1}, id='7')
    name, connection, service, arguments, answer = desk.did[0]
    assert (name, connection, service, arguments) == ('call', 'me', '/plan', {'a': 1})
    answer(True, {'b': 2})
    assert desk.sent == [{'op': 'service_response', 'service': '/plan', 'id': '7', 'values': {'b': 2}, 'result': True}]
    for service, args, word in (
        ('/halt', {}, '/halt is not on the list of what may be called'),
        ('/rosapi/get_param', {'name': '/secret'}, '/secret is not on the list of what may be read'),
        ('/rosapi/get_param', {}, 'name is'),
    ):
        (response,) = desk.send('call_service', service=service, args=args)
        assert response['result'] is False and word in response['values']


def test_messages_wait_in_a_bounded_queue_and_in_turn():
    desk = Desk()
    desk.send('subscribe', topic='/a', queue_length=1000)
    desk.send('subscribe', topic='/b')
    for k in range(9):
        assert desk.bridge.offer(0.0, '/a', 'none', f'a{k}')
        assert desk.bridge.offer(0.0, '/b', 'none', f'b{k}')
    assert [desk.bridge.take() for _ in range(5)] == ['a6', 'b8', 'a7', 'a8', None]
    assert not desk.bridge.offer(0.0, '/c', 'none', 'c') and not desk.bridge.offer(0.0, '/a', 'cbor', b'')


def test_throttle():
    desk = Desk()
    desk.send('subscribe', topic='/a', throttle_rate=100, compression='cbor')
    assert [desk.bridge.offer(t / 16, '/a', 'cbor', b'') for t in range(5)] == [True, False, True, False, True]


def test_subscriptions_are_counted_by_id_and_bounded():
    desk = Desk()
    desk.send('subscribe', topic='/a', id='1')
    desk.send('subscribe', topic='/a', id='2')
    desk.send('unsubscribe', topic='/a', id='1')
    assert [did[0] for did in desk.did] == ['subscribe', 'subscribe']
    desk.send('unsubscribe', topic='/a', id='2')
    assert desk.did[-1] == ('unsubscribe', 'me', '/a')
    for topic in ('/a', '/b'):
        desk.send('subscribe', topic=topic)
    assert '2 topics are subscribed' in desk.send('subscribe', topic='/c')[0]['msg']
    assert desk.send('unsubscribe', topic='/nothing') == []
    assert desk.send('subscribe', topic='/b', fragment_size=10)[0]['level'] == 'warning'


def test_the_end_leaves_nothing():
    desk = Desk()
    desk.send('subscribe', topic='/a')
    desk.send('advertise', topic='/goal', type='a/B')
    desk.bridge.end()
    assert desk.did[-2:] == [('unadvertise', 'me', '/goal'), ('unsubscribe', 'me', '/a')]
    assert desk.bridge.take() is None


def test_floats_in_cbor_are_doubles():
    assert cbor.dumps(np.float32(0.5)) == b'\xfb' + struct.pack('>d', 0.5)
