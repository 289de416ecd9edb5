"""What several nodes of one file get wrong together: two filters and navsat_transform_node, as for outdoors.

One filter (world_frame: odom) gives odom -> base_link, which never jumps; the other (world_frame: map), which takes
odometry/gps, map -> odom (REP-105). What users of such set-ups get wrong is told in one sentence each, with its remedy.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping

from sara_common.config import ConfigError
from sara_common.diagnostics import OK
from sara_localization.checks import check_config
from sara_localization.checks.findings import Finding, error, warning
from sara_localization.checks.gps_inputs import is_gps
from sara_localization.checks.navsat_settings import check_navsat, is_for_navsat
from sara_localization.config.filter_config import FilterConfig
from sara_localization.config.input_config import INPUT
from sara_localization.filters.state import YAW
from sara_localization.gps.navsat_config import NavSatConfig

Filters = Mapping[str, FilterConfig]
HEADING = 'gps/heading'
_FUSED = ('odometry/filtered', 'odometry/filtered_map', 'odometry/local', 'odometry/global')
"""How filters' own outputs are usually called."""


def is_set(params: Mapping[str, object]) -> bool:
    """Whether a file holds the parameters of several nodes, each under its name."""
    return len(params) > 1 and all(isinstance(value, dict) for value in params.values())


def check_set(sections: Mapping[str, dict]) -> list[Finding]:
    """Everything found in the parameters of several nodes; {node: its parameters}. Other nodes are passed over."""
    filters, navsats, found = {}, {}, []
    for name, params in sections.items():
        if is_for_navsat(params):
            own, navsats[name] = check_navsat(params), params
        elif any(INPUT.match(parameter) for parameter in params):
            config, own = check_config.check(params)
            if config is not None:
                filters[name] = config
        else:
            continue
        found += [finding._replace(sentence=f'{name}: {finding.sentence}') for finding in own]
    return found + list(_frames(filters)) + list(_transforms(filters)) + list(_gps(filters, navsats))


def _frames(filters: Filters) -> Iterator[Finding]:
    """Filters that do not speak of the same frames, or not of the same robot."""
    for (a, one), (b, other) in itertools.combinations(filters.items(), 2):
        for frame in ('map_frame', 'odom_frame', 'base_link_frame'):
            names = getattr(one, frame), getattr(other, frame)
            if len(set(names)) > 1:
                yield error(frame, f'{frame} is {names[0]} in {a} and {names[1]} in {b}: the two do not join in tf.')
        if one.two_d_mode != other.two_d_mode:
            flat = a if one.two_d_mode else b
            yield warning(
                'two_d_mode',
                f'two_d_mode is true in {flat} alone: map -> odom then tilts. Set it in {a} and {b}.',
            )


def _transforms(filters: Filters) -> Iterator[Finding]:
    """Transforms that two publish, or nobody."""
    for (a, one), (b, other) in itertools.combinations(filters.items(), 2):
        if one.publish_tf and other.publish_tf and one.world_frame == other.world_frame:
            where = _published(one)
            yield error(
                'world_frame',
                f'{a} and {b} both have world_frame: {one.world_frame} and publish {where}: it jumps between the two. '
                'The filter without GPS has world_frame: odom, that with it world_frame: map.',
            )
    if len(filters) < 2:
        return
    for inside, what in ((True, 'map -> odom'), (False, 'odom -> base_link')):
        of = [name for name, config in filters.items() if config.publishes_map_to_odom == inside]
        if of and not any(filters[name].publish_tf for name in of):
            yield warning('publish_tf', f'{of[0]} has publish_tf: false: does another node publish {what}?')
        elif not of:
            wanted = 'map' if inside else 'odom'
            yield error('world_frame', f'no filter has world_frame: {wanted}: nobody publishes {what}.')


def _published(config):
    if config.publishes_map_to_odom:
        return f'{config.map_frame} -> {config.odom_frame}'
    return f'{config.world_frame} -> {config.base_link_frame_output}'


def _gps(filters: Filters, navsats: Mapping[str, dict]) -> Iterator[Finding]:
    """Who takes odometry/gps, and who takes what holds it already."""
    takers = {name: [i for i in config.inputs if is_gps(i)] for name, config in filters.items()}
    if navsats and filters and not any(takers.values()):
        yield error('odometry/gps', 'no filter takes odometry/gps: the one with world_frame: map needs it as an odomN.')
    for name, config in filters.items():
        if takers[name] and not config.publishes_map_to_odom and len(filters) > 1:
            yield error(
                'odometry/gps',
                f'{name} takes odometry/gps and has world_frame: {config.world_frame}: {_published(config)} jumps with '
                'each fix, and planners with it. Only the filter with world_frame: map takes odometry/gps.',
            )
        for i in config.inputs:
            if i.kind == 'odom' and i.topic.strip('/').endswith(_FUSED):
                yield warning(
                    i.name + '_configuration',
                    f'{i.name} of {name} is {i.topic}, the output of a filter: what both are told by the same sensors '
                    'counts twice. Give both filters the sensors themselves.',
                )
    for name, params in navsats.items():
        yield from _velocity_heading(name, params, filters)
        yield from _yaw(name, params, filters, takers)


def _is_heading(i):
    """Whether an input is navsat_transform_node's gps/heading, which counts from the world frame, not from north."""
    return i.kind == 'imu' and i.topic.strip('/').endswith(HEADING)


def _velocity_heading(name, params, filters):
    """gps/heading that nobody takes, or that nobody gives."""
    takers = [f'{i.name} of {taker}' for taker, config in filters.items() for i in config.inputs if _is_heading(i)]
    given = params.get('velocity_heading') is True
    if given and filters and not takers:
        yield warning(
            'velocity_heading',
            f'{name} gives {HEADING} (velocity_heading), and no filter takes it: the one with world_frame: map needs '
            'it as an imuN, for its yaw.',
        )
    if takers and not given:
        yield error(
            'velocity_heading', f'{takers[0]} is {HEADING}, which {name} gives with velocity_heading: true alone.'
        )


def _yaw(name, params, filters, takers):
    """Where navsat_transform_node has north from."""
    try:
        config = NavSatConfig.from_params(params)
    except ConfigError:
        return
    measured = any(
        i.mask[YAW] and not i.differential and not i.relative and not _is_heading(i)
        for taker, inputs in takers.items()
        if inputs
        for i in filters[taker].inputs
    )
    if config.use_odometry_yaw and not measured:
        yield error(
            'use_odometry_yaw',
            f'{name} takes the yaw of the odometry (use_odometry_yaw), which no input measures against north: yaw of '
            'an IMU with a compass (neither differential nor relative), or wait_for_datum, is needed.',
        )
    if config.magnetic_declination_radians == 0.0 and not config.wait_for_datum:
        yield Finding(
            OK,
            'magnetic_declination_radians',
            f'{name} has magnetic_declination_radians: 0: right for an IMU that says true north. Without the line the '
            'declination comes from the world magnetic model.',
        )
