"""Connections, roles, pairing and orders, without a socket and without a robot."""

import json

import pytest

from sara_common.config import ConfigError
from sara_hmi.config.config import HmiConfig, LimitsConfig, NetworkConfig, PairingConfig, SessionsConfig
from sara_hmi.hub.actions import Close, Everyone, Motion, Order, Send, Show, Store
from sara_hmi.hub.hub import Hub
from sara_hmi.pairing import pairing as pairing_module
from sara_hmi.pairing.pairing import DAY, Pairing, StoreError, Token, digest, dumps, loads
from sara_nav.maps.edits import MOST, Edit

KITCHEN = (2.0, 3.0, 0.5)


class Desk:
    """A Hub with a clock, and frames written short."""

    def __init__(self, **groups):
        network = groups.pop('network', NetworkConfig(address='192.168.0.9'))
        self.config = HmiConfig(network=network, **groups)
        secrets = iter(f'secret {k}' for k in range(99))
        self.pairing = Pairing(self.config.pairing, lambda n: 3, lambda: next(secrets))
        self.t = self.date = 100.0
        self.hub = Hub(self.config, self.pairing, lambda: self.date)
        self.hub.tasks.places = {'kitchen': KITCHEN}

    def connect(self, local=True, hello=True, **more):
        number = self.hub.connect(self.t, local).number
        if hello:
            self.send(number, 'hello', version=1, **more)
        return number

    def send(self, number, op, **fields):
        return self.hub.receive(self.t, number, json.dumps({'op': op, **fields}))

    def driver(self):
        number = self.connect()
        self.send(number, 'take')
        return number

    def beat(self):
        return next(a.frame['n'] for a in self.hub.step(self.t) if isinstance(a, Send) and a.frame['op'] == 'beat')


@pytest.fixture(name='desk')
def opened():
    return Desk()


def errors(actions):
    return [action.frame['key'] for action in actions if isinstance(action, Send) and action.frame['op'] == 'error']


def frames(actions, op):
    return [action.frame for action in actions if isinstance(action, (Send, Everyone)) and action.frame['op'] == op]


def test_this_computer_is_the_rider(desk):
    number = desk.hub.connect(0.0, local=True).number
    actions = desk.send(number, 'hello', version=1, language='es', name='Ann')
    (welcome,) = frames(actions, 'welcome')
    assert welcome['role'] == 'rider' and welcome['session'] == number and welcome['driver'] is None
    assert welcome['profiles'] == ['standard'] and welcome['limits']['max_turn'] == 0.6
    assert Order(number, 'catch_up') in actions
    assert desk.hub.clients[number].language == 'es'


def test_this_computer_may_be_configured_to_look(desk):
    desk = Desk(sessions=SessionsConfig(local_role='look'))
    number = desk.connect()
    assert errors(desk.send(number, 'take')) == ['error.may_not']
    assert Order(number, 'stop') in desk.send(number, 'stop')


@pytest.mark.parametrize('op, fields', [
    ('take', {}), ('stop', {}), ('go', {'place': 'kitchen'}), ('say', {'key': 'goal.going'}), ('reset', {}),
    ('invite', {'role': 'look'}), ('drive', {'seq': 1, 't': 0, 'n': 1, 'v': 1, 'w': 0}), ('halt', {'seq': 1}),
])  # fmt: skip
def test_a_stranger_may_nothing(desk, op, fields):
    number = desk.connect(local=False)
    actions = desk.send(number, op, **fields)
    assert errors(actions) == ['error.pair_first'] and len(actions) == 1


def test_a_stranger_is_told_its_role_and_nothing_else(desk):
    number = desk.connect(local=False, hello=False)
    actions = desk.send(number, 'hello', version=1, token='guessed')
    assert actions == [Send(number, {'op': 'welcome', 'session': number, 'role': 'none', 'version': 1})]
    assert frames(desk.send(number, 'echo', t=5), 'echo') == [{'op': 'echo', 't': 5}]


