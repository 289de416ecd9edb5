"""`rosrun sara_bringup check_config [NAME|FOLDER ...]`: the usual mistakes in a robot's folder of numbers, in words,
without running anything; without arguments, of every robot there is.

One line for each finding, and for what is only worth knowing (`note`). The status is 1 where something is wrong, else
0.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator

from canserial.dbc.bus import BusDescription, BusError
from canserial.reader.config import ReaderConfig
from sara_bringup.platforms import bus_check, geometry_check, hearing_check, speed_check
from sara_common.config import ConfigError
from sara_common.platforms import Platform, folders, load, parameters
from sara_control.assist.help_profiles import HelpProfiles
from sara_control.gate.gate_config import SafetyConfig
from sara_control.wheels.config import ControllerConfig
from sara_localization.ranges.range_config import RangeConfig
from sara_lowlevel.config import JoystickConfig, MotorConfig, SensorConfig, SpeedLoopConfig
from sara_lowlevel.joystick.joystick_node import JoystickNode
from sara_nav.config.parameters import Parameters
from sara_nav.move_base.settings import read_settings
from sara_sim.config import ChairConfig
from sara_slam.sonar.node_config import SonarNodeConfig

NODES: dict[str, Callable[[Platform], object]] = {
    'safety_gate': lambda p: SafetyConfig.from_params(parameters('sara_control', 'safety.yaml', p)),
    'diff_drive_controller': lambda p: ControllerConfig.from_params(
        parameters('sara_control', 'diff_drive_controller.yaml', p)
    ),
    'shared_control': lambda p: HelpProfiles.from_params(parameters('sara_control', 'assist.yaml', p)),
    'move_base': lambda p: read_settings(Parameters(parameters('sara_nav', 'sara_nav.yaml', p))),
    'range_localization': lambda p: RangeConfig.from_params(parameters('sara_bringup', 'range_localization.yaml', p)),
    'slam_sonar': lambda p: SonarNodeConfig.from_params(parameters('sara_bringup', 'slam_sonar.yaml', p)),
    'read': ReaderConfig.of,
    'sensor_node': SensorConfig.of,
    'motor_node': MotorConfig.of,
    "motor_node's speed loop": SpeedLoopConfig.of,
    'joystick_node': lambda p: JoystickNode(config=JoystickConfig.of(p), bus=BusDescription.of(p)),
    'the simulator': ChairConfig.of,
}
"""Who is told what: each refuses what it cannot use."""


def findings(platform: Platform) -> Iterator[str]:
    """A sentence for each mistake: what a node refuses by itself, and what contradicts something else in the folder."""
    yield from _refused(platform)
    yield from geometry_check.findings(platform)
    yield from speed_check.findings(platform)
    try:
        bus = BusDescription.of(platform)
    except BusError as error:
        yield f'the bus: {error}'
    else:
        yield from bus_check.findings(platform, bus)


def _refused(platform):
    for node, read in NODES.items():
        try:
            read(platform)
        except BusError:
            pass  # of which `findings` tells
        except ConfigError as error:
            yield from (f'{node} refuses it: {fault}' for fault in error.faults)
        except (KeyError, TypeError) as error:
            yield f'{node} misses something: {error}'


def main(words: list[str] | None = None) -> None:
    """The program."""
    parser = argparse.ArgumentParser(prog='check_config', description=__doc__.split('\n\n')[0])
    parser.add_argument(
        'platforms', nargs='*', metavar='NAME|FOLDER', help=f'of {", ".join(folders())}; all without it'
    )
    bad = False
    for name in parser.parse_args(words).platforms or folders():
        notes = []
        try:
            platform = load(name)
            found = list(findings(platform))
            remarks = *speed_check.remarks(platform), *hearing_check.remarks(platform)
            notes = [f'note: {remark}' for remark in remarks]
        except ConfigError as error:
            found = list(error.faults)
        bad = bad or bool(found)
        print('\n'.join(f'{name}: {sentence}' for sentence in [*(found or ['nothing to mend was found']), *notes]))
    sys.exit(1 if bad else 0)
