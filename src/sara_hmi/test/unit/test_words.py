"""Every reason, state, goal ending and refusal has its sentence in both languages, and none is shown as a code."""

import json
import re
from pathlib import Path

import pytest

from sara_control.assist.correction import Correction
from sara_control.assist.correction import sentence as assist_sentence
from sara_control.gate.reasons import Reason, State, sentence
from sara_hmi.words import endings
from sara_hmi.words.catalogue import Catalogue
from sara_hmi.words.keys import ALL, ASSIST, ERRORS, GOALS, REASONS, STATES, WHYS, assist, gate

PACKAGE = Path(__file__).resolve().parents[2]
LANGUAGES = ('en', 'es')
SOURCES = [path for path in (PACKAGE / 'src').rglob('*.py') if path.name != 'keys.py']
KEY = re.compile(r"'((?:error|goal|why|event)\.[a-z_]+)'")


def words(language):
    return json.loads((PACKAGE / 'www' / 'words' / f'{language}.json').read_text(encoding='utf-8'))


@pytest.mark.parametrize('language', LANGUAGES)
def test_every_key_has_its_sentence(language):
    have = words(language)
    assert [key for key in ALL if not str(have.get(key, '')).strip()] == []


@pytest.mark.parametrize('language', LANGUAGES)
def test_no_sentence_is_a_code(language):
    have = words(language)
    assert [key for key in ALL if re.search(r'[a-z]+[._][A-Z_]{3,}|[a-z]+_[a-z]+', have[key])] == []
    assert [key for key in ALL if have[key].strip() == key.split('.')[1]] == []


def test_both_languages_have_the_same_keys_and_values():
    one, other = words('en'), words('es')
    assert set(one) == set(other)
    values = re.compile(r'\{(\w+)\}')
    assert [key for key in one if set(values.findall(one[key])) != set(values.findall(other[key]))] == []
    assert [key for key in (*STATES, *ASSIST, *ERRORS, *WHYS) if one[key] == other[key]] == []


def test_every_state_and_reason_of_the_gate_is_listed():
    assert [f'state.{state.name}' for state in State] == list(STATES)
    assert [f'reason.{reason.name}' for reason in Reason] == list(REASONS)
    assert [f'assist.{one.name}' for one in Correction] == list(ASSIST)
    assert set(endings.ENDINGS.values()) <= set(GOALS)
    assert sorted(endings.ENDINGS) == list(range(10))  # actionlib_msgs/GoalStatus


def test_every_key_that_the_server_speaks_of_is_listed():
    spoken = {key for path in SOURCES for key in KEY.findall(path.read_text(encoding='utf-8'))}
    assert spoken - set(ALL) == set()
    assert set(ERRORS) - spoken == set()


def test_what_the_gate_says_is_understood_back():
    for state in State:
        for reason in Reason:
            said = gate(sentence(state, reason))
            assert said == (state.name, '' if state in (State.IDLE, State.DRIVING) else reason.name)
    assert gate('Something else.') == ('', '')


def test_what_shared_control_says_is_understood_back():
    assert [assist(assist_sentence(one)) for one in Correction] == [one.name for one in Correction]
    assert assist(assist_sentence(None)) == assist('Something else.') == ''


@pytest.mark.parametrize(
    'text, key',
    [
        ('Goal aborted: The chair is stopping because the chair was hit by something.', 'reason.IMPACT'),
        ('Goal aborted: The chair is ready.', 'why.gate'),
        ('Failed to find a valid plan. Even after executing recovery behaviors. No way.', 'why.no_plan'),
        ('Failed to find a valid control. Even after executing recovery behaviors. Something.', 'why.no_command'),
        ('Robot is oscillating. Even after executing recovery behaviors. It moved less.', 'why.oscillation'),
        ('Robot is held. Even after executing recovery behaviors. It is told to move.', 'why.blocked'),
        ('Goal aborted: there is no pose of the robot newer than 0.50 s (transform_tolerance).', 'why.no_pose'),
        ('Goal aborted: the robot is probably lost (0.90 on x), for lost_patience (30.0 s).', 'why.unsure'),
        ("Goal aborted: Sensor data is out of date, we're not going (controller_patience).", 'why.old_data'),
        ('Goal aborted: time went back.', 'why.clock'),
        ('Goal refused: it holds a NaN or an infinity.', 'why.not_finite'),
        ('Aborting on goal because it was sent with an invalid quaternion', 'why.not_finite'),
        ('Goal refused: (99.00, 1.00) is off the map.', 'why.off_map'),
        ('Goal refused: at (1.00, 1.00, 0 deg) the footprint would overlap an obstacle, ...', 'why.occupied'),
        ('Goal refused: Failed to transform the goal pose from x into the map frame: y', 'why.transform'),
        ('Goal refused: there is no map.', 'why.no_map'),
        ('Goal refused: (1.00, 2.00) is in a keep-out place, or too near to one.', 'why.keep_out'),
        ('Failed to find a valid plan. Even after executing all recovery behaviors.', 'why.no_plan'),
        ('', 'why.unknown'),
    ],
)
def test_why_a_goal_ended(text, key):
    assert endings.why(text) == key


def test_every_why_is_reached_by_a_text_but_that_of_a_move_base_that_says_nothing():
    reached = {key for _, key in test_why_a_goal_ended.pytestmark[0].args[1]}
    assert set(WHYS) - reached == {'why.no_navigation'}


def test_why_the_emergency_stop_stays():
    assert endings.reset('The emergency stop is still pressed.') == 'error.reset_pressed'
    assert endings.reset('... released only when the chair stands still.') == 'error.reset_moving'
    assert endings.reset('... released only when no command to move is given.') == 'error.reset_command'


def test_sentences_are_put_together(tmp_path):
    (tmp_path / 'en.json').write_text('{"a.b": "Slow because {why}, {n}.", "c.d": "it rains", "x.y": "{{why}}"}')
    catalogue = Catalogue.load(tmp_path, 'en')
    assert catalogue.say('a.b', {'why': 'c.d', 'n': 3}) == 'Slow because it rains, 3.'
    assert catalogue.say('a.b', {}) == 'Slow because , .'
    assert catalogue.say('x.y', {'why': '{n}'}) == '{{n}}'
    assert catalogue.say('no.such', {}) is None and 'a.b' in catalogue
    assert Catalogue.load(tmp_path, 'xx') is None


def test_the_page_knows_each_correction_as_one_or_as_no_help():
    """The two lists in chair.js: what is missing there is neither drawn nor said."""
    chair = (PACKAGE / 'www' / 'js' / 'chair.js').read_text(encoding='utf-8')
    listed = re.findall(r'const (?:CORRECTIONS|UNHELPED) = new Set\(\[(.*?)\]\)', chair)
    assert len(listed) == 2
    assert sorted(re.findall(r'[A-Z]+', ' '.join(listed))) == sorted(one.name for one in Correction)