def test_before_hello_nothing_is_heeded(desk):
    number = desk.connect(hello=False)
    for op in ('take', 'stop', 'echo', 'pair'):
        fields = {'echo': {'t': 0}, 'pair': {'code': 'A'}}.get(op, {})
        assert errors(desk.send(number, op, **fields)) == ['error.hello_first']


def test_who_does_not_say_hello_in_time_is_closed(desk):
    slow, quick = desk.connect(hello=False), desk.connect()
    desk.t += 4.9
    assert desk.hub.step(desk.t) == []
    desk.t += 0.2
    assert desk.hub.step(desk.t)[-1] == Close(slow)
    assert quick in desk.hub.clients


def test_hello_is_said_once_and_in_this_version(desk):
    number = desk.connect()
    assert errors(desk.send(number, 'hello', version=1)) == ['error.hello_twice']
    number = desk.connect(hello=False)
    actions = desk.send(number, 'hello', version=2)
    assert errors(actions) == ['error.version'] and actions[-1] == Close(number)


def test_a_code_pairs_one_device_for_good(desk):
    rider, phone = desk.connect(), desk.connect(local=False)
    (show,) = desk.send(rider, 'invite', role='carer')
    assert show == Show(rider, '5555-5555', 'carer', 300.0)
    actions = desk.send(phone, 'pair', code='5555 5555')
    (paired,) = frames(actions, 'paired')
    assert paired == {'op': 'paired', 'token': 'secret 0', 'role': 'carer'}
    assert frames(actions, 'welcome')[0]['role'] == 'carer'
    (store,) = [action for action in actions if isinstance(action, Store)]
    assert 'secret 0' not in store.text and digest('secret 0') in store.text
    assert errors(desk.send(desk.connect(local=False), 'pair', code='5555-5555')) == ['error.code_none']
    again = Desk()
    again.pairing.tokens = list(loads(store.text))
    number = again.connect(local=False, token='secret 0')
    assert again.hub.clients[number].role == 'carer'
    again.date += 91 * DAY
    assert again.hub.clients[again.connect(local=False, token='secret 0')].role == 'none'


def test_wrong_codes_void_the_code_and_then_nobody_pairs_for_a_while(desk):
    rider, phone = desk.connect(), desk.connect(local=False)
    desk.send(rider, 'invite', role='look')
    for _ in range(5):
        assert errors(desk.send(phone, 'pair', code='2222-2222')) == ['error.code_wrong']
    assert errors(desk.send(phone, 'pair', code='5555-5555')) == ['error.code_paused']
    desk.send(rider, 'invite', role='look')
    assert errors(desk.send(phone, 'pair', code='5555-5555')) == ['error.code_paused']
    desk.t += 60.0
    assert frames(desk.send(phone, 'pair', code='5555-5555'), 'paired')


def test_a_code_is_too_old_after_its_time(desk):
    rider, phone = desk.connect(), desk.connect(local=False)
    desk.send(rider, 'invite', role='look')
    desk.t += 300.0
    assert errors(desk.send(phone, 'pair', code='5555-5555')) == ['error.code_none']


def test_only_the_chair_s_own_screen_invites(desk):
    rider, phone = desk.connect(), desk.connect(local=False)
    desk.send(rider, 'invite', role='rider')
    desk.send(phone, 'pair', code='5555-5555')
    assert errors(desk.send(phone, 'invite', role='rider')) == ['error.may_not']
    local = Desk(network=NetworkConfig())
    assert errors(local.send(local.connect(), 'invite', role='rider')) == ['error.no_network']


def test_the_oldest_device_is_forgotten_when_there_are_too_many():
    pairing = Pairing(PairingConfig(tokens=2), lambda n: 0, iter('abc').__next__)
    for _ in range(3):
        code = pairing.invite(0.0, 'look')
        pairing.pair(0.0, 0.0, code, '')
    assert [pairing.known(1.0, secret) is not None for secret in 'abc'] == [False, True, True]


