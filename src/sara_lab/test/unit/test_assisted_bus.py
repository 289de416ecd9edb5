"""Somebody drives by the chair's own joystick with the PC's help, and something happens: a few chairs of the campaign's
part.
"""

import dataclasses

import pytest

from sara_lab.campaign import assisted_bus as part
from sara_lab.campaign.assisted_bus import EVENTS, happen


@pytest.mark.parametrize('seed', (0, 1))
@pytest.mark.parametrize('name', EVENTS)
def test_it_stands_in_time_and_nothing_moves_it_until_the_stick_was_let_go(name, seed):
    outcome = happen(name, seed)
    assert outcome.faults == [] and outcome.before > 0.08


def test_the_same_seed_is_the_same_drive():
    assert happen('bus_cut', 3) == happen('bus_cut', 3)


@pytest.mark.parametrize(
    'event, words',
    (
        (dataclasses.replace(EVENTS['pc_killed'], make=lambda driven, luck: None, pc_runs=True), 'at rest after'),
        (dataclasses.replace(EVENTS['let_go'], mode=1), 'after letting go the mode is 2'),
    ),
)
def test_what_does_not_happen_and_what_goes_on_otherwise_is_told(event, words, monkeypatch):
    monkeypatch.setitem(part.EVENTS, 'let_go', event)
    assert any(words in fault for fault in happen('let_go', 0).faults)


def test_the_table_holds_the_worst_of_each_event(tmp_path):
    made = part.assisted_bus(2, tmp_path)
    assert len(made.cases) == 2 * len(EVENTS)
    results = [
        {'event': name, 'stopped_after': 0.1 + 0.1 * seed, 'allowed': 1.0, 'commands': seed}
        for name in EVENTS
        for seed in range(2)
    ]
    lines, figures = made.summary(results)
    assert len(lines) == 1 + len(EVENTS)
    assert figures['bus_cut'] == {'cases': 2, 'worst_s': 0.2, 'share': 0.2, 'commands': 1}
