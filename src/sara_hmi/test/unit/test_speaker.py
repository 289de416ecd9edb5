"""What the chair says, and that it comes out as sound where espeak-ng is installed."""

import shutil
import sys
import time
import wave
from pathlib import Path

import pytest

from sara_hmi.words.catalogue import Catalogue
from sara_hmi.words.speaker import Speaker

WORDS = Path(__file__).resolve().parents[2] / 'www' / 'words'
# Writes down what it is told and asked to say, once a file is there.
PROGRAM = """
import pathlib, sys, time
folder = pathlib.Path(sys.argv[1])
said = sys.stdin.read()
with (folder / 'said').open('a') as file:
    file.write(f'{sys.argv[2:]} {said}|')
while not (folder / 'over').exists():
    time.sleep(0.01)
"""


def wait(condition):
    end = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.fixture
def speaker(tmp_path):
    speaker = Speaker([sys.executable, '-c', PROGRAM, str(tmp_path)])
    yield speaker
    (tmp_path / 'over').touch()
    wait(lambda: not speaker.busy)


def said(folder):
    file = folder / 'said'
    return file.read_text() if file.exists() else ''


def test_a_sentence_goes_by_the_input_with_its_language(speaker, tmp_path):
    assert speaker.say('es', '-w /etc/passwd') and speaker.busy
    wait(lambda: said(tmp_path))
    assert said(tmp_path) == "['-v', 'es', '--stdin'] -w /etc/passwd|"


def test_while_it_speaks_nothing_else_is_begun(speaker, tmp_path):
    assert speaker.say('en', 'one')
    wait(lambda: said(tmp_path))
    assert speaker.say('en', 'two')
    (tmp_path / 'over').touch()
    wait(lambda: not speaker.busy)
    assert speaker.say('en', 'three')
    wait(lambda: 'three' in said(tmp_path))
    assert 'two' not in said(tmp_path)


def test_what_somebody_has_asked_for_is_said_afterwards_once(speaker, tmp_path):
    for sentence, asked in (('one', False), ('two', True), ('three', True), ('two', True), ('four', False)):
        assert speaker.say('en', sentence, asked)
    (tmp_path / 'over').touch()
    wait(lambda: 'three' in said(tmp_path) and not speaker.busy)
    assert [entry.split('] ')[1] for entry in said(tmp_path).split('|')[:-1]] == ['one', 'two', 'three']


def test_without_the_program_it_says_so():
    assert not Speaker(['/nowhere/espeak-ng']).say('en', 'one')


@pytest.mark.skipif(shutil.which('espeak-ng') is None, reason='espeak-ng is not installed')
@pytest.mark.parametrize('language', ['en', 'es'])
def test_a_sentence_becomes_sound(language, tmp_path):
    sentence = Catalogue.load(WORDS, language).say('goal.succeeded', {'place': 'kitchen'})
    sound = tmp_path / 'said.wav'
    speaker = Speaker(['espeak-ng', '-w', str(sound)])
    assert speaker.say(language, sentence)
    wait(lambda: not speaker.busy)
    with wave.open(str(sound)) as held:
        data = held.readframes(held.getnframes())
        assert held.getnframes() / held.getframerate() > 0.5 and len(set(data)) > 50
