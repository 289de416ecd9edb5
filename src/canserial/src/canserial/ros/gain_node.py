"""calibrate_gain: turns of known angle to the gain k of the gyroscope (thesis table 4.11), at a terminal beside the
chair.

It reads canrx itself, without gain and with an offset that it measures first, so that it needs neither read.py nor what
read.py is set to. The chair is turned by its joystick; nothing here moves it.
"""

from __future__ import annotations

import argparse
import math
import sys

import rospy

from canserial.calibration.calibration_file import CalibrationFileError
from canserial.calibration.gain import ANGLES, GainError, GainProcedure, GainResult
from canserial.dbc.bus import BusError
from canserial.ros import calibration_store
from canserial.ros.bus_tool import BusTool, GivenUp, common_arguments, reload
from sara_common.config import ConfigError

SIGNS = {'left': (1.0,), 'right': (-1.0,), 'both': (1.0, -1.0)}
WAYS = {1.0: 'left', -1.0: 'right'}


class GainTool(BusTool):
    """Asks, listens, computes."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.procedure = GainProcedure(
            [sign * angle for sign in SIGNS[options.directions] for angle in options.angles], options.max_residual
        )
        self.zero = 0.0
        super().__init__(options, None, gain=1.0)

    def run(self) -> GainResult:
        """The whole procedure; returns the GainResult. Raises GivenUp, GainError."""
        self.measure_offset()
        sign = 0.0
        while self.procedure.next_angle is not None:
            angle = self.procedure.next_angle
            if math.copysign(1.0, angle) != sign:
                sign = math.copysign(1.0, angle)
                self.ask(f'Zero: stand at the mark from which you will turn {WAYS[sign]}, and press Enter')
                self.zero = self.turned_at_rest()
            self.ask(f'Turn {WAYS[sign]} until the chair stands {abs(angle):g} deg from zero, and press Enter')
            measured = self.turned_at_rest() - self.zero
            try:
                self.procedure.add(angle, measured)
            except GainError as error:
                print(f'{error}. Again:', flush=True)
                continue
            print(f'  true {angle:.1f} deg, measured {measured:.2f} deg', flush=True)
        return self.procedure.result()

    def turned_at_rest(self) -> float:
        """The turned angle, deg, once the chair stands."""
        said = False
        while True:
            with self.lock:
                moving = self.reader.motion(rospy.get_time())
                age = rospy.get_time() - self.reader.seen['IMPACT_GYRO']
                doubtful, turned = self.reader.yaw_doubtful, math.degrees(self.reader.turned)
            if doubtful:
                raise GivenUp(
                    'rates (IMPACT_GYRO) were missing for so long that the turned angle is not known: begin again'
                )
            if age > self.reader.config.max_gap:
                moving = 'no rates (IMPACT_GYRO) come'
            if not moving:
                return turned
            if not said:
                print(f'  waiting until the chair stands ({moving})', flush=True)
                said = True
            self.pause(0.1)

    @staticmethod
    def ask(prompt: str) -> None:
        """A line from the user, or GivenUp at the end of the input."""
        print(f'{prompt}: ', end='', flush=True)
        if not sys.stdin.readline():
            raise GivenUp('no more input')
        if rospy.is_shutdown():
            raise GivenUp('ROS was shut down')


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog='calibrate_gain',
        description='Find the gain k of the gyroscope from turns of known angle, '
        'and write it into the calibration file of read.py.',
    )
    parser.add_argument(
        '--angles', nargs='+', type=float, default=list(ANGLES), metavar='DEG', help='each from zero (90 180 270 360)'
    )
    parser.add_argument(
        '--directions',
        choices=SIGNS,
        default='both',
        help="both ways cancel what is left of the offset's error (default)",
    )
    parser.add_argument(
        '--max-residual', type=float, default=5.0, metavar='DEG', help='a turn further off the line is an error (5)'
    )
    common_arguments(parser, '', 'gain')
    options = parser.parse_args(arguments)
    if any(angle < 0.0 for angle in options.angles):
        parser.error(f'--angles are {options.angles}, allowed are positive numbers: --directions says which way')
    return options


def main() -> None:
    """Run the command; exit status 0 with a gain, 1 without, 2 for a wrong command line."""
    options = parse(rospy.myargv()[1:])
    rospy.init_node('calibrate_gain', anonymous=True, disable_signals=True)
    path = calibration_store.resolve_for(options.node, options.file)
    try:
        result = GainTool(options).run()
        print('\n'.join(result.table()), flush=True)
        if not options.dry_run:
            calibration_store.update(
                path, gain=result.gain, gain_error=result.error, gain_measured=calibration_store.now_in_words()
            )
            print(f'k is saved in {path}; {reload(options.node, "gain")}', flush=True)
    except (GivenUp, GainError, ConfigError, BusError, CalibrationFileError) as error:
        raise SystemExit(f'calibrate_gain: {error}') from None
    except KeyboardInterrupt:
        raise SystemExit('\ncalibrate_gain: interrupted, nothing is saved') from None