def test_stored_devices_are_read_or_refused():
    tokens = [Token(digest('a'), 'look', 'phone', 5.0)]
    assert loads(dumps(tokens)) == tuple(tokens)
    for text in ('', '{', '[1]', '[{"digest": "a"}]', '[{"digest": 1, "role": "look", "name": "", "until": 1}]',
                 '[{"digest": "a", "role": "king", "name": "", "until": 1}]'):  # fmt: skip
        with pytest.raises(StoreError):
            loads(text)


def test_codes_have_no_letters_that_look_alike():
    assert len(set(pairing_module.ALPHABET)) == 31 and not set('0O1IL') & set(pairing_module.ALPHABET)


def test_driving(desk):
    number = desk.driver()
    beat = desk.beat()
    actions = desk.send(number, 'drive', seq=1, t=7, n=beat, v=0.5, w=-1)
    assert actions == [Motion(0.5, -1), Send(number, {'op': 'ack', 'seq': 1, 't': 7, 'ok': True})]
    assert desk.hub.tasks.speed(0.5, -1) == (0.2, -0.6) and desk.hub.tasks.speed(-1.0, 0.0) == (-0.2, 0.0)
    assert desk.hub.due(desk.t) == pytest.approx(desk.t + 0.05)
    desk.t += 0.2
    assert Motion(0.0, 0.0) in desk.hub.step(desk.t)
    desk.t += 0.1
    (answer,) = desk.send(number, 'drive', seq=2, t=8, n=beat, v=0.5, w=0)
    assert answer.frame == {'op': 'ack', 'seq': 2, 't': 8, 'ok': False, 'why': 'error.drive_late'}


def test_only_the_driver_drives(desk):
    desk.driver()
    other = desk.connect()
    beat = desk.beat()
    (answer,) = desk.send(other, 'drive', seq=1, t=0, n=beat, v=1, w=0)
    assert answer.frame['why'] == 'error.drive_not_driver'
    (answer,) = desk.send(other, 'halt', seq=1)
    assert answer.frame['why'] == 'error.drive_not_driver'


def test_a_driver_who_is_gone_leaves_one_zero(desk):
    number = desk.driver()
    desk.send(number, 'drive', seq=1, t=0, n=desk.beat(), v=1, w=0)
    assert desk.hub.disconnect(number) == [Motion(0.0, 0.0), Everyone({'op': 'driver', 'session': None, 'name': ''})]
    desk.t += 1.0
    assert desk.hub.step(desk.t) == [] and desk.hub.disconnect(number) == []
    assert desk.hub.end() == []


def test_the_end_of_the_server_is_one_zero(desk):
    number = desk.driver()
    desk.send(number, 'drive', seq=1, t=0, n=desk.beat(), v=1, w=0)
    assert desk.hub.end() == [Motion(0.0, 0.0)]


def test_beats_of_the_driver_before_count_for_nothing(desk):
    first = desk.driver()
    old = desk.beat()
    second = desk.connect()
    desk.send(second, 'take')
    actions = desk.send(first, 'grant', session=second)
    assert frames(actions, 'driver') == [{'op': 'driver', 'session': second, 'name': ''}]
    (answer,) = desk.send(second, 'drive', seq=1, t=0, n=old, v=1, w=0)
    assert answer.frame['why'] == 'error.drive_late'
    assert desk.beat() > old


def test_hand_over_while_driving_is_one_zero_first(desk):
    first, second = desk.driver(), desk.connect(name='Bo')
    desk.send(first, 'drive', seq=1, t=0, n=desk.beat(), v=1, w=0)
    (asked,) = desk.send(second, 'take')
    assert asked == Send(first, {'op': 'asked', 'session': second, 'name': 'Bo', 'seconds': 15.0})
    assert desk.send(first, 'grant', session=second)[0] == Motion(0.0, 0.0)
    assert errors(desk.send(first, 'refuse', session=second)) == ['error.not_driver']


