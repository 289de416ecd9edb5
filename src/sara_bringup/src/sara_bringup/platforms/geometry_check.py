"""What contradicts what in a robot's geometry: body, footprints, wheels, places of the sensors, URDF."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from xml.etree import ElementTree

import numpy as np

from sara_bringup.platforms.sensor_places import NOWHERE, fixed_places
from sara_common.config import finite_numbers
from sara_common.planar import Pose2D
from sara_common.platforms import Platform, parameters
from sara_control.wheels.urdf import UrdfError, WheelGeometry
from sara_nav.grids.footprint import FootprintError, contains_origin, parse_footprint, radii

OUTSIDE_M, SAME_M, SAME_RAD = 0.05, 1e-3, 2e-3
COSTMAPS = ('global_costmap', 'local_costmap')


def findings(platform: Platform) -> Iterator[str]:
    """A sentence for each contradiction."""
    yield from _footprints(platform)
    yield from _wheels(platform)
    yield from _sensors(platform)
    try:
        robot = ElementTree.fromstring(platform.urdf)
    except (OSError, ElementTree.ParseError) as error:
        yield f'robot.urdf cannot be read: {error}'
    else:
        yield from _frames(platform, robot)
        yield from _wheel_joints(platform)


def _footprints(platform):
    nav, (length, width) = platform.parameters('move_base'), platform.size
    for name in COSTMAPS:
        given = nav.get(name, {})
        where = f'move_base/{name}/footprint'
        try:
            corners = parse_footprint(given.get('footprint', []))
        except FootprintError as error:
            yield f'{where}: {error}'
            continue
        if not contains_origin(corners):
            yield f'{where} is {given["footprint"]}: base_link, its origin, lies outside of it'
        elif not np.allclose(np.abs(corners).max(axis=0), (0.5 * length, 0.5 * width), atol=SAME_M):
            yield (
                f'{where} reaches {np.abs(corners).max(axis=0).tolist()} m from base_link, half of platform/body is '
                f'{0.5 * length:g} x {0.5 * width:g} m: the gate and the planner know different bodies'
            )
        _, around = radii(corners)
        reach = given.get('inflation_layer', {}).get('inflation_radius', 0.0)
        if reach < around:
            yield (
                f'move_base/{name}/inflation_layer/inflation_radius is {reach:g} m, less than the corners reach '
                f'({around:.3f} m): the planner does not see where the robot can turn in place'
            )


def _wheels(platform):
    wheels, body = platform.wheels, platform.body
    for name, value, most, why in (
        ('radius', wheels.radius, 0.5 * body.height, 'half the height of the body'),
        ('separation', wheels.separation, body.width + 2 * OUTSIDE_M, 'the width of the body and a bit'),
    ):
        if not 0.0 < value <= most:
            yield f'platform/wheels/{name} is {value:g} m, allowed are numbers above 0 to {most:g} ({why})'
    known = {
        'wheel_separation': wheels.separation,
        'wheel_radius': wheels.radius,
        'steps_per_turn': wheels.steps_per_turn,
    }
    for node, told in (
        ('diff_drive_controller', platform.parameters('diff_drive_controller')),
        ('safety_gate', platform.parameters('safety_gate').get('plausibility', {})),
    ):
        for name, value in known.items():
            if told.get(name) != value:
                yield f'{node} has {name} {told.get(name)!r}, platform/wheels says {value:g}'


def _sensors(platform):
    length, width = platform.size
    for name, mount in {**platform.sonars, 'imu': platform.imu, 'scan': platform.scan, 'gps': platform.gps}.items():
        beyond = max(abs(mount.x) - 0.5 * length, abs(mount.y) - 0.5 * width)
        if beyond > OUTSIDE_M:
            yield f'{name} sits at ({mount.x:g}, {mount.y:g}), {beyond:.2f} m outside of the body'
    gate = platform.parameters('safety_gate')
    told = gate.get('zones', {}).get('sensors', {})
    yield from same_names('safety_gate/zones/sensors', told, platform.sonars)
    for name in sorted(set(told) & set(platform.sonars)):
        mount = platform.sonars[name]
        if not _same(_mount_of(told[name]), mount):
            yield f'safety_gate has {name} at {told[name]}, platform/sonars at ({mount.x:g}, {mount.y:g})'
        elif told[name].get('stops', True) and _looks_inward(mount, length, width):
            yield (
                f'{name} at ({mount.x:g}, {mount.y:g}) looks across the body: its echoes would be the robot itself; '
                'turn it round, or say stops: false in safety_gate/zones/sensors'
            )
    if not _same(_mount_of(gate.get('scan', {})), platform.scan):
        x, y, _ = platform.scan
        yield f'safety_gate has the scanner at {gate.get("scan")}, platform/scan at ({x:g}, {y:g})'


def _looks_inward(mount, length, width):
    """Whether 0.1 m along the axis is still above the body."""
    x, y = mount.x + 0.1 * math.cos(mount.yaw), mount.y + 0.1 * math.sin(mount.yaw)
    return abs(x) < 0.5 * length and abs(y) < 0.5 * width


def _mount_of(place):
    try:
        return Pose2D(place['x'], place['y'], math.radians(place.get('yaw_deg', 0.0)))
    except (KeyError, TypeError):
        return Pose2D(math.nan, math.nan, math.nan)


def _same(a, b):
    return math.dist(a[:2], b[:2]) <= SAME_M and abs(math.remainder(a.yaw - b.yaw, math.tau)) <= SAME_RAD


def same_names(where: str, names: Iterable[str], sonars: Iterable[str]) -> Iterator[str]:
    """A sentence where those are not the names of the sonars."""
    missing, strange = sorted(set(sonars) - set(names)), sorted(set(names) - set(sonars))
    if missing:
        yield f'{where} leaves out {", ".join(missing)}'
    if strange:
        yield f'{where} names {", ".join(strange)}, which platform/sonars does not hold'


def _frames(platform, robot):
    places = fixed_places(robot)
    wanted = {f'{name}_frame': mount for name, mount in platform.sonars.items()}
    for link, mount in {**wanted, 'imu_link': platform.imu, 'scan': platform.scan, 'gps': platform.gps}.items():
        place = places.get(link)
        if place is None:
            yield f'robot.urdf has no fixed joint from base_link to {link}'
        elif not place.is_finite():
            yield NOWHERE.format(link)
        elif not _same(place, mount):
            there = f'({mount.x:g}, {mount.y:g}), or turned otherwise'
            yield f'robot.urdf has {link} at ({place.x:g}, {place.y:g}), platform.yaml at {there}'
    box = robot.find("link[@name='base_link']/collision/geometry/box")
    size = (None if box is None else finite_numbers(box.get('size'), 3)) or []
    if size != list(platform.body):
        yield f'robot.urdf has a body (collision box of base_link) of {size}, platform/body is {list(platform.body)}'


def _wheel_joints(platform):
    wheels, told = platform.wheels, parameters('sara_control', 'diff_drive_controller.yaml', platform)
    left, right = told['left_wheel'], told['right_wheel']
    try:
        geometry = WheelGeometry(platform.urdf)
        found = geometry.separation(left, right), geometry.radius(left)
    except UrdfError as error:
        yield f'robot.urdf: {error}'
        return
    if not np.allclose(found, (wheels.separation, wheels.radius), atol=SAME_M):
        yield (
            f'robot.urdf has wheels {found[0]:g} m apart with a radius of {found[1]:g} m, platform/wheels says '
            f'{wheels.separation:g} and {wheels.radius:g} m'
        )
