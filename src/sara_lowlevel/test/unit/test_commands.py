"""The three commands as processes: frames on a CAN bus (UDP multicast on this machine), a clean end, errors that say
what to do.
"""

import argparse
import io
import itertools
import os
import pty
import random
import re
import signal
import struct
import subprocess
import sys
import threading
import time
import tty
from contextlib import suppress
from pathlib import Path

import pytest

from canserial.adapter.adapter import Adapter, AdapterConfig
from canserial.dbc.bus import BusDescription
from sara_common.config import ConfigError
from sara_lowlevel.hardware import HardwareError, open_i2c
from sara_lowlevel.joystick.joystick_command import Device
from sara_lowlevel.joystick.joystick_device import JoystickState
from sara_lowlevel.runner import Recorder, Runner, adapter_config

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
from fake_amplifier import STEPS_PER_TURN, FakeAmplifier  # noqa: E402

BUS = BusDescription.default()


class Command:
    """A command on a bus of its own, and that bus's frames."""

    def __init__(self, name, *arguments, bus=BUS):
        luck = random.SystemRandom()
        group = f'239.{luck.randint(64, 127)}.{luck.randint(0, 255)}.{luck.randint(1, 254)}'
        self.bus = bus
        self.frames, self.adapter = [], Adapter(AdapterConfig('udp_multicast', group))
        self.adapter.open()
        path = os.pathsep.join([str(HERE), *filter(None, sys.path)])
        code = f'from sara_lowlevel.{name}.{name}_command import main; main()'
        self.process = subprocess.Popen(
            [sys.executable, '-c', code, '--can', f'udp_multicast:{group}', *map(str, arguments)],
            env={**os.environ, 'PYTHONPATH': path},
            stderr=subprocess.PIPE,
            text=True,
            cwd=HERE,
        )

    def hear(self, until, limit=600.0):
        """Collect frames until `until(self)` or `limit` s have passed."""
        end = time.monotonic() + limit
        while not until(self):
            assert time.monotonic() < end and self.process.poll() is None, self.names()
            frame = self.adapter.receive(0.1, time.monotonic)
            if frame is not None:
                self.frames.append((frame.time, *self.bus.decode(frame)))
        return self

    def names(self):
        return [name for _, name, _ in self.frames]

    def count(self, name):
        return self.names().count(name)

    def send(self, name, **values):
        self.adapter.send(self.bus.encode(name, **values))

    def end(self, how=signal.SIGINT):
        self.process.send_signal(how)
        _, errors = self.process.communicate(timeout=600)
        while (frame := self.adapter.receive(0.2, time.monotonic)) is not None:
            self.frames.append((frame.time, *self.bus.decode(frame)))
        self.adapter.close()
        return self.process.returncode, errors

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()
        self.adapter.close()


@pytest.mark.parametrize('slow', [False, True])
def test_the_sensor_node_on_chips_of_a_factory(slow, tmp_path):
    log, started = tmp_path / 'bus.log', time.monotonic()
    with Command(
        'sensor', '--i2c', 'fake_chips:demo', '--no-calibrate', '--record', log, *(['--slow'] if slow else [])
    ) as command:
        command.hear(lambda c: c.count('IMPACT_GYRO') >= 12 and c.count('MADGWICK') >= 12)
        status, errors = command.end()
    assert status == 0 and 'running' in errors and 'frames sent' in errors
    names = command.names()
    assert set(names) == {'RANGES_1', 'RANGES_2', 'RANGE_ACCEL', 'IMPACT_GYRO', 'COMPLEMENTARY', 'MADGWICK'}
    # A process may be late, never early.
    period = 0.2 if slow else 0.05
    assert names.count('IMPACT_GYRO') <= (time.monotonic() - started) / period + 1
    between = ' '.join(names).split('RANGES_1')
    assert max(part.count('IMPACT_GYRO') for part in between) in ((1, 2) if slow else (3, 4, 5))
    lines = log.read_text().splitlines()
    assert len(lines) >= len(command.frames)
    identifiers = '|'.join(f'{BUS.id_of(name):03X}' for name in set(names))
    assert all(re.fullmatch(rf'\(\d+\.\d{{6}}\) \S+ ({identifiers})#[0-9A-F]{{16}}', line) for line in lines)


