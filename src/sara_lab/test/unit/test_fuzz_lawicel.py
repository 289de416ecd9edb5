"""20 000 random lines through the Lawicel path; and the test itself notices what it looks for."""

import pytest

from canserial.adapter import adapter, lawicel
from sara_lab.fuzz.bus.lawicel import FuzzFailure, fuzz_lawicel


def test_random_lines_give_frames_or_an_adapter_error():
    assert fuzz_lawicel(20000, 0) > 2000


def test_the_same_seed_gives_the_same_frames():
    first, second = [], []
    fuzz_lawicel(1000, 5, first.append)
    fuzz_lawicel(1000, 5, second.append)
    assert first == second and first


def test_lines_taken_on_trust_would_be_found(monkeypatch):
    monkeypatch.setattr(lawicel, 'is_frame', lambda line: True)
    with pytest.raises(FuzzFailure, match='is right'):
        fuzz_lawicel(20000, 0)


def test_an_adapter_that_never_ends_would_be_found(monkeypatch):
    monkeypatch.setattr(adapter.Adapter, 'receive', lambda self, timeout, clock: None)
    with pytest.raises(FuzzFailure, match='does not come to an end'):
        fuzz_lawicel(10, 0)
