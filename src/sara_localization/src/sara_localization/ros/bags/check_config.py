"""What is wrong with the parameters of a filter, amcl, range_localization or navsat_transform_node, without running it;
with a bag, also with a filter's data, or with the heading that navsat_transform_node takes. A file that holds two
filters and navsat_transform_node, each under its name, is also looked at as a whole.

    rosrun sara_localization check_config FILE.yaml [BAG] [--static-tf "X Y Z YAW PITCH ROLL PARENT CHILD"]...
        [--fix TOPIC] [--imu TOPIC]

One line for each finding, errors first. The status is 1 where something is an error, 2 where the arguments are of no
use, else 0.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from typing import TextIO

import rosbag
import rospy
from tqdm import tqdm

from sara_common.diagnostics import ERROR, OK, WARN
from sara_common.ros import bags
from sara_localization.checks import check_config
from sara_localization.checks.amcl_settings import check_amcl, is_for_amcl
from sara_localization.checks.findings import Finding, sorted_findings
from sara_localization.checks.gps_heading import heading_findings
from sara_localization.checks.navsat_settings import check_navsat, is_for_navsat
from sara_localization.checks.node_set import check_set, is_set
from sara_localization.checks.range_settings import check_ranges, is_for_ranges
from sara_localization.checks.survey import Survey
from sara_localization.config.filter_config import FilterConfig
from sara_localization.geometry.rigid import IDENTITY
from sara_localization.geometry.transforms import TransformBuffer
from sara_localization.ros.bags import bag_tools, gps_options, gps_survey
from sara_localization.ros.bags.bag_tools import TF_TOPICS, UsageError
from sara_localization.ros.inputs import resolved

NODES = (('range_localization', is_for_ranges, check_ranges), ('amcl', is_for_amcl, check_amcl))
"""Nodes besides the filters: name, whether parameters are its own, the check; the first that fits counts."""
WORDS = {ERROR: 'error', WARN: 'warning', OK: 'note'}


def survey_bag(path: str, config: FilterConfig, static: Sequence = ()) -> tuple[list[Finding], Survey]:
    """(findings, Survey) of a bag under a configuration; static: [(parent, child, Transform)] that the bag lacks."""
    buffer = TransformBuffer()
    for parent, child, transform in static:
        buffer.set_transform(parent, child, transform)
    survey = Survey(config, buffer)
    with rosbag.Bag(path) as bag:
        published = bag_tools.topic_types(bag)
        wrong = dict(bag_tools.wrong_topics(config, published))
        if '/tf_static' in dict(published):
            names = [name for name in bag.get_type_and_topic_info().topics if resolved(name) == '/tf_static']
            for topic, msg, _ in bags.messages(bag, names):
                bag_tools.enter_transforms(buffer, resolved(topic), msg)
        _own_transform(buffer, config)
        base_moves = _survey_messages(bag, survey, buffer, wrong)
    found = [Finding(ERROR, name + '_data', sentence) for name, sentence in wrong.items()]
    if base_moves:
        found.append(
            Finding(
                WARN,
                'publish_tf',
                f'the bag holds {config.world_frame} -> {config.base_link_frame_output}, which this filter would '
                'publish too: two publishers of one transform make it jump. Set publish_tf: false here, or stop the '
                'other (diff_drive_controller: enable_odom_tf: false).',
            )
        )
    told = {name + '_data' for name in wrong}
    return found + [finding for finding in survey.findings() if finding.key not in told], survey


def _survey_messages(bag, survey, buffer, wrong) -> bool:
    """Give a bag's messages to the survey, but not those of the inputs in `wrong`, and its transforms to the buffer.

    Returns whether one of them is the transform that the filter publishes itself.
    """
    config, base_moves = survey.config, False
    inputs = {topic: [i for i in used if i.name not in wrong] for topic, used in bag_tools.by_topic(config).items()}
    names = [
        name
        for name in bag.get_type_and_topic_info().topics
        if inputs.get(resolved(name)) or resolved(name) in TF_TOPICS
    ]
    if not names:
        return False
    total = bag.get_message_count(names)
    with tqdm(total=total, unit='msg', file=sys.stderr, mininterval=0.2, leave=False) as bar:
        for name, msg, received in bags.messages(bag, names):
            topic = resolved(name)
            if topic in TF_TOPICS:
                bag_tools.enter_transforms(buffer, topic, msg)
                base_moves = base_moves or any(_leads_to(config, t) for t in msg.transforms)
            for i in inputs.get(topic, ()):
                survey.add(i.name, bag_tools.converted(i, topic, msg), received.to_sec())
            bar.update()
    return base_moves


def _leads_to(config, t):
    """Whether a transform is the one that the filter publishes itself."""
    return (
        config.publish_tf
        and not config.publishes_map_to_odom
        and t.header.frame_id.lstrip('/') == config.world_frame
        and t.child_frame_id.lstrip('/') == config.base_link_frame_output
    )


def _own_transform(buffer, config):
    """map -> odom will be the filter's own: that the bag lacks it is no fault."""
    if config.publishes_map_to_odom and buffer.lookup(config.map_frame, config.odom_frame, None) is None:
        buffer.set_transform(config.map_frame, config.odom_frame, IDENTITY)


