"""plan_path: a plan on a map from the command line, without ROS running.

    rosrun sara_nav plan_path MAP.yaml --start X Y YAW --goal X Y YAW [--planner NAME] [--footprint "[[x,y],...]"]
                                       [--json] [--png FILE] [--param NAME=VALUE ...]

The costmap is the one move_base's defaults give: the map's obstacles, inflated by 0.55 m (at least by the inscribed
radius of the footprint) with cost_scaling_factor 10; the footprint is not padded. --param sets a parameter of the
inflation layer or of the planner (inflation_radius=0.7, allow_unknown=false, use_astar=true). Metres, radians. Exit
status 0 with a plan, 1 when there is none, 2 when the question makes no sense.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import yaml

from sara_common.config import ConfigError
from sara_common.planar import Pose2D
from sara_common.platforms import chosen
from sara_nav.config.parameters import Parameters
from sara_nav.config.registry import UnknownPlanner
from sara_nav.costmaps.costmap import Costmap, InflationConfig, build
from sara_nav.grids.footprint import FootprintError, parse_footprint, radii
from sara_nav.maps.map_io import MapError, load_map
from sara_nav.planners.plan_picture import draw_plan
from sara_nav.planners.planning import GLOBAL_PLANNERS, PlanError, path_length

PLANNED, NO_PLAN, BAD_QUESTION = 0, 1, 2


class Question(argparse.Namespace):
    """What is asked: map, start, goal (Pose2D), planner (name), footprint (text or None), json, png (file or None),
    param (list of NAME=VALUE)."""


def parse(arguments: Sequence[str]) -> Question:
    """Return the Question of command-line arguments; exits as argparse does when they make none."""
    parser = argparse.ArgumentParser(prog='plan_path', description='Plan a way on a map, without ROS running.')
    parser.add_argument('map', metavar='MAP.yaml')
    for name in ('start', 'goal'):
        parser.add_argument(
            '--' + name,
            nargs=3,
            type=float,
            required=True,
            metavar=('X', 'Y', 'YAW'),
            help='metres and radians, in the map',
        )
    parser.add_argument(
        '--planner',
        default='navfn/NavfnROS',
        metavar='NAME',
        help='{} (default: %(default)s)'.format(', '.join(GLOBAL_PLANNERS.names())),
    )
    parser.add_argument(
        '--footprint', metavar='"[[x,y],...]"', help="corners about base_link, m (the chosen platform's)"
    )
    parser.add_argument('--json', action='store_true', help='print {"success", "length_m", "planning_ms", "path"}')
    parser.add_argument('--png', metavar='FILE', help='draw the map and the plan')
    parser.add_argument(
        '--param',
        action='append',
        default=[],
        metavar='NAME=VALUE',
        help='of the planner or the inflation layer; may be given again',
    )
    question = parser.parse_args([_spaced(a) for a in arguments], Question())
    question.start, question.goal = Pose2D(*question.start), Pose2D(*question.goal)
    return question


def _spaced(argument):
    """Return a negative number with a space before it, so that argparse takes no -1e-3 for an option."""
    try:
        return ' ' + argument if argument.startswith('-') and float(argument) is not None else argument
    except ValueError:
        return argument


def answer(
    question: Question, clock: Callable[[], float] = time.perf_counter
) -> tuple[np.ndarray | None, float, str, Costmap, np.ndarray]:
    """Return (plan (n, 3) or None, seconds it took, what to say, Costmap, footprint (k, 2)).

    Raises MapError, FootprintError, ConfigError or UnknownPlanner for a question that makes no sense.
    """
    cls = GLOBAL_PLANNERS.find(question.planner)
    parameters = Parameters(dict(_parameter(text) for text in question.param))
    planner_config, inflation = parameters.config(cls.config_class, ''), parameters.config(InflationConfig, '')
    given = parameters.has('inflation_radius')
    parameters.faults += parameters.left_over()
    parameters.check()
    for warning in getattr(planner_config, 'warnings', list)():
        print(f'plan_path: {warning}', file=sys.stderr)
    planner = cls(planner_config)
    footprint = parse_footprint(
        list(map(list, chosen().footprint)) if question.footprint is None else question.footprint
    )
    inscribed = radii(footprint)[0]
    if not given:
        inflation = replace(inflation, inflation_radius=max(inflation.inflation_radius, inscribed))
    elif inflation.inflation_radius < inscribed:
        raise ConfigError(
            f'inflation_radius is {inflation.inflation_radius:g} m, allowed is at least the inscribed radius of the '
            f'footprint, {inscribed:g} m: '
            'plans would touch obstacles'
        )
    grid_map = load_map(question.map)
    if grid_map.origin_yaw:
        raise MapError(
            f'map file {question.map}: its origin is turned by {grid_map.origin_yaw:g} rad but must not be turned'
        )
    costmap = build(grid_map, inscribed, inflation=inflation)
    if hasattr(planner, 'set_footprint'):
        planner.set_footprint(footprint)
    begin = clock()
    try:
        plan, text = planner.plan(costmap, question.start, question.goal), ''
    except PlanError as error:
        plan, text = None, str(error)
    return plan, clock() - begin, text, costmap, footprint


def _parameter(text):
    name, equals, value = text.partition('=')
    try:
        return name, yaml.safe_load(value if equals else '')
    except yaml.YAMLError:
        raise ConfigError(f'--param {text} cannot be read: it must be NAME=VALUE') from None


def as_json(plan: np.ndarray | None, seconds: float) -> str:
    """Return the JSON text of a plan, or of there being none."""
    return json.dumps(
        {
            'success': plan is not None,
            'length_m': 0.0 if plan is None else path_length(plan),
            'planning_ms': 1e3 * seconds,
            'path': [] if plan is None else plan.tolist(),
        }
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer the command line; returns by exiting with its status."""
    question = parse(sys.argv[1:] if arguments is None else arguments)
    try:
        plan, seconds, text, costmap, footprint = answer(question)
        if question.png:
            draw_plan(question.png, costmap, plan, question.start, question.goal, footprint)
    except (MapError, FootprintError, ConfigError, UnknownPlanner, OSError, ValueError) as error:
        if question.json:
            print(as_json(None, 0.0))
        print(f'plan_path: {error}', file=sys.stderr)
        sys.exit(BAD_QUESTION)
    if question.json:
        print(as_json(plan, seconds))
    elif plan is not None:
        print(f'{path_length(plan):.2f} m in {len(plan)} points, planned in {1e3 * seconds:.1f} ms')
    if text:
        print(f'plan_path: {text}', file=sys.stderr)
    sys.exit(NO_PLAN if plan is None else PLANNED)
