"""`rosrun sara_sim fault`: make something go wrong with the simulated chair, or right again."""

from __future__ import annotations

import argparse
import sys

import yaml

from sara_sim.faults.faults import FaultError, build, describe

ASSIGN = ':='
WAIT_S = 5.0


def parse(arguments: list[str]) -> dict:
    """{name: value} from words `name:=value`, values in YAML. Raises FaultError."""
    values = {}
    for word in arguments:
        name, assign, text = word.partition(ASSIGN)
        if not assign or not name:
            raise FaultError(f'{word!r} is no argument: write name:=value.')
        try:
            values[name] = yaml.safe_load(text)
        except yaml.YAMLError as error:
            raise FaultError(f'{name}: {text!r} is no YAML value: {error}.') from error
    return values


def main() -> None:
    """Exit status 0 when the simulator did as told."""
    parser = argparse.ArgumentParser(
        prog='fault',
        description=__doc__,
        epilog='Example: rosrun sara_sim fault frames_dropped probability:=0.1 ids:=[0x204] duration:=2.0',
    )
    parser.add_argument('name', nargs='?', help='which fault')
    parser.add_argument('arguments', nargs='*', metavar='name:=value', help='its arguments')
    parser.add_argument('--list', action='store_true', help='show all faults with their arguments')
    parser.add_argument('--clear', action='store_true', help='end all faults')
    parser.add_argument('--node', default='/simulator', help="the simulator's name (/simulator)")
    options = parser.parse_args()
    if options.list:
        print(describe())
        return
    if bool(options.name) == options.clear:
        parser.error('give the name of a fault, --clear or --list')
    try:
        success, message = _call(options)
    except FaultError as error:
        success, message = False, str(error)
    print(message, file=sys.stdout if success else sys.stderr)
    sys.exit(0 if success else 1)


def _call(options) -> tuple[bool, str]:
    if not options.clear:
        values = parse(options.arguments)
        build(options.name, values)  # what is wrong with the arguments is said without a simulator too
    import rospy
    from std_srvs.srv import Trigger

    from sara_sim.srv import Fault

    service = f'{options.node}/{"clear_faults" if options.clear else "fault"}'
    try:
        rospy.wait_for_service(service, WAIT_S)
        if options.clear:
            answer = rospy.ServiceProxy(service, Trigger)()
        else:
            answer = rospy.ServiceProxy(service, Fault)(options.name, yaml.safe_dump(values, default_flow_style=True))
    except (rospy.ROSException, rospy.ServiceException) as error:
        return False, f'{service}: {error}'
    return answer.success, answer.message
