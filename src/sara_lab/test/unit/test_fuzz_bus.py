"""Random frames against the reader: readings stay finite, every fault has a sentence, and the fuzz notices what it
looks for.
"""

import math

import pytest

from canserial.dbc.bus import BusDescription, packaged
from canserial.reader.faults import kinds_of
from canserial.reader.reader import Reader
from canserial.reader.readings import (
    AnglesReading,
    BatteryReading,
    EncoderReading,
    ImpactReading,
    ImuReading,
    JoystickReading,
    ModeReading,
    RangeReading,
)
from sara_lab.fuzz.bus import frames, fuzz_command
from sara_lab.fuzz.bus.frames import FuzzFailure, fuzz_reader

BUS = BusDescription.default()


def test_any_frames_at_any_time_give_finite_readings_and_every_kind_of_them():
    kinds = set()
    assert fuzz_reader(20_000, 3, BUS, lambda reading: kinds.add(type(reading))) > 5000
    assert kinds == {
        AnglesReading,
        BatteryReading,
        EncoderReading,
        ImpactReading,
        ImuReading,
        JoystickReading,
        ModeReading,
        RangeReading,
    }


def test_the_fuzz_notices_a_number_that_is_none(monkeypatch):
    monkeypatch.setattr(Reader, '_battery', lambda self, stamp, values: [BatteryReading(stamp, math.nan)])
    with pytest.raises(FuzzFailure, match='BatteryReading'):
        fuzz_reader(2000, 1, BUS)


def test_every_kind_has_a_sentence(monkeypatch):
    """All that the reader counts under random frames is either a kind of fault or none."""
    counted = set()

    class Spy(Reader):
        def _drop(self, kind, stamp):
            counted.add(kind)
            return super()._drop(kind, stamp)

    monkeypatch.setattr(frames, 'Reader', Spy)
    fuzz_reader(20_000, 8)
    assert counted - {'imu_before_set_pose'} <= kinds_of(sum(BUS.ranges.values(), ())).keys() and len(counted) > 20


def test_the_command_says_what_came_of_it(monkeypatch, capsys):
    monkeypatch.setattr('sys.argv', ['fuzz_bus', '--count', '100', '--seed', '7'])
    fuzz_command.main()
    assert capsys.readouterr().out.count('no failure') == 1 + len(packaged())  # the Lawicel path; a reader of each bus
    monkeypatch.setattr('sys.argv', ['fuzz_bus', '--count', '0'])
    with pytest.raises(SystemExit) as ended:
        fuzz_command.main()
    assert ended.value.code == 2
