"""`rosrun sara_lab compass_bag DRIVE.bag`: the heading of a recorded magnetometer against the track of the GPS.

The drive itself calibrates the magnetometer, so it must have turned all round. Heading and wheels give a way, the fixes
another; what is printed is how far the one is turned from the other, in windows of 10 s, and in which interval. The
declination of the place is taken off: what is left is the heading's error (mounting and soft iron included).
"""

from __future__ import annotations

import argparse
import datetime
import json
import math

import numpy as np
import rosbag

from canserial.calibration.iron import IronError
from canserial.reader.tilt import Tilt
from sara_common.earth_field import FIRST, LAST, earth_field
from sara_lab.studies.compass_track import Agreement, agreement
from sara_localization.gps.tangent_plane import TangentPlane

AXES = {'flu': (1.0, 1.0, 1.0), 'frd': (1.0, -1.0, -1.0)}
"""Signs of a magnetometer whose axes point forward, left, up, or forward, right, down."""
SHARE = 0.95


def main() -> None:
    """Exit status 1 with a sentence where the bag does not do."""
    options = _arguments()
    try:
        fields, speeds, fixes = _read(options)
        found = agreement(fields, speeds, _east_north(fixes) - (options.delay, 0.0, 0.0))
        date, declination = _declination(fixes)
    except (IronError, ValueError, OSError, rosbag.ROSBagException) as error:
        raise SystemExit(f'compass_bag: {error}') from None
    if options.json:
        print(json.dumps(_figures(found, declination)))
        return
    for line in _report(found, date, declination, len(fixes)):
        print(line)


def _arguments():
    parser = argparse.ArgumentParser(prog='compass_bag', description=__doc__)
    parser.add_argument('bag')
    parser.add_argument('--mag', default='/imu/mag', help='MagneticField or Vector3Stamped (%(default)s)')
    parser.add_argument(
        '--imu', default='/imu/data', help='Imu, z up, whose rates and accelerations level it (%(default)s)'
    )
    parser.add_argument('--odom', default='/encoder', help='Odometry with the forward speed (%(default)s)')
    parser.add_argument('--fix', default='/fix', help='NavSatFix (%(default)s)')
    parser.add_argument(
        '--axes',
        choices=AXES,
        default='flu',
        help="the magnetometer's axes: forward, left, up; or forward, right, down",
    )
    parser.add_argument(
        '--delay', type=float, default=0.0, metavar='S', help="of the receiver's positions, where it is known (0)"
    )
    parser.add_argument('--json', action='store_true', help='one line of figures, deg and m')
    return parser.parse_args()


def _read(options):
    """(n, 3) fields, (n, 2) speeds, (n, 4) fixes (s, deg, deg, m), by the stamps of their headers."""
    rows, tilt = {options.mag: [], options.odom: [], options.fix: []}, Tilt()
    with rosbag.Bag(options.bag) as bag:
        for topic, message, _ in bag.read_messages(topics=[*rows, options.imu]):
            stamp = message.header.stamp.to_sec()
            if topic == options.imu:
                rates, force = message.angular_velocity, message.linear_acceleration
                tilt.add(stamp, (rates.x, rates.y, rates.z), (force.x, force.y, force.z))
            elif topic == options.mag:
                field = getattr(message, 'magnetic_field', None) or message.vector
                own = (sign * value for sign, value in zip(AXES[options.axes], (field.x, field.y, field.z)))
                rows[topic].append((stamp, *tilt.levelled(tuple(own))[:2]))
            elif topic == options.odom:
                rows[topic].append((stamp, message.twist.twist.linear.x))
            elif message.status.status >= 0:
                rows[topic].append((stamp, message.latitude, message.longitude, message.altitude))
    for topic, found in rows.items():
        if len(found) < 2:
            raise ValueError(f'{options.bag} holds {len(found)} messages on {topic}')
    return (np.array(sorted(rows[topic])) for topic in (options.mag, options.odom, options.fix))


def _east_north(fixes):
    """(n, 3) s, m, on the plane that touches the earth at the first fix."""
    plane = TangentPlane(*fixes[0, 1:3])
    return np.array([(stamp, *plane.forward(*place)) for stamp, *place in fixes])


def _declination(fixes):
    """(date of the model, rad) of the first fix."""
    date = datetime.datetime.fromtimestamp(fixes[0, 0], datetime.UTC).date()
    date = min(max(date, FIRST), LAST)
    return date, earth_field(*fixes[0, 1:], date).declination


def _figures(found: Agreement, declination: float) -> dict[str, float]:
    """deg, m. A needle that points east of true north makes the track lie clockwise of the heading."""
    low, high = (math.degrees(bound + declination) for bound in found.interval(SHARE))
    return {
        'turned_deg': math.degrees(math.remainder(found.whole + declination, math.tau)),
        'low_deg': low,
        'high_deg': high,
        'windows': len(found.windows),
        'residual_m': found.residual,
        'ratio': found.ratio,
        'deg_for_0.1_s': 0.1 * math.degrees(found.rate),
    }


def _report(found, date, declination, fixes):
    figures = _figures(found, declination)
    late = figures['deg_for_0.1_s']
    return [
        'calibrated by the drive: the ellipse is {ratio:.2f} times as long as wide'.format(**figures),
        f'declination {math.degrees(declination):+.1f} deg (World Magnetic Model, {date})',
        'the track of the GPS is turned by {turned_deg:+.1f} deg from the heading; {share:.0f} % of {windows} windows '
        'of 10 s from {low_deg:+.1f} to {high_deg:+.1f}'.format(share=100 * SHARE, **figures),
        f'a receiver that is 0.1 s later than --delay says turns it by {-late:+.1f} deg: the robot turned all the time',
        f'{fixes} fixes lie {found.residual:.2f} m r.m.s. off the way by compass and wheels',
    ]
