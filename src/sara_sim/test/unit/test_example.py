"""The example for one process: a rider drives, frames get lost, and all is the same again with the same seed."""

import importlib
from pathlib import Path

import pytest

from sara_sim.world.world import World


@pytest.fixture(name='example')
def import_example(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[2] / 'examples')
    return importlib.import_module('one_process')


def test_the_rider_gets_on_and_the_same_seed_gives_the_same_frames(example):
    (chair, frames), (_, again), (_, other) = (example.drive(World.empty(), 8.0, seed=seed) for seed in (0, 0, 1))
    assert chair.pose[0] > 2.0
    assert frames == again != other
    assert chair.faults.list() == [] and sum(frame.id == 0x204 for frame in frames) < sum(
        frame.id == 0x203 for frame in frames
    )