def test_the_button_calibrates_and_imu_frames_pause():
    with Command('sensor', '--i2c', 'fake_chips:demo', '--no-calibrate') as command:
        command.hear(lambda c: c.count('IMPACT_GYRO') >= 2)
        command.process.send_signal(signal.SIGUSR1)
        # More than a second of ranges with nothing between, where there were IMU frames.
        command.hear(lambda c: set(c.names()[-12:]) == {'RANGES_1', 'RANGES_2'})
        assert command.end(signal.SIGTERM)[0] == 0


class AmplifierOnAPty(threading.Thread):
    """The simulated AX3500 on a pseudo-terminal."""

    def __init__(self):
        super().__init__(daemon=True)
        self.fake, self.ending = FakeAmplifier(), False
        self.master, slave = pty.openpty()
        tty.setraw(slave)
        os.set_blocking(self.master, False)
        self.name_of_port = os.ttyname(slave)
        self._slave = slave

    def run(self):
        start = time.monotonic()
        while not self.ending:
            self.fake.advance(time.monotonic() - start)
            with suppress(BlockingIOError):
                self.fake.write(os.read(self.master, 4096))
            os.write(self.master, self.fake.read())
            time.sleep(0.003)


def test_the_motor_node_drives_on_command_and_ends_with_a_stop():
    amplifier = AmplifierOnAPty()
    amplifier.start()
    with Command('motor', '--serial', amplifier.name_of_port) as command:
        command.hear(lambda c: c.count('ENCODER_LEFT') >= 2 and c.count('BATTERY') >= 1)

        sent = [0.0, 0]

        def drive(c):
            now = time.monotonic()
            if now < sent[0] + 0.02:  # what is sent is heard here too: no faster than it is read
                return min(amplifier.fake.angles) > 1.0
            sent[0], sent[1] = now, sent[1] + 1
            c.send('JOYSTICK', velD=0, velI=0, joyx=512, modo=1, joyy=512)
            granted = [values['modoPC'] for _, name, values in c.frames if name == 'MODO_PC'][-1:] == [3]
            granted = granted and sent[1] % 50 > 0  # a stop now and then: on a slow machine the drive may wait for one
            c.send(
                'WHEEL_COMMAND', right=2 if granted else 0, left=2 if granted else 0, mode=ord('C' if granted else 'A')
            )
            return min(amplifier.fake.angles) > 1.0

        command.hear(drive)
        status, errors = command.end(signal.SIGHUP)
    assert status == 0 and 'PC drives' in errors
    deadline = time.monotonic() + 10
    while amplifier.fake.power != [0.0, 0.0] and time.monotonic() < deadline:
        time.sleep(0.01)
    amplifier.ending = True
    assert amplifier.fake.power == [0.0, 0.0] and amplifier.fake.commands[-1][1] in ('!A00', '!B00')
    right = [values['steps'] for _, name, values in command.frames if name == 'ENCODER_RIGHT']
    assert right[-1] > 0.08 * STEPS_PER_TURN
    # Its regulator brakes against the motion; where it has to wait, a wheel turns back a little, not a tenth of a turn.
    assert all(after > before - 0.1 * STEPS_PER_TURN for before, after in itertools.pairwise(right))
    assert [values['voltage'] for _, name, values in command.frames if name == 'BATTERY'][-1] == pytest.approx(24.707)


def test_the_joystick_node_reads_a_device(tmp_path):
    device = tmp_path / 'js0'
    os.mkfifo(device)
    keep = os.open(device, os.O_RDWR)
    with Command('joystick', '--device', device) as command:
        command.hear(lambda c: c.count('JOYSTICK') >= 2)
        assert command.frames[-1][2]['joyy'] == 512
        os.write(keep, struct.pack('<IhBB', 0, -32767, 2, 1))
        command.hear(lambda c: c.frames[-1][2]['joyy'] == 1023)
        values = command.frames[-1][2]
        assert values['velD'] == values['velI'] > 2.5 and values['modo'] == 1
        assert command.end()[0] == 0
    os.close(keep)


