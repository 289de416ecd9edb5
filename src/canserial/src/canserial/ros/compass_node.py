"""calibrate_compass: two turns on the spot, one to each side, to the chair's iron; at a terminal beside the chair.

It reads canrx itself; the chair is turned by its joystick, and nothing here moves it.
"""

from __future__ import annotations

import argparse
import datetime
import math
from collections.abc import Sequence
from typing import NamedTuple

import rospy

from canserial.calibration import calibration_file
from canserial.calibration.calibration_file import Calibration, CalibrationFileError
from canserial.calibration.iron import IronError
from canserial.calibration.turns import Turned, Turns
from canserial.dbc.bus import BusError
from canserial.reader.readings import FieldReading, ImuReading
from canserial.ros import calibration_store
from canserial.ros.bus_tool import BusTool, GivenUp, common_arguments, reload
from sara_common.config import ConfigError
from sara_common.earth_field import EarthField, earth_field

MICROTESLA = 1e6
SILENT = 5.0
"""s of wall time without a field, after which the procedure is given up."""


class CompassTool(BusTool):
    """Says what to turn, listens, computes."""

    def __init__(self, options: argparse.Namespace, stored: Calibration | None) -> None:
        self.turns, self.rates, self.fields = Turns(), (0.0, 0.0, 0.0), 0
        known = None if stored is None else Calibration(gain=stored.gain)
        super().__init__(options, known, gain=None)
        if self.reader.compass is None:
            raise GivenUp(f'the bus {options.dbc} has no compass; +compass adds it')

    def on_readings(self, readings: Sequence[NamedTuple]) -> None:
        reader = self.reader
        for reading in readings:
            if isinstance(reading, ImuReading):
                self.rates = reading.angular_velocity
            elif isinstance(reading, FieldReading):
                self.fields += 1
                if reader.ready and reader.imu_stamp is not None:
                    self.turns.add(reading.field, reader.gain * reader.turned, self.rates, reader.compass.efforts)

    def run(self, earth: EarthField) -> Turned:
        """The whole procedure. Raises GivenUp, IronError."""
        self.measure_offset()
        print('Turn on the spot, slowly: once round to the left and once to the right.', flush=True)
        said, fields, silent = None, -1, 0.0
        while True:
            self.pause(0.1)
            with self.lock:
                missing, count = self.turns.missing, self.fields
            silent, fields = (silent + 0.1, fields) if count == fields else (0.0, count)
            if silent > SILENT:
                raise GivenUp(
                    'no magnetic fields (COMPASS) come: is there a chip, and does the sensor node know the bus?'
                )
            news = tuple(round(math.degrees(left) / 30.0) * 30 for left in missing)
            if news != said:
                said = news
                print(f'  still missing: {news[0]} deg to the left, {news[1]} deg to the right', flush=True)
            if not any(missing):
                break
        options = self.options
        facing = None if options.facing is None else math.radians(options.facing)
        with self.lock:
            return self.turns.result(
                MICROTESLA * earth.horizontal,
                MICROTESLA * earth.down,
                self.reader.gain,
                facing,
                math.radians(options.north),
            )


def table(turned: Turned) -> list[str]:
    """What was found, in lines."""
    iron = turned.iron
    return [
        'hard iron {:.1f}, {:.1f}, {:.1f} uT; the ellipse is {:.2f} times as long as wide'.format(
            *iron.offset, turned.ratio
        ),
        f'the fields lie {turned.residual:.2f} uT off the circle, r.m.s.; the earth has {iron.horizontal:.1f} uT '
        f'horizontally and {iron.down:.1f} down',
        f'compass and gyroscope are {math.degrees(turned.wander):.2f} deg apart, r.m.s.; by the compass the '
        f"gyroscope's gain is {iron.gain:.4f}",
        f'constant error of the heading: {iron.yaw_sigma:.1f} deg (one sigma)',
    ]


def parse(arguments: list[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog='calibrate_compass',
        description="Find the chair's iron from two turns on the spot, and write it into the calibration file of "
        'read.py. Do it outdoors, away from cars and steel.',
    )
    parser.add_argument(
        '--place', nargs=2, type=float, required=True, metavar=('LAT', 'LON'), help="deg; it gives the earth's field"
    )
    parser.add_argument(
        '--date', type=datetime.date.fromisoformat, default=None, metavar='YYYY-MM-DD', help='of the field (today)'
    )
    parser.add_argument(
        '--facing',
        type=float,
        metavar='DEG',
        help="the chair's yaw at the start, as exactly as you can tell: it takes away the constant error (the chip's "
        'mounting). Counter-clockwise; magnetic north is --north',
    )
    parser.add_argument(
        '--north', type=float, default=90.0, metavar='DEG', help='the yaw that faces magnetic north (90)'
    )
    common_arguments(parser, '+compass', 'compass')
    return parser.parse_args(arguments)


def main() -> None:
    """Run the command; exit status 0 with a calibration, 1 without, 2 for a wrong command line."""
    options = parse(rospy.myargv()[1:])
    rospy.init_node('calibrate_compass', anonymous=True, disable_signals=True)
    path = calibration_store.resolve_for(options.node, options.file)
    try:
        date = options.date or datetime.datetime.now(datetime.UTC).date()
        earth = earth_field(*options.place, 0.0, date)
        try:
            stored = calibration_file.load(path)
        except FileNotFoundError:
            stored = None
        turned = CompassTool(options, stored).run(earth)
        print('\n'.join(table(turned)), flush=True)
        if not options.dry_run:
            calibration_store.update(path, **turned.iron.fields(), compass_measured=calibration_store.now_in_words())
            print(f'saved in {path}; {reload(options.node, "compass")}', flush=True)
    except (GivenUp, IronError, ConfigError, BusError, CalibrationFileError, ValueError) as error:
        raise SystemExit(f'calibrate_compass: {error}') from None
    except KeyboardInterrupt:
        raise SystemExit('\ncalibrate_compass: interrupted, nothing is saved') from None
