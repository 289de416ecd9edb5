"""What the page is shown."""

import datetime
import io
import json
import math
import ssl
import stat

import numpy as np
import pytest
from PIL import Image

from sara_hmi.hub.mission import Mission
from sara_hmi.view import frames
from sara_hmi.view.frames import Assist, Seen, View
from sara_hmi.view.history import History
from sara_hmi.view.map_image import map_frame, png
from sara_hmi.web import access, certificate, qr


def test_a_state_of_nothing_and_of_everything_is_json():
    json.dumps(frames.state_frame(0.0, View(), None, None), allow_nan=False)
    view = View(
        (1.00004, 2.0, 3.0),
        math.nan,
        0.5,
        ('HELD', 'IMPACT', 'It stands.'),
        (0.1, -0.2),
        (math.nan, 24.126),
        True,
        {'a': True},
    )
    mission = Mission()
    mission.go('kitchen', (1.0, 2.0, 3.0))
    frame = frames.state_frame(1.5, view, 7, frames.goal_field(mission, 2.346))
    json.dumps(frame, allow_nan=False)
    assert frame['pose'] == [1.0, 2.0, 3.0] and frame['v'] is None and frame['w'] == 0.5 and frame['t'] == 1500
    assert frame['gate'] == {'state': 'HELD', 'reasons': ['IMPACT'], 'sentence': 'It stands.'}
    assert frame['battery'] == {'share': None, 'volts': 24.13} and frame['asked'] == {'v': 0.1, 'w': -0.2}
    assert frame['goal'] == {'state': 'going', 'place': 'kitchen', 'pose': [1.0, 2.0, 3.0], 'left': 2.35}


def test_what_shared_control_does_is_shown_only_where_it_runs():
    assert frames.state_frame(0.0, View(), None, None)['assist'] is None
    view = View(assist=Assist('LEFT', (0.31234, math.nan), 17.6, 20.0, 'much', ('much', 'little')))
    frame = frames.state_frame(0.0, view, None, None)
    json.dumps(frame, allow_nan=False)
    profiles = {'profile': 'much', 'profiles': ['much', 'little']}
    assert frame['assist'] == {'does': 'LEFT', 'command': {'v': 0.312, 'w': None}, 'left': 18, 'lasts': 20} | profiles
    view.assist = Assist('', None, math.inf, 20.0)
    frame = frames.state_frame(0.0, view, None, None)
    nothing = {'profile': '', 'profiles': []}
    assert frame['assist'] == {'does': '', 'command': None, 'left': None, 'lasts': 20} | nothing


def test_whether_a_map_is_made_is_shown():
    assert [frames.state_frame(0.0, View(maps=maps), None, None)['maps'] for maps in (False, True)] == [False, True]


def test_whether_the_chair_is_lost_is_shown_as_it_is_known():
    assert [frames.state_frame(0.0, View(lost=lost), None, None)['lost'] for lost in (None, True, False)] == [
        None,
        True,
        False,
    ]


@pytest.mark.parametrize('said, shown', [(math.inf, None), (-math.inf, 0.0), (1.23456, 1.235)])
def test_ranges(said, shown):
    frame = frames.ranges_frame({'SDI': Seen((0.5, 0.0, 0.0), said, 0.16, 6.0, 1.0)})
    assert frame['SDI'] == {'pose': [0.5, 0.0, 0.0], 'range': shown, 'min': 0.16, 'max': 6.0, 'fov': 1.0}


@pytest.mark.parametrize('count', [0, 1, 2, 199, 200, 201, 5000])
def test_a_plan_keeps_its_ends_and_few_points(count):
    points = [(float(k), 0.0) for k in range(count)]
    shown = frames.plan_frame(points)['points']
    assert len(shown) <= 200 and (not count or (shown[0], shown[-1]) == ([0.0, 0.0], [count - 1.0, 0.0]))
    assert len(shown) == count or count > 200


def test_what_is_left_of_a_plan():
    points = [(0.0, 0.0), (1.0, 0.0), (1.0, 2.0)]
    assert frames.left_of(points, (0.9, 0.1, 0.0)) == 2.0
    assert frames.left_of(points, None) is None and frames.left_of([], (0, 0, 0)) is None
    assert frames.finite_pairs([(1.0, 2.0), (math.nan, 0.0), (0.0, math.inf)]) == [(1.0, 2.0)]


