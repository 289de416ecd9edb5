"""The bus log is one that other people's tools read."""

import re
import subprocess
import sys

import pytest

from canserial.dbc.bus import BusDescription
from canserial.frame import Frame
from sara_common.platforms import chosen
from sara_sim.bus.wire import CandumpLog
from sara_sim.chair import SimulatedChair
from sara_sim.world.world import World

COMMAND = f'{BusDescription.default().id_of("WHEEL_COMMAND"):03X}'
LINE = re.compile(r'\((\d+\.\d{6})\) can0 ([0-9A-F]{3}|[0-9A-F]{8})#((?:[0-9A-F]{2})*)$')


@pytest.fixture(scope='module')
def logged(tmp_path_factory):
    """(path, frames heard, number of frames sent) of 5 s of driving."""
    path = tmp_path_factory.mktemp('log') / 'drive.log'
    bus = BusDescription.default()
    chair = SimulatedChair(World.empty(), 1, bus=bus)
    log = chair.log(path)
    heard, sent = [], 0
    for tick in range(500):
        if tick % 2 == 0:
            before = chair.counts['frames lost']
            chair.receive(bus.encode('WHEEL_COMMAND', right=0.0, left=0.0, mode=ord('A')))
            sent += chair.counts['frames lost'] == before
        heard += chair.step()
    log.close()
    return path, heard, sent


def test_every_frame_of_both_directions_is_a_line_in_order(logged):
    path, heard, sent = logged
    lines = [LINE.match(line).groups() for line in path.read_text().splitlines()]
    times = [float(time) for time, _, _ in lines]
    assert times == sorted(times)
    assert [(int(i, 16), bytes.fromhex(data)) for _, i, data in lines if i != COMMAND] == [
        (frame.id, frame.data) for frame in heard
    ]
    assert sum(i == COMMAND for _, i, _ in lines) == sent > 200


@pytest.mark.parametrize('dbc', [path.stem for path in sorted(chosen().folder.glob('*.dbc'))])
def test_cantools_decodes_it_with_our_dbc(logged, dbc):
    path, heard, sent = logged
    command = [sys.executable, '-m', 'cantools', 'decode', '--single-line', BusDescription.named(dbc).path]
    output = subprocess.run(command, stdin=path.open(), capture_output=True, text=True, timeout=600, check=True).stdout
    lines = output.splitlines()
    assert len(lines) == len(heard) + sent
    assert not [line for line in lines if 'Unknown' in line or 'Error' in line or '::' not in line]
    names = {line.split('::')[1].split('(')[0].strip() for line in lines}
    assert {'ENCODER_RIGHT', 'IMPACT_GYRO', 'RANGES_1', 'MADGWICK', 'WHEEL_COMMAND', 'JOYSTICK'} <= names


def test_extended_frames_have_eight_digits(tmp_path):
    log = CandumpLog(tmp_path / 'a.log', 'vcan1')
    log.write(Frame(0x1234, b'\xab', extended=True), 61.5)
    log.close()
    assert (tmp_path / 'a.log').read_text() == '(61.500000) vcan1 00001234#AB\n'


def test_a_second_log_ends_the_first(tmp_path):
    chair = SimulatedChair(World.empty(), 1)
    chair.log(tmp_path / 'a.log')
    chair.step()
    chair.log(tmp_path / 'b.log').close()
    assert (tmp_path / 'a.log').exists() and (tmp_path / 'b.log').read_text() == ''
    with pytest.raises(OSError):
        chair.log(tmp_path / 'nowhere' / 'c.log')