def test_a_device_that_comes_back_is_read_before_it_says_anything(tmp_path):
    """The stick is held: that it was let go, which one in the middle says, would let it drive."""
    path, away = tmp_path / 'js0', tmp_path / 'away'
    os.mkfifo(path)
    keep = os.open(path, os.O_RDWR)
    device = Device(argparse.Namespace(device=str(path), x_axis=0, y_axis=1, hold_button=None))
    assert device.poll(0.0).stick == (512, 512)
    device._lose('No such device')
    path.rename(away)
    assert device.poll(1.0) is None and 'is it plugged in' in device.problem
    os.write(keep, struct.pack('<IhBB', 0, -32767, 0x82, 1))
    away.rename(path)
    assert device.poll(1.5) is None and device.poll(2.0).stick == (512, 1023)
    device.close()
    os.close(keep)


def test_the_switch_of_the_joystick_node_needs_a_bus_that_has_it(tmp_path):
    device = tmp_path / 'js0'
    os.mkfifo(device)
    keep = os.open(device, os.O_RDWR)
    options = ('--device', device, '--assist-switch', '2')
    with Command('joystick', *options) as command:
        _, errors = command.process.communicate(timeout=600)
        assert command.process.returncode == 2 and f'{Path(BUS.path).name} has no such mode' in errors
    assisted = BusDescription.named('sara_assisted')
    with Command('joystick', *options, '--dbc', 'sara_assisted', bus=assisted) as command:
        command.hear(lambda c: c.count('JOYSTICK') >= 1)
        assert command.frames[-1][2]['modo'] == 1
        os.write(keep, struct.pack('<IhBB', 0, 1, 1, 2))
        command.hear(lambda c: c.frames[-1][2]['modo'] == 2)
        os.write(keep, struct.pack('<IhBB', 0, 0, 1, 2))
        command.hear(lambda c: c.frames[-1][2]['modo'] == 1)
        assert command.end()[0] == 0
    os.close(keep)


def test_the_stick_counts_only_while_its_button_is_held():
    state = JoystickState(hold_button=4)
    state.feed(struct.pack('<IhBB', 1, 32767, 0x82, 0))
    assert state.stick == (512, 512)
    event = struct.pack('<IhBB', 2, 1, 1, 4)
    state.feed(event[:3])
    state.feed(event[3:])
    assert state.stick == (1023, 512)
    state.feed(struct.pack('<IhBB', 3, 0, 1, 4))
    assert state.stick == (512, 512)


@pytest.mark.parametrize(
    'name, arguments, says',
    [
        ('sensor', ['--i2c', '/dev/i2c-99', '--can', 'udp_multicast:239.74.163.2'], 'there is no /dev/i2c-99'),
        ('sensor', ['--i2c', 'no_such_module:x', '--can', 'udp_multicast:239.74.163.2'], 'no_such_module'),
        ('sensor', ['--i2c', 'fake_chips:demo', '--can', 'can0'], 'INTERFACE:CHANNEL'),
        ('sensor', ['--i2c', 'fake_chips:demo', '--can', 'carrier_pigeon:can0'], 'carrier_pigeon'),
        (
            'sensor',
            ['--i2c', 'fake_chips:demo', '--can', 'udp_multicast:239.74.163.2', '--dbc', '/nowhere.dbc'],
            '/nowhere.dbc',
        ),
        (
            'sensor',
            ['--i2c', 'fake_chips:demo', '--can', 'udp_multicast:239.74.163.2', '--record', '/nowhere/x.log'],
            '/nowhere/x.log',
        ),
        ('motor', ['--serial', '/dev/ttyS99', '--can', 'udp_multicast:239.74.163.2'], '/dev/ttyS99'),
        (
            'motor',
            ['--serial', '/dev/null', '--can', 'udp_multicast:239.74.163.2', '--max-speed', '-1'],
            'max_wheel_speed',
        ),
        (
            'joystick',
            ['--device', '/dev/null', '--can', 'udp_multicast:239.74.163.2', '--max-forward', '10', '--max-turn', '5'],
            'max_forward and max_turn are 10 and 5 rad/s',
        ),
        ('joystick', ['--device', '/dev/input/js99', '--can', 'udp_multicast:239.74.163.2'], '/dev/input/js99'),
    ],
)
def test_what_is_missing_is_said_in_one_line(name, arguments, says):
    path = os.pathsep.join([str(HERE), *filter(None, sys.path)])
    done = subprocess.run(
        [sys.executable, '-c', f'from sara_lowlevel.{name}.{name}_command import main; main()', *arguments],
        env={**os.environ, 'PYTHONPATH': path},
        stderr=subprocess.PIPE,
        text=True,
        timeout=600,
    )
    assert done.returncode == 2
    assert done.stderr.startswith('error: ') and says in done.stderr and len(done.stderr.splitlines()) == 1


