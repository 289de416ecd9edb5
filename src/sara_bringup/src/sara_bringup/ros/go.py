"""`go PLACE`, `go X Y YAW_DEG`: drive to a named place or a pose in the map. Exit status: 0 reached, 1 not reached, 2
wrong or not there, 130 interrupted.
"""

import argparse

import rospy

from sara_bringup.ros import goals
from sara_nav.maps import places


def parse(argv: list[str] | None) -> argparse.Namespace:
    """The arguments; ends with a usage line and status 2 where they make no sense together."""
    parser = argparse.ArgumentParser(prog='go', description=__doc__)
    parser.add_argument(
        'target', nargs='*', metavar='PLACE | X Y YAW_DEG', help='a name of --list, or a pose in the map: m, m, deg'
    )
    parser.add_argument('--list', action='store_true', help='the named places, and end')
    parser.add_argument('--here', metavar='NAME', help='write where the chair is as a place, and end')
    goals.add_file_options(parser)
    parser.add_argument(
        '--timeout',
        type=float,
        default=0.0,
        metavar='S',
        help='cancel the goal after so long; 0: move_base alone decides when it is hopeless',
    )
    parser.add_argument(
        '--wait', type=float, default=60.0, metavar='S', help='how long to wait for move_base and the pose'
    )
    parser.add_argument('--quiet', action='store_true', help='say the beginning and the end alone')
    arguments = parser.parse_args(argv)
    if sum((bool(arguments.target), arguments.list, arguments.here is not None)) != 1:
        parser.error('one of PLACE, X Y YAW_DEG, --list and --here NAME is needed')
    if arguments.target and len(arguments.target) not in (1, 3):
        parser.error(f'{len(arguments.target)} words are neither a place nor X Y YAW_DEG')
    if not arguments.timeout >= 0.0 or not arguments.wait >= 0.0:
        parser.error('--timeout and --wait are 0 or more')
    return arguments


def go(arguments: argparse.Namespace) -> int:
    """Do it; the exit status."""
    if arguments.list:
        path = goals.places_file(arguments)
        print(f'{path}:\n{places.listing(places.load(path)) or "no places yet"}')
        return goals.REACHED
    if arguments.here is not None:
        goals.begin('go')
        _, *pose = goals.Robot().wait(arguments.wait, fresh=True)
        place, path = places.Place(arguments.here, *pose), goals.places_file(arguments)
        goals.say(f'{"moved" if places.write(path, place) else "added"}: {place}, in {path}')
        return goals.REACHED
    if len(arguments.target) == 3:
        place = places.pose(*arguments.target)
    else:
        path = goals.places_file(arguments)
        place = places.find(places.load(path), arguments.target[0], path)
    goals.begin('go')
    reached, _ = goals.Driver(arguments.wait).go(place, arguments.timeout, arguments.quiet)
    return goals.REACHED if reached else goals.MISSED


def main() -> None:
    """The command."""
    import sys

    arguments = parse(rospy.myargv(sys.argv)[1:])
    goals.run(lambda: go(arguments))