def test_a_driver_who_drives_on_is_not_taken_to_be_away(desk):
    first, second = desk.driver(), desk.connect()
    desk.send(second, 'take')
    desk.send(first, 'drive', seq=1, t=0, n=desk.beat(), v=1, w=0)
    desk.t += 15.0
    assert errors(desk.hub.step(desk.t)) == ['error.take_refused']


def test_everybody_s_stop_is_at_once_and_stays(desk):
    number, looker = desk.driver(), desk.connect()
    desk.hub.clients[looker].role = 'look'
    desk.send(number, 'drive', seq=1, t=0, n=desk.beat(), v=1, w=0)
    assert desk.send(looker, 'stop') == [Motion(0.0, 0.0), Order(looker, 'stop')]
    (answer,) = desk.send(number, 'drive', seq=2, t=0, n=1, v=1, w=0)
    assert answer.frame['why'] == 'error.drive_stopped'
    assert errors(desk.send(number, 'go', place='kitchen')) == ['error.stopped']
    assert errors(desk.send(looker, 'reset')) == ['error.may_not']
    assert desk.send(number, 'reset') == [Order(number, 'reset')]


def test_where_nobody_takes_commands_the_driver_is_told(desk):
    driver = desk.driver()
    command = {'t': 0, 'n': desk.beat(), 'v': 0.5, 'w': 0.0}
    assert Motion(0.5, 0.0) in desk.send(driver, 'drive', seq=1, **command)
    desk.hub.driving.obeyed = False
    (answer,) = desk.send(driver, 'drive', seq=2, **command)
    assert answer.frame['why'] == 'error.drive_unheard'
    assert Motion(0.0, 0.0) in desk.send(driver, 'halt', seq=3)


def test_stop_and_halt_are_heeded_however_many_frames_came(desk):
    number = desk.driver()
    desk.send(number, 'drive', seq=1, t=0, n=desk.beat(), v=1, w=0)
    for _ in range(310):
        desk.send(number, 'echo', t=0)
    assert desk.send(number, 'take') == []  # told of it once, and not heeded
    assert Motion(0.0, 0.0) in desk.send(number, 'halt', seq=9)
    assert Order(number, 'stop') in desk.send(number, 'stop')


def test_a_flood_is_told_once_and_then_ended():
    desk = Desk(limits=LimitsConfig(frames_burst=10, faults=20))
    number = desk.connect()
    answers = [desk.send(number, 'echo', t=0) for _ in range(31)]
    assert [errors(answer) for answer in answers[9:11]] == [['error.rate'], []]
    assert Close(number) in answers[-1] or Close(number) in answers[-2]


def test_faults_are_forgiven_slowly(desk):
    number = desk.connect()
    for _ in range(39):
        desk.t += 0.05
        assert Close(number) not in desk.hub.receive(desk.t, number, '{')
    desk.t += 60.0
    assert [Close(number) in desk.hub.receive(desk.t, number, '{') for _ in range(13)].count(True) <= 1
    assert desk.hub.refuse(desk.t, 999, 'error.no_frame') == [] and desk.hub.receive(desk.t, 999, '{}') == []


def test_a_goal_goes_pauses_and_goes_on(desk):
    number = desk.connect()
    assert desk.send(number, 'go', place='kitchen') == [Order(number, 'go', (1, KITCHEN))]
    assert desk.send(number, 'pause') == [Order(number, 'cancel', (1,))]
    assert errors(desk.send(number, 'pause')) == ['error.not_going']
    mission = desk.hub.tasks.mission
    assert mission.ended(1) is None and mission.state == 'paused'  # move_base says that it was cancelled
    assert desk.send(number, 'resume') == [Order(number, 'go', (3, KITCHEN))]
    assert errors(desk.send(number, 'resume')) == ['error.not_paused']
    assert mission.ended(1) is None and mission.ended(3).place == 'kitchen'
    assert errors(desk.send(number, 'cancel')) == ['error.no_goal']


