"""Parameters, pacing and the pseudo-terminal."""

import os
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sara_sim.bus.pacing import MAX_LAG_STEPS, Pacer
from sara_sim.bus.terminal import PortError, Terminal
from sara_sim.chips.magnetic_config import MagneticConfig
from sara_sim.ros.settings import SettingsError, SimulatorSettings

MAX_LAG_S = MAX_LAG_STEPS * 0.01


def test_every_fault_is_named_at_once():
    with pytest.raises(SettingsError) as error:
        SimulatorSettings.from_params(
            {
                'map': 3,
                'start': [1, 2],
                'seed': -1,
                'speed': float('nan'),
                'port': 'ttyUSB0',
                'sede': 1,
                'obstacles': 1,
                'bitrate': 123,
                'dbc': 7,
                'platform': 8,
                'assisted': 2,
                'power_up': 1,
                'calibrate': 'yes',
                'fast': 0,
                'madgwick': None,
                'log': 5,
                'castor_swing': 3.0,
                'options': {},
            }
        )
    for name in (
        'map',
        'start',
        'seed',
        'speed',
        'port',
        'sede',
        'obstacles',
        'bitrate',
        'dbc',
        'assisted',
        'power_up',
        'calibrate',
        'fast',
        'madgwick',
        'log',
        'castor_swing',
        'options',
    ):
        assert f'{name} is' in str(error.value)


def test_good_parameters_pass():
    settings = SimulatorSettings.from_params(
        {'start': [1, 2.5, 0], 'seed': 4, 'payload': 10.0, 'collision_shake': True}
    )
    assert settings.start == (1, 2.5, 0) and settings.seed == 4
    assert settings.magnetic == MagneticConfig()
    assert settings.options.changes() == {'payload': (10.0, 0.0), 'collision_shake': (True, False)}


def test_the_magnetic_field_is_a_mapping():
    given_field = {'latitude': 52.0, 'steel': [[1.0, 2.0]], 'date': [2026, 5, 1]}
    settings = SimulatorSettings.from_params({'magnetic': given_field})
    assert settings.magnetic.changes().keys() == {'latitude', 'steel', 'date'}
    with pytest.raises(SettingsError, match='magnetic: latitud is 1, but there is no such .*magnetic: noise is -1'):
        SimulatorSettings.from_params({'magnetic': {'latitud': 1, 'noise': -1.0}})
    with pytest.raises(SettingsError, match='magnetic: .* is given where a mapping'):
        SimulatorSettings.from_params({'magnetic': 3})


@given(st.lists(st.floats(0.0, 0.75 * MAX_LAG_STEPS * 0.01), min_size=50, max_size=200))
def test_pacing_keeps_the_mean_rate_when_steps_are_late(delays):
    pacer, now, steps = Pacer(0.01, 0.0), 0.0, 0
    for delay in delays:
        now += pacer.wait(now) + (delay if steps % 4 == 0 else 0.0)
        pacer.stepped(now)
        steps += 1
    assert now == pytest.approx(steps * 0.01, abs=MAX_LAG_STEPS * 0.01)
    assert pacer.slips == 0


def test_a_long_stop_is_not_caught_up():
    pacer = Pacer(0.01, 0.0)
    pacer.stepped(5.0)
    assert pacer.slips == 1 and pacer.wait(5.0) == 0.0
    pacer.stepped(5.0)
    assert pacer.wait(5.0) == pytest.approx(0.01)


def test_bytes_pass_both_ways_unchanged_and_survive_reopening(tmp_path):
    path = str(tmp_path / 'port')
    everything = bytes(range(256))
    with Terminal(path) as terminal:
        for _ in range(2):
            far = os.open(path, os.O_RDWR | os.O_NOCTTY)
            os.write(far, everything)
            assert terminal.read(1.0) == everything
            assert terminal.write(everything)
            assert os.read(far, 512) == everything
            os.close(far)
            assert terminal.read(0.0) == b''
    assert not os.path.lexists(path)


def test_it_knows_how_much_was_not_read(tmp_path):
    path = str(tmp_path / 'port')
    with Terminal(path) as terminal:
        far = os.open(path, os.O_RDWR | os.O_NOCTTY)
        assert terminal.unread() == 0
        terminal.write(b'0123456789\r')
        deadline = time.monotonic() + 10.0
        while terminal.unread() < 11 and time.monotonic() < deadline:  # the kernel passes them on when it likes
            time.sleep(0.001)
        assert terminal.unread() == 11
        assert os.read(far, 4) == b'0123'
        assert terminal.unread() == 7
        os.read(far, 512)
        assert terminal.unread() == 0
        os.close(far)


def test_nobody_reading_drops_and_does_not_block(tmp_path):
    with Terminal(str(tmp_path / 'port')) as terminal:
        answers = [terminal.write(b't1208\r' * 20) for _ in range(2000)]
    assert answers[0] and not answers[-1]


def test_does_not_take_the_name_of_a_real_file(tmp_path):
    (tmp_path / 'port').write_text('precious')
    with pytest.raises(PortError, match='port'):
        Terminal(str(tmp_path / 'port'))
    with pytest.raises(PortError, match='port'):
        Terminal(str(tmp_path / 'nowhere' / 'port'))


def test_what_was_left_unread_can_be_forgotten(tmp_path):
    path = str(tmp_path / 'port')
    with Terminal(path) as terminal:
        while terminal.write(b'old' * 100):
            pass
        terminal.discard()
        terminal.write(b'new')
        far = os.open(path, os.O_RDWR | os.O_NOCTTY)
        assert os.read(far, 100) == b'new'
        os.close(far)