def report(findings: Sequence[Finding], file: TextIO = sys.stdout) -> int:
    """Print the findings; returns the status of the process."""
    for finding in sorted_findings(findings):
        print(f'{WORDS[finding.level]}: {finding.sentence}', file=file)
    if not any(finding.level for finding in findings):
        print('nothing to mend was found', file=file)
    return 1 if any(finding.level == ERROR for finding in findings) else 0


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        prog='check_config',
        description='What is wrong with the parameters of ekf_localization_node, ukf_localization_node, amcl, '
        'range_localization or navsat_transform_node, without running it; with a bag, which sensor misleads a filter.',
    )
    parser.add_argument('params', metavar='FILE.yaml')
    parser.add_argument('bag', metavar='BAG', nargs='?')
    gps_options.add_topics(parser)
    bag_tools.add_static_option(parser)
    arguments = parser.parse_args(rospy.myargv(sys.argv)[1:] if argv is None else argv)
    try:
        params = bag_tools.load_params(arguments.params)
        static = [bag_tools.static_transform(text) for text in arguments.static_tf]
        if is_set(params):
            if arguments.bag:
                raise UsageError('a bag is compared with the parameters of one node, this file holds several')
            sys.exit(report(check_set(params)))
        if is_for_navsat(params):
            sys.exit(report(check_navsat(params) + _against_gps(arguments, static)))
        for node, its_own, check in NODES:
            if its_own(params):
                if arguments.bag:
                    raise UsageError(f'a bag is compared with the parameters of a filter, not with those of {node}')
                sys.exit(report(check(params)))
        config, findings = check_config.check(params)
        if arguments.bag and config is not None:
            found, survey = survey_bag(arguments.bag, config, static)
            findings = [finding for finding in findings if finding.key not in survey.replaces] + found
            _print_comparison(survey.comparison())
    except (UsageError, OSError, rosbag.ROSBagException) as error:
        print(f'check_config: {error}', file=sys.stderr)
        sys.exit(2)
    sys.exit(report(findings))


def _against_gps(arguments, static):
    """What a bag says of the heading that navsat_transform_node takes."""
    if not arguments.bag:
        return []
    arguments.navsat = arguments.params
    gps = gps_options.inputs(arguments, quiet=True)
    drive = gps_survey.survey(arguments.bag, gps, static)
    if len(drive.courses):
        low, high = map(math.degrees, drive.quartiles)
        print(
            f'the way by the GPS less the heading: median {math.degrees(drive.median):.1f} deg, half within '
            f'{low:.1f} to {high:.1f} deg, {len(drive.courses)} straight stretches'
        )
    return heading_findings(drive, gps.config.yaw_offset)


def _print_comparison(comparison):
    if comparison is None:
        return
    print(f'turning in windows of 10 s ({comparison.windows} of them), median of the difference and scale:')
    for (a, b), value in comparison.median.items():
        print(f'  {a:24} {b:24} {math.degrees(value):6.2f} deg   x {comparison.scale[a, b]:.3f}')