def test_a_goal_is_cancelled_going_or_paused(desk):
    number = desk.connect()
    desk.send(number, 'go', pose=[1, 2, 3])
    assert desk.send(number, 'cancel') == [Order(number, 'cancel', (1,))]
    desk.send(number, 'go', place='kitchen')
    desk.send(number, 'pause')
    assert desk.send(number, 'cancel') == []
    assert desk.hub.tasks.mission.goal is None


def test_a_new_goal_replaces_the_old_one(desk):
    number = desk.connect()
    desk.send(number, 'go', place='kitchen')
    desk.send(number, 'go', pose=[1, 2, 3])
    mission = desk.hub.tasks.mission
    assert mission.ended(1) is None and mission.ended(2).pose == (1.0, 2.0, 3.0)


def test_places(desk):
    number = desk.connect()
    assert errors(desk.send(number, 'go', place='attic')) == ['error.no_place']
    assert errors(desk.send(number, 'place', name='here')) == ['error.no_pose']
    desk.hub.tasks.pose = (1.0, 1.0, 0.0)
    assert desk.send(number, 'place', name='here') == [Order(number, 'place', ('here', (1.0, 1.0, 0.0)))]
    assert desk.send(number, 'place', name='x', pose=[3, 2, 1]) == [Order(number, 'place', ('x', (3.0, 2.0, 1.0)))]
    assert desk.send(number, 'rename', name='kitchen', to='galley') == [Order(number, 'rename', ('kitchen', 'galley'))]
    assert errors(desk.send(number, 'rename', name='attic', to='x')) == ['error.no_place']
    assert errors(desk.send(number, 'rename', name='kitchen', to='kitchen')) == ['error.place_known']
    assert desk.send(number, 'delete', name='kitchen') == [Order(number, 'delete', ('kitchen',))]
    assert errors(desk.send(number, 'delete', name='attic')) == ['error.no_place']


def test_the_map_is_drawn_over_and_each_edit_is_taken_back(desk):
    number = desk.connect()
    door = {'kind': 'wall', 'points': [[0, 1], [0, 2.5]]}
    edit = Edit('wall', (0.0, 1.0), (0.0, 2.5))
    assert errors(desk.send(number, 'edit', **door)) == ['error.no_edits']  # nobody publishes a map that has some
    assert errors(desk.send(number, 'unedit', **door)) == ['error.no_edit']
    desk.hub.tasks.edits = ()
    assert desk.send(number, 'edit', **door) == [Order(number, 'edit', (edit,))]
    for kind, points in (('wall', [[0, 1], [0, 1]]), ('free', [[0, 1], [0, 5]]), ('keep_out', [[0, 0], [3, 0.01]])):
        assert errors(desk.send(number, 'edit', kind=kind, points=points)) == ['error.edit_small']
    assert errors(desk.send(number, 'unedit', **door)) == ['error.no_edit']
    desk.hub.tasks.edits = (edit,) * MOST
    assert errors(desk.send(number, 'edit', **door)) == ['error.edits_full']
    assert desk.send(number, 'unedit', **door) == [Order(number, 'unedit', (edit,))]
    desk.hub.clients[number].role = 'look'
    assert errors(desk.send(number, 'edit', **door)) == errors(desk.send(number, 'unedit', **door)) == ['error.may_not']


def test_a_map_is_saved_where_one_is_made(desk):
    number = desk.connect()
    assert errors(desk.send(number, 'save_map')) == ['error.no_map']
    desk.hub.tasks.maps = True
    assert desk.send(number, 'save_map') == [Order(number, 'save_map')]


