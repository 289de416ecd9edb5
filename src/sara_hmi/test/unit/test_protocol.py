"""Frames from the page: what fits is read, and everything else is refused by name."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_hmi.protocol.frames import LARGEST, OPS, Frame, ProtocolError, parse
from sara_hmi.protocol.limits import Bucket
from sara_hmi.protocol.outbox import ORDER, Outbox

GOOD = {
    'hello': {'version': 1, 'token': 'x', 'language': 'en', 'name': 'Ann Lee'},
    'pair': {'code': 'ABCD-2345'},
    'echo': {'t': 12.5},
    'take': {},
    'release': {},
    'grant': {'session': 3},
    'refuse': {'session': 3},
    'drive': {'seq': 1, 't': 1.0, 'n': 4, 'v': -1, 'w': 0.25},
    'halt': {'seq': 2, 't': 3},
    'stop': {},
    'reset': {},
    'go': {'place': 'kitchen'},
    'pause': {},
    'resume': {},
    'cancel': {},
    'pose': {'pose': [1.0, -2, 0.5]},
    'profile': {'name': 'gentle'},
    'override': {'on': True},
    'help': {'name': 'little'},
    'place': {'name': 'küche_2', 'pose': [0, 0, 0]},
    'rename': {'name': 'a', 'to': 'b'},
    'edit': {'kind': 'wall', 'points': [[0, 1.5], [2, -1]]},
    'unedit': {'kind': 'keep_out', 'points': [[0, 1], [2, 3]]},
    'save_map': {},
    'delete': {'name': 'a'},
    'say': {'key': 'goal.succeeded', 'values': {'place': 'kitchen', 'left': 1.5}, 'language': 'es', 'asked': True},
    'invite': {'role': 'carer'},
}


def test_every_op_has_a_good_frame_here():
    assert set(GOOD) == set(OPS)


@pytest.mark.parametrize('op', GOOD)
def test_a_good_frame_is_read(op):
    assert parse(json.dumps({'op': op, **GOOD[op]})) == Frame(op, GOOD[op])


@pytest.mark.parametrize('op, name', [(op, name) for op in GOOD for name in OPS[op].needs])
def test_what_is_needed_is_missed_by_name(op, name):
    fields = {key: value for key, value in GOOD[op].items() if key != name}
    with pytest.raises(ProtocolError) as fault:
        parse(json.dumps({'op': op, **fields}))
    assert (fault.value.key, fault.value.of, fault.value.values) == ('error.field_missing', op, {'field': name})


@pytest.mark.parametrize('op, name', [(op, name) for op in GOOD for name in {**OPS[op].needs, **OPS[op].may}])
@pytest.mark.parametrize(
    'value', [None, True, [], {'a': 1e9}, '', -1, 'x' * 200, [1, 2], [1, 2, '3'], 1e300, '\ud800', '\n']
)
def test_a_wrong_value_is_refused_by_name(op, name, value):
    if (name, value) in (('t', -1), ('v', -1), ('w', -1), ('on', True), ('asked', True)):
        return
    with pytest.raises(ProtocolError) as fault:
        parse(json.dumps({'op': op, **GOOD[op], name: value}))
    assert (fault.value.key, fault.value.of) == ('error.field_wrong', op)


@pytest.mark.parametrize(
    'text',
    [
        '',
        'x',
        '1',
        '[]',
        '"stop"',
        'null',
        '{}',
        '{"op": 1}',
        '{"op": "stop"',
        '{"op": "stop", "op": "go"}',
        '{"op": "drive", "seq": 1, "t": 0, "n": 1, "v": NaN, "w": 0}',
        '{"op": "drive", "seq": 1, "t": 0, "n": 1, "v": -Infinity, "w": 0}',
        '{"op": "echo", "t": ' + '9' * 400 + '}',
        '[' * 4000,
        '{"op":' * 800,
        '\x00',
    ],
)
def test_what_is_no_frame(text):
    with pytest.raises(ProtocolError) as fault:
        parse(text)
    assert fault.value.key == 'error.no_frame'


@pytest.mark.parametrize('v, w', [(1.0001, 0), (0, -1.0001), ('1', 0), (1e999, 0)])
def test_a_share_over_one_is_refused(v, w):
    text = json.dumps({'op': 'drive', 'seq': 1, 't': 0, 'n': 1, 'v': v, 'w': w}).replace('Infinity', '1e999')
    with pytest.raises(ProtocolError, match='field_wrong'):
        parse(text)


def test_unknown_ops_and_fields_are_refused():
    with pytest.raises(ProtocolError, match='no_such_op'):
        parse('{"op": "fly"}')
    with pytest.raises(ProtocolError, match='field_wrong'):
        parse('{"op": "stop", "now": true}')
    with pytest.raises(ProtocolError, match='field_wrong') as fault:
        parse(json.dumps({'op': 'stop', 'x' * 99: 1}))
    assert fault.value.values == {'field': ''}


@pytest.mark.parametrize(
    'field, value',
    [('kind', 'lava'), ('kind', ['wall']), ('points', [[0, 1]]), ('points', [[0, 1], [2, 3], [4, 5]])]
    + [('points', [[0, 1], [2, bad]]) for bad in (None, True, '3', [3], 1e5)],
)
def test_an_edit_is_one_of_three_kinds_between_two_points(field, value):
    with pytest.raises(ProtocolError, match='field_wrong') as fault:
        parse(json.dumps({'op': 'edit', **GOOD['edit'], field: value}))
    assert fault.value.values == {'field': field}


@pytest.mark.parametrize('op', ['go', 'pose'])
def test_a_goal_and_where_the_chair_is_are_a_place_or_a_pose(op):
    for fields in ({}, {'place': 'a', 'pose': [0, 0, 0]}):
        with pytest.raises(ProtocolError, match='field_missing'):
            parse(json.dumps({'op': op, **fields}))
    assert parse(json.dumps({'op': op, 'pose': [1, 2, 3]})).get('pose') == [1, 2, 3]
    assert parse(json.dumps({'op': op, 'place': 'a'})).get('place') == 'a'


def test_whole_numbers_are_those_of_javascript():
    assert parse(json.dumps({'op': 'grant', 'session': LARGEST})).get('session') == LARGEST
    with pytest.raises(ProtocolError):
        parse(json.dumps({'op': 'grant', 'session': LARGEST + 1}))


@given(
    st.text(max_size=200) | st.recursive(st.none() | st.booleans() | st.floats() | st.text(), st.lists).map(json.dumps)
)
def test_any_text_is_read_or_refused(text):
    try:
        assert isinstance(parse(text), Frame)
    except ProtocolError as fault:
        json.dumps(fault.values).encode()


def test_a_bucket_lets_a_burst_pass_and_then_its_rate():
    bucket = Bucket(2.0, 3)
    assert [bucket.take(0.0) for _ in range(4)] == [True, True, True, False]
    assert [bucket.take(0.5), bucket.take(0.5)] == [True, False]
    assert [bucket.take(100.0) for _ in range(4)] == [True, True, True, False]
    assert not bucket.take(50.0)  # a clock that goes back fills nothing


def test_answers_come_in_order_and_of_the_rest_only_the_newest():
    box = Outbox(3)
    assert box.take() is None and len(box) == 0
    for k in range(50):
        box.put('state', f'state {k}')
        box.put('map', k)
    assert [box.answer('a'), box.answer('b'), box.answer('c'), box.answer('d')] == [True, True, True, False]
    assert len(box) == 5 and box.dropped == 98
    assert [box.take(urgent_only=True) for _ in range(4)] == ['a', 'b', 'c', None]
    assert [box.take() for _ in range(3)] == ['state 49', 49, None]


def test_the_map_is_last_among_what_waits():
    box = Outbox(1)
    for kind in reversed(ORDER):
        box.put(kind, kind)
    assert [box.take() for _ in ORDER] == list(ORDER)
    assert ORDER[-1] == 'map'