def test_one_stop_is_one_entry():
    history = History(3)
    told = [('BRAKING', 'IMPACT'), ('HELD', 'IMPACT'), ('WAITING', 'IMPACT'), ('HELD', 'IMPACT'), ('IDLE', '')]
    assert [history.on_gate(1.5, *one) for one in told] == [True, False, False, False, False]
    assert not history.on_gate(31.0, 'HELD', 'IMPACT') and not history.on_gate(60.9, 'BRAKING', 'IMPACT')
    assert history.on_gate(91.0, 'HELD', 'IMPACT') and history.on_gate(91.0, 'HELD', 'IMU')
    assert not history.on_gate(3.0, 'DRIVING', '') and not history.on_gate(3.0, 'SLOWED', 'FRONT')
    history.add(4.0, 'event.stop', {})
    assert [entry['key'] for entry in history.frame()['list']] == ['state.HELD', 'state.HELD', 'event.stop']
    assert history.frame()['list'][0] == {'t': 91000, 'key': 'state.HELD', 'values': {'reason': 'reason.IMPACT'}}


def test_a_map_is_grey_as_map_server_has_it():
    image = png(np.array([100, -1, 0, 50, 101, -128], np.int8), 3, 2)
    assert np.asarray(Image.open(io.BytesIO(image))).tolist() == [[127, 205, 205], [0, 205, 254]]
    frame = map_frame(image, (3, 2), 0.05, (1, 2, 0))
    assert frame['origin'] == [1.0, 2.0, 0.0] and frame['id'] != map_frame(image, (3, 2), 0.05, (1, 3, 0))['id']
    for size in ((2, 2), (0, 0), (-3, -2)):
        with pytest.raises(ValueError):
            png(np.zeros(6, np.int8), *size)


@pytest.mark.parametrize(
    'host, may',
    [
        ('localhost:8080', True),
        ('LOCALHOST', True),
        ('127.0.0.1:8080', True),
        ('[::1]:8080', True),
        ('chair.local', True),
        ('192.168.1.7:8443', True),
        ('evil.example:8080', False),
        ('localhost.evil.example', False),
        ('', False),
        ('[x', False),
    ],
)
def test_the_server_has_names(host, may):
    assert access.may_call(host, {'localhost', 'chair.local'}) is may


@pytest.mark.parametrize(
    'origin, same',
    [
        (None, True),
        ('http://localhost:8080', True),
        ('HTTP://LOCALHOST:8080', True),
        ('https://localhost:8080', False),
        ('http://localhost:8081', False),
        ('http://localhost', False),
        ('http://evil.example', False),
        ('null', False),
        ('', False),
    ],
)
def test_only_our_own_page_s_origin(origin, same):
    assert access.same_origin(origin, 'http', 'localhost:8080') is same


@pytest.mark.parametrize(
    'peer, local', [('127.0.0.1', True), ('::1', True), ('192.168.1.2', False), (None, False), ('x', False)]
)
def test_who_is_of_this_computer(peer, local):
    assert access.is_local(peer) is local


def test_the_certificate_is_made_once_and_its_key_is_secret(tmp_path):
    now = datetime.datetime(2026, 1, 2)
    context, mark = certificate.kept(tmp_path / 'new', ['localhost', '192.168.0.7'], now)
    assert isinstance(context, ssl.SSLContext) and len(mark) == 95
    assert certificate.kept(tmp_path / 'new', ['other'], now)[1] == mark
    key = tmp_path / 'new' / 'key.pem'
    assert stat.S_IMODE(key.stat().st_mode) == 0o600 and b'PRIVATE KEY' in key.read_bytes()
    certificate.write_secret(key, b'x')
    assert key.read_bytes() == b'x' and stat.S_IMODE(key.stat().st_mode) == 0o600


def test_qr_codes():
    assert len(qr.terminal('https://192.168.0.7:8443/#code=AAAA-AAAA').splitlines()) > 10
    picture = qr.svg('x')
    assert picture.startswith('<svg ') and picture.count('h1v1h-1z') > 100