def test_profile_pose_and_speech(desk):
    number = desk.connect()
    assert errors(desk.send(number, 'profile', name='fast')) == ['error.no_profile']
    gentle = {'gentle': {'max_forward': 0.5, 'max_reverse': 0.25, 'max_turn': 0.5, 'jerk': 1.0}}
    (told,) = desk.hub.tasks.use_profiles(gentle, 'gentle')
    assert told.frame['limits'] == {'max_forward': 0.5, 'max_reverse': 0.25, 'max_turn': 0.5}
    assert desk.hub.tasks.use_profiles(gentle, 'gentle') == []
    assert desk.send(number, 'profile', name='gentle')[0] == Order(number, 'profile', ('gentle',))
    assert desk.send(number, 'pose', pose=[1, 2, 3]) == [Order(number, 'pose', ((1.0, 2.0, 3.0), False))]
    assert desk.send(number, 'pose', place='kitchen') == [Order(number, 'pose', (KITCHEN, True))]
    assert errors(desk.send(number, 'pose', place='cellar')) == ['error.no_place']
    assert desk.send(number, 'say', key='goal.going') == [Order(number, 'say', ('goal.going', {}, '', False))]
    said = desk.send(number, 'say', key='goal.going', language='es', asked=True)
    assert said == [Order(number, 'say', ('goal.going', {}, 'es', True))]


def test_an_override_is_the_driver_s(desk):
    number, other = desk.connect(), desk.connect()
    assert errors(desk.send(number, 'override', on=True)) == ['error.no_assist']  # shared control does not run
    desk.hub.tasks.assisted = True
    assert desk.send(number, 'override', on=True) == [Order(number, 'override', (True,))]  # who steers by the joystick
    desk.send(number, 'take')
    assert desk.send(number, 'override', on=False) == [Order(number, 'override', (False,))]
    for on in (True, False):  # even where the driver stands
        assert errors(desk.send(other, 'override', on=on)) == ['error.other_drives']
    assert errors(desk.send(number, 'override', on=1)) == ['error.field_wrong']
    assert errors(desk.send(number, 'override')) == ['error.field_missing']
    desk.hub.clients[number].role = 'look'
    assert errors(desk.send(number, 'override', on=True)) == ['error.may_not']


def test_how_much_shared_control_helps_is_the_driver_s(desk):
    number, other = desk.connect(), desk.connect()
    assert errors(desk.send(number, 'help', name='little')) == ['error.no_assist']
    desk.hub.tasks.assisted, desk.hub.tasks.helps = True, ('much', 'little')
    assert desk.send(number, 'help', name='little') == [Order(number, 'help', ('little',))]
    assert errors(desk.send(number, 'help', name='none')) == ['error.no_help']
    desk.send(number, 'take')
    assert desk.send(number, 'help', name='much') == [Order(number, 'help', ('much',))]
    assert errors(desk.send(other, 'help', name='little')) == ['error.other_drives']
    desk.hub.clients[other].role = 'look'
    assert errors(desk.send(other, 'help', name='little')) == ['error.may_not']


def test_nobody_is_sent_off_while_another_drives(desk):
    number, other = desk.driver(), desk.connect()
    desk.send(number, 'drive', seq=1, t=0, n=desk.beat(), v=1, w=0)
    assert errors(desk.send(other, 'go', place='kitchen')) == ['error.other_drives']
    assert errors(desk.send(other, 'pose', pose=[0, 0, 0])) == ['error.other_drives']
    assert errors(desk.send(other, 'pose', place='kitchen')) == ['error.other_drives']
    assert desk.send(number, 'go', place='kitchen')


def test_the_configuration_names_every_fault():
    with pytest.raises(ConfigError) as fault:
        HmiConfig.from_params(
            {
                'x': 1,
                'network': {'port': 'a', 'y': 2, 'address': ''},
                'limits': 3,
                'freshness': {'hold_s': 9.0},
                'sessions': {'local_role': 'king'},
                'robot': {'profiles': {'a': {}}, 'speech': 1, 'places': 3},
                'pairing': {'attempts': 2.5, 'first_role': ''},
            }
        )
    text = '; '.join(fault.value.faults)
    names = 'x is|network/port|network/y|network/address|limits/it is|freshness/hold_s|local_role|profiles/a'
    assert [name for name in f'{names}|speech|places|attempts|first_role'.split('|') if name not in text] == []
