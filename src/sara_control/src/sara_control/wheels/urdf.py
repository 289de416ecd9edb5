"""Wheel separation and radius from a URDF, by the rule of the C++ diff_drive_controller.

Separation: the distance of the two wheel joints' origins, which hang on the same link. Radius: of the cylinder or
sphere that is the collision geometry of the left wheel's link.
"""

import math
from xml.etree import ElementTree

from sara_common.config import finite_numbers


class UrdfError(ValueError):
    """One sentence on what the URDF does not tell."""


class WheelGeometry:
    """text: the URDF. Raises UrdfError where it is none."""

    def __init__(self, text: str) -> None:
        try:
            self._robot = ElementTree.fromstring(text)
        except (ElementTree.ParseError, TypeError, ValueError) as error:
            raise UrdfError(f'robot_description is not XML: {error}') from error
        if self._robot.tag != 'robot':
            raise UrdfError(f'robot_description is a <{self._robot.tag}>, allowed is a <robot>')

    def separation(self, left: str, right: str) -> float:
        """Distance of the origins of these two joints, m."""
        left, right = self._joint(left), self._joint(right)
        parents = [_attribute(joint, 'parent', 'link') for joint in (left, right)]
        if parents[0] != parents[1]:
            raise UrdfError(
                f'in robot_description the wheels hang on two links ({parents[0]}, {parents[1]}): '
                'their distance is not told'
            )
        distance = math.dist(_origin(left), _origin(right))
        if distance == 0.0:
            raise UrdfError('in robot_description both wheel joints are at one place')
        return distance

    def radius(self, joint: str) -> float:
        """Radius of the wheel on this joint, m."""
        name = _attribute(self._joint(joint), 'child', 'link')
        link = next((link for link in self._robot.findall('link') if link.get('name') == name), None)
        shape = None if link is None else link.find('collision/geometry')
        for kind in ('cylinder', 'sphere'):
            if shape is not None and shape.find(kind) is not None:
                return _numbers(shape.find(kind).get('radius'), 1, f'the radius of {name}')[0]
        raise UrdfError(
            f'in robot_description the collision geometry of {name} is neither cylinder nor sphere: '
            'the wheel radius is not told'
        )

    def _joint(self, name):
        for joint in self._robot.findall('joint'):
            if joint.get('name') == name:
                return joint
        raise UrdfError(f'robot_description has no joint {name}')


def _attribute(element, child, name):
    found = element.find(child)
    if found is None or not found.get(name):
        raise UrdfError(f'in robot_description the joint {element.get("name")} has no {child} {name}')
    return found.get(name)


def _origin(joint):
    origin = joint.find('origin')
    text = '0 0 0' if origin is None else origin.get('xyz', '0 0 0')
    return _numbers(text, 3, f'the origin of {joint.get("name")}')


def _numbers(text, count, what):
    values = finite_numbers(text, count)
    if values is None:
        raise UrdfError(f'in robot_description {what} is {text!r}')
    return values
