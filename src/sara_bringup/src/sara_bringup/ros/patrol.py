"""`patrol PLACE PLACE ...`: drive to one place after the other. Exit status: 0 all reached, 1 not all, 2 wrong or not
there, 130 interrupted.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

import rospy

from sara_bringup.missions.patrol import Patrol
from sara_bringup.ros import goals
from sara_nav.maps import places

if TYPE_CHECKING:
    from sara_nav.maps.places import Place


def parse(argv: list[str] | None) -> argparse.Namespace:
    """The arguments."""
    parser = argparse.ArgumentParser(prog='patrol', description=__doc__)
    parser.add_argument(
        'stops',
        nargs='+',
        metavar='PLACE',
        help='names of `go --list`, or X,Y,YAW_DEG in one word (after -- where X is negative)',
    )
    parser.add_argument('--loops', type=int, default=1, metavar='N', help='how often; 0: until Ctrl-C (default 1)')
    parser.add_argument('--pause', type=float, default=0.0, metavar='S', help='wait so long at each place (default 0)')
    parser.add_argument(
        '--on-failure',
        choices=('go-on', 'stop'),
        default='go-on',
        help=(
            'what happens when a place is not reached: drive to the next one (default), or end. A whole round in '
            'vain ends it anyhow'
        ),
    )
    goals.add_file_options(parser)
    parser.add_argument(
        '--timeout',
        type=float,
        default=0.0,
        metavar='S',
        help='for one place; 0: move_base alone decides when it is hopeless',
    )
    parser.add_argument(
        '--wait', type=float, default=60.0, metavar='S', help='how long to wait for move_base and the pose'
    )
    parser.add_argument('--quiet', action='store_true', help='no word on the way')
    arguments = parser.parse_args(argv)
    if arguments.loops < 0 or not arguments.pause >= 0.0 or not arguments.timeout >= 0.0 or not arguments.wait >= 0.0:
        parser.error('--loops, --pause, --timeout and --wait are 0 or more')
    return arguments


def stops(arguments: argparse.Namespace) -> list[Place]:
    """The Places named. All are looked up before the first is driven to. Raises PlacesError, Unavailable."""
    known, path, result = None, '', []
    for word in arguments.stops:
        if word.count(',') == 2:
            result.append(places.pose(*word.split(',')))
            continue
        if known is None:
            path = goals.places_file(arguments)
            known = places.load(path)
        result.append(places.find(known, word, path))
    return result


def patrol(arguments: argparse.Namespace) -> int:
    """Do it; the exit status."""
    tour = Patrol(stops(arguments), arguments.loops, arguments.on_failure == 'stop')
    goals.begin('patrol')
    driver = goals.Driver(arguments.wait)
    try:
        while not tour.done:
            if not tour.visit.first and arguments.pause:
                goals.say(f'pause of {arguments.pause:g} s')
                driver.pause(arguments.pause)
            if not driver.taken:
                goals.say(str(tour.visit))
                tour.ended(*driver.go(tour.visit.place, arguments.timeout, arguments.quiet))
            if driver.taken:
                goals.say('somebody took over: the patrol ends')
                break
    finally:
        goals.say(tour.summary())
    return goals.REACHED if tour.all_reached else goals.MISSED


def main() -> None:
    """The command."""
    import sys

    arguments = parse(rospy.myargv(sys.argv)[1:])
    goals.run(lambda: patrol(arguments))
