"""The example for one process: a rider drives, frames get lost, and all is the same again with the same seed."""

import importlib
from pathlib import Path

import pytest

from canserial.dbc.bus import BusDescription
from sara_sim.world.world import World


@pytest.fixture(name='example')
def import_example(monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[2] / 'examples')
    return importlib.import_module('one_process')


def test_the_rider_gets_on_and_the_same_seed_gives_the_same_frames(example):
    (chair, frames), (_, again), (_, other) = (example.drive(World.empty(), 8.0, seed=seed) for seed in (0, 0, 1))
    assert chair.pose[0] > 2.0
    assert frames == again != other
    bus = BusDescription.default()
    rates, accelerations = (
        sum(frame.id == bus.id_of(name) for frame in frames) for name in ('IMPACT_GYRO', 'RANGE_ACCEL')
    )
    assert chair.faults.list() == [] and rates < accelerations