def test_an_adapter_that_is_missing_is_waited_for():
    path = os.pathsep.join([str(HERE), *filter(None, sys.path)])
    process = subprocess.Popen(
        [
            sys.executable,
            '-c',
            'from sara_lowlevel.sensor.sensor_command import main; main()',
            '--i2c',
            'fake_chips:demo',
            '--can',
            'slcan:/dev/nowhere',
        ],
        env={**os.environ, 'PYTHONPATH': path},
        stderr=subprocess.PIPE,
        text=True,
    )
    said = ''
    while 'Waiting for it' not in said:
        line = process.stderr.readline()
        assert line, said
        said += line
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=600)
    assert process.returncode == 0 and '/dev/nowhere is missing' in said and ' 0 frames sent' in rest


class Clock:
    """Time that passes only in sleep."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


def runner(step, **arguments):
    clock = Clock()
    name = f'test{random.SystemRandom().getrandbits(32)}'
    return Runner(
        'node', adapter_config(f'virtual:{name}'), step, lambda: 'well', clock=clock, sleep=clock.sleep, **arguments
    ), clock


def test_a_turn_that_took_long_is_followed_by_turns_in_phase():
    times = []

    def step(t, heard):
        times.append(round(t, 4))
        clock.now += 0.034 if len(times) == 3 else 0.001
        if len(times) == 8:
            node.stop()
        return []

    node, clock = runner(step)
    assert node.run() == 0
    assert times == [0.0, 0.01, 0.02, 0.054, 0.06, 0.07, 0.08, 0.09] and node.late == 2


def test_whatever_ends_the_loop_the_end_is_called_first():
    ended = []

    def step(t, heard):
        raise RuntimeError('a fault in a node')

    node, _ = runner(step, at_end=lambda: ended.append(True))
    with pytest.raises(RuntimeError):
        node.run()
    assert ended == [True]


class BrokenLog(io.StringIO):
    """stderr on a full disk, or a pipe that nobody reads any more."""

    def __init__(self, error, terminal):
        super().__init__()
        self.error, self.isatty, self.tried = error, lambda: terminal, 0

    def flush(self):
        self.tried += 1
        raise self.error


@pytest.mark.parametrize('terminal', [False, True])
@pytest.mark.parametrize('error', [OSError(28, 'No space left on device'), BrokenPipeError(32, 'Broken pipe')])
def test_a_log_that_cannot_be_written_does_not_end_the_node(error, terminal, monkeypatch):
    turns = []

    def step(t, heard):
        turns.append(t)
        if len(turns) == 300:
            node.stop()
        return []

    log = BrokenLog(error, terminal)
    monkeypatch.setattr(sys, 'stderr', log)
    node, _ = runner(step)
    assert node.run() == 0 and len(turns) == 300 and log.tried >= 2


def test_adapters_by_name():
    assert (
        adapter_config('socketcan:can0').port == 'can0' and adapter_config('slcan:/dev/canusb@250000').bitrate == 250000
    )
    for wrong in ('can0', 'slcan:', 'slcan:/dev/canusb@fast', ':x', 'slcan:/dev/canusb@123'):
        with pytest.raises(ConfigError):
            adapter_config(wrong)


def test_an_object_without_smbus2s_methods_is_refused():
    with pytest.raises(HardwareError, match='read_i2c_block_data'):
        open_i2c('collections:OrderedDict')


def test_a_full_disk_ends_the_recording_only():
    recorder = Recorder('/dev/full', 'can0', lambda: 1.5)
    for _ in range(2000):
        recorder.write(BUS.encode('MODO_PC', modoPC=1))
    recorder.close()
    assert 'No space left' in recorder.problem
