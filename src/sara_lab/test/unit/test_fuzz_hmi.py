"""Random frames against the touch screen's server, and that the judge would see what is wrong."""

import os
import random

import pytest

from sara_hmi.freshness.freshness import Freshness
from sara_hmi.hub import hub as hub_module
from sara_hmi.hub.actions import Order
from sara_lab.fuzz.touch.frames import Failed, Trial, fuzz_hub

SEED = random.randrange(10**6) if os.environ.get('SARA_RANDOM_TESTS') else 0


@pytest.mark.parametrize('strangers', [True, False])
@pytest.mark.parametrize('number', range(3))
def test_random_frames(strangers, number):
    assert fuzz_hub(3000, SEED * 1000 + number, strangers) > 1000


def test_the_pages_do_move_the_chair():
    trial = Trial(1, strangers=False)
    trial.run(3000)
    assert trial.motions > 50


def test_the_judge_sees_an_old_command(monkeypatch):
    monkeypatch.setattr(Freshness, 'step', lambda self, t: self._command and (self._command.v, self._command.w))
    with pytest.raises(Failed, match='published at'):
        fuzz_hub(3000, 1, strangers=False)


def test_the_judge_sees_a_stranger_who_may_something(monkeypatch):
    monkeypatch.setattr(hub_module, 'NONE', 'look')
    with pytest.raises(Failed, match='stranger'):
        fuzz_hub(3000, 1, strangers=True)


def test_the_judge_sees_an_override_by_who_does_not_drive(monkeypatch):
    monkeypatch.setattr(hub_module.Tasks, 'heed', lambda self, client, frame, *_: [Order(client, frame.op)])
    with pytest.raises(Failed, match='took the help'):
        for seed in range(30):  # few frames of each are an override
            fuzz_hub(3000, seed, strangers=False)
