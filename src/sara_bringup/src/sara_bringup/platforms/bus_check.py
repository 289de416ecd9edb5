"""What contradicts what on a robot's buses: messages of the DBC file, names of the ultrasonic sensors, addresses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from canserial.dbc.bus import BusDescription
from sara_bringup.platforms.geometry_check import same_names
from sara_common.platforms import Platform

SIGNALS = {
    'ENCODER_RIGHT': {'steps', 'time'},
    'ENCODER_LEFT': {'steps', 'time'},
    'JOYSTICK': {'velD', 'velI', 'joyx', 'joyy', 'modo'},
    'MODO_PC': {'modoPC'},
    'WHEEL_COMMAND': {'right', 'left', 'mode'},
    'RANGES_1': set(),
    'RANGES_2': set(),
    'RANGE_ACCEL': {'ax', 'ay', 'az'},
    'IMPACT_GYRO': {'alarma', 'gx', 'gy', 'gz'},
    'COMPLEMENTARY': {'rx', 'ry', 'rz'},
    'MADGWICK': {'roll', 'pitch', 'yaw'},
    'BATTERY': {'voltage'},
}
"""{message: signals} that the nodes exchange, besides those of the ranges."""


def findings(platform: Platform, bus: BusDescription) -> Iterator[str]:
    """A sentence for each contradiction."""
    yield from _messages(bus)
    read = platform.parameters('read').get('dbc', platform.name)
    driven = platform.parameters('diff_drive_controller').get('dbc', read)
    if read != driven:
        yield f'diff_drive_controller/dbc is {driven}, read/dbc {read}: commands would go out as frames of another bus'
    ranges = bus.ranges
    on_the_bus = [name for names in ranges.values() for name in names]
    yield from _twice('the bus', on_the_bus, 'holds the ranges of {} in two frames')
    yield from same_names(f'{Path(bus.path).name} (signals in m of {", ".join(ranges)})', on_the_bus, platform.sonars)
    node = platform.sensor_node
    addresses = node.get('sonar_addresses', {})
    yield from same_names('platform/sensor_node/sonar_addresses', addresses, platform.sonars)
    yield from _twice(
        'the I2C bus', [hex(a) for a in (*addresses.values(), node.get('imu_address', 0))], 'has two chips at {}'
    )
    for where, topics in _topics(platform):
        names = [topic.strip('/').removesuffix('_range') for topic in topics]
        strange = sorted(set(names) - set(platform.sonars))
        if strange:
            yield f'{where} has the topics of {", ".join(strange)}, which platform/sonars does not hold'
        if not names:
            yield f'{where} is empty: no range is heard there'


def _messages(bus):
    for name, signals in SIGNALS.items():
        if name not in bus.names:
            yield f'{Path(bus.path).name} has no message {name}'
        elif not signals <= set(bus.signals(name)):
            yield f'{Path(bus.path).name}: {name} has no signal {", ".join(sorted(signals - set(bus.signals(name))))}'


def _twice(where, names, what):
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield f'{where} {what.format(name)}'


def _topics(platform):
    nav = platform.parameters('move_base')
    for name in ('global_costmap', 'local_costmap'):
        yield f'move_base/{name}/ultrasonic/topics', nav.get(name, {}).get('ultrasonic', {}).get('topics', [])
    yield 'range_localization/range_topics', platform.parameters('range_localization').get('range_topics', [])
    yield 'slam_sonar/range_topics', platform.parameters('slam_sonar').get('range_topics', [])
    yield 'explore/range_topics', platform.parameters('explore').get('range_topics', [])
    yield 'hmi/robot/range_topics', platform.parameters('hmi').get('robot', {}).get('range_topics', [])
